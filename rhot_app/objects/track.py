"""Tracks of several objects: every camera frame updates an iterated Kalman filter at its own time.

An ambiguous start is followed as several hypotheses until the frames decide (a multiple-model estimator with static
models; Bar-Shalom, Li and Kirubarajan 2001, 11.6.2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.diagnostics import Diagnostics, Part
from rhot_app.errors import ObjectError
from rhot_app.estimation.filter import Estimate, FilteredState, Knot
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.estimation.residual import Process, Residual
from rhot_app.estimation.se3 import difference
from rhot_app.estimation.track import PREDICTED_NS, Life, TrackFilter
from rhot_app.geometry.camera import CameraModel
from rhot_app.objects.motion import TWIST, VELOCITY, CameraArrays, ObjectProcess, StatePrior
from rhot_app.objects.object_file import ObjectModel, require_distinct
from rhot_app.objects.observations import FiducialFrame, FrameOfObjects, ObjectPoints, ObjectView, PictureFrame
from rhot_app.objects.pose import (
    AMBIGUOUS,
    Mode,
    faces_camera,
    find_modes,
    log_mass,
    point_residual,
    refine,
    reversed_state,
    same_pose,
)
from rhot_app.objects.state import ObjectState, Validity, unknown_object
from rhot_node.wire.messages import FAMILIES

Array = NDArray[np.float64]

GATE_2, GATE_6 = (float(chi_squared(0.999, numbers)) for numbers in (2, 6))
"""Squared Mahalanobis distance of an innovation of 2 and of 6 numbers from which on it is rejected: 99.9 % quantiles of
chi-squared."""

REJECTIONS = 3
"""Frames rejected in a row that are no outliers: most corners of three frames are rejected with a chance of 1e-9."""

FORGET = 1e-4
"""Probability under which a hypothesis is dropped: a hundredth of an ambiguous one's."""

OUTLIER = math.sqrt(FORGET)
"""Probability that a frame is an outlier, as of a misread tag: a hypothesis outlives one that another hypothesis
explains, and is forgotten after some in a row."""

REJECTION = -2.0 * math.log(OUTLIER / (1.0 - OUTLIER))
"""-2 log likelihood of a frame under a hypothesis for which it is an outlier, beyond that under the best one."""

EXCLUDED = -2.0 * math.log(FORGET)
"""Squared Mahalanobis distance from a prediction beyond which a second hypothesis is as improbable."""


@dataclass(frozen=True, slots=True)
class Gated:
    """A measurement's part that a prediction accepts: `residual`, None when it is rejected, and its -2 log likelihood
    `cost` under the prediction. `beside`: residuals of the state that no measurement has. `initial` (n,): see
    `estimation.filter.update`."""

    residual: Residual | None
    cost: float
    beside: Sequence[Residual] = ()
    initial: Array | None = None


class Measurement(Protocol):
    """What a track takes: image points of one frame, its picture, or another tracker's pose."""

    @property
    def t_ns(self) -> int:
        """Master time."""
        ...

    def modes(self) -> list[Mode]:
        """The states that it determines without a prediction, the most probable first."""
        ...

    def gate(self, state: Array, covariance: Array) -> Gated:
        """What a predicted state with its covariance accepts of it."""
        ...

    def pair(self, state: Array, prediction: Estimate) -> tuple[Mode, Mode] | None:
        """The estimate at `state` and another one that explains measurement and prediction; None without another."""
        ...


