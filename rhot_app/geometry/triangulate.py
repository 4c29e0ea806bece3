"""Triangulation of one point from any number of cameras, with its covariance.

A linear least-squares start, then Gauss-Newton on the reprojection error weighted with each camera's pixel covariance.
"""

from __future__ import annotations

import enum
import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS = 2  # Gauss-Newton converges quadratically; the linear start is within pixels
_MIN_PARALLAX_RAD = 5e-4  # 75 mm of baseline seen from 150 m: noise alone would place the point


class Outcome(enum.IntEnum):
    """What became of a triangulation."""

    OK = 0
    TOO_FEW = 1  # fewer than two cameras see the point
    PARALLEL = 2  # the rays hardly diverge; depth is not determined
    BEHIND = 3  # the rays meet behind a camera


@njit(cache=True)
def solve_symmetric3(a: Array, b: Array, x: Array, inverse: Array) -> bool:
    """Solve a x = b for a symmetric positive definite (3, 3) `a` and invert it; False when it is not one."""
    c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[1, 2]
    c01 = a[0, 2] * a[1, 2] - a[0, 1] * a[2, 2]
    c02 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    determinant = a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
    scale = a[0, 0] * a[1, 1] * a[2, 2]
    if not determinant > 1e-14 * scale or not scale > 0.0:
        return False
    inverse[0, 0] = c00 / determinant
    inverse[0, 1] = inverse[1, 0] = c01 / determinant
    inverse[0, 2] = inverse[2, 0] = c02 / determinant
    inverse[1, 1] = (a[0, 0] * a[2, 2] - a[0, 2] * a[0, 2]) / determinant
    inverse[1, 2] = inverse[2, 1] = (a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2]) / determinant
    inverse[2, 2] = (a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]) / determinant
    for i in range(3):
        x[i] = inverse[i, 0] * b[0] + inverse[i, 1] * b[1] + inverse[i, 2] * b[2]
    return True


@njit(cache=True)
def _parallax_sine(rays: Array, cameras: Array, used: NDArray[np.bool_]) -> float:
    """Largest sine of the angle between any two used rays, whose normalised coordinates are (C, 2)."""
    count = rays.shape[0]
    directions = np.empty((count, 3))
    for c in range(count):
        norm = math.sqrt(rays[c, 0] ** 2 + rays[c, 1] ** 2 + 1.0)
        for k in range(3):
            directions[c, k] = (rays[c, 0] * cameras[c, 0, k] + rays[c, 1] * cameras[c, 1, k] + cameras[c, 2, k]) / norm
    largest = 0.0
    for i in range(count):
        for j in range(i):
            if used[i] and used[j]:
                a, b = directions[i], directions[j]
                sine = math.sqrt((a[1] * b[2] - a[2] * b[1]) ** 2 + (a[2] * b[0] - a[0] * b[2]) ** 2
                                 + (a[0] * b[1] - a[1] * b[0]) ** 2)
                largest = max(largest, sine)
    return largest


@njit(cache=True)
def _linear_start(rays: Array, cameras: Array, used: NDArray[np.bool_], normal: Array, side: Array) -> None:
    """Normal equations of the rays' planes: (x p3 - p1) X = 0 and (y p3 - p2) X = 0 for every used camera."""
    normal[:] = 0.0
    side[:] = 0.0
    row = np.empty(3)
    for c in range(rays.shape[0]):
        if not used[c]:
            continue
        for axis in range(2):
            for k in range(3):
                row[k] = rays[c, axis] * cameras[c, 2, k] - cameras[c, axis, k]
            value = cameras[c, axis, 3] - rays[c, axis] * cameras[c, 2, 3]
            for i in range(3):
                side[i] += row[i] * value
                for j in range(3):
                    normal[i, j] += row[i] * row[j]


