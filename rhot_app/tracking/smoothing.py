"""States of a recording that use what comes after each instant as well: the estimator, then a pass back over its knots.

There is one state for every frame, at the frame's own time, in the order of time. A hand that is lost ends a segment.
Segments are smoothed independently.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from rhot_app.estimation.filter import ChunkedSmoother, FilteredState, Knot
from rhot_app.estimation.track import FinalKnot
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, no_hand
from rhot_app.tracking.markers.estimator import Estimator, Weighed, copied
from rhot_app.tracking.markers.estimator_state import EstimatorStates
from rhot_app.tracking.tracker import CameraFrame, CameraObservations

NOT_SMOOTHED = ("only the estimator smooths, and only markers and landmarks. Choose it (tracker.kind, or --tracker "
                "estimator), or do not smooth.")
"""Why states of another tracker are not smoothed, and what to do."""

CONTRADICTED = "Smoothing contradicts what was tracked. The states there are filtered, not smoothed."
"""What is said of a frame whose state could not be smoothed."""

RECENT = 16
"""Frames: those that an estimator weighs again when it starts are fewer."""

_Key = tuple[int, int]  # camera, time of row 0


@dataclass(slots=True, eq=False)
class Instant:
    """What is kept of one frame. `none`: the state without a hand. Of a weighed one: `weighed` and its `knot`, and the
    smoothed `estimate`."""

    number: int
    observations: CameraObservations
    t_ns: int
    none: HandState | None = None
    weighed: Weighed | None = None
    knot: Knot | None = None
    estimate: FilteredState | None = None


class RecordingEstimator(Estimator):
    """An estimator whose states are smoothed. Give it one frame before each `solve`."""

    def __init__(self, rig: Rig) -> None:
        """Raises RigError as `Estimator` does."""
        super().__init__(rig)
        self._count = 0  # of frames
        self._instants: dict[_Key, Instant] = {}  # that are not final yet, in the order of arrival
        self._final: list[Instant] = []
        self._smoother = ChunkedSmoother()
        self._filter.history = []

    def reset(self) -> None:
        """Forget everything but the states that are not taken yet."""
        super().reset()
        if self._filter.history is not None:
            self.conclude()

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame in."""
        if isinstance(frame, CameraObservations):
            self._instants.setdefault(_key(frame), Instant(self._count, frame, frame.t_row0_master_ns))
            self._count += 1
        super().ingest(frame)

    def solve(self) -> HandState | None:
        """The filtered state after the frame, None when it came before."""
        newest = next(reversed(self._instants.values()), None)
        newest = newest if newest is not None and newest.number == self._count - 1 else None
        try:
            state = super().solve()
        except Exception:
            if newest is not None and newest.weighed is None:
                newest.none = replace(
                    no_hand(newest.t_ns, Condition.LOST, self._rig.camera_names, markers=self._rig.marker_ids),
                    t_receive_ns=newest.observations.t_receive_ns)
            raise
        self._smooth()
        if newest is not None and newest.weighed is None:
            if state is not None and state.condition in (Condition.SEARCHING, Condition.LOST):
                newest.none = state
            else:  # it came before, or is older than the first knot
                self._instants.pop(_key(newest.observations), None)
        if not self._life.alive:
            self._release(self._count - RECENT)
        return state

    def final(self) -> list[Instant]:
        """The instants that have become final, in the order of time."""
        final, self._final = self._final, []
        return final

    def conclude(self) -> None:
        """The recording, or a part of it, is over: all instants are final."""
        self._filter.end()
        self._smooth()
        self._release(self._count)

    def describe(self, instant: Instant, t_ns: int) -> HandState:
        """The smoothed state of an instant, predicted to `t_ns` if that is later. Its `sequence` is 0."""
        if instant.none is not None:
            return replace(instant.none, sequence=0)
        estimate, knot, weighed = instant.estimate, instant.knot, instant.weighed
        assert estimate is not None and knot is not None and weighed is not None
        states, begun = EstimatorStates(self._rig, self._file_size, weighed.recent), time.perf_counter()
        states.resize(*weighed.scale)
        state, covariance, later_ns = estimate.state, estimate.covariance, max(t_ns - instant.t_ns, 0)
        if later_ns:
            state, covariance = estimate.process.predict(state, covariance, 1e-9 * later_ns)
        # What is triangulated stays as it was tracked: its observations are carried on by the motion of then.
        own = states.describe(instant.t_ns, knot.state, knot.covariance, 0, instant.observations, begun)
        out = states.describe(instant.t_ns + later_ns, state, covariance, 0, instant.observations, begun,
                              by_one=weighed.by_one)
        self._states.turns = states.turns
        return replace(out, marker_raw_positions=own.marker_raw_positions, epipolar_error_px=own.epipolar_error_px)

    def _note(self, weighed: Weighed | None) -> Instant | None:
        """The instant of a weighed frame; None when it is final already."""
        found = None if weighed is None else self._instants.get(_key(weighed.frame))
        if found is not None:
            found.none, found.weighed = None, weighed
        return found

    def _smooth(self) -> None:
        """Take the knots that no late frame can change any more."""
        assert self._filter.history is not None
        history, self._filter.history = self._filter.history, []
        for one in history:
            if one is None:
                self._conclude(self._smoother.finish())
                for key in [key for key, instant in self._instants.items() if instant.weighed is not None]:
                    del self._instants[key]  # so late that they have no knot of their own
            elif one.knot.residuals:
                self._add(one)
        for knot in self._filter.knots:
            self._note(knot.label)
        if None in history:
            self._release(self._count)

    def _add(self, final: FinalKnot) -> None:
        """A knot of a frame, or of what another kind observes."""
        knot, weighed = final.knot, final.knot.label
        instant, process = self._note(weighed), copied(self._process) if weighed is None else weighed.process
        if instant is not None:
            instant.knot, instant.t_ns = knot, final.t_ns
        self._conclude(self._smoother.add(FilteredState(
            knot.t_s, knot.state, knot.covariance, process, instant, final.inflated,
            residuals=knot.residuals)))

    def _conclude(self, estimates: list[FilteredState]) -> None:
        for estimate in estimates:
            if isinstance(estimate.label, Instant):
                estimate.label.estimate = replace(estimate, label=None, residuals=())
                if estimate.contradicted:
                    self.diagnostics.warn(CONTRADICTED)
                self._final.append(estimate.label)
                self._instants.pop(_key(estimate.label.observations), None)

    def _release(self, number: int) -> None:
        """The frames before `number` that show no hand are final."""
        for key, one in list(self._instants.items()):
            if one.number < number and one.none is not None:
                self._final.append(self._instants.pop(key))


def _key(observations: CameraObservations) -> _Key:
    return observations.camera, observations.t_row0_master_ns