class PointMeasurement:
    """Image points of one object in one frame. `others`: the newest views of other cameras, for objects that one camera
    does not determine."""

    def __init__(self, points: ObjectPoints, cameras: CameraArrays, view: ObjectView,
                 others: Sequence[ObjectView] = ()) -> None:
        self._points, self._cameras, self._view, self._others = points, cameras, view, others

    @property
    def t_ns(self) -> int:
        """Master time of the points' mean row."""
        return self._view.t_ns

    def modes(self) -> list[Mode]:
        """By this view alone, else with the other cameras' newest ones."""
        alone = find_modes(self._points, self._cameras, [self._view], moving=True)
        return alone or find_modes(self._points, self._cameras, [self._view, *self._others], moving=True)

    def gate(self, state: Array, covariance: Array) -> Gated:
        """The points within GATE_2 whose tags face the camera; nothing when these are less than half."""
        residual = point_residual(self._points, self._cameras, self._view, self._view.t_ns)
        pixels, jacobian = residual.predict(state)
        whitened = residual.whitening @ jacobian
        error = (residual.whitening @ (residual.pixels - pixels)[:, :, None])[:, :, 0]
        total = whitened @ covariance @ whitened.swapaxes(1, 2) + np.eye(2)
        accepted = faces_camera(self._points, self._cameras, self._view, pose_matrix(state)) & np.isfinite(error[:, 0])
        distances = np.full(len(error), np.inf)
        distances[accepted] = np.einsum("ki,ki->k", error[accepted],
                                        np.linalg.solve(total[accepted], error[accepted][:, :, None])[:, :, 0])
        accepted &= distances <= GATE_2
        count = np.count_nonzero(accepted)
        if 2 * count < len(error):
            return Gated(None, GATE_2 * len(error))
        cost = _innovation_cost(error[accepted].ravel(), whitened[accepted].reshape(2 * count, -1), covariance)
        return Gated(residual.only(accepted), cost + GATE_2 * (len(error) - count))

    def pair(self, state: Array, prediction: Estimate) -> tuple[Mode, Mode] | None:
        """The estimate and its reversal, if the prediction does not exclude that: a tag's tilt may be taken for the
        opposite one as it goes through the frontal pose."""
        other = reversed_state(self._points, self._cameras, self._view, state)
        step = difference(other, prediction[0])[:TWIST]
        if step @ np.linalg.solve(prediction[1][:TWIST, :TWIST], step) > EXCLUDED:
            return None
        residuals = [point_residual(self._points, self._cameras, self._view, self._view.t_ns)]
        found = [refine(residuals, [StatePrior(*prediction)], start, len(prediction[1])) for start in (state, other)]
        if found[0] is None or found[1] is None or same_pose(found[0].state, found[0].covariance, found[1].state,
                                                             found[1].covariance):
            return None
        return found[0], found[1]


def _innovation_cost(error: Array, jacobian: Array, covariance: Array) -> float:
    """-2 log likelihood, up to a constant, of a whitened innovation (K,) with `jacobian` (K, n)."""
    total = jacobian @ covariance @ jacobian.T + np.eye(len(error))
    return float(error @ np.linalg.solve(total, error) + np.linalg.slogdet(total)[1])


@dataclass(slots=True)
class _Hypothesis:
    filter: TrackFilter
    log_weight: float


