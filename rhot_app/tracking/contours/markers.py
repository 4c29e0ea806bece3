"""Markers or landmarks of a hand that is tracked by its contours.

They start a track if there are enough of them, and update the same state: motion, shape and the lasting errors of the
markers. The state of `marker_residual` has no shape.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.joints import points_in
from rhot_app.barehand.surface import FINGER_SIZE, HAND_SIZE, LENGTH, RADIUS
from rhot_app.barehand.surface import sized as sized_table
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.estimation.residual import Rows
from rhot_app.estimation.track import TrackFilter
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.motion.hand_process import FASTEST, PALM_SPREAD, HandProcess
from rhot_app.hand.motion.hand_state import MOTION, POSE, SHAPE, STATE, TANGENT
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.tracking.association import MarkerAssociation
from rhot_app.tracking.markers.acquisition import Starter
from rhot_app.tracking.markers.marker_model import MarkerModel, compile_markers
from rhot_app.tracking.markers.marker_residual import MarkerFrame, lasting_covariances
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LENGTHS = np.concatenate([[HAND_SIZE, FINGER_SIZE], np.arange(LENGTH, RADIUS)])
"""Indices of a shape that move joints and markers."""


class MarkersOfHand:
    """The markers of a hand that a `BareHandTracker` tracks."""

    def __init__(self, rig: Rig, hand: BareHandTracker) -> None:
        """Replaces the tracker's process and filter by ones whose state includes the markers' lasting errors. Raises
        RigError when a marker has no position on the hand."""
        arrays, self._markers = compile_rig(rig), compile_markers(rig)
        self._starter, self._association = Starter(arrays, self._markers), MarkerAssociation(arrays)
        prior, self._shape, lasting = hand.model.pose_prior, hand.shape_covariance, self._markers.lasting_s
        self._process = HandProcess(
            hand.surface.dh, hand.model.limits, prior.mean, np.asarray(np.linalg.inv(prior.information)),
            PALM_SPREAD, hand.slowest, FASTEST, np.concatenate([self._shape, np.zeros((len(lasting), 3, 3))]),
            np.concatenate([hand.shape_s, lasting]))
        hand.process, hand.filter = self._process, TrackFilter(self._process)
        self._hand = hand
        self.reset()

    def reset(self) -> None:
        """Discard all frames."""
        self._starter.reset()
        self._association.reset()

    def locate(self, frame: CameraObservations) -> tuple[HandPose, int] | None:
        """The pose that the markers of the last frames determine without contours, and its time, master ns; None
        without."""
        self._starter.ingest(self._association.select(frame))
        located = self._starter.locate()
        pose = None if located is None else self._starter.pose_of(located.positions)
        return None if located is None or pose is None else (pose, located.t_ns)

    def start(self) -> None:
        """Start with a track: lasting errors are unknown, with their stationary covariance."""
        knot = self._hand.filter.newest
        self._set_lasting_errors(knot.state)
        own = TANGENT.biases
        knot.covariance[own, own] = self._process.stationary[own, own]
        self.reset()

    def update(self, frame: CameraObservations) -> bool:
        """Update the state by the markers of one frame; False without any. Raises LinAlgError when they contradict the
        estimate."""
        hand, reported = self._hand, MarkerFrame(self._markers, frame)
        t_s = hand.filter.seconds(reported.t_ns)
        if hand.filter.forgot(reported.t_ns) or not reported.seen.any():
            return False
        hand.prepare_update((), t_s)
        prediction = hand.filter.predict(t_s)
        self._set_lasting_errors(prediction[0])
        residual = SizedMarkerResidual(reported, self._markers, hand.surface.bone, prediction, reported.t_ns)
        hand.filter.add(t_s, [residual, *hand.constraints], prediction)
        return True

    def _set_lasting_errors(self, state: Array) -> None:
        """Set the process's covariance of the lasting errors to that of the markers of a hand in `state`."""
        bias = lasting_covariances(without_shape(state), sized(self._markers, self._hand.surface.bone, state).arrays)
        self._process.set_lasting(np.concatenate([self._shape, bias]))


class SizedMarkerResidual:
    """Implements `Residual`: a `MarkerFrame` on a state with the hand's shape, whose lengths move the markers. `bone`
    (R,): the phalanx of each row of the DH table, as in `Surface`."""

    def __init__(self, frame: MarkerFrame, markers: MarkerModel, bone: Indices, prediction: tuple[Array, Array],
                 t_ns: int) -> None:
        """Associates the frame's candidates with the hand that is predicted for `t_ns`, master ns."""
        self._markers, self._bone = markers, bone
        frame.markers = sized(markers, bone, prediction[0])
        frame.add_landmark_noise(without_shape(prediction[0]))
        frame.set_time(t_ns)
        lengths = lengths_jacobian(markers.dh, bone, prediction[0])
        pixels, covariances = frame.predict_pixels(without_shape(prediction[0]),
                                                   without_shape_covariance(prediction[1], lengths))
        self.frame = frame.associated(pixels, covariances, frame.distances(pixels, covariances))

    def linearise(self, state: Array) -> Rows:
        """See `Residual`."""
        self.frame.markers = sized(self._markers, self._bone, state)
        rows = self.frame.linearise(without_shape(state))
        by_place = rows.jacobian[:, MOTION:MOTION + 3 * len(self._markers.finger)]  # a lasting error moves its marker
        jacobian = np.insert(rows.jacobian, [MOTION] * SHAPE, 0.0, axis=1)
        jacobian[:, MOTION + LENGTHS] = by_place @ lengths_jacobian(self._markers.dh, self._bone, state)
        return replace(rows, jacobian=jacobian)


def sized(markers: MarkerModel, bone: Indices, state: Array) -> MarkerModel:
    """The marker model of a hand with the lengths in `state`."""
    return replace(markers, dh=sized_table(markers.dh, bone, state[STATE.shape]))


def lengths_jacobian(dh: DhArrays, bone: Indices, state: Array) -> Array:
    """(3 P, 17): Jacobian of the P points of a hand file's table by the LENGTHS of a shape."""
    return np.asarray(points_in(dh, bone, state)[1][:, :, POSE + LENGTHS].reshape(-1, len(LENGTHS)))


def without_shape_covariance(covariance: Array, lengths: Array) -> Array:
    """The covariance of the state of `marker_residual`. By the Jacobian `lengths` (3 M, 17), the uncertainty of the
    lengths adds to the lasting errors."""
    size = len(covariance)
    to = np.zeros((size - SHAPE, size))
    to[:MOTION, :MOTION], to[MOTION:, MOTION + SHAPE:] = np.eye(MOTION), np.eye(size - SHAPE - MOTION)
    to[MOTION:MOTION + len(lengths), MOTION + LENGTHS] = lengths
    return np.asarray(to @ covariance @ to.T)


def without_shape(state: Array) -> Array:
    """The state of `marker_residual`."""
    return np.concatenate([state[STATE.motion], state[STATE.biases]])
