"""All markers of one instant from pixels to points: undistort, triangulate, set back to the marker's centre."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import undistort_point
from rhot_app.geometry.silhouette import point_rays
from rhot_app.geometry.triangulate import triangulate
from rhot_app.tracking.tracks import DOUBTFUL

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

GATE_FLOOR_PX = 2.5
"""A reprojection error below this (rms over cameras; half the epipolar distance of a pair) is never an outlier:
calibrations drift that far before anybody notices."""

DOUBT_PX = 1.0
"""Rays that miss each other by more (rms over cameras) are no outlier yet, but something is hidden in one view or the
calibration has drifted: such a place is inferred, not measured."""

GATE_SIGMAS = 6.0

EXACT_PX2 = 1e-6
"""Variance, per axis, of a sight that is said to be exact: to a thousandth of a pixel."""


@njit(cache=True)
def choose_views(flags: NDArray[np.int64], live: Mask, used: Mask, doubtful: Mask) -> None:
    """Which cameras count for each marker: those that see it beyond doubt if these are two, else all that see it.

    `flags` (C, M) of the bracketing samples, -1 for none; `live` (C,). Fills `used` (C, M), and `doubtful` (M,):
    whether a doubtful sight counts.
    """
    for m in range(flags.shape[1]):
        clear = 0
        for c in range(flags.shape[0]):
            if live[c] and flags[c, m] >= 0 and not flags[c, m] & DOUBTFUL:
                clear += 1
        doubtful[m] = clear < 2
        for c in range(flags.shape[0]):
            seen = live[c] and flags[c, m] >= 0
            used[c, m] = seen and (clear < 2 or not flags[c, m] & DOUBTFUL)


@njit(cache=True)
def _locate(rays: Array, covariances: Array, cameras: Array, focal: Array, used: Mask, shape: Array, position: Array,
            covariance: Array) -> tuple[float, int]:
    error, outcome = triangulate(rays, covariances, cameras, focal, used, position, covariance)
    if outcome == 0 and shape[0, 0] + shape[1, 1] + shape[2, 2] > 0.0:
        centred = np.empty_like(rays)
        point_rays(rays, cameras, shape, position, centred)
        error, outcome = triangulate(centred, covariances, cameras, focal, used, position, covariance)
    return error, outcome


@njit(cache=True)
def _gate(pixel_covariances: Array, used: Mask) -> float:
    total, count = 0.0, 0
    for c in range(used.shape[0]):
        if used[c]:
            total += 0.5 * (pixel_covariances[c, 0, 0] + pixel_covariances[c, 1, 1])
            count += 1
    return max(GATE_FLOOR_PX, GATE_SIGMAS * math.sqrt(total / max(count, 1)))


@njit(cache=True)
def locate_all(pixels: Array, covariances: Array, used: Mask, intrinsics: Array, cameras: Array, focal: Array,
               shapes: Array, positions: Array, position_covariances: Array, errors: Array) -> None:
    """Locate M markers from C cameras.

    `pixels` (C, M, 2) raw px with `covariances` (C, M, 2, 2); `used` (C, M) which count; `intrinsics` (C, 9),
    `cameras` (C, 3, 4), `focal` (C, 2), `shapes` (M, 3, 3) as in `RigArrays`. Fills `positions` (M, 3) m,
    `position_covariances` (M, 3, 3) m^2 and `errors` (M,) px rms. A marker that cannot be located, or whose rays miss
    each other by more than the gate, has NaN positions; in the second case its error is told. With three cameras or
    more the one view whose removal leaves the smallest error is given up first, and cleared in `used`.
    """
    count = pixels.shape[0]
    rays, ray_covariances = np.empty((count, 2)), np.empty((count, 2, 2))
    views, trial = np.empty(count, np.bool_), np.empty(count, np.bool_)
    for m in range(pixels.shape[1]):
        for c in range(count):
            views[c] = used[c, m]
            x, y, xu, xv, yu, yv = undistort_point(pixels[c, m, 0], pixels[c, m, 1], intrinsics[c])
            rays[c, 0], rays[c, 1] = x, y
            uu, vv = max(covariances[c, m, 0, 0], EXACT_PX2), max(covariances[c, m, 1, 1], EXACT_PX2)
            uv = covariances[c, m, 0, 1]
            ray_covariances[c, 0, 0] = xu * xu * uu + 2.0 * xu * xv * uv + xv * xv * vv
            ray_covariances[c, 1, 1] = yu * yu * uu + 2.0 * yu * yv * uv + yv * yv * vv
            ray_covariances[c, 0, 1] = xu * yu * uu + (xu * yv + xv * yu) * uv + xv * yv * vv
            ray_covariances[c, 1, 0] = ray_covariances[c, 0, 1]
            if not (math.isfinite(x) and math.isfinite(y)):
                views[c] = False
        error, outcome = _locate(rays, ray_covariances, cameras, focal, views, shapes[m], positions[m],
                                 position_covariances[m])
        if outcome == 0 and error > _gate(covariances[:, m], views) and np.sum(views) > 2:
            best, worst = error, -1
            for c in range(count):
                if views[c]:
                    trial[:] = views
                    trial[c] = False
                    error, outcome = _locate(rays, ray_covariances, cameras, focal, trial, shapes[m], positions[m],
                                             position_covariances[m])
                    if outcome == 0 and error < best:
                        best, worst = error, c
            if worst >= 0:
                views[worst] = False
            error, outcome = _locate(rays, ray_covariances, cameras, focal, views, shapes[m], positions[m],
                                     position_covariances[m])
        errors[m] = error
        if outcome != 0 or error > _gate(covariances[:, m], views):
            positions[m] = math.nan
            position_covariances[m] = math.nan
        used[:, m] = views