class ObjectTrack:
    """The track of one object: it appears, is lost, and returns, unless its measurements show no start."""

    poses: ClassVar[bool] = True
    """Whether it takes the poses of other trackers."""

    def __init__(self, name: str, process: Process | None = None, velocity: slice = VELOCITY) -> None:
        """`process`: of a state that begins with the object's pose, and has its `velocity`; a rigid object's by
        default."""
        self.name, self.velocity, self._process = name, velocity, process or ObjectProcess()
        self.reset()

    def reset(self) -> None:
        """Forget everything: a new session, or a node's clock was set."""
        self._hypotheses: list[_Hypothesis] = []
        self._life, self._rejected = Life(), 0
        self._period_ns = 0

    def take(self, measurement: Measurement) -> bool:
        """Weigh a measurement; whether it was accepted. One from before the oldest knot is not."""
        t_ns = measurement.t_ns
        if self._life.lost(t_ns, self._period_ns):
            self._hypotheses.clear()
        if not self._hypotheses:
            return self._start(measurement)
        if self._hypotheses[0].filter.forgot(t_ns):
            return False
        if self._update(measurement):
            self._life.observe(t_ns)
            self._rejected = 0
            return True
        self._rejected += 1
        return self._rejected >= REJECTIONS and self._start(measurement)

    def ingest(self, frame: FrameOfObjects) -> None:
        """Weigh what one frame has of the object; nothing where only poses come."""

    def begun(self, mode: Mode) -> Estimate:
        """The estimate that a measurement's mode begins a hypothesis with."""
        return mode.state, mode.covariance

    def predicts(self, measurement: Measurement) -> bool:
        """Whether a hypothesis accepts a measurement; False without a track."""
        t_ns = measurement.t_ns
        return not self._life.lost(t_ns, self._period_ns) and any(
            not one.filter.forgot(t_ns) and measurement.gate(*one.filter.predict_ns(t_ns)).residual is not None
            for one in self._hypotheses)

    def state(self, t_ns: int) -> ObjectState:
        """The state at master time `t_ns` by the measurements before it. The newest ones are kept for that: at an
        earlier time than all of them it is that of the oldest."""
        if not self._hypotheses or self._life.lost(t_ns, self._period_ns):
            return unknown_object(self.name, t_ns, Validity.LOST if self._life.ever else Validity.SEARCHING)
        best = self._hypotheses[0]
        t_s = max(best.filter.seconds(t_ns), best.filter.knots[0].t_s)
        state, covariance = best.filter.predict(t_s)
        validity = Validity.TRACKED
        if len(self._hypotheses) > 1 and math.exp(self._hypotheses[1].log_weight) >= AMBIGUOUS:
            validity = Validity.AMBIGUOUS
        elif self._life.predicted(t_ns):
            validity = Validity.PREDICTED
        return ObjectState(self.name, best.filter.time_ns(t_s), validity, pose_matrix(state),
                           covariance[:TWIST, :TWIST], state[self.velocity])

    def estimate(self) -> tuple[int, FilteredState] | None:
        """Master time, ns, and the most probable hypothesis after the newest measurement, labelled by its filter; None
        without one."""
        if not self._hypotheses:
            return None
        best = self._hypotheses[0].filter
        knot = best.newest
        return best.newest_ns, FilteredState(knot.t_s, knot.state, knot.covariance, self._process, best)

    def _start(self, measurement: Measurement) -> bool:
        modes = measurement.modes()
        if not modes:
            return False
        self._life.begin(measurement.t_ns)
        self._rejected = 0
        self._hypotheses.clear()
        for mode in modes:
            started = TrackFilter(self._process)
            started.begin(measurement.t_ns, *self.begun(mode))
            self._hypotheses.append(_Hypothesis(started, math.log(max(mode.probability, 1e-300))))
        self._normalise()
        return True

    def _update(self, measurement: Measurement) -> bool:
        """Update every hypothesis that accepts the measurement; for the others it is an outlier. False, and nothing is
        changed, when none does."""
        accepting, rejecting, younger = [], [], []
        for hypothesis in self._hypotheses:
            if hypothesis.filter.forgot(measurement.t_ns):  # it began with a later frame of another camera
                younger.append(hypothesis)
                continue
            prediction = hypothesis.filter.predict_ns(measurement.t_ns)
            gated = measurement.gate(*prediction)
            if gated.residual is None:
                rejecting.append(hypothesis)
            else:
                accepting.append((hypothesis, [gated.residual, *gated.beside], gated, prediction))
        least = min((gated.cost for _, _, gated, _ in accepting), default=math.inf)
        kept: list[_Hypothesis] = []
        for hypothesis, residuals, gated, prediction in accepting:
            try:
                knot = hypothesis.filter.add(hypothesis.filter.seconds(measurement.t_ns), residuals, prediction,
                                             gated.initial)
            except np.linalg.LinAlgError:  # the estimate contradicts itself
                continue
            hypothesis.log_weight -= 0.5 * min(gated.cost, least + REJECTION)
            kept.append(hypothesis)
            if len(accepting) == 1 and not rejecting and knot is hypothesis.filter.newest:
                kept += self._second(measurement, hypothesis, knot, prediction)
        if not kept:
            return False
        for hypothesis in rejecting:
            hypothesis.log_weight -= 0.5 * (least + REJECTION)
        for hypothesis in younger:  # the frame holds no information on it
            hypothesis.log_weight -= 0.5 * least
        self._hypotheses = kept + rejecting + younger
        self._normalise()
        return True

    def _second(self, measurement: Measurement, first: _Hypothesis, knot: Knot,
                prediction: Estimate) -> list[_Hypothesis]:
        """Another hypothesis that explains the measurement at `knot` as well, if there is one."""
        pair = measurement.pair(knot.state, prediction)
        if pair is None:
            return []
        second = TrackFilter(self._process, first.filter.begun_ns)
        second.start(knot.t_s, pair[1].state, pair[1].covariance)
        return [_Hypothesis(second, first.log_weight + log_mass(pair[1]) - log_mass(pair[0]))]

    def _normalise(self) -> None:
        """Normalise the weights to a sum of 1, order by them, and drop what is too improbable."""
        logs = np.array([hypothesis.log_weight for hypothesis in self._hypotheses])
        logs -= logs.max() + math.log(np.exp(logs - logs.max()).sum())
        for hypothesis, log_weight in zip(self._hypotheses, logs, strict=True):
            hypothesis.log_weight = float(log_weight)
        ranked, self._hypotheses = sorted(self._hypotheses, key=lambda one: -one.log_weight), []
        for one in ranked:
            here = one.filter.newest
            if math.exp(one.log_weight) >= FORGET and not any(
                    same_pose(here.state, here.covariance, other.filter.newest.state, other.filter.newest.covariance)
                    for other in self._hypotheses):
                self._hypotheses.append(one)


