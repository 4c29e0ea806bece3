"""Forward kinematics of a Denavit-Hartenberg tree and its analytic Jacobian (Rehg 1995, eq. 2.2, 2.15 and 2.16).

The numba functions know rows and points only; `forward` and `jacobian` speak of hands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.se3 import move_pose
from rhot_app.hand.dh import ROOT, DhArrays
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose

Array = NDArray[np.float64]

TWIST = 6
"""Columns of a Jacobian before the angles: palm translation (3, m), then palm rotation (3, rad) about the palm
frame's own origin, both along the world's axes."""


@dataclass(frozen=True, slots=True)
class HandPoints:
    """Where a posed hand is, world frame, m."""

    joints: Array  # (21, 3) in the order of skeleton.JOINTS
    marker_centres: Array  # (5, 3) in the order of skeleton.FINGERS


def forward(model: HandModel, pose: HandPose) -> HandPoints:
    """Joints and marker centres of the hand in `pose`."""
    frames, points = empty_frames(model.dh), np.empty((len(model.dh.point_row), 3))
    forward_arrays(model.dh, pose.world_from_palm, pose.angles, frames, points)
    return HandPoints(points[:len(JOINTS)], points[len(JOINTS):])


def jacobian(model: HandModel, pose: HandPose) -> Array:
    """(26, 3, 27): change of the 21 joints and 5 marker centres, m, per palm twist (see TWIST) and 21 angles."""
    frames, points = empty_frames(model.dh), np.empty((len(model.dh.point_row), 3))
    forward_arrays(model.dh, pose.world_from_palm, pose.angles, frames, points)
    out = np.empty((len(points), 3, TWIST + len(ANGLES)))
    jacobian_arrays(model.dh, pose.world_from_palm, frames, points, out)
    return out


def frames_and_points(dh: DhArrays, worlds: Array, angles: Array) -> tuple[Array, Array]:
    """Frames (T, R + 1, 3, 4) of the table's rows, the palm's last so that ROOT finds it, and points (T, 26, 3) m, of
    poses world_from_palm (T, 4, 4) and angles (T, 21) rad."""
    worlds, angles = np.ascontiguousarray(worlds), np.ascontiguousarray(angles)
    frames = np.empty((len(worlds), len(dh.parent) + 1, 3, 4))
    points = np.empty((len(worlds), len(dh.point_row), 3))
    for k in range(len(worlds)):
        forward_arrays(dh, worlds[k], angles[k], frames[k, :-1], points[k])
    frames[:, ROOT] = worlds[:, :3]
    return frames, points


def empty_frames(dh: DhArrays) -> Array:
    """Room for the (R, 3, 4) world frames of every row that `forward_arrays` fills."""
    return np.empty((len(dh.parent), 3, 4))


@njit(cache=True)
def forward_arrays(dh: DhArrays, world_from_root: Array, angles: Array, frames: Array, points: Array) -> None:
    """Fill `frames` (R, 3, 4) world_from_row and `points` (P, 3) m, for `world_from_root` (4, 4) and `angles`."""
    for row in range(dh.parent.shape[0]):
        theta = dh.theta[row]
        if dh.angle[row] >= 0:
            theta += dh.sign[row] * angles[dh.angle[row]]
        c, s = math.cos(theta), math.sin(theta)
        ca, sa = dh.cos_alpha[row], dh.sin_alpha[row]
        base = world_from_root if dh.parent[row] < 0 else frames[dh.parent[row]]
        for i in range(3):
            x = base[i, 0] * c + base[i, 1] * s
            y = base[i, 1] * c - base[i, 0] * s
            z = base[i, 2]
            frames[row, i, 0] = x
            frames[row, i, 1] = y * ca + z * sa
            frames[row, i, 2] = z * ca - y * sa
            frames[row, i, 3] = base[i, 3] + dh.a[row] * x + dh.d[row] * z
    for point in range(dh.point_row.shape[0]):
        base = world_from_root if dh.point_row[point] < 0 else frames[dh.point_row[point]]
        offset = dh.point_offset[point]
        for i in range(3):
            points[point, i] = base[i, 3] + base[i, 0] * offset[0] + base[i, 1] * offset[1] + base[i, 2] * offset[2]


@njit(cache=True)
def jacobian_arrays(dh: DhArrays, world_from_root: Array, frames: Array, points: Array, out: Array) -> None:
    """Fill `out` (P, 3, 6 + angles) from what `forward_arrays` filled; columns as `jacobian` says."""
    out[:] = 0.0
    for point in range(points.shape[0]):
        x, y, z = points[point]
        point_jacobian(dh, world_from_root, frames, dh.point_row[point], x, y, z, out[point])


@njit(cache=True)
def point_jacobian(dh: DhArrays, world_from_root: Array, frames: Array, row: int, x: float, y: float, z: float,
                   out: Array) -> None:
    """dp = dt + w x (p - o) + sum_k dq_k a_k x (p - b_k): row k turns what rides on it about its parent's z axis a_k,
    through its parent's origin b_k (Rehg eq. 2.16); o is the palm's origin.

    Adds the Jacobian of p = (x, y, z) m, world, which rides on a `row` of the table, to `out` (3, 6 + angles); columns
    as `jacobian` says. The Jacobian of a unit vector d fixed to a row is that of the point p + d less that of p.
    """
    rx, ry, rz = x - world_from_root[0, 3], y - world_from_root[1, 3], z - world_from_root[2, 3]
    for i in range(3):
        out[i, i] += 1.0
    _add_turn(out, 3, 1.0, 0.0, 0.0, rx, ry, rz)
    _add_turn(out, 4, 0.0, 1.0, 0.0, rx, ry, rz)
    _add_turn(out, 5, 0.0, 0.0, 1.0, rx, ry, rz)
    while row >= 0:
        parent = dh.parent[row]
        if dh.angle[row] >= 0:
            base, sign = world_from_root if parent < 0 else frames[parent], dh.sign[row]
            _add_turn(out, TWIST + dh.angle[row], sign * base[0, 2], sign * base[1, 2], sign * base[2, 2],
                      x - base[0, 3], y - base[1, 3], z - base[2, 3])
        row = parent


@njit(cache=True, inline="always")
def chain_row(dh: DhArrays, world_from_root: Array, frames: Array, row: int, x: float, y: float, z: float,
              gradient: Array, out: Array) -> None:
    """g^T dp: `point_jacobian` times a `gradient` g (3,), such as a row of a projection's slope.

    Adds to the first 6 + angles numbers of `out`.
    """
    rx, ry, rz = x - world_from_root[0, 3], y - world_from_root[1, 3], z - world_from_root[2, 3]
    gx, gy, gz = gradient[0], gradient[1], gradient[2]
    out[0], out[1], out[2] = out[0] + gx, out[1] + gy, out[2] + gz
    out[3], out[4], out[5] = out[3] + ry * gz - rz * gy, out[4] + rz * gx - rx * gz, out[5] + rx * gy - ry * gx
    while row >= 0:
        parent = dh.parent[row]
        if dh.angle[row] >= 0:
            base = world_from_root if parent < 0 else frames[parent]
            ax, ay, az = base[0, 2], base[1, 2], base[2, 2]
            rx, ry, rz = x - base[0, 3], y - base[1, 3], z - base[2, 3]
            out[TWIST + dh.angle[row]] += dh.sign[row] * (gx * (ay * rz - az * ry) + gy * (az * rx - ax * rz)
                                                          + gz * (ax * ry - ay * rx))
        row = parent


@njit(cache=True)
def _add_turn(out: Array, column: int, ax: float, ay: float, az: float, rx: float, ry: float, rz: float) -> None:
    """Add axis x lever to a column: the velocity of a point at a lever from an axis of unit angular speed."""
    out[0, column] += ay * rz - az * ry
    out[1, column] += az * rx - ax * rz
    out[2, column] += ax * ry - ay * rx


@njit(cache=True)
def move(world: Array, angles: Array, step: Array, out_world: Array, out_angles: Array) -> None:
    """Apply a step of twist (rotation on the manifold, in world axes) and angles."""
    move_pose(world, step, out_world)
    for j in range(4):
        out_world[3, j] = world[3, j]
    for i in range(angles.shape[0]):
        out_angles[i] = angles[i] + step[TWIST + i]


@njit(cache=True)
def point_covariances(jacobian: Array, columns: NDArray[np.int64], covariance: Array, out: Array) -> None:
    """C_p = J_p P J_p^T: fills `out` (N, 3, 3) for N points.

    `jacobian` (N, 3, K): of the points by K numbers, most of which do not move a point; `columns` (K,): where these
    numbers are in the `covariance` P.
    """
    used, product = np.empty(columns.shape[0], np.int64), np.empty(3)
    for p in range(jacobian.shape[0]):
        count = 0
        for k in range(columns.shape[0]):
            if jacobian[p, 0, k] != 0.0 or jacobian[p, 1, k] != 0.0 or jacobian[p, 2, k] != 0.0:
                used[count] = k
                count += 1
        out[p] = 0.0
        for a in used[:count]:
            product[:] = 0.0
            for b in used[:count]:
                for i in range(3):
                    product[i] += covariance[columns[a], columns[b]] * jacobian[p, i, b]
            for i in range(3):
                for j in range(3):
                    out[p, i, j] += jacobian[p, i, a] * product[j]
