"""States at equal intervals: for formats that have a rate instead of times, and for whoever asks for one.

Between two states positions, covariances and angles are interpolated linearly, the palm's rotation along the shorter
arc; what is known worse of the two decides how it is known. An interval of more than two periods of a camera (one lost
frame) is a gap: what lies in it is NaN, unknown, LOST.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ExportError
from rhot_app.export.states import ARRAYS, CONDITIONS, VALIDITIES, HandStates, ObjectStates, joined
from rhot_app.objects.state import Validity
from rhot_app.state import Condition, Knowledge

BRIDGED_PERIODS = 2.5
"""One lost frame makes an interval of two periods; the half is for jitter."""

MOST_HZ = 1000.0

PAUSE_ROWS_MAX = 60_000
"""States without a hand that stand for a pause, such as ten minutes at 100 Hz; a longer pause is another recording."""

_PIECE = 4096  # states that are interpolated at a time: some 60 MB

_LOST = CONDITIONS.index(Condition.LOST)
_SEVERITY = np.array([{Condition.TRACKING: 0, Condition.PARTIAL: 1, Condition.LOST: 2, Condition.SEARCHING: 3,
                       Condition.IDLE: 4, Condition.FAULT: 5}[one] for one in CONDITIONS])
_UNSURE = np.array([{Validity.TRACKED: 0, Validity.AMBIGUOUS: 1, Validity.PREDICTED: 2, Validity.LOST: 3,
                     Validity.SEARCHING: 4}[one] for one in VALIDITIES])
_LINEAR = tuple(name for name in ARRAYS if name not in ("sequence", "t_master_ns", "condition", "world_from_palm")
                and not name.endswith("knowledge"))


def checked_rate(rate_hz: float) -> float:
    """The rate, if it is one. Raises ExportError."""
    if not (math.isfinite(rate_hz) and 0.0 < rate_hz <= MOST_HZ):
        raise ExportError(f"the rate {rate_hz:g} Hz is out of range; give more than 0 and at most {MOST_HZ:g} Hz.")
    return rate_hz


class Resampler:
    """Takes blocks of states and gives them at `rate_hz`, the first one at the time of the first state.

    `period_s`: of the camera's frames; longer pauses than `BRIDGED_PERIODS` of it stay gaps.
    """

    def __init__(self, rate_hz: float, period_s: float) -> None:
        self.rate_hz = rate_hz
        self._bridged_ns = round(1e9 * BRIDGED_PERIODS * period_s)
        self._first_ns: int | None = None
        self._given = 0  # of the grid
        self._last: HandStates | None = None

    def take(self, block: HandStates) -> Iterator[HandStates]:
        """What lies between the states so far, in pieces. Raises ExportError at a pause of more than `PAUSE_ROWS_MAX`
        states."""
        known = block if self._last is None else joined([self._last, block])
        known = known.where(_forward(known.t_master_ns))
        if self._first_ns is None:
            self._first_ns = int(known.t_master_ns[0])
        self._last = known.where(slice(-1, None))
        span_s = 1e-9 * (int(known.t_master_ns[-1]) - self._first_ns)
        end = math.floor(span_s * self.rate_hz + 1e-6) + 1  # exclusive
        self._require_short(known.t_master_ns)
        while self._given < end:
            numbers = np.arange(self._given, min(end, self._given + _PIECE))
            self._given += len(numbers)
            yield self._between(known, self._first_ns + np.rint(numbers * (1e9 / self.rate_hz)).astype(np.int64))

    def _require_short(self, times: NDArray[np.int64]) -> None:
        pauses_s = 1e-9 * np.diff(times)
        longest = int(np.argmax(pauses_s)) if len(pauses_s) else -1
        if longest < 0 or pauses_s[longest] * self.rate_hz <= PAUSE_ROWS_MAX:
            return
        pause, after = (timedelta(seconds=round(seconds)) for seconds in (
            pauses_s[longest], 1e-9 * (int(times[longest]) - (self._first_ns or 0))))
        raise ExportError(f"the recording has a pause of {pause} h after {after} h, which would be "
                          f"{pauses_s[longest] * self.rate_hz:.0f} empty states at {self.rate_hz:g} Hz. Export it "
                          "without a rate to a format that has times, such as CSV; or record what comes after the "
                          "pause apart.")

    def _between(self, known: HandStates, grid_ns: NDArray[np.int64]) -> HandStates:
        times = known.t_master_ns
        after = np.clip(np.searchsorted(times, grid_ns), 0, len(times) - 1)
        before = np.where(times[after] > grid_ns, np.maximum(after - 1, 0), after)
        pause = times[after] - times[before]
        weight = np.where(pause > 0, (grid_ns - times[before]) / np.maximum(pause, 1), 0.0)
        found = _mixed(known.where(before), known.where(after), weight)
        return _stamped(_blanked(found, pause > self._bridged_ns), grid_ns)


def _forward(times: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(N,) whether a time lies after all before it: times may stand still where a clock was set."""
    latest = np.maximum.accumulate(times)
    return np.concatenate([[True], times[1:] > latest[:-1]])


