"""States of a recording that use what comes after each instant as well: the estimator, then a pass back over its knots.

There is one state for every frame, at the frame's own time, in the order of time. A hand that is lost ends a segment.
Segments are smoothed independently.
"""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rhot_app.diagnostics import diagnostics_of
from rhot_app.estimation.filter import ChunkedSmoother, FilteredState, Knot
from rhot_app.estimation.track import comes_late
from rhot_app.hand.motion.hand_process import HandProcess
from rhot_app.hand.skeleton import HandPose
from rhot_app.objects.observations import ObjectFrame
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, no_hand
from rhot_app.tracking.markers.acquisition import Located
from rhot_app.tracking.markers.estimator import Estimator
from rhot_app.tracking.markers.estimator_state import EstimatorStates, RecentObservations
from rhot_app.tracking.markers.marker_residual import MarkerFrame
from rhot_app.tracking.rig_arrays import without_objects
from rhot_app.tracking.rig_objects import MarkersBeside, SmoothedObjects
from rhot_app.tracking.tracker import CameraObservations, Tracker
from rhot_app.tracking.two_hands import TwoHands

Array = NDArray[np.float64]
Kept = TypeVar("Kept")

NOT_SMOOTHED = ("only the estimator smooths, and only markers and landmarks. Choose it (tracker.kind, or --tracker "
                "estimator), or do not smooth.")
"""Why states of another tracker are not smoothed, and what to do."""

CONTRADICTED = "Smoothing contradicts what was tracked. The states there are filtered, not smoothed."
"""What is said of a frame whose state could not be smoothed."""

_RECENT = 16  # frames: those that an estimator weighs again when it starts are fewer

_Key = tuple[int, int]  # camera, time of row 0


@dataclass(slots=True, eq=False)
class Instant:
    """What is kept of one frame. `none`: the state without a hand. `filtered`: the knot. `recent`, `scale` and
    `process` are as they were after it. `by_one`: one camera alone had begun the hand. `estimate`: smoothed."""

    number: int
    observations: CameraObservations
    t_ns: int
    none: HandState | None = None
    recent: RecentObservations | None = None
    scale: tuple[float, float] = (1.0, math.nan)
    process: HandProcess | None = None
    filtered: Knot | None = None
    estimate: FilteredState | None = None
    by_one: bool = False


