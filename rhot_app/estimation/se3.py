"""Rotations, SO(3), and poses, SE(3): exponential and logarithm, Jacobians, unit quaternions (w, x, y, z).

A pose is a rotation and a place: (3, 4), or a transform (4, 4). Its tangent space has six numbers: translation, m, then
rotation about its own origin, rad, both along the outer frame's axes. Rotation vectors are in rad. The left Jacobian J
of v has exp(v + d) = exp(J d) exp(v) to first order in d (Solà, Deray and Atchuthan 2018, eq. 145).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_SMALL_RAD = 1e-4  # below this the Taylor series is exact to double precision and free of 0 / 0


@njit(cache=True)
def exponential(x: float, y: float, z: float, rotation: Array, left: Array) -> None:
    """Fill the `rotation` (3, 3) of a rotation vector (Rodrigues) and its `left` Jacobian (3, 3)."""
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL_RAD:
        a, b, c = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
        c = (1.0 - a) / square
    vector = (x, y, z)
    cross = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    for i in range(3):
        for j in range(3):
            outer = vector[i] * vector[j]
            same = 1.0 if i == j else 0.0
            rotation[i, j] = same * (1.0 - b * square) + a * cross[i][j] + b * outer
            left[i, j] = same * (1.0 - c * square) + b * cross[i][j] + c * outer


@njit(cache=True)
def rotation_vector(to: Array, origin: Array) -> tuple[float, float, float]:
    """The turn, about the axes that both are seen from, that takes the rotation `origin` to the rotation `to`, each
    (3, 3) or the beginning of a transform; 0..pi long."""
    r, q = np.empty((3, 3)), np.empty(4)
    for i in range(3):
        for j in range(3):
            r[i, j] = to[i, 0] * origin[j, 0] + to[i, 1] * origin[j, 1] + to[i, 2] * origin[j, 2]
    x, y, z = 0.5 * (r[2, 1] - r[1, 2]), 0.5 * (r[0, 2] - r[2, 0]), 0.5 * (r[1, 0] - r[0, 1])
    sine, cosine = math.sqrt(x * x + y * y + z * z), 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)
    angle = math.atan2(sine, cosine)
    if cosine < 0.0:  # towards half a turn the sine loses its digits
        fill_quaternion(r, q)
        x, y, z = q[1], q[2], q[3]
        sine = math.sqrt(x * x + y * y + z * z)
        angle = 2.0 * math.atan2(sine, q[0])
    scale = angle / sine if sine > 1e-9 else 1.0
    return scale * x, scale * y, scale * z


@njit(cache=True)
def move_pose(pose: Array, step: Array, out: Array) -> None:
    """Fill the first three rows of `out` with a pose after a step (6,) of its tangent space: Rodrigues' formula without
    arrays, for the processes."""
    x, y, z = step[3], step[4], step[5]
    angle = math.sqrt(x ** 2 + y ** 2 + z ** 2)
    c = math.cos(angle)
    s = math.sin(angle) / angle if angle > 1e-12 else 1.0
    v = (1.0 - c) / angle ** 2 if angle > 1e-6 else 0.5
    for j in range(3):
        a, b, d = pose[0, j], pose[1, j], pose[2, j]
        along = v * (x * a + y * b + z * d)
        out[0, j] = c * a + s * (y * d - z * b) + along * x
        out[1, j] = c * b + s * (z * a - x * d) + along * y
        out[2, j] = c * d + s * (x * b - y * a) + along * z
        out[j, 3] = pose[j, 3] + step[j]


@njit(cache=True)
def pose_difference(to: Array, origin: Array) -> tuple[float, float, float, float, float, float]:
    """The step that moves the pose `origin` to the pose `to`."""
    x, y, z = rotation_vector(to, origin)
    return to[0, 3] - origin[0, 3], to[1, 3] - origin[1, 3], to[2, 3] - origin[2, 3], x, y, z


@njit(cache=True)
def fill_quaternion(r: Array, out: Array) -> None:
    """Fill the unit quaternion `out` (4,) of a rotation, w >= 0; divides by the largest of the four numbers (Shepperd
    1978). NaN where the rotation has a NaN."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    largest, best = 0, trace
    for i in range(3):
        if r[i, i] > best:
            largest, best = i + 1, r[i, i]
    if largest == 0:
        out[0], out[1], out[2], out[3] = 1.0 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        out[0] = r[k, j] - r[j, k]
        out[1 + i] = 1.0 + 2.0 * r[i, i] - trace
        out[1 + j] = r[j, i] + r[i, j]
        out[1 + k] = r[k, i] + r[i, k]
    scale = 1.0 / math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    if out[0] < 0.0:
        scale = -scale
    for n in range(4):
        out[n] *= scale


