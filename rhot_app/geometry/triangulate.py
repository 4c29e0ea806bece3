"""Triangulation of one point from any number of cameras, with its covariance.

With h_c the projection of camera c to normalised coordinates, r_c a ray and W_c its inverse covariance, the point is

    argmin_X  sum_c (r_c - h_c(X))^T W_c (r_c - h_c(X)),

by Gauss-Newton from the linear least-squares solution of the rays' planes, (x p3 - p1) X = 0 and (y p3 - p2) X = 0.
"""

from __future__ import annotations

import enum
import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import camera_coordinates, undistort_point

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EXACT_PX2 = 1e-6
"""px^2: variance, per axis, of an observation that is said to be exact: to a thousandth of a pixel."""

_STEPS = 2  # Gauss-Newton converges quadratically; the linear start is within pixels
_MIN_PARALLAX_RAD = 5e-4  # 75 mm of baseline seen from 150 m: noise alone would place the point


class Outcome(enum.IntEnum):
    """What became of a triangulation."""

    OK = 0
    TOO_FEW = 1  # fewer than two cameras see the point
    PARALLEL = 2  # the rays hardly diverge; depth is not determined
    BEHIND = 3  # the rays meet behind a camera


class Rays(NamedTuple):
    """One point's rays in C cameras: `at` (C, 2), normalised coordinates; `covariances` (C, 2, 2) in the same units;
    `by_pixel` (C, 2, 2), their change with the pixel."""

    at: Array
    covariances: Array
    by_pixel: Array


@njit(cache=True)
def empty_rays(cameras: int) -> Rays:
    """Room for the rays that `cast` fills."""
    return Rays(np.empty((cameras, 2)), np.empty((cameras, 2, 2)), np.empty((cameras, 2, 2)))


@njit(cache=True)
def cast(pixels: Array, covariances: Array, intrinsics: Array, used: Mask, rays: Rays) -> None:
    """Fill `rays`: of a pixel with covariance P the undistorted one, with covariance S P S^T, S its slope.

    `pixels` (C, 2) raw px with `covariances` (C, 2, 2) px^2; `intrinsics` (C, 13). A camera whose pixel has no ray is
    cleared in `used` (C,).
    """
    for c in range(pixels.shape[0]):
        x, y, xu, xv, yu, yv = undistort_point(pixels[c, 0], pixels[c, 1], intrinsics[c])
        uu, vv = max(covariances[c, 0, 0], EXACT_PX2), max(covariances[c, 1, 1], EXACT_PX2)
        uv = covariances[c, 0, 1]
        slope, spread = rays.by_pixel[c], rays.covariances[c]
        rays.at[c, 0], rays.at[c, 1] = x, y
        slope[0, 0], slope[0, 1], slope[1, 0], slope[1, 1] = xu, xv, yu, yv
        spread[0, 0] = xu * xu * uu + 2.0 * xu * xv * uv + xv * xv * vv
        spread[1, 1] = yu * yu * uu + 2.0 * yu * yv * uv + yv * yv * vv
        spread[0, 1] = spread[1, 0] = xu * yu * uu + (xu * yv + xv * yu) * uv + xv * yv * vv
        used[c] = used[c] and math.isfinite(x) and math.isfinite(y)


@njit(cache=True)
def triangulate(rays: Rays, cameras: Array, used: Mask, position: Array, covariance: Array) -> tuple[float, int]:
    """Triangulate one point; never raises and never returns a half-valid point.

    `cameras` (C, 3, 4) camera_from_world, m; `used` (C,) which cameras count. Writes `position` (3,) m and `covariance`
    (3, 3) m^2, both NaN unless the outcome is OK. Returns the rms reprojection error in px (NaN unless OK) and the
    `Outcome` as an int.
    """
    position[:] = math.nan
    covariance[:] = math.nan
    good = used.copy()
    weights = _inverse_covariances(rays, good)
    if np.sum(good) < 2:
        return math.nan, 1
    if not _parallax_sine(rays.at, cameras, good) > _MIN_PARALLAX_RAD:
        return math.nan, 2
    normal, inverse, vectors = np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    side, point, step = vectors[0], vectors[1], vectors[2]
    for number in range(1 + _STEPS):
        if not _normal_equations(rays.at, weights, cameras, good, point, number == 0, normal, side):
            return math.nan, 3
        if not _solve_symmetric3(normal, side, step, inverse):
            return math.nan, 2
        for k in range(3):
            point[k] += step[k]
    error = _reprojection_rms(point, rays, cameras, good)
    if math.isnan(error):
        return math.nan, 3
    position[:] = point
    covariance[:] = inverse
    return error, 0


