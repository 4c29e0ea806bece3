"""Markers or landmarks beside the contours of one hand: which frames are weighed with which edges, and whether the
markers or the contours are right where they contradict each other. Enough of them start the track."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import SAME_TIME_S, ContourFrame, Contours, velocity_of
from rhot_app.barehand.observations import EdgeFrame
from rhot_app.barehand.relocalisation import RELOCALISATION_LOG_ODDS
from rhot_app.barehand.surface import SHAPE
from rhot_app.barehand.tracker import CONFUSED_PX, PASSES, BareHandTracker
from rhot_app.estimation.filter import IteratedFilter, Knot, update
from rhot_app.estimation.residual import Residual
from rhot_app.hand.landmarks import LASTING_M, LASTING_S
from rhot_app.hand.motion.hand_process import BIAS_S, FASTEST, MOTION, PALM_SPREAD, POSE, HandProcess
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.tracking.association import GATE, MarkerAssociation
from rhot_app.tracking.contours.requests import NEVER, CameraFrames
from rhot_app.tracking.contours.sized_markers import (
    BesideContours,
    sized,
    with_errors_of,
    without_errors,
    without_size,
)
from rhot_app.tracking.markers.acquisition import Starter
from rhot_app.tracking.markers.estimator import Rejections
from rhot_app.tracking.markers.estimator_state import RecentObservations
from rhot_app.tracking.markers.marker_model import LASTING_PX, compile_markers
from rhot_app.tracking.markers.marker_residual import MarkerFrame, triangulation_covariance
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]
Estimate = tuple[Array, Array]

_SAME_FRAME_NS = round(1e9 * SAME_TIME_S)  # markers and edges of one frame come apart, and their times are rounded


class MarkersOfHand:
    """The markers of a rig's hand, whose contours a `BareHandTracker` follows."""

    def __init__(self, rig: Rig, hand: BareHandTracker) -> None:
        """Gives the tracker a state with the markers' lasting errors. Raises RigError when one has no place."""
        arrays, self._markers = compile_rig(rig), compile_markers(rig)
        self._starter, self._association = Starter(arrays, self._markers), MarkerAssociation(arrays)
        count, prior, self._shape = len(self._markers.finger), hand.model.pose_prior, hand.shape_covariance
        lasting = np.where(self._markers.landmark, LASTING_S, BIAS_S)
        self._process = HandProcess(
            hand.surface.dh, hand.model.limits, prior.mean, np.asarray(np.linalg.inv(prior.information)),
            PALM_SPREAD, hand.slowest, FASTEST, np.concatenate([self._shape, np.zeros((count, 3, 3))]),
            np.concatenate([hand.shape_s, lasting]))
        hand.process, hand.filter = self._process, IteratedFilter(self._process)
        self._hand, self._observations = hand, RecentObservations(arrays, self._markers)
        self.reset()

    def reset(self) -> None:
        """Forget the frames."""
        self._starter.reset()
        self._association.reset()
        self._observations.reset()
        cameras = len(self._observations.newest)
        self._rejections = Rejections(cameras, self._markers)
        self._wrong: list[list[tuple[slice, float]]] = [[] for _ in range(cameras)]  # of each camera's last frame
        self._epoch_ns = 0
        self.forget()

    def forget(self) -> None:
        """Forget the frames whose edges have not come."""
        self._waiting: list[CameraObservations] = []

    def locate(self, frame: CameraObservations) -> tuple[HandPose, int] | None:
        """The pose of a hand that the markers of the last frames show alone, and its time, master ns."""
        self._starter.ingest(self._association.select(frame))
        located = self._starter.locate()
        pose = None if located is None else self._starter.pose_of(located.positions)
        return None if located is None or pose is None else (pose, located.t_ns)

    def begin(self, epoch_ns: int) -> None:
        """The hand has been found at `epoch_ns`: the markers' lasting errors are those at its pose."""
        knot = self._hand.filter.newest
        self._note(knot.state)
        own = slice(MOTION + SHAPE, None)
        knot.covariance[own, own] = self._process.stationary[own, own]
        self.reset()
        self._epoch_ns = epoch_ns

    def take(self, frame: CameraObservations, cameras: Sequence[CameraFrames]) -> bool:
        """Keep one frame's markers until the edges of the same frame come, so that both are weighed at once; weigh
        those alone whose edges do not come. Whether these showed anything. Raises LinAlgError."""
        frames = [*self._waiting, frame]
        self._waiting = [one for one in frames if _awaited(one, cameras[one.camera])]
        return self._weigh_all([one for one in frames if not _awaited(one, cameras[one.camera])])

    def beside(self, edges_ns: Mapping[int, int]) -> list[CameraObservations]:
        """The markers of the frames whose edges are weighed next, of which the times are given by camera. Those of
        earlier frames are weighed alone. Raises LinAlgError."""
        late = [(one, one.t_row0_master_ns - edges_ns.get(one.camera, NEVER)) for one in self._waiting]
        self._waiting = [one for one, late_ns in late if late_ns > _SAME_FRAME_NS]
        self._weigh_all([one for one, late_ns in late if late_ns < -_SAME_FRAME_NS])
        return [one for one, late_ns in late if abs(late_ns) <= _SAME_FRAME_NS]

    def _weigh_all(self, frames: Sequence[CameraObservations]) -> bool:
        """Weigh the markers of some frames. Whether they showed anything. Raises LinAlgError."""
        return bool(sum(self.weigh(one) for one in frames))

    def weigh(self, frame: CameraObservations) -> bool:
        """Weigh the markers of one frame alone; False when it shows none. Raises LinAlgError when they contradict
        all."""
        hand, t_s = self._hand, 1e-9 * (MarkerFrame(self._markers, frame).t_ns - self._epoch_ns)
        if t_s < hand.filter.knots[0].t_s:
            return False
        hand.prepare_update((), t_s)
        prediction = hand.filter.predict(t_s)
        found = self._residuals([frame], prediction, self._epoch_ns + round(1e9 * t_s))
        if found:
            self.judge(found, hand.filter.add(t_s, [*found, *hand.constraints], prediction))
        return bool(found)

    def choose(self, frames: Sequence[CameraObservations], contours: Contours, predicted: Estimate,
               t_s: float) -> tuple[Estimate, list[BesideContours], Array]:
        """The prediction, what the markers of these frames say of it, and where the contours are looked for: where it
        has the hand, or, after markers have contradicted it, where these would show a less certain hand, whichever
        explains both best."""
        hand, t_ns = self._hand, self._epoch_ns + round(1e9 * t_s)
        found, wide = self._residuals(frames, predicted, t_ns), self.widened(*predicted)
        if not found or wide is None:
            return predicted, found, predicted[0]
        again, stationary = self._residuals(frames, wide, t_ns), hand.process.stationary
        residuals: list[Residual] = [*again, *hand.constraints]
        state = update(hand.process, t_s, wide, residuals, None, hand.filter.partial).state
        state = update(hand.process, t_s, wide, [*residuals, contours], state, hand.filter.partial).state
        away = hand.process.difference(state, predicted[0])[:POSE]
        cost = (2.0 * RELOCALISATION_LOG_ODDS + float(away @ np.linalg.solve(wide[1][:POSE, :POSE], away))
                + _cost(again, contours, state, stationary))
        if cost < _cost(found, contours, predicted[0], stationary):
            return wide, again, state
        return predicted, found, predicted[0]

    def _residuals(self, frames: Sequence[CameraObservations], prediction: Estimate,
                   t_ns: int) -> list[BesideContours]:
        """What the markers of some cameras' frames say of a hand that is predicted for master time `t_ns`, as far as
        they may be its markers; none of a frame that shows none."""
        self._note(prediction[0])
        reported = [MarkerFrame(self._markers, frame) for frame in frames]
        for one in reported:
            if not one.seen.any():
                self._wrong[one.camera] = []  # a marker that is not seen contradicts nothing
        return [BesideContours(one, self._markers, self._hand.surface.bone, prediction, t_ns) for one in reported
                if one.seen.any()]

    def judge(self, found: list[BesideContours], knot: Knot) -> None:
        """A knot has weighed `found`, its first residuals."""
        first = 0
        for one in found:
            frame, state = one.frame, without_size(knot.state)
            distances = one.distances(knot.state, with_errors_of(self._process.stationary, knot.covariance))
            self._observations.enter(frame)
            inliers = self._observations.accept(frame, state, knot.weights[first:])
            inliers &= distances < GATE  # what lasting errors explain may be no such error
            first += int(np.count_nonzero(frame.seen & np.isfinite(frame.expected(state)[:, 0])))
            self._wrong[frame.camera] = self._rejections.wrong(frame, inliers, distances,
                                                               self._observations.periods_s[frame.camera])

    def widened(self, state: Array, covariance: Array) -> tuple[Array, Array] | None:
        """The hand, less certain where its markers contradict it and with lasting errors that are not known, as the
        markers may be right; None while none does."""
        wrong = [one for each in self._wrong for one in each]
        if not wrong:
            return None
        covariance = with_errors_of(self._process.stationary, covariance)
        largest: dict[tuple[int, int], float] = {}
        for part, factor in wrong:  # two cameras may say the same
            key = part.start, part.stop
            largest[key] = max(largest.get(key, 1.0), factor)
        for (first, last), factor in largest.items():
            self._process.inflate(covariance, slice(first, last), factor)
        return without_errors(state), covariance

    def _note(self, state: Array) -> None:
        """Have the process know the lasting errors of the markers of a hand in `state`."""
        m = sized(self._markers, self._hand.surface.bone, state)
        bias = np.empty((len(m.finger), 3, 3))
        triangulation_covariance(without_size(state), m.dh, m.half_axes, m.poses, m.intrinsics, LASTING_PX,
                                 np.where(m.landmark, LASTING_M, 0.0), m.paint_variance, bias)
        self._process.set_bias(np.concatenate([self._shape, bias]))


