"""Positions of a bare hand's joints, with their covariances."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rhot_app.barehand.surface import FINGER_SIZE, HAND_SIZE, LENGTH, RADIUS, sized_table
from rhot_app.estimation.layout import pose_matrix
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays, point_covariances
from rhot_app.hand.motion.hand_state import MOTION, POSE, STATE
from rhot_app.state import Knowledge

Array = NDArray[np.float64]


def knowledge_of(sd: ArrayLike, observed: ArrayLike, measured: float, inferred: float) -> NDArray[np.uint8]:
    """MEASURED for observed values with a standard deviation of `measured` or less, INFERRED up to `inferred`, else
    GUESSED."""
    guessed = np.where(np.asarray(sd) <= inferred, int(Knowledge.INFERRED), int(Knowledge.GUESSED))
    certain = (np.asarray(sd) <= measured) & np.asarray(observed, np.bool_)
    return np.where(certain, int(Knowledge.MEASURED), guessed).astype(np.uint8)


@njit(cache=True)
def add_lengths(table, bone, world, frames, points, out):
    """Add to `out` (P, 3, 17) the Jacobian of the points of a sized table by HAND_SIZE, FINGER_SIZE and the 15
    LENGTHs."""
    for p in range(points.shape[0]):
        for i in range(3):
            out[p, i, 0] += points[p, i] - world[i, 3]
        row = table.point_row[p]
        while row >= 0:
            if bone[row] >= 0:
                for i in range(3):
                    out[p, i, 2 + bone[row]] += table.a[row] * frames[row, i, 0]
                    out[p, i, 1] += table.a[row] * frames[row, i, 0]
            row = table.parent[row]


@njit(cache=True)
def place_joints(state, covariance, dh, bone, points, covariances, motion):
    """Fill `points` (26, 3) m, their `covariances` (26, 3, 3), and `motion` (2, 21): standard deviations of the joints'
    velocities, m/s, and accelerations, m/s^2 (roots of the traces of their covariances)."""
    frames, world = np.empty((dh.parent.shape[0], 3, 4)), pose_matrix(state)
    a, d = np.empty(dh.a.shape[0]), np.empty(dh.a.shape[0])
    sized_table(dh, bone, state[STATE.shape], a, d)
    factor = np.exp(state[STATE.shape][HAND_SIZE])
    table = DhArrays(dh.parent, dh.theta, d, a, dh.cos_alpha, dh.sin_alpha, dh.angle, dh.sign, dh.point_row,
                     dh.point_offset * factor)
    forward_arrays(table, world, state[STATE.angles], frames, points)
    lengths = RADIUS - LENGTH
    jacobian = np.zeros((points.shape[0], 3, POSE + 2 + lengths))
    jacobian_arrays(table, world, frames, points, jacobian)
    add_lengths(table, bone, world, frames, points, jacobian[:, :, POSE:])
    own = np.empty(POSE + 2 + lengths, np.int64)
    own[:POSE] = np.arange(POSE)
    own[POSE], own[POSE + 1] = MOTION + HAND_SIZE, MOTION + FINGER_SIZE
    own[POSE + 2:] = MOTION + LENGTH + np.arange(lengths)
    point_covariances(jacobian, own, covariance, covariances)
    scratch = np.empty((motion.shape[1], 3, 3))
    for order in range(2):
        point_covariances(jacobian[:len(scratch)], np.arange(POSE) + POSE * (order + 1), covariance, scratch)
        for p in range(len(scratch)):
            motion[order, p] = np.sqrt(max(np.trace(scratch[p]), 0.0))