@njit(cache=True)
def _inverse_covariances(rays: Rays, used: Mask) -> Array:
    """(C, 3) weights xx, xy, yy; a ray that is not finite, or whose covariance is not positive definite, is dropped
    from `used`."""
    weights = np.zeros((used.shape[0], 3))
    for c in range(used.shape[0]):
        spread = rays.covariances[c]
        xx, yy, xy = spread[0, 0], spread[1, 1], 0.5 * (spread[0, 1] + spread[1, 0])
        determinant = xx * yy - xy * xy
        used[c] = (used[c] and xx > 0.0 and determinant > 0.0
                   and math.isfinite(determinant + rays.at[c, 0] + rays.at[c, 1]))
        if used[c]:
            weights[c, 0], weights[c, 1], weights[c, 2] = yy / determinant, -xy / determinant, xx / determinant
    return weights


@njit(cache=True)
def _parallax_sine(rays: Array, cameras: Array, used: Mask) -> float:
    """Largest sine of the angle between any two used rays."""
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
def _direction(rays: Array, cameras: Array, c: int) -> tuple[float, float, float]:
    """Unit vector, world axes, along one camera's ray. No array: this is asked of every marker of every state."""
    x, y = rays[c, 0], rays[c, 1]
    norm = math.sqrt(x ** 2 + y ** 2 + 1.0)
    return ((x * cameras[c, 0, 0] + y * cameras[c, 1, 0] + cameras[c, 2, 0]) / norm,
            (x * cameras[c, 0, 1] + y * cameras[c, 1, 1] + cameras[c, 2, 1]) / norm,
            (x * cameras[c, 0, 2] + y * cameras[c, 1, 2] + cameras[c, 2, 2]) / norm)


@njit(cache=True)
def _slope(camera: Array, axis: int, at: float, depth: float) -> tuple[float, float, float]:
    """Change per m of a point of its normalised coordinate `axis`, which is `at`; at depth 1 the normal of the plane
    that all points with that coordinate lie in."""
    return ((camera[axis, 0] - at * camera[2, 0]) / depth, (camera[axis, 1] - at * camera[2, 1]) / depth,
            (camera[axis, 2] - at * camera[2, 2]) / depth)


@njit(cache=True)
def _normal_equations(rays: Array, weights: Array, cameras: Array, used: Mask, point: Array, linear: bool,
                      normal: Array, side: Array) -> bool:
    """Fill the normal equations of a step from `point`: of the weighted reprojection error, False when it is behind a
    camera; or, `linear`, of the distances from the rays' planes."""
    normal[:] = 0.0
    side[:] = 0.0
    for c in range(rays.shape[0]):
        if not used[c]:
            continue
        x, y, z = camera_coordinates(cameras[c], point[0], point[1], point[2])
        xx, xy, yy = weights[c, 0], weights[c, 1], weights[c, 2]
        if linear:
            u, v = _slope(cameras[c], 0, rays[c, 0], 1.0), _slope(cameras[c], 1, rays[c, 1], 1.0)
            ex, ey = rays[c, 0] * z - x, rays[c, 1] * z - y
            xx, xy, yy = 1.0, 0.0, 1.0
        elif z > 0.0:
            u, v = _slope(cameras[c], 0, x / z, z), _slope(cameras[c], 1, y / z, z)
            ex, ey = rays[c, 0] - x / z, rays[c, 1] - y / z
        else:
            return False
        wx, wy = xx * ex + xy * ey, xy * ex + yy * ey
        for i in range(3):
            side[i] += u[i] * wx + v[i] * wy
            for j in range(3):
                normal[i, j] += u[i] * (xx * u[j] + xy * v[j]) + v[i] * (xy * u[j] + yy * v[j])
    return True


@njit(cache=True)
def _solve_symmetric3(a: Array, b: Array, x: Array, inverse: Array) -> bool:
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
def _reprojection_rms(position: Array, rays: Rays, cameras: Array, used: Mask) -> float:
    """Root mean square over the used cameras of the distance between pixel and reprojection, px; NaN behind one."""
    total, count = 0.0, 0
    for c in range(used.shape[0]):
        if not used[c]:
            continue
        x, y, z = camera_coordinates(cameras[c], position[0], position[1], position[2])
        if not z > 0.0:
            return math.nan
        x, y, d = x / z - rays.at[c, 0], y / z - rays.at[c, 1], rays.by_pixel[c]
        determinant = d[0, 0] * d[1, 1] - d[0, 1] * d[1, 0]
        total += ((d[1, 1] * x - d[0, 1] * y) ** 2 + (d[0, 0] * y - d[1, 0] * x) ** 2) / determinant**2
        count += 1
    return math.sqrt(total / count)