def weigh(hand: BareHandTracker, markers: MarkersOfHand | None, waiting: Mapping[int, tuple[EdgeFrame, ContourFrame]],
          epoch_ns: int) -> None:
    """Estimate by the edges of some cameras, by number, with the markers of the same frames: PASSES times with the same
    edges, and each time the contour is expected twice as near. Raises LinAlgError when they contradict the estimate."""
    times_ns = [one.t_row0_master_ns + _middle_ns(one) for one, _ in waiting.values()]
    t_s = max(1e-9 * (max(times_ns) - epoch_ns), hand.filter.knots[0].t_s)
    contours = [contour for _, contour in waiting.values()]
    for contour, t_ns in zip(contours, times_ns, strict=True):
        contour.late_s = contour.late_s + (1e-9 * (t_ns - epoch_ns) - t_s)
    edges_ns = {number: one.t_row0_master_ns for number, (one, _) in waiting.items()}
    marked = [] if markers is None else markers.beside(edges_ns)
    hand.prepare_update(waiting, t_s)
    prediction, spreads = hand.filter.predict(t_s), [contour.expected_sd for contour in contours]
    found: list[BesideContours] = []
    initial = prediction[0]
    edges = Contours(contours, velocity_of(prediction))
    if markers is not None:
        prediction, found, initial = markers.choose(marked, edges, prediction, t_s)
        edges.move_by(velocity_of(prediction))
    residuals: list[Residual] = [*found, edges, *hand.constraints]
    for number in range(PASSES):
        for contour, spread in zip(contours, spreads, strict=True):
            contour.expected_sd = np.minimum(spread * 0.5**number, CONFUSED_PX)
        if number < PASSES - 1:
            better = update(hand.process, t_s, prediction, residuals, initial, hand.filter.partial)
            initial = better.state
            edges.move_by(velocity_of((better.state, better.covariance)))
    knot = hand.filter.add(t_s, residuals, prediction, initial)
    if markers is not None:
        markers.judge(found, knot)


def _middle_ns(frame: EdgeFrame) -> int:
    """From the exposure of row 0 to that of the mean row of the slices, ns."""
    slices = frame.request.slices
    return round(float(slices[:, 1].mean()) * frame.row_time_ns) if len(slices) else 0


def _awaited(frame: CameraObservations, camera: CameraFrames) -> bool:
    """Whether the edges of a frame may still come."""
    assert camera.newest is not None
    return (camera.newest.t_row0_master_ns - frame.t_row0_master_ns < 1.5 * camera.period_ns
            and camera.answers(frame.t_row0_master_ns))


def _cost(markers: list[BesideContours], contours: Contours, state: Array, stationary: Array) -> float:
    """-2 log of how probable a hand in `state` makes its markers and contours, but for a constant."""
    cost = float(np.sum(contours.linearise(state).error ** 2))
    return cost + sum(one.cost(state, stationary) for one in markers)