class RigidTrack(ObjectTrack):
    """The track of one object by its tags or markers, with the cameras of one rig."""

    def __init__(self, model: ObjectModel, cameras: CameraArrays, diagnostics: Diagnostics,
                 camera_names: Sequence[str]) -> None:
        self._points, self._cameras = ObjectPoints(model), cameras
        self._rigid = ObjectProcess(cameras, sized=self._points.sized)
        super().__init__(model.name, self._rigid)
        self._diagnostics, self._camera_names = diagnostics, camera_names

    def reset(self) -> None:
        """Forget everything."""
        super().reset()
        self._newest: dict[int, ObjectView] = {}

    def ingest(self, frame: FrameOfObjects) -> None:
        """See `ObjectTrack`."""
        if isinstance(frame, PictureFrame):
            return
        chosen = self._chosen(frame) if isinstance(frame, FiducialFrame) else []
        view = self._points.view(frame, chosen)
        if view is not None:
            others = [other for camera, other in self._newest.items()
                      if camera != view.camera and abs(view.t_ns - other.t_ns) < PREDICTED_NS]
            self._newest[view.camera] = view
            self.take(PointMeasurement(self._points, self._cameras, view, others))

    def begun(self, mode: Mode) -> Estimate:
        """See `ObjectTrack`."""
        return self._rigid.with_turns(mode.state, mode.covariance)

    def _chosen(self, frame: FiducialFrame) -> list[int]:
        """Of each tag that is seen more than once the copy that alone fits the prediction, if there is one."""
        points, chosen = self._points, list[int]()
        for copies in points.copies(frame):
            fits = []
            for n in copies:
                view = points.view(replace(frame, keys=frame.keys[[n]], corners=frame.corners[[n]],
                                           covariances=frame.covariances[[n]]))
                if view is not None and self.predicts(PointMeasurement(points, self._cameras, view)):
                    fits.append(n)
            chosen += fits if len(fits) == 1 else []
            self._diagnostics.warn(copies_sentence(self._camera_names[frame.camera], frame.keys[copies[0]], self.name))
        return chosen


class ObjectTracker:
    """Tracks several objects with the cameras of one rig. Cameras need no synchronisation."""

    def __init__(self, objects: Sequence[ObjectModel], cameras: Sequence[CameraModel],
                 diagnostics: Diagnostics | None = None, camera_names: Sequence[str] = (),
                 further: Sequence[ObjectTrack] = (), reference: int = 0, turn_sd: Array | None = None) -> None:
        """`diagnostics` takes what it fails over and warns of, by `camera_names`. `further`: tracks of other objects.
        `reference`, `turn_sd`: as `CameraArrays`. Raises ObjectError when two objects cannot be told apart, or have one
        name."""
        require_distinct(objects, [one.name for one in objects])
        called = [one.name for one in objects] + [one.name for one in further]
        if twice := [name for name in called if called.count(name) > 1]:
            raise ObjectError(f"two objects are called {twice[0]!r}. Rename one.")
        self._diagnostics = Diagnostics() if diagnostics is None else diagnostics
        names = camera_names or [str(number) for number in range(len(cameras))]
        arrays = CameraArrays.of(list(cameras), reference, turn_sd)
        self.tracks = [*(RigidTrack(one, arrays, self._diagnostics, names) for one in objects), *further]

    def take(self, frame: FrameOfObjects) -> None:
        """Weigh one frame."""
        for track in self.tracks:
            with self._part(track):
                track.ingest(frame)

    def take_pose(self, name: str, measurement: Measurement) -> bool:
        """Weigh a pose of the object `name`; whether it was accepted. One of an object that is not here is not."""
        accepted = False
        for track in self.tracks:
            if track.poses and track.name == name:
                with self._part(track):
                    accepted |= track.take(measurement)
        return accepted

    def states(self, t_ns: int) -> list[ObjectState]:
        """The state of every object at master time `t_ns`, by what has been taken."""
        return [self._state(track, t_ns) for track in self.tracks]

    def reset(self) -> None:
        """Forget everything: a new session, or a node's clock was set."""
        for track in self.tracks:
            track.reset()

    def _part(self, track: ObjectTrack, what: str = "the object") -> Part:
        return self._diagnostics.part(f"{what} {track.name}", track.reset)

    def _state(self, track: ObjectTrack, t_ns: int) -> ObjectState:
        with self._part(track, "the state of the object"):
            return track.state(t_ns)
        return unknown_object(track.name, t_ns, Validity.LOST)


def copies_sentence(camera: str, key: NDArray[np.int64], name: str) -> str:
    """That a camera sees the tag `key` (2,) of the object `name` more than once, and what becomes of it."""
    family, number = key
    return (f"Camera {camera} sees tag {number} ({FAMILIES[family]}) of {name} more than once. All copies but one "
            "where the object is predicted are left out. Cover the other print.")