@njit(cache=True)
def _weighted_step(rays: Array, weights: Array, cameras: Array, used: NDArray[np.bool_], position: Array,
                   normal: Array, side: Array) -> bool:
    """Gauss-Newton normal equations of the weighted reprojection error at `position`; False when it is behind one."""
    normal[:] = 0.0
    side[:] = 0.0
    jacobian = np.empty((2, 3))
    local = np.empty(3)
    for c in range(rays.shape[0]):
        if not used[c]:
            continue
        for i in range(3):
            local[i] = cameras[c, i, 3]
            for k in range(3):
                local[i] += cameras[c, i, k] * position[k]
        if not local[2] > 0.0:
            return False
        x, y = local[0] / local[2], local[1] / local[2]
        for k in range(3):
            jacobian[0, k] = (cameras[c, 0, k] - x * cameras[c, 2, k]) / local[2]
            jacobian[1, k] = (cameras[c, 1, k] - y * cameras[c, 2, k]) / local[2]
        ex, ey = rays[c, 0] - x, rays[c, 1] - y
        wx = weights[c, 0] * ex + weights[c, 1] * ey
        wy = weights[c, 1] * ex + weights[c, 2] * ey
        for i in range(3):
            side[i] += jacobian[0, i] * wx + jacobian[1, i] * wy
            for j in range(3):
                normal[i, j] += (jacobian[0, i] * (weights[c, 0] * jacobian[0, j] + weights[c, 1] * jacobian[1, j])
                                 + jacobian[1, i] * (weights[c, 1] * jacobian[0, j] + weights[c, 2] * jacobian[1, j]))
    return True


@njit(cache=True)
def _inverse_covariances(covariances: Array, used: NDArray[np.bool_]) -> Array:
    """(C, 3) weights xx, xy, yy; a covariance that is not positive definite drops its camera from `used`."""
    weights = np.zeros((covariances.shape[0], 3))
    for c in range(covariances.shape[0]):
        if not used[c]:
            continue
        xx, yy = covariances[c, 0, 0], covariances[c, 1, 1]
        xy = 0.5 * (covariances[c, 0, 1] + covariances[c, 1, 0])
        determinant = xx * yy - xy * xy
        if not determinant > 0.0 or not xx > 0.0 or not math.isfinite(determinant):
            used[c] = False
            continue
        weights[c, 0] = yy / determinant
        weights[c, 1] = -xy / determinant
        weights[c, 2] = xx / determinant
    return weights


@njit(cache=True)
def reprojection_rms(position: Array, rays: Array, cameras: Array, focal: Array, used: NDArray[np.bool_]) -> float:
    """Root mean square over the used cameras of the distance between ray and reprojected point, undistorted px."""
    total = 0.0
    count = 0
    for c in range(rays.shape[0]):
        if not used[c]:
            continue
        x, y, z = cameras[c, 0, 3], cameras[c, 1, 3], cameras[c, 2, 3]
        for k in range(3):  # not @: three products do not pay for a call of BLAS
            x += cameras[c, 0, k] * position[k]
            y += cameras[c, 1, k] * position[k]
            z += cameras[c, 2, k] * position[k]
        total += (focal[c, 0] * (x / z - rays[c, 0])) ** 2 + (focal[c, 1] * (y / z - rays[c, 1])) ** 2
        count += 1
    return math.sqrt(total / count) if count > 0 else math.nan


@njit(cache=True)
def triangulate(rays: Array, covariances: Array, cameras: Array, focal: Array, used: NDArray[np.bool_],
                position: Array, covariance: Array) -> tuple[float, int]:
    """Triangulate one point; never raises and never returns a half-valid point.

    `rays` (C, 2) undistorted normalised coordinates with `covariances` (C, 2, 2) in the same units; `cameras`
    (C, 3, 4) camera_from_world; `focal` (C, 2) px, for the error's unit only; `used` (C,) which cameras count.
    Writes `position` (3,) m and `covariance` (3, 3) m^2, both NaN unless the outcome is OK. Returns the rms
    reprojection error in px (NaN unless OK) and the `Outcome` as an int.
    """
    position[:] = math.nan
    covariance[:] = math.nan
    good = used.copy()
    for c in range(rays.shape[0]):
        if not (math.isfinite(rays[c, 0]) and math.isfinite(rays[c, 1])):
            good[c] = False
    weights = _inverse_covariances(covariances, good)
    if np.sum(good) < 2:
        return math.nan, 1
    if not _parallax_sine(rays, cameras, good) > _MIN_PARALLAX_RAD:
        return math.nan, 2
    normal, side, point, step = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    inverse = np.empty((3, 3))
    _linear_start(rays, cameras, good, normal, side)
    if not solve_symmetric3(normal, side, point, inverse):
        return math.nan, 2
    for _ in range(_STEPS):
        if not _weighted_step(rays, weights, cameras, good, point, normal, side):
            return math.nan, 3
        if not solve_symmetric3(normal, side, step, inverse):
            return math.nan, 2
        point += step
    if not _weighted_step(rays, weights, cameras, good, point, normal, side):
        return math.nan, 3
    position[:] = point
    covariance[:] = inverse
    return reprojection_rms(point, rays, cameras, focal, good), 0
