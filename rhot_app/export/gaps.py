"""Fills short gaps of a recording: what lies between two states that are known, for whoever needs no holes.

Angles and positions are interpolated linearly, the palm's turn along the shorter arc, joints and fingertips within the
palm's frame, so that a turning hand keeps its size. What is filled in has the knowledge `FILLED` and no covariance;
the tracker's condition stays, so that a filled state still says that the hand was lost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ExportError
from rhot_app.export.resample import interpolated, interpolated_poses
from rhot_app.export.states import FILLED, HandStates, Mask, joined

LONGEST_S: Final = 10.0
"""No gap may be longer that is to be filled: a hand does something else meanwhile."""

_IN_PALM = "joint_positions", "fingertip_positions"
_LINEAR = "angles", "hand_scale"
_NO_LONGER_KNOWN = "joint_covariances", "fingertip_covariances", "angle_sd", "palm_covariance", "hand_scale_sd"
_KNOWLEDGE = "joint_knowledge", "angle_knowledge", "palm_knowledge"


def checked_fill(seconds: float) -> float:
    """The length up to which gaps are filled, if it is one. Raises ExportError."""
    if not (math.isfinite(seconds) and 0.0 < seconds <= LONGEST_S):
        raise ExportError(f"gaps of {seconds:g} s cannot be filled; give more than 0 and at most {LONGEST_S:g} s.")
    return seconds


@dataclass(frozen=True, slots=True)
class FilledGap:
    """States `first` to `last` of a run, counted from 0, in which `what` was filled in: "hand", "other_hand" or
    "marker_" and its id. Their times are the master's clock."""

    what: str
    first: int
    last: int
    begin_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class _Rows:
    """The K rows of gaps: themselves, the known rows `before` and `after` each, and the `weight` of the latter."""

    rows: NDArray[np.intp]
    before: NDArray[np.intp]
    after: NDArray[np.intp]
    weight: NDArray[np.float64]


class GapFiller:
    """Takes blocks of states and gives them with every gap of at most `longest_s` filled in. `filled`: which."""

    def __init__(self, longest_s: float) -> None:
        self.filled: list[FilledGap] = []
        self._longest_ns = round(1e9 * longest_s)
        self._given = 0
        self._held: HandStates | None = None

    def take(self, block: HandStates) -> Iterator[HandStates]:
        """What is settled so far: states behind which a gap may still be filled are held back."""
        known = self._fill(block if self._held is None else joined([self._held, block]))
        settled = self._settled(known)
        self._held = known.where(slice(settled, None))
        self._given += settled
        if settled:
            yield known.where(slice(settled))

    def finish(self) -> Iterator[HandStates]:
        """The states that were held back."""
        if self._held is not None and len(self._held):
            yield self._held
        self._held = None

    def _settled(self, states: HandStates) -> int:
        """How many states no later one can change; the last that is known is needed for the gap that may follow."""
        settled, times = len(states) - 1, states.t_master_ns
        for known in (states.present, *((states.other.present,) if states.other is not None else ()),
                      *_known_markers(states).T):
            last = int(np.flatnonzero(known)[-1]) if known.any() else len(known)
            if last < settled and times[-1] - times[last] < self._longest_ns:
                settled = last
        return settled

    def _fill(self, states: HandStates) -> HandStates:
        out = self._fill_hand("hand", states)
        if states.other is not None:
            out = replace(out, other=self._fill_hand("other_hand", states.other))
        return self._fill_markers(out)

    def _fill_hand(self, name: str, states: HandStates) -> HandStates:
        gaps = self._gaps(name, states.present, states.t_master_ns)
        if gaps is None:
            return states
        before, after = states.where(gaps.before), states.where(gaps.after)
        palm = interpolated_poses(before.world_from_palm, after.world_from_palm, gaps.weight)
        new: dict[str, Any] = {"world_from_palm": palm}
        for field in _LINEAR:
            new[field] = interpolated(getattr(before, field), getattr(after, field), gaps.weight)
        for field in _IN_PALM:
            inside = interpolated(_in_palm(before, field), _in_palm(after, field), gaps.weight)
            new[field] = inside @ palm[:, :3, :3].transpose(0, 2, 1) + palm[:, None, :3, 3]
        new |= dict.fromkeys(_NO_LONGER_KNOWN, np.nan) | dict.fromkeys(_KNOWLEDGE, FILLED)
        changed: dict[str, Any] = {field: _put(getattr(states, field), gaps.rows, new[field]) for field in new}
        return replace(states, **changed)

    def _fill_markers(self, states: HandStates) -> HandStates:
        known = _known_markers(states)
        positions, covariances = states.marker_positions, states.marker_covariances
        knowledge = states.marker_knowledge
        for index, marker in enumerate(states.marker_ids):
            gaps = self._gaps(f"marker_{marker}", known[:, index], states.t_master_ns)
            if gaps is not None:
                own = positions[:, index]
                place = gaps.rows, np.full(len(gaps.rows), index)
                positions = _put(positions, place, interpolated(own[gaps.before], own[gaps.after], gaps.weight))
                covariances, knowledge = _put(covariances, place, np.nan), _put(knowledge, place, FILLED)
        return replace(states, marker_positions=positions, marker_covariances=covariances, marker_knowledge=knowledge)

    def _gaps(self, what: str, known: Mask, times: NDArray[np.int64]) -> _Rows | None:
        """The gaps between known states (N,) that are short enough, which are noted; None when there is none."""
        there = np.flatnonzero(known)
        short = (np.diff(there) > 1) & (np.diff(times[there]) <= self._longest_ns)
        if not short.any():
            return None
        before, after = there[:-1][short], there[1:][short]
        for first, last in zip(before.tolist(), after.tolist(), strict=True):
            self.filled.append(FilledGap(what, self._given + first + 1, self._given + last - 1, int(times[first + 1]),
                                         int(times[last - 1])))
        counts = after - before - 1
        rows = np.concatenate([np.arange(a + 1, b) for a, b in zip(before, after, strict=True)])
        before, after = np.repeat(before, counts), np.repeat(after, counts)
        span = np.maximum(times[after] - times[before], 1)
        return _Rows(rows, before, after, (times[rows] - times[before]) / span)


def _known_markers(states: HandStates) -> Mask:
    return np.asarray(np.isfinite(states.marker_positions).all(axis=2))


def _in_palm(states: HandStates, field: str) -> NDArray[np.float64]:
    """(N, P, 3) m of positions in the rig frame, seen from the palm."""
    palm = states.world_from_palm
    return np.asarray((getattr(states, field) - palm[:, None, :3, 3]) @ palm[:, :3, :3])


def _put(array: NDArray[Any], place: Any, value: Any) -> NDArray[Any]:
    out = array.copy()
    out[place] = value
    return out
