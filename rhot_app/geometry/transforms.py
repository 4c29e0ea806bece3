"""Rigid transforms as 4x4 matrices.

A transform ``a_from_b`` takes coordinates in frame b to frame a, so products read as chains:
``world_from_tip = world_from_palm @ palm_from_tip``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

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