class RecordingEstimator(Estimator):
    """An estimator that smooths what it has found. Give it one frame before each `solve`."""

    def __init__(self, rig: Rig) -> None:
        """Raises RigError as `Estimator` does."""
        self._count = 0  # of frames
        self._instants: dict[_Key, Instant] = {}  # that are not final yet, in the order of arrival
        self._final: list[Instant] = []
        self._failed: list[Instant] = []
        self._buffered: list[Knot] = []  # late frames may still change them
        self._scale = 1.0, math.nan
        self._smoother: ChunkedSmoother | None = None
        super().__init__(rig)

    def reset(self) -> None:
        """Forget everything but the states that are not taken yet."""
        self.conclude()
        super().reset()

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in."""
        self._instants.setdefault(_key(observations), Instant(self._count, observations, observations.t_row0_master_ns))
        self._count += 1
        super().ingest(observations)

    def solve(self) -> HandState | None:
        """The filtered state after the frame, None when it came before."""
        newest = next(reversed(self._instants.values()), None)
        try:
            state = super().solve()
        except Exception:
            if newest is not None and newest.number == self._count - 1 and newest.recent is None:
                self._failed.append(self._instants.pop(_key(newest.observations)))
            raise
        if newest is not None and newest.number == self._count - 1 and newest.recent is None:
            if state is not None and state.condition in (Condition.SEARCHING, Condition.LOST):
                newest.none = state
            else:  # it came before, or is older than the first knot
                del self._instants[_key(newest.observations)]
        if self._smoother is None:
            self._release(self._count - _RECENT)
        return state

    def smoothed(self) -> Iterator[HandState]:
        """The states that have become final, in the order of time. Their `sequence` is 0."""
        self._failed.clear()
        for instant in self.taken():
            state = None
            with self.diagnostics.part("a smoothed state", lambda: None):
                state = self.describe(instant, instant.t_ns)
            if state is not None:
                yield state

    def taken(self) -> list[Instant]:
        """The instants that have become final, in the order of time."""
        final, self._final = self._final, []
        return final

    def failed(self) -> list[Instant]:
        """The instants over which it failed since this was asked last: there is no hand in them."""
        failed, self._failed = self._failed, []
        for one in failed:
            one.none = replace(no_hand(one.t_ns, Condition.LOST, self._rig.camera_names, markers=self._rig.marker_ids),
                               t_receive_ns=one.observations.t_receive_ns)
        return failed

    def conclude(self) -> None:
        """The recording, or a part of it, is over: all instants are final."""
        self._end_segment()
        self._release(self._count)

    def describe(self, instant: Instant, t_ns: int) -> HandState:
        """The smoothed state of an instant, predicted to `t_ns` if that is later."""
        if instant.none is not None:
            return replace(instant.none, sequence=0)
        estimate, knot, recent = instant.estimate, instant.filtered, instant.recent
        assert estimate is not None and knot is not None and recent is not None
        states, begun = EstimatorStates(self._rig, self._file_size, recent), time.perf_counter()
        states.resize(*instant.scale)
        state, covariance, later_ns = estimate.state, estimate.covariance, max(t_ns - instant.t_ns, 0)
        if later_ns:
            state, covariance = estimate.process.predict(state, covariance, 1e-9 * later_ns)
        # What is triangulated stays as it was tracked: its observations are carried on by the motion of then.
        own = states.describe(instant.t_ns, knot.state, knot.covariance, 0, instant.observations, begun)
        out = states.describe(instant.t_ns + later_ns, state, covariance, 0, instant.observations, begun,
                              by_one=instant.by_one)
        return replace(out, marker_raw_positions=own.marker_raw_positions, epipolar_error_px=own.epipolar_error_px)

    # -- observing the estimator ---------------------------------------------------------------------------------------

    def _resize(self, log_scale: float, variance: float) -> None:
        super()._resize(log_scale, variance)
        self._scale = math.exp(log_scale), math.sqrt(variance)

    def _start(self, t_ns: int, pose: HandPose, located: Located | None = None) -> None:
        self._end_segment()
        self._smoother = ChunkedSmoother()
        super()._start(t_ns, pose, located)
        self._release(self._count)

    def _give_up(self) -> None:
        super()._give_up()
        self._end_segment()

    def _weighed(self, frame: MarkerFrame) -> None:
        instant = self._instants.get(_key(frame.observations))
        if instant is not None:
            instant.none, instant.scale, instant.by_one = None, self._scale, self._by_one
            instant.recent, instant.process = _copied(self._observations), _copied(self._process)
        before, knots = self._buffered, list(self._filter.knots)
        if before and not knots[0].residuals and knots[0] is not before[0]:  # begun anew from the newest one
            self._smooth_buffered(knots[0].covariance)
        elif before and len(knots) <= len(before) and [knot.t_s for knot in knots] != [knot.t_s for knot in before]:
            self._smooth(before[0])
        self._buffered = knots

    # -- smoothed states -----------------------------------------------------------------------------------------------

    def _smooth(self, knot: Knot, inflated: Array | None = None) -> None:
        """Take a knot that no late frame can change any more; `inflated`: see `FilteredState`."""
        frame = next((residual for residual in knot.residuals if isinstance(residual, MarkerFrame)), None)
        if frame is None or self._smoother is None:
            return
        instant = self._instants.get(_key(frame.observations))
        process = None if instant is None else instant.process
        if instant is not None:
            instant.filtered, instant.t_ns = knot, self._filter.time_ns(knot.t_s)
        self._conclude(self._smoother.add(FilteredState(
            knot.t_s, knot.state, knot.covariance, _copied(self._process) if process is None else process, instant,
            inflated, residuals=knot.residuals)))

    def _smooth_buffered(self, inflated: Array | None = None) -> None:
        for knot in self._buffered:
            self._smooth(knot, inflated if knot is self._buffered[-1] else None)
        self._buffered = []

    def _conclude(self, estimates: list[FilteredState]) -> None:
        for estimate in estimates:
            if isinstance(estimate.label, Instant):
                estimate.label.estimate = replace(estimate, label=None, residuals=())
                if estimate.contradicted:
                    self.diagnostics.warn(CONTRADICTED)
                self._final.append(estimate.label)
                self._instants.pop(_key(estimate.label.observations), None)

    def _end_segment(self) -> None:
        if self._smoother is None:
            return
        self._smooth_buffered()
        self._conclude(self._smoother.finish())
        self._smoother = None
        for key in [key for key, one in self._instants.items() if one.recent is not None]:
            del self._instants[key]  # so late that they have no knot of their own

    def _release(self, number: int) -> None:
        """The frames before `number` that show no hand are final."""
        for key, one in list(self._instants.items()):
            if one.number < number and one.none is not None:
                self._final.append(self._instants.pop(key))


class TwoRecordingEstimators(TwoHands[RecordingEstimator]):
    """Two hands, each of whose estimators smooths what it has found."""

    def __init__(self, rig: Rig) -> None:
        """Raises RigError as `Estimator` does."""
        super().__init__(rig, RecordingEstimator)
        self._waiting: tuple[dict[int, Instant], dict[int, Instant]] = {}, {}  # for the same frame of the other hand

    def smoothed(self) -> Iterator[HandState]:
        """The states of both hands that have become final, in the order of time."""
        for tracker, waiting in zip(self._both, self._waiting, strict=True):
            waiting.update((instant.number, instant) for instant in tracker.failed() + tracker.taken())
        one, other = self._waiting
        for number in [number for number in one if number in other]:
            pair = one.pop(number), other.pop(number)
            t_ns = max([instant.t_ns for instant in pair if instant.none is None] or [pair[0].t_ns])
            state = None
            with self.diagnostics.part("a smoothed state", lambda: None):
                state = self._merge(*(replace(tracker.describe(instant, t_ns), t_master_ns=t_ns)
                                      for tracker, instant in zip(self._both, pair, strict=True)))
            if state is not None:
                yield state
            for waiting in self._waiting:  # what is so far behind has no counterpart
                for late in [late for late in waiting if late < number - _RECENT]:
                    del waiting[late]

    def conclude(self) -> None:
        """The recording is over: all instants are final."""
        for tracker in self._both:
            tracker.conclude()


class SmoothedTracker(Tracker):
    """Takes the frames of a recording in the order of arrival, and gives smoothed states in the order of time."""

    smooths = True

    def __init__(self, rig: Rig) -> None:
        """Raises RigError as `Estimator` does; the rig's tracker must be the estimator of markers."""
        assert rig.tracker.smooths
        hand, own = without_objects(rig)
        self._tracker = RecordingEstimator(hand) if rig.other_hand is None else TwoRecordingEstimators(hand)
        self.diagnostics = diagnostics_of(self._tracker)
        self._objects = SmoothedObjects(rig, self.diagnostics) if rig.objects else None
        self._markers = MarkersBeside(rig, own)
        self._sequence = 0
        self._last_ns: int | None = None

    def reset(self) -> None:
        """Forget everything but the states that are not taken yet: a new session, or a clock was set."""
        self._tracker.reset()

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in."""
        if self._objects is not None:
            self._objects.ingest_markers(observations)
            observations = self._markers.of_hand(observations)
        self._tracker.ingest(observations)
        with self.diagnostics.part("the hand", self._tracker.reset):
            self._tracker.solve()

    def ingest_objects(self, frame: ObjectFrame) -> None:
        """Take the tags of one frame in."""
        if self._objects is not None:
            self._objects.ingest_objects(frame)

    def states(self) -> Iterator[HandState]:
        """The states that have become final."""
        for state in self._tracker.smoothed():
            before_ns, self._last_ns = self._last_ns, state.t_master_ns
            if before_ns is not None and state.t_master_ns != before_ns and comes_late(state.t_master_ns, before_ns):
                self._last_ns = before_ns
                continue  # a frame without a hand that was late
            other = None if state.other is None else replace(state.other, sequence=self._sequence)
            found = replace(state, sequence=self._sequence, other=other)
            if self._objects is not None:
                objects = self._objects.states(state.t_master_ns)
                found = self._objects.with_objects(self._markers.completed(found, objects), objects)
            yield found
            self._sequence += 1

    def finish(self) -> Iterator[HandState]:
        """The rest of the states."""
        self._tracker.conclude()
        if self._objects is not None:
            self._objects.finish()
        yield from self.states()


def _key(observations: CameraObservations) -> _Key:
    return observations.camera, observations.t_row0_master_ns


def _copied(original: Kept) -> Kept:
    """A copy with arrays of its own."""
    out = copy.copy(original)
    for name, value in vars(original).items():
        if isinstance(value, np.ndarray):
            setattr(out, name, value.copy())
    return out