def _mixed(first: HandStates, second: HandStates, weight: NDArray[np.float64]) -> HandStates:
    """Between two states each; `weight` (N,) 0..1 is the second one's."""
    changed: dict[str, Any] = {name: interpolated(getattr(first, name), getattr(second, name), weight)
                               for name in _LINEAR}
    for name in ARRAYS:
        if name.endswith("knowledge"):
            part = weight.reshape(-1, *[1] * (getattr(first, name).ndim - 1))
            changed[name] = np.where(part > 0.0, np.maximum(getattr(first, name), getattr(second, name)),
                                     getattr(first, name))
    worse = (_SEVERITY[second.condition] > _SEVERITY[first.condition]) & (weight > 0.0)
    other = None if first.other is None or second.other is None else _mixed(first.other, second.other, weight)
    return replace(first, **changed, condition=np.where(worse, second.condition, first.condition),
                   world_from_palm=interpolated_poses(first.world_from_palm, second.world_from_palm, weight),
                   other=other,
                   objects=tuple(_mixed_object(*pair, weight)
                                 for pair in zip(first.objects, second.objects, strict=True)))


def _mixed_object(first: ObjectStates, second: ObjectStates, weight: NDArray[np.float64]) -> ObjectStates:
    """Between two states each; the less certain validity of the two, and contacts that both have."""
    later = weight > 0.0
    worse = (_UNSURE[second.validity] > _UNSURE[first.validity]) & later
    changed: dict[str, Any] = {name: interpolated(getattr(first, name), getattr(second, name), weight)
                               for name in ("covariance", "velocity", "distances", "distance_sd")}
    return replace(first, **changed, validity=np.where(worse, second.validity, first.validity),
                   world_from_object=interpolated_poses(first.world_from_object, second.world_from_object, weight),
                   contacts=np.where(later[:, None], first.contacts & second.contacts, first.contacts))


def interpolated(first: NDArray[Any], second: NDArray[Any], weight: NDArray[np.float64]) -> NDArray[Any]:
    """(N, ...) between two rows each; `weight` (N,) 0..1 is the second one's."""
    part = weight.reshape(-1, *[1] * (first.ndim - 1))
    return np.where(part > 0.0, first + part * (second - first), first)


def interpolated_poses(first: NDArray[Any], second: NDArray[Any], weight: NDArray[np.float64]) -> NDArray[Any]:
    """Rigid transforms (N, 4, 4) between two each: the turn along its own axis, at a part of its angle. `weight` (N,)
    0..1 is the second one's."""
    from scipy.spatial.transform import Rotation

    out = interpolated(first, second, weight)
    turning = (weight > 0.0) & np.isfinite(first[:, 0, 0]) & np.isfinite(second[:, 0, 0])
    if turning.any():
        begin = Rotation.from_matrix(first[turning, :3, :3])
        turn = begin.inv() * Rotation.from_matrix(second[turning, :3, :3])
        part = Rotation.from_rotvec(turn.as_rotvec() * weight[turning, None])
        out[turning, :3, :3] = (begin * part).as_matrix()
    return out


def _blanked(states: HandStates, gap: NDArray[np.bool_]) -> HandStates:
    """The states with nothing known where there is a gap (N,)."""
    if not gap.any():
        return states
    changed: dict[str, Any] = {}
    for name in (*_LINEAR, "world_from_palm"):
        changed[name] = np.where(gap.reshape(-1, *[1] * (getattr(states, name).ndim - 1)), np.nan,
                                 getattr(states, name))
    for name in ARRAYS:
        if name.endswith("knowledge"):
            column = getattr(states, name)
            changed[name] = np.where(gap.reshape(-1, *[1] * (column.ndim - 1)), np.uint8(Knowledge.UNKNOWN), column)
    other = None if states.other is None else _blanked(states.other, gap)
    return replace(states, **changed, condition=np.where(gap, np.uint8(_LOST), states.condition), other=other,
                   objects=tuple(_blanked_object(one, gap) for one in states.objects))


def _blanked_object(one: ObjectStates, gap: NDArray[np.bool_]) -> ObjectStates:
    changed: dict[str, Any] = {}
    for name in ("world_from_object", "covariance", "velocity", "distances", "distance_sd"):
        changed[name] = np.where(gap.reshape(-1, *[1] * (getattr(one, name).ndim - 1)), np.nan, getattr(one, name))
    return replace(one, **changed, validity=np.where(gap, np.uint8(VALIDITIES.index(Validity.LOST)), one.validity),
                   contacts=np.where(gap[:, None], np.uint8(0), one.contacts))


def _stamped(states: HandStates, grid_ns: NDArray[np.int64]) -> HandStates:
    other = None if states.other is None else _stamped(states.other, grid_ns)
    return replace(states, t_master_ns=grid_ns, other=other)
