"""Markers or landmarks of a hand that is tracked by its contours.

They start a track if there are enough of them, and update it together with the edges of the same frame. Where markers
and contours contradict each other, the more probable hypothesis is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import SAME_TIME_S, ContourFrame, Contours, velocity_of
from rhot_app.barehand.observations import EdgeFrame
from rhot_app.barehand.relocalisation import RELOCALISATION_LOG_ODDS
from rhot_app.barehand.surface import SHAPE
from rhot_app.barehand.tracker import AMBIGUOUS_PX, PASSES, BareHandTracker
from rhot_app.estimation.filter import IteratedFilter, Knot, update
from rhot_app.estimation.residual import Residual
from rhot_app.hand.landmarks import LASTING_S
from rhot_app.hand.motion.hand_process import BIAS_S, FASTEST, MOTION, PALM_SPREAD, POSE, HandProcess
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.tracking.association import GATE, MarkerAssociation
from rhot_app.tracking.contours.requests import NEVER, CameraFrames
from rhot_app.tracking.contours.sized_markers import (
    SizedMarkerResidual,
    sized,
    with_stationary_errors,
    with_zero_errors,
    without_shape,
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

_SAME_FRAME_NS = round(1e9 * SAME_TIME_S)  # markers and edges of one frame have rounded times


class MarkersOfHand:
    """The markers of a hand that a `BareHandTracker` tracks."""

    def __init__(self, rig: Rig, hand: BareHandTracker) -> None:
        """Replaces the tracker's process and filter by ones whose state includes the markers' lasting errors. Raises
        RigError when a marker has no position on the hand."""
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
        """Discard all frames."""
        self._starter.reset()
        self._association.reset()
        self._observations.reset()
        cameras = len(self._observations.newest)
        self._rejections = Rejections(cameras, self._markers)
        # of each camera's last frame: parts of the tangent space and the factors by which to inflate them
        self._contradictions: list[list[tuple[slice, float]]] = [[] for _ in range(cameras)]
        self._epoch_ns = 0
        self.clear_waiting()

    def clear_waiting(self) -> None:
        """Discard the frames that wait for their edges."""
        self._waiting: list[CameraObservations] = []

    def locate(self, frame: CameraObservations) -> tuple[HandPose, int] | None:
        """The pose that the markers of the last frames determine without contours, and its time, master ns; None
        without."""
        self._starter.ingest(self._association.select(frame))
        located = self._starter.locate()
        pose = None if located is None else self._starter.pose_of(located.positions)
        return None if located is None or pose is None else (pose, located.t_ns)

    def start(self, epoch_ns: int) -> None:
        """Start with a track of master time `epoch_ns`: lasting errors are unknown, with their stationary
        covariance."""
        knot = self._hand.filter.newest
        self._set_lasting_errors(knot.state)
        own = slice(MOTION + SHAPE, None)
        knot.covariance[own, own] = self._process.stationary[own, own]
        self.reset()
        self._epoch_ns = epoch_ns

    def take(self, frame: CameraObservations, cameras: Sequence[CameraFrames]) -> bool:
        """Keep the markers of one frame until its edges arrive, for a joint update. Update by the markers alone of
        frames whose edges do not arrive. Returns whether any of these were used. Raises LinAlgError."""
        frames = [*self._waiting, frame]
        self._waiting = [one for one in frames if _awaited(one, cameras[one.camera])]
        return self._update_all([one for one in frames if not _awaited(one, cameras[one.camera])])

    def take_matching(self, edges_ns: Mapping[int, int]) -> list[CameraObservations]:
        """Remove and return the kept markers of the frames of `edges_ns`: master times of edges, by camera. Update by
        the markers alone of earlier frames. Raises LinAlgError."""
        late = [(one, one.t_row0_master_ns - edges_ns.get(one.camera, NEVER)) for one in self._waiting]
        self._waiting = [one for one, late_ns in late if late_ns > _SAME_FRAME_NS]
        self._update_all([one for one, late_ns in late if late_ns < -_SAME_FRAME_NS])
        return [one for one, late_ns in late if abs(late_ns) <= _SAME_FRAME_NS]

    def _update_all(self, frames: Sequence[CameraObservations]) -> bool:
        """Update by the markers of some frames. Returns whether any were used. Raises LinAlgError."""
        return bool(sum(self.update(one) for one in frames))

    def update(self, frame: CameraObservations) -> bool:
        """Update the state by the markers of one frame alone; False without any. Raises LinAlgError when they
        contradict the estimate."""
        hand, t_s = self._hand, 1e-9 * (MarkerFrame(self._markers, frame).t_ns - self._epoch_ns)
        if t_s < hand.filter.knots[0].t_s:
            return False
        hand.prepare_update((), t_s)
        prediction = hand.filter.predict(t_s)
        found = self._residuals([frame], prediction, self._epoch_ns + round(1e9 * t_s))
        if found:
            self.update_inliers(found, hand.filter.add(t_s, [*found, *hand.constraints], prediction))
        return bool(found)

    def choose_prediction(self, frames: Sequence[CameraObservations], contours: Contours, predicted: Estimate,
                          t_s: float) -> tuple[Estimate, list[SizedMarkerResidual], Array]:
        """Choose between two hypotheses by the markers of these frames and the contours: the prediction, and, after
        markers have contradicted it, the hand that they show under an inflated covariance.

        Returns the prediction of the more probable one, its marker residuals, and the state (n,) about which the
        contours are linearised first.
        """
        hand, t_ns = self._hand, self._epoch_ns + round(1e9 * t_s)
        found, inflated = self._residuals(frames, predicted, t_ns), self.inflated(*predicted)
        if not found or inflated is None:
            return predicted, found, predicted[0]
        again, stationary = self._residuals(frames, inflated, t_ns), hand.process.stationary
        residuals: list[Residual] = [*again, *hand.constraints]
        state = update(hand.process, t_s, inflated, residuals, None, hand.filter.partial).state
        state = update(hand.process, t_s, inflated, [*residuals, contours], state, hand.filter.partial).state
        away = hand.process.difference(state, predicted[0])[:POSE]
        cost = (2.0 * RELOCALISATION_LOG_ODDS + float(away @ np.linalg.solve(inflated[1][:POSE, :POSE], away))
                + _cost(again, contours, state, stationary))
        if cost < _cost(found, contours, predicted[0], stationary):
            return inflated, again, state
        return predicted, found, predicted[0]

    def _residuals(self, frames: Sequence[CameraObservations], prediction: Estimate,
                   t_ns: int) -> list[SizedMarkerResidual]:
        """The residuals of the markers of some frames, associated with the hand predicted for master time `t_ns`; none
        of a frame without markers."""
        self._set_lasting_errors(prediction[0])
        reported = [MarkerFrame(self._markers, frame) for frame in frames]
        for one in reported:
            if not one.seen.any():
                self._contradictions[one.camera] = []  # markers that are not observed contradict nothing
        return [SizedMarkerResidual(one, self._markers, self._hand.surface.bone, prediction, t_ns) for one in reported
                if one.seen.any()]

    def update_inliers(self, found: list[SizedMarkerResidual], knot: Knot) -> None:
        """Update inliers and contradictions by a `knot` whose first residuals are `found`."""
        first = 0
        for one in found:
            frame, state = one.frame, without_shape(knot.state)
            distances = one.distances(knot.state, with_stationary_errors(self._process.stationary, knot.covariance))
            self._observations.enter(frame)
            inliers = self._observations.accept(frame, state, knot.weights[first:])
            inliers &= distances < GATE  # a lasting error may explain a marker that is none of the hand's
            first += int(np.count_nonzero(frame.seen & np.isfinite(frame.expected(state)[:, 0])))
            self._contradictions[frame.camera] = self._rejections.wrong(frame, inliers, distances,
                                                               self._observations.periods_s[frame.camera])

    def inflated(self, state: Array, covariance: Array) -> tuple[Array, Array] | None:
        """State and covariance of a hand that its markers contradict: inflated so far that they may be right, and with
        unknown lasting errors. None while no marker contradicts it."""
        wrong = [one for each in self._contradictions for one in each]
        if not wrong:
            return None
        covariance = with_stationary_errors(self._process.stationary, covariance)
        largest: dict[tuple[int, int], float] = {}
        for part, factor in wrong:  # two cameras may contradict the same part
            key = part.start, part.stop
            largest[key] = max(largest.get(key, 1.0), factor)
        for (first, last), factor in largest.items():
            self._process.inflate(covariance, slice(first, last), factor)
        return with_zero_errors(state), covariance

    def _set_lasting_errors(self, state: Array) -> None:
        """Set the process's covariance of the lasting errors to that of the markers of a hand in `state`."""
        m = sized(self._markers, self._hand.surface.bone, state)
        bias = np.empty((len(m.finger), 3, 3))
        triangulation_covariance(without_shape(state), m.dh, m.half_axes, m.poses, m.intrinsics, LASTING_PX,
                                 m.paint_variance, bias)
        self._process.set_bias(np.concatenate([self._shape, bias]))


