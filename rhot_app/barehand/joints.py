"""Positions of a bare hand's joints and markers, with their Jacobian and covariances."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rhot_app.barehand.contours import COLUMNS, add_length_columns
from rhot_app.barehand.surface import HAND_SIZE, sized
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.vectors import axis, origin_of
from rhot_app.hand.kinematics import chain_row, forward_arrays
from rhot_app.hand.motion.hand_state import POSE, STATE, TANGENT
from rhot_app.state import Knowledge

Array = NDArray[np.float64]

POSE_AND_SHAPE = np.r_[TANGENT.pose, TANGENT.shape]
"""(COLUMNS,) where pose and shape stand in the tangent space."""


def knowledge_of(sd: ArrayLike, observed: ArrayLike, measured: float, inferred: float) -> NDArray[np.uint8]:
    """MEASURED for observed values with a standard deviation of `measured` or less, INFERRED up to `inferred`, else
    GUESSED."""
    guessed = np.where(np.asarray(sd) <= inferred, int(Knowledge.INFERRED), int(Knowledge.GUESSED))
    certain = (np.asarray(sd) <= measured) & np.asarray(observed, np.bool_)
    return np.where(certain, int(Knowledge.MEASURED), guessed).astype(np.uint8)


@njit(cache=True)
def points_in(dh, bone, state):
    """The P points of the DH table of a hand file, in a `state` with a shape: (P, 3) m, world, and their Jacobian
    (P, 3, COLUMNS) by pose and shape. `bone` (R,): as in `Surface`."""
    world, table = pose_matrix(state), sized(dh, bone, state[STATE.shape])
    frames, points = np.empty((len(table.parent), 3, 4)), np.empty((len(table.point_row), 3))
    forward_arrays(table, world, state[STATE.angles], frames, points)
    jacobian = np.zeros((len(points), 3, COLUMNS))
    for k in range(len(points)):
        row = table.point_row[k]
        for i in range(3):
            g = axis(i)
            chain_row(table, world, frames, row, points[k, 0], points[k, 1], points[k, 2], g, jacobian[k, i])
            jacobian[k, i, POSE + HAND_SIZE] = points[k, i] - world[i, 3]
            if row >= 0:
                add_length_columns(table, bone, frames, row, origin_of(frames[row]), g, jacobian[k, i, POSE:])
    return points, jacobian


def covariances_of(jacobian: Array, covariance: Array) -> tuple[Array, Array]:
    """(P, 3, 3) of points with a `jacobian` (P, 3, COLUMNS), and (2, P) standard deviations of their velocities, m/s,
    and accelerations, m/s^2, by the state's `covariance` (n, n)."""
    by_pose = jacobian[:, :, :POSE]
    variances = [np.trace(by_pose @ covariance[own, own] @ by_pose.swapaxes(1, 2), axis1=1, axis2=2)
                 for own in (TANGENT.velocity, TANGENT.acceleration)]
    return (jacobian @ covariance[np.ix_(POSE_AND_SHAPE, POSE_AND_SHAPE)] @ jacobian.swapaxes(1, 2),
            np.sqrt(np.maximum(variances, 0.0)))