@njit(cache=True)
def fill_rotation(quaternion: Array, out: Array) -> None:
    """Fill the rotation `out`, (3, 3) or the beginning of a transform, of a quaternion (4,) of any length but zero."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)


def exp_so3(vector: ArrayLike) -> Array:
    """(3, 3) rotation of a rotation vector (3,)."""
    return _exponential_of(vector)[0]


def left_jacobian(vector: ArrayLike) -> Array:
    """(3, 3) of a rotation vector (3,)."""
    return _exponential_of(vector)[1]


def log_so3(rotation: Array) -> Array:
    """Rotation vector (3,) of a rotation (3, 3); 0..pi long."""
    return np.array(rotation_vector(np.ascontiguousarray(rotation), np.eye(3)))


def skew(vectors: ArrayLike) -> Array:
    """(..., 3, 3) matrices whose product with u is the cross product of `vectors` (..., 3) and u."""
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=np.float64), -1, 0)
    out = np.zeros((*x.shape, 3, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = x, y, z
    return out - out.swapaxes(-1, -2)


def quaternion_from_rotation(rotation: Array) -> Array:
    """Unit quaternions (..., 4), w >= 0, of rotations (..., 3, 3); NaN where a rotation has a NaN."""
    flat = np.array(rotation, dtype=np.float64).reshape(-1, 3, 3)
    out = np.empty((len(flat), 4))
    _quaternions(flat, out)
    return out.reshape(*np.shape(rotation)[:-2], 4)


def rotation_from_quaternion(quaternion_wxyz: ArrayLike) -> Array:
    """Rotations (..., 3, 3) of quaternions (..., 4), normalised first. Raises ValueError for a zero quaternion."""
    flat = np.array(quaternion_wxyz, dtype=np.float64).reshape(-1, 4)
    if (flat == 0.0).all(axis=1).any():
        raise ValueError("a quaternion of length zero describes no rotation")
    out = np.empty((len(flat), 3, 3))
    _rotations(flat, out)
    return out.reshape(*np.shape(quaternion_wxyz)[:-1], 3, 3)


def _exponential_of(vector: ArrayLike) -> Array:
    x, y, z = np.asarray(vector, dtype=np.float64)
    out = np.empty((2, 3, 3))
    exponential(x, y, z, out[0], out[1])
    return out


@njit(cache=True)
def _quaternions(rotations: Array, out: Array) -> None:
    for n in range(rotations.shape[0]):
        fill_quaternion(rotations[n], out[n])


@njit(cache=True)
def _rotations(quaternions: Array, out: Array) -> None:
    for n in range(quaternions.shape[0]):
        fill_rotation(quaternions[n], out[n])


# -- states that begin with a pose, 12 numbers row by row; all others are added to ------------------------------------

class PoseState:
    """How such a state moves in its tangent space, which has six numbers for the pose: part of a `Process`."""

    def retract(self, state: Array, step: Array) -> Array:
        """See `Process`."""
        return np.asarray(retract(state, step))

    def difference(self, state: Array, origin: Array) -> Array:
        """See `Process`."""
        return np.asarray(difference(state, origin))


@njit(cache=True)
def retract(state: Array, step: Array) -> Array:
    """The state (12 + n,) after a step (6 + n,) of its tangent space."""
    out = state.copy()
    move_pose(state[:12].reshape(3, 4), step, out[:12].reshape(3, 4))
    for i in range(6, step.shape[0]):
        out[6 + i] += step[i]
    return out


@njit(cache=True)
def difference(state: Array, origin: Array) -> Array:
    """The step (6 + n,) from the state `origin` to `state`, each (12 + n,)."""
    out = np.empty(state.shape[0] - 6)
    out[0], out[1], out[2], out[3], out[4], out[5] = pose_difference(state[:12].reshape(3, 4),
                                                                     origin[:12].reshape(3, 4))
    for i in range(6, out.shape[0]):
        out[i] = state[6 + i] - origin[6 + i]
    return out
