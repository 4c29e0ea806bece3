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
def _direction(rays: Array, cameras: Array, c: int) -> tuple[float, float, float]:
    """Unit vector, world axes, along one camera's ray. No array: this is asked of every marker of every state."""
    x, y = rays[c, 0], rays[c, 1]
    norm = math.sqrt(x ** 2 + y ** 2 + 1.0)
    return ((x * cameras[c, 0, 0] + y * cameras[c, 1, 0] + cameras[c, 2, 0]) / norm,
            (x * cameras[c, 0, 1] + y * cameras[c, 1, 1] + cameras[c, 2, 1]) / norm,
            (x * cameras[c, 0, 2] + y * cameras[c, 1, 2] + cameras[c, 2, 2]) / norm)


@njit(cache=True)
def _parallax_sine(rays: Array, cameras: Array, used: NDArray[np.bool_]) -> float:
    """Largest sine of the angle between any two used rays, whose normalised coordinates are (C, 2)."""
    largest = 0.0
    for i in range(rays.shape[0]):
        if not used[i]:
            continue
        a = _direction(rays, cameras, i)
        for j in range(i):
            if used[j]:
                b = _direction(rays, cameras, j)
                sine = math.sqrt((a[1] * b[2] - a[2] * b[1]) ** 2 + (a[2] * b[0] - a[0] * b[2]) ** 2
                                 + (a[0] * b[1] - a[1] * b[0]) ** 2)
                largest = max(largest, sine)
    return largest


@njit(cache=True)
def _slope(camera: Array, axis: int, at: float, depth: float) -> tuple[float, float, float]:
    """Change per m of a point of its normalised coordinate `axis`, which is `at`. For a depth of -1 it is the normal of
    the plane that all points with that coordinate lie in."""
    return ((camera[axis, 0] - at * camera[2, 0]) / depth, (camera[axis, 1] - at * camera[2, 1]) / depth,
            (camera[axis, 2] - at * camera[2, 2]) / depth)


@njit(cache=True)
def _linear_start(rays: Array, cameras: Array, used: NDArray[np.bool_], normal: Array, side: Array) -> None:
    """Normal equations of the rays' planes: (x p3 - p1) X = 0 and (y p3 - p2) X = 0 for every used camera."""
    normal[:] = 0.0
    side[:] = 0.0
    for c in range(rays.shape[0]):
        if not used[c]:
            continue
        for axis in range(2):
            row = _slope(cameras[c], axis, rays[c, axis], -1.0)
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
    for c in range(rays.shape[0]):
        if not used[c]:
            continue
        x, y, z = _local(cameras[c], position)
        if not z > 0.0:
            return False
        x, y = x / z, y / z
        u, v = _slope(cameras[c], 0, x, z), _slope(cameras[c], 1, y, z)
        ex, ey = rays[c, 0] - x, rays[c, 1] - y
        wx = weights[c, 0] * ex + weights[c, 1] * ey
        wy = weights[c, 1] * ex + weights[c, 2] * ey
        for i in range(3):
            side[i] += u[i] * wx + v[i] * wy
            for j in range(3):
                normal[i, j] += (u[i] * (weights[c, 0] * u[j] + weights[c, 1] * v[j])
                                 + v[i] * (weights[c, 1] * u[j] + weights[c, 2] * v[j]))
    return True


@njit(cache=True)
def _local(camera: Array, position: Array) -> tuple[float, float, float]:
    """A point (3,) m, world, in the frame of a camera, (3, 4) camera_from_world."""
    x, y, z = camera[0, 3], camera[1, 3], camera[2, 3]
    for k in range(3):  # not @: three products do not pay for a call of BLAS
        x += camera[0, k] * position[k]
        y += camera[1, k] * position[k]
        z += camera[2, k] * position[k]
    return x, y, z


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
def reprojection_rms(position: Array, rays: Array, cameras: Array, by_pixel: Array, used: NDArray[np.bool_]) -> float:
    """Root mean square over the used cameras of the distance between pixel and reprojected point, px."""
    total = 0.0
    count = 0
    for c in range(rays.shape[0]):
        if not used[c]:
            continue
        x, y, z = _local(cameras[c], position)
        x, y, d = x / z - rays[c, 0], y / z - rays[c, 1], by_pixel[c]
        determinant = d[0, 0] * d[1, 1] - d[0, 1] * d[1, 0]
        total += ((d[1, 1] * x - d[0, 1] * y) ** 2 + (d[0, 0] * y - d[1, 0] * x) ** 2) / determinant**2
        count += 1
    return math.sqrt(total / count) if count > 0 else math.nan


@njit(cache=True)
def triangulate(rays: Array, covariances: Array, cameras: Array, by_pixel: Array, used: NDArray[np.bool_],
                position: Array, covariance: Array) -> tuple[float, int]:
    """Triangulate one point; never raises and never returns a half-valid point.

    `rays` (C, 2) undistorted normalised coordinates with `covariances` (C, 2, 2) in the same units; `cameras`
    (C, 3, 4) camera_from_world; `by_pixel` (C, 2, 2) the change of a ray with its pixel, for the error's unit only;
    `used` (C,) which cameras count.
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
    normal, inverse, vectors = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    side, point, step = vectors[0], vectors[1], vectors[2]
    _linear_start(rays, cameras, good, normal, side)
    if not solve_symmetric3(normal, side, point, inverse):
        return math.nan, 2
    for _ in range(_STEPS):
        if not _weighted_step(rays, weights, cameras, good, point, normal, side):
            return math.nan, 3
        if not solve_symmetric3(normal, side, step, inverse):
            return math.nan, 2
        for k in range(3):
            point[k] += step[k]
    if not _weighted_step(rays, weights, cameras, good, point, normal, side):
        return math.nan, 3
    position[:] = point
    covariance[:] = inverse
    return reprojection_rms(point, rays, cameras, by_pixel, good), 0
