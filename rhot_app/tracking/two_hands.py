"""Two hands at once: an estimator for each, one state of both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from rhot_app.diagnostics import Diagnostics
from rhot_app.estimation.track import comes_late
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, no_hand
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.tracking.rig_arrays import rigs_of_hands
from rhot_app.tracking.tracker import CameraObservations, Tracker

Indices = NDArray[np.intp]
Column = NDArray[Any]

_PER_OBSERVATION = ("pixels", "covariances", "diameters", "qualities", "flags")
_PER_MARKER = ("marker_positions", "marker_raw_positions", "marker_covariances", "marker_knowledge",
               "epipolar_error_px")
_PER_CAMERA = ("camera_pixels", "camera_flags")
_STAGES = ("triangulate", "filter", "solve")
"""Stages of the latency that run for one hand after the other."""

OneHand = TypeVar("OneHand", bound=Tracker)


class TwoHands(Tracker, Generic[OneHand]):
    """For a rig with an `other_hand`: states of its `hand`; their field `other` is the state of the other hand.

    The arrays of a state's markers are those of the whole rig; its `other` has its own markers only.
    """

    def __init__(self, rig: Rig, one_hand: Callable[[Rig], OneHand]) -> None:
        """`one_hand` makes the tracker of each hand. Raises RigError as it does."""
        (first, own), (second, others) = rigs_of_hands(rig)
        self._ids, self._own = rig.markers.ids, (own, others)
        self._order = np.argsort(np.concatenate(self._own))
        self._both = one_hand(first), one_hand(second)
        self.diagnostics = Diagnostics()
        self._names = tuple(node.name for node in rig.nodes)
        self._extrapolators = Extrapolator(first), Extrapolator(second)
        self._sequence = 0
        self._newest: list[CameraObservations | None] = [None] * len(rig.nodes)

    def reset(self) -> None:
        """Forget everything but the count of states."""
        self._newest = [None] * len(self._newest)
        for hand in self._both:
            hand.reset()

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in; each hand gets the observations of its own markers."""
        last = self._newest[observations.camera]
        if last is None or not comes_late(observations.t_row0_master_ns, last.t_row0_master_ns):
            self._newest[observations.camera] = observations
        for tracker, own in zip(self._both, self._own, strict=True):
            further = None if observations.further is None else observations.further.of(own)
            columns = {name: getattr(observations, name)[own] for name in _PER_OBSERVATION}
            tracker.ingest(replace(observations, further=further, **columns))

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, of all markers, None before its first."""
        return tuple(self._newest)

    def solve(self) -> HandState | None:
        """The state after the frames since the last one, None without any."""
        (hand, failed), (other, other_failed) = self._each()
        if hand is not None and other_failed:
            other = self._failed(1, hand)
        elif other is not None and failed:
            hand = self._failed(0, other)
        if hand is None or other is None:  # both or neither: they see the same frames
            return None
        t_ns = max([state.t_master_ns for state in (hand, other) if state.tracked] or [hand.t_master_ns])
        return self._merged_at(t_ns, hand, other)

    def _each(self) -> list[tuple[HandState | None, bool]]:
        """The next state of each hand, and whether its tracker failed."""
        found = []
        for tracker, name in zip(self._both, ("the hand", "the other hand"), strict=True):
            state = None
            with self.diagnostics.part(name, tracker.reset) as part:
                state = tracker.solve()
            found.append((state, part.failed))
        return found

    def _failed(self, number: int, counterpart: HandState) -> HandState:
        """The state of a hand whose tracker failed, beside that of the other one."""
        ids = tuple(self._ids[marker] for marker in self._own[number])
        return replace(no_hand(counterpart.t_master_ns, Condition.LOST, self._names, markers=ids),
                       t_receive_ns=counterpart.t_receive_ns)

    def _merged_at(self, t_ns: int, hand: HandState, other: HandState) -> HandState:
        """The next state, of both hands at `t_ns`."""
        self._sequence += 1
        return self._merge(*(replace(extrapolator.at(state, t_ns) or state, t_master_ns=t_ns)
                             for state, extrapolator in zip((hand, other), self._extrapolators, strict=True)))

    def _merge(self, hand: HandState, other: HandState) -> HandState:
        """The state of `hand` with the markers of both."""
        arrays: dict[str, Any] = {name: self._gather(getattr(hand, name), getattr(other, name), axis)
                                 for axis, names in enumerate((_PER_MARKER, _PER_CAMERA)) for name in names}
        latency = hand.latency_s | {stage: hand.latency_s.get(stage, 0.0) + other.latency_s.get(stage, 0.0)
                                    for stage in _STAGES}
        return replace(hand, sequence=self._sequence - 1, marker_ids=self._ids, latency_s=latency,
                       other=replace(other, sequence=self._sequence - 1), **arrays)

    def _gather(self, hand: Column, other: Column, axis: int) -> Column:
        """An array of both hands' markers in the rig's order; `axis` is that of the markers."""
        return np.concatenate([hand, other], axis=axis).take(self._order, axis=axis)
