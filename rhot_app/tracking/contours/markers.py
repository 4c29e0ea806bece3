"""Markers or landmarks beside the contours of one hand: residuals of the same state, and a start where they are enough.

The state of a bare hand has its size behind the motion; the lasting errors of the markers follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.joints import add_lengths
from rhot_app.barehand.surface import FINGERS, LENGTH, RADIUS, SHAPE, WHOLE, sized_table
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.estimation.filter import IteratedFilter, Knot
from rhot_app.estimation.residual import Rows
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.landmarks import LASTING_M, LASTING_S
from rhot_app.hand.motion.hand_process import (
    ANGLES,
    BIAS,
    BIAS_S,
    FASTEST,
    MOTION,
    PALM_SPREAD,
    VELOCITY,
    HandProcess,
)
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.tracking.association import GATE, MarkerAssociation
from rhot_app.tracking.markers.acquisition import Starter
from rhot_app.tracking.markers.estimator import Rejections, associate, distances_of
from rhot_app.tracking.markers.estimator_state import RecentObservations
from rhot_app.tracking.markers.marker_model import LASTING_PX, MarkerModel, compile_markers
from rhot_app.tracking.markers.marker_residual import MarkerFrame, triangulation_covariance
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LENGTHS = np.concatenate([[WHOLE, FINGERS], np.arange(LENGTH, RADIUS)])
"""Of a shape: what moves joints and markers."""


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
            PALM_SPREAD, np.full(3, FASTEST), FASTEST, np.concatenate([self._shape, np.zeros((count, 3, 3))]),
            np.concatenate([hand.shape_s, lasting]))
        hand.process, hand.filter = self._process, IteratedFilter(self._process)
        self._bone, self._observations = hand.surface.bone, RecentObservations(arrays, self._markers)
        self.reset()

    def reset(self) -> None:
        """Forget the frames."""
        self._starter.reset()
        self._association.reset()
        self._observations.reset()
        cameras = len(self._observations.newest)
        self._rejections = Rejections(cameras, self._markers)
        self._wrong: list[list[tuple[slice, float]]] = [[] for _ in range(cameras)]  # of each camera's last frame

    def locate(self, frame: CameraObservations) -> tuple[HandPose, int] | None:
        """The pose of a hand that the markers of the last frames show alone, and its time, master ns."""
        self._starter.ingest(self._association.select(frame))
        located = self._starter.locate()
        pose = None if located is None else self._starter.pose_of(located.positions)
        return None if located is None or pose is None else (pose, located.t_ns)

    def begin(self, hand: BareHandTracker) -> None:
        """The tracker has started: the markers' lasting errors are those at its pose."""
        self._note(hand, hand.filter.newest.state)
        knot = hand.filter.newest
        own = slice(MOTION + SHAPE, None)
        knot.covariance[own, own] = self._process.stationary[own, own]
        self.reset()

    def weigh(self, frame: CameraObservations, hand: BareHandTracker, epoch_ns: int) -> bool:
        """Weigh the markers of one frame alone; False when it shows none. Raises LinAlgError when they contradict
        all."""
        t_s = 1e-9 * (MarkerFrame(self._markers, frame).t_ns - epoch_ns)
        if t_s < hand.filter.knots[0].t_s:
            return False
        hand.take((), t_s)
        prediction = hand.filter.predict(t_s)
        found = self.residuals([frame], hand, prediction, epoch_ns + round(1e9 * t_s))
        if found:
            self.judge(found, hand.filter.add(t_s, [*found, *hand.known], prediction))
        return bool(found)

    def residuals(self, frames: Sequence[CameraObservations], hand: BareHandTracker, prediction: tuple[Array, Array],
                  t_ns: int) -> list[BesideContours]:
        """What the markers of some cameras' frames say of a hand that is predicted for master time `t_ns`, as far as
        they may be its markers; none of a frame that shows none."""
        self._note(hand, prediction[0])
        reported = [MarkerFrame(self._markers, frame) for frame in frames]
        for one in reported:
            if not one.seen.any():
                self._wrong[one.camera] = []  # a marker that is not seen contradicts nothing
        return [BesideContours(one, self._markers, hand.surface.bone, prediction, t_ns) for one in reported
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

    def _note(self, hand: BareHandTracker, state: Array) -> None:
        m = sized(self._markers, hand.surface.bone, state)
        bias = np.empty((len(m.finger), 3, 3))
        triangulation_covariance(without_size(state), m.dh, m.half_axes, m.poses, m.intrinsics, LASTING_PX,
                                 np.where(m.landmark, LASTING_M, 0.0), m.paint_variance, bias)
        self._process.set_bias(np.concatenate([self._shape, bias]))


class BesideContours:
    """Implements `Residual`: a `MarkerFrame` on a state that has the hand's shape before the markers' errors. The
    lengths of the shape move the markers; `bone` (R,): the phalanx of each row of the table, as in `Surface`."""

    def __init__(self, frame: MarkerFrame, markers: MarkerModel, bone: Indices, prediction: tuple[Array, Array],
                 t_ns: int) -> None:
        """Associates the frame with the hand as it is predicted for `t_ns`, master ns."""
        self._markers, self._bone, self.frame = markers, bone, frame
        frame.markers = sized(markers, bone, prediction[0])
        frame.add_landmark_noise(without_size(prediction[0]))
        frame.late_s, frame.t_ns = np.where(frame.seen, frame.late_s + 1e-9 * (frame.t_ns - t_ns), 0.0), t_ns
        pixels, covariances = self._expected(*prediction)
        self._reported = frame
        self.frame = associate(frame, pixels, covariances, distances_of(frame, pixels, covariances))

    def _expected(self, state: Array, covariance: Array) -> tuple[Array, Array]:
        """See `MarkerFrame.predict_pixels`."""
        self.frame.markers = sized(self._markers, self._bone, state)
        lengths = lengths_jacobian(self.frame.markers.dh, self._bone, state)
        return self.frame.predict_pixels(without_size(state), without_size_covariance(covariance, lengths))

    def distances(self, state: Array, covariance: Array) -> Array:
        """(M,) squared Mahalanobis distances of the markers that were reported from a hand in `state`, whose lasting
        errors are not known."""
        return distances_of(self._reported, *self._expected(without_errors(state), covariance))

    def cost(self, state: Array, stationary: Array) -> float:
        """-2 log of how probable a hand in `state` makes the markers that were reported; one that is none of its costs
        GATE, as in `association.assign`. `stationary`: the process's covariance, of which that of the lasting errors
        counts."""
        distances = self.distances(state, with_errors_of(stationary, np.zeros_like(stationary)))
        return float(np.minimum(distances[self._reported.seen], GATE).sum())

    def linearise(self, state: Array) -> Rows:
        """See `Residual`."""
        self.frame.markers = sized(self._markers, self._bone, state)
        rows = self.frame.linearise(without_size(state))
        by_place = rows.jacobian[:, MOTION:]  # a lasting error moves its marker
        jacobian = np.insert(rows.jacobian, [MOTION] * SHAPE, 0.0, axis=1)
        jacobian[:, MOTION + LENGTHS] = by_place @ lengths_jacobian(self.frame.markers.dh, self._bone, state)
        return replace(rows, jacobian=jacobian)


def sized(markers: MarkerModel, bone: Indices, state: Array) -> MarkerModel:
    """The markers on a hand of the lengths that `state` has."""
    dh, shape = markers.dh, np.ascontiguousarray(state[BIAS:BIAS + SHAPE])
    a, d = np.empty(len(dh.a)), np.empty(len(dh.d))
    sized_table(dh, bone, shape, a, d)
    return replace(markers, dh=dh._replace(a=a, d=d, point_offset=np.exp(shape[WHOLE]) * dh.point_offset))


def lengths_jacobian(dh: DhArrays, bone: Indices, state: Array) -> Array:
    """(3 P, 17): how the points of a sized table follow the LENGTHS of a shape."""
    world, frames, points = np.eye(4), empty_frames(dh), np.empty((len(dh.point_row), 3))
    world[:3] = state[:ANGLES].reshape(3, 4)
    forward_arrays(dh, world, state[ANGLES:VELOCITY], frames, points)
    out = np.zeros((len(points), 3, len(LENGTHS)))
    add_lengths(dh, bone, world, frames, points, out)
    return out.reshape(-1, len(LENGTHS))


def without_size_covariance(covariance: Array, lengths: Array) -> Array:
    """The covariance of a state as `marker_residual` knows it: what the `lengths` (3 M, 17) move its markers by counts
    as their lasting errors."""
    size = len(covariance)
    to = np.zeros((size - SHAPE, size))
    to[:MOTION, :MOTION], to[MOTION:, MOTION + SHAPE:] = np.eye(MOTION), np.eye(size - SHAPE - MOTION)
    to[MOTION:, MOTION + LENGTHS] = lengths
    return np.asarray(to @ covariance @ to.T)


def without_errors(state: Array) -> Array:
    """The state with lasting errors of 0."""
    return np.concatenate([state[:BIAS + SHAPE], np.zeros(len(state) - BIAS - SHAPE)])


def with_errors_of(stationary: Array, covariance: Array) -> Array:
    """The covariance with lasting errors as the `stationary` process has them."""
    out, own = covariance.copy(), slice(MOTION + SHAPE, None)
    out[own], out[:, own] = 0.0, 0.0
    out[own, own] = stationary[own, own]
    return out


def without_size(state: Array) -> Array:
    """The state as `marker_residual` knows it."""
    return np.concatenate([state[:BIAS], state[BIAS + SHAPE:]])