def update_hand(hand: BareHandTracker, markers: MarkersOfHand | None,
                waiting: Mapping[int, tuple[EdgeFrame, ContourFrame]], epoch_ns: int) -> None:
    """Update the state by the edges of some cameras, by number, and the markers of the same frames. There are PASSES
    with the same edges, each with half the standard deviation of the expected contour. Raises LinAlgError when the
    observations contradict the estimate."""
    times_ns = [one.t_row0_master_ns + _middle_ns(one) for one, _ in waiting.values()]
    t_s = max(1e-9 * (max(times_ns) - epoch_ns), hand.filter.knots[0].t_s)
    contours = [contour for _, contour in waiting.values()]
    for contour, t_ns in zip(contours, times_ns, strict=True):
        contour.late_s = contour.late_s + (1e-9 * (t_ns - epoch_ns) - t_s)
    edges_ns = {number: one.t_row0_master_ns for number, (one, _) in waiting.items()}
    marked = [] if markers is None else markers.take_matching(edges_ns)
    hand.prepare_update(waiting, t_s)
    prediction, spreads = hand.filter.predict(t_s), [contour.expected_sd for contour in contours]
    found: list[SizedMarkerResidual] = []
    initial = prediction[0]
    edges = Contours(contours, velocity_of(prediction))
    if markers is not None:
        prediction, found, initial = markers.choose_prediction(marked, edges, prediction, t_s)
        edges.move_by(velocity_of(prediction))
    residuals: list[Residual] = [*found, edges, *hand.constraints]
    for number in range(PASSES):
        for contour, spread in zip(contours, spreads, strict=True):
            contour.expected_sd = np.minimum(spread * 0.5**number, AMBIGUOUS_PX)
        if number < PASSES - 1:
            better = update(hand.process, t_s, prediction, residuals, initial, hand.filter.partial)
            initial = better.state
            edges.move_by(velocity_of((better.state, better.covariance)))
    knot = hand.filter.add(t_s, residuals, prediction, initial)
    if markers is not None:
        markers.update_inliers(found, knot)


def _middle_ns(frame: EdgeFrame) -> int:
    """Time from the exposure of row 0 to that of the mean row of the slices, ns."""
    slices = frame.request.slices
    return round(float(slices[:, 1].mean()) * frame.row_time_ns) if len(slices) else 0


def _awaited(frame: CameraObservations, camera: CameraFrames) -> bool:
    """Whether the edges of a frame may still arrive."""
    assert camera.newest is not None
    return (camera.newest.t_row0_master_ns - frame.t_row0_master_ns < 1.5 * camera.period_ns
            and camera.returns_edges(frame.t_row0_master_ns))


def _cost(markers: list[SizedMarkerResidual], contours: Contours, state: Array, stationary: Array) -> float:
    """-2 log likelihood of the markers and contours for a hand in `state`, up to a constant."""
    cost = float(np.sum(contours.linearise(state).error ** 2))
    return cost + sum(one.cost(state, stationary) for one in markers)
