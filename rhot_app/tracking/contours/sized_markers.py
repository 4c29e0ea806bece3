"""The residual of markers on a hand whose shape is part of the state, as contours estimate it.

The state of a bare hand consists of motion, shape and the lasting errors of its markers. That of `marker_residual` has
no shape.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.joints import add_lengths
from rhot_app.barehand.surface import FINGER_SIZE, HAND_SIZE, LENGTH, RADIUS, SHAPE, sized_table
from rhot_app.estimation.residual import Rows
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.motion.hand_process import ANGLES, BIAS, MOTION, VELOCITY
from rhot_app.tracking.association import GATE
from rhot_app.tracking.markers.estimator import associate, distances_of
from rhot_app.tracking.markers.marker_model import MarkerModel
from rhot_app.tracking.markers.marker_residual import MarkerFrame

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LENGTHS = np.concatenate([[HAND_SIZE, FINGER_SIZE], np.arange(LENGTH, RADIUS)])
"""Indices of a shape that move joints and markers."""


class SizedMarkerResidual:
    """Implements `Residual`: a `MarkerFrame` on a state with the hand's shape, whose lengths move the markers. `bone`
    (R,): the phalanx of each row of the DH table, as in `Surface`."""

    def __init__(self, frame: MarkerFrame, markers: MarkerModel, bone: Indices, prediction: tuple[Array, Array],
                 t_ns: int) -> None:
        """Associates the frame's candidates with the hand that is predicted for `t_ns`, master ns."""
        self._markers, self._bone, self.frame = markers, bone, frame
        frame.markers = sized(markers, bone, prediction[0])
        frame.add_landmark_noise(without_shape(prediction[0]))
        frame.late_s, frame.t_ns = np.where(frame.seen, frame.late_s + 1e-9 * (frame.t_ns - t_ns), 0.0), t_ns
        pixels, covariances = self._expected(*prediction)
        self._reported = frame
        self.frame = associate(frame, pixels, covariances, distances_of(frame, pixels, covariances))

    def _expected(self, state: Array, covariance: Array) -> tuple[Array, Array]:
        """See `MarkerFrame.predict_pixels`."""
        self.frame.markers = sized(self._markers, self._bone, state)
        lengths = lengths_jacobian(self.frame.markers.dh, self._bone, state)
        return self.frame.predict_pixels(without_shape(state), without_shape_covariance(covariance, lengths))

    def distances(self, state: Array, covariance: Array) -> Array:
        """(M,) squared Mahalanobis distances of the reported markers from a hand in `state`, with lasting errors of
        0."""
        return distances_of(self._reported, *self._expected(with_zero_errors(state), covariance))

    def cost(self, state: Array, stationary: Array) -> float:
        """-2 log likelihood of the reported markers for a hand in `state`, up to a constant. An outlier costs GATE, as
        in `association.assign`. `stationary`: the process's covariance, from which that of the lasting errors is
        taken."""
        distances = self.distances(state, with_stationary_errors(stationary, np.zeros_like(stationary)))
        return float(np.minimum(distances[self._reported.seen], GATE).sum())

    def linearise(self, state: Array) -> Rows:
        """See `Residual`."""
        self.frame.markers = sized(self._markers, self._bone, state)
        rows = self.frame.linearise(without_shape(state))
        by_place = rows.jacobian[:, MOTION:]  # a lasting error moves its marker directly
        jacobian = np.insert(rows.jacobian, [MOTION] * SHAPE, 0.0, axis=1)
        jacobian[:, MOTION + LENGTHS] = by_place @ lengths_jacobian(self.frame.markers.dh, self._bone, state)
        return replace(rows, jacobian=jacobian)


def sized(markers: MarkerModel, bone: Indices, state: Array) -> MarkerModel:
    """The marker model of a hand with the lengths in `state`."""
    dh, shape = markers.dh, np.ascontiguousarray(state[BIAS:BIAS + SHAPE])
    a, d = np.empty(len(dh.a)), np.empty(len(dh.d))
    sized_table(dh, bone, shape, a, d)
    return replace(markers, dh=dh._replace(a=a, d=d, point_offset=np.exp(shape[HAND_SIZE]) * dh.point_offset))


def lengths_jacobian(dh: DhArrays, bone: Indices, state: Array) -> Array:
    """(3 P, 17): Jacobian of the P points of a sized table by the LENGTHS of a shape."""
    world, frames, points = np.eye(4), empty_frames(dh), np.empty((len(dh.point_row), 3))
    world[:3] = state[:ANGLES].reshape(3, 4)
    forward_arrays(dh, world, state[ANGLES:VELOCITY], frames, points)
    out = np.zeros((len(points), 3, len(LENGTHS)))
    add_lengths(dh, bone, world, frames, points, out)
    return out.reshape(-1, len(LENGTHS))


def without_shape_covariance(covariance: Array, lengths: Array) -> Array:
    """The covariance of the state of `marker_residual`. By the Jacobian `lengths` (3 M, 17), the uncertainty of the
    lengths adds to the lasting errors."""
    size = len(covariance)
    to = np.zeros((size - SHAPE, size))
    to[:MOTION, :MOTION], to[MOTION:, MOTION + SHAPE:] = np.eye(MOTION), np.eye(size - SHAPE - MOTION)
    to[MOTION:, MOTION + LENGTHS] = lengths
    return np.asarray(to @ covariance @ to.T)


def with_zero_errors(state: Array) -> Array:
    """The state with lasting errors of 0."""
    return np.concatenate([state[:BIAS + SHAPE], np.zeros(len(state) - BIAS - SHAPE)])


def with_stationary_errors(stationary: Array, covariance: Array) -> Array:
    """The covariance with lasting errors that are independent and as uncertain as in the `stationary` process."""
    out, own = covariance.copy(), slice(MOTION + SHAPE, None)
    out[own], out[:, own] = 0.0, 0.0
    out[own, own] = stationary[own, own]
    return out


def without_shape(state: Array) -> Array:
    """The state of `marker_residual`."""
    return np.concatenate([state[:BIAS], state[BIAS + SHAPE:]])
