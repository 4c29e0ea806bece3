"""Rotations and rigid transforms: unit quaternions (w, x, y, z), rotation vectors, 4x4 matrices.

A transform ``a_from_b`` takes coordinates in frame b to frame a, so products read as chains:
``world_from_tip = world_from_palm @ palm_from_tip``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_SMALL_RAD = 1e-4  # below this the Taylor series is exact to double precision and free of 0 / 0


def rotation_from_quaternion(quaternion_wxyz: ArrayLike) -> Array:
    """(3, 3) rotation of a quaternion (4,); it is normalised first. Raises ValueError for the zero quaternion."""
    q = np.asarray(quaternion_wxyz, dtype=np.float64)
    norm = float(np.linalg.norm(q))
    if not norm > 0.0:
        raise ValueError("a quaternion of length zero describes no rotation")
    w, x, y, z = q / norm
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ])


def quaternion_from_rotation(rotation: Array) -> Array:
    """Unit quaternions (..., 4) wxyz, w >= 0, of rotations (..., 3, 3); NaN where a rotation is."""
    from scipy.spatial.transform import Rotation

    matrices = np.asarray(rotation, dtype=np.float64)
    flat = matrices.reshape(-1, 3, 3)
    out, known = np.full((len(flat), 4), np.nan), np.isfinite(flat).all(axis=(1, 2))
    if known.any():
        found = Rotation.from_matrix(flat[known]).as_quat()[:, [3, 0, 1, 2]]
        out[known] = np.where(found[:, :1] < 0.0, -found, found)
    return out.reshape(*matrices.shape[:-2], 4)


def skew(vector: ArrayLike) -> Array:
    """(3, 3) matrix whose product with u is the cross product ``vector x u``."""
    x, y, z = np.asarray(vector, dtype=np.float64)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp_so3(rotation_vector: ArrayLike) -> Array:
    """(3, 3) rotation about `rotation_vector` (3,) by its length in rad (Rodrigues)."""
    vector = np.asarray(rotation_vector, dtype=np.float64)
    angle = float(np.linalg.norm(vector))
    k = skew(vector)
    if angle < _SMALL_RAD:
        a, b = 1.0 - angle**2 / 6.0, 0.5 - angle**2 / 24.0
    else:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
    return np.asarray(np.eye(3) + a * k + b * (k @ k))


def log_so3(rotation: Array) -> Array:
    """Rotation vector (3,) rad of a rotation (3, 3); its length is 0..pi."""
    q = quaternion_from_rotation(rotation)
    sine = float(np.linalg.norm(q[1:]))
    factor = 2.0 / q[0] if sine < 1e-9 else 2.0 * np.arctan2(sine, q[0]) / sine
    return np.asarray(factor * q[1:])


def rigid(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """(4, 4) transform from a rotation (3, 3) and a translation (3,) m."""
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation
    return transform


def inverse(transform: Array) -> Array:
    """Inverse of a rigid (4, 4) transform: ``inverse(a_from_b)`` is ``b_from_a``."""
    rotation = transform[:3, :3].T
    return rigid(rotation, -rotation @ transform[:3, 3])


def apply(transform: Array, points: Array) -> Array:
    """Points (..., 3) m, taken from frame b to frame a by a rigid ``a_from_b`` (4, 4)."""
    return np.asarray(points @ transform[:3, :3].T + transform[:3, 3])


def fit_rigid(source: Array, target: Array) -> Array:
    """(4, 4) target_from_source that takes points (N, 3) nearest to others (N, 3), least squares (Kabsch 1976).

    Three points that are not in a row determine it; with fewer the rotation is one of many.
    """
    to, origin = target.mean(axis=0), source.mean(axis=0)
    rotation = best_rotation((target - to).T @ (source - origin))
    return rigid(rotation, to - rotation @ origin)


def best_rotation(products: Array) -> Array:
    """(3, 3) rotation R with the largest trace of R^T times `products` (3, 3), the sum of target times source^T."""
    u, _, vt = np.linalg.svd(products)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)
