"""Kinematics of the state vector: root quaternion (4, wxyz), root translation (3, m), angles (rad).

The quaternion may have any length but zero: the rotation is that of the quaternion divided by its length (Rehg 1995,
2.2.1), and the Jacobian with respect to its four numbers says so, so it has no change along the quaternion itself.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import add_angle_columns, add_turn, forward_arrays

Array = NDArray[np.float64]

STATE_ROOT = 7
"""State numbers before the angles: the root's quaternion and translation."""


@njit(cache=True)
def forward_state_arrays(dh: DhArrays, state: Array, root: Array, frames: Array, points: Array) -> None:
    """Fill `root` (4, 4) world_from_root, `frames` (R, 3, 4) and `points` (P, 3) m, for a state (7 + A,)."""
    root_arrays(state, root)
    forward_arrays(dh, root, state[STATE_ROOT:], frames, points)


@njit(cache=True)
def root_arrays(state: Array, root: Array) -> None:
    """Fill `root` (4, 4) world_from_root from the first seven numbers of a state."""
    w, x, y, z = state[0], state[1], state[2], state[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    root[0, 0], root[0, 1], root[0, 2] = 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)
    root[1, 0], root[1, 1], root[1, 2] = s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)
    root[2, 0], root[2, 1], root[2, 2] = s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)
    for i in range(3):
        root[i, 3] = state[4 + i]
        root[3, i] = 0.0
    root[3, 3] = 1.0


@njit(cache=True)
def state_jacobian_arrays(dh: DhArrays, state: Array, root: Array, frames: Array, points: Array, out: Array) -> None:
    """Fill `out` (P, 3, 7 + A) from what `forward_state_arrays` filled: change of the points, m, per state number.

    A change dq of the quaternion turns the object by the vector part of 2 dq q* / |q|^2.
    """
    w, x, y, z = state[0], state[1], state[2], state[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    out[:] = 0.0
    for point in range(points.shape[0]):
        px, py, pz = points[point]
        rx, ry, rz = px - root[0, 3], py - root[1, 3], pz - root[2, 3]
        add_turn(out[point], 0, -s * x, -s * y, -s * z, rx, ry, rz)
        add_turn(out[point], 1, s * w, s * z, -s * y, rx, ry, rz)
        add_turn(out[point], 2, -s * z, s * w, s * x, rx, ry, rz)
        add_turn(out[point], 3, s * y, -s * x, s * w, rx, ry, rz)
        for i in range(3):
            out[point, i, 4 + i] = 1.0
        add_angle_columns(dh, root, frames, point, px, py, pz, STATE_ROOT, out[point])
