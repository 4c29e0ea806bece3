"""Where on the image a solid may be: ranges of pixels per row, generous, so that rays are sent only there (numba)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import REACH, project_ray, undistort_point
from rhot_app.simulator.render.body import BOUNDS, CAPSULE, KIND, PARAMETERS, PLAIN, Solids
from rhot_app.simulator.render.exposure_samples import evaluate
from rhot_app.simulator.render.paint import is_painted, local_point
from rhot_app.simulator.render.raycast import NO_HIT, PREPARED, hit, prepare
from rhot_app.simulator.render.rays import SAMPLES

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NEAR_M = 0.03  # what comes nearer to the camera's plane is not drawn


@njit(cache=True)
def span(kind: int, row: Array, size: Array, sweep: Array, n: int, intrinsics: Array, y: int,
          width: int) -> tuple[int, int]:
    """Half-open range of pixels of image row `y` that a solid may touch; generous, (0, 0) when none.

    The solid's image lies within a circle's way along its axis: only the part of the axis near the row counts.
    """
    u0, v0, u1, v1, radius = outline(kind, row, size, n, intrinsics)
    reach = radius + 0.5 * sweep[n, 1] + 1.0
    low, high = 0.0, 1.0
    if abs(v1 - v0) > 1e-9:
        enter, leave = (y - reach - v0) / (v1 - v0), (y + reach - v0) / (v1 - v0)
        low, high = max(low, min(enter, leave)), min(high, max(enter, leave))
    elif abs(y - v0) > reach:
        return 0, 0
    if not (radius > 0.0 and low <= high):
        return 0, 0
    ua, ub = u0 + low * (u1 - u0), u0 + high * (u1 - u0)
    pad = radius + 0.5 * sweep[n, 0] + 1.0
    x0 = int(max(0.0, min(float(width), math.floor(min(ua, ub) - pad))))
    x1 = int(max(0.0, min(float(width), math.ceil(max(ua, ub) + pad) + 1.0)))
    return (x0, x1) if x0 < x1 else (0, 0)


@njit(cache=True)
def outline(kind: int, row: Array, size: Array, n: int, intrinsics: Array) -> tuple[float, float, float, float, float]:
    """Where the ends of a solid's axis appear, (u0, v0, u1, v1) px, and how far its image may reach from the axis.

    All NaN when an end is not clearly before the camera: such a solid is not drawn.
    """
    radius = size[n, 0] if kind == CAPSULE else max(size[n, 1], size[n, 2])
    if kind == CAPSULE:
        ax, ay, az, bx, by, bz = row[0], row[1], row[2], row[3], row[4], row[5]
    else:
        half = size[n, 0]
        ax, ay, az = row[0] - half * row[3], row[1] - half * row[4], row[2] - half * row[5]
        bx, by, bz = row[0] + half * row[3], row[1] + half * row[4], row[2] + half * row[5]
    nearest = min(az, bz) - radius
    if not nearest > NEAR_M:
        return math.nan, math.nan, math.nan, math.nan, math.nan
    u0, v0 = _within(ax / az, ay / az, intrinsics)
    u1, v1 = _within(bx / bz, by / bz, intrinsics)
    u, v = _within((ax + bx) / (az + bz), (ay + by) / (az + bz), intrinsics)
    length = math.hypot(u1 - u0, v1 - v0)
    bent = abs((u - u0) * (v1 - v0) - (v - v0) * (u1 - u0)) / max(length, 1.0)  # px: a lens bends straight lines
    return u0, v0, u1, v1, 1.1 * max(intrinsics[0], intrinsics[1]) * radius / nearest + 1.5 * bent + 1.0


@njit(cache=True)
def _within(x: float, y: float, intrinsics: Array) -> tuple[float, float]:
    """The pixel of a ray, and of one that the lens does not reach the last one in its direction."""
    square = x * x + y * y
    if square > intrinsics[REACH]:
        inside = 0.9999 * math.sqrt(intrinsics[REACH] / square)
        x, y = inside * x, inside * y
    u, v, _, _, _, _ = project_ray(x, y, intrinsics)
    return u, v


@njit(cache=True)
def in_block(active: Indices, actives: int, scanline_bounds: Indices, y: int, x: int,
              near: Indices) -> int:
    """Fill `near` with the active solids that touch pixels x .. x + SAMPLES - 1 of row `y`; returns how many."""
    nears = 0
    for k in range(actives):
        n = active[k]
        if scanline_bounds[y, n, 0] < x + SAMPLES and x < scanline_bounds[y, n, 1]:
            near[nears] = n
            nears += 1
    return nears


@njit(cache=True)
def area_outside(series: Array, n: int, solids: Solids, intrinsics: Array, timing: Array, width: int, height: int,
                 limits: Indices) -> float:
    """Area, px^2, of what is painted of solid `n` beyond the image borders, within `limits` (x0, y0, x1, y1): one
    ray per pixel."""
    kind, size, paint = solids.what[n, KIND], solids.size, solids.paint
    row, prepared = np.empty(PARAMETERS), np.empty((1, len(size), PREPARED))
    area, partly = 0.0, paint[n, BOUNDS] != PLAIN
    for y in range(limits[1], limits[3]):
        tau = min(max(timing[0] + y * timing[1], -1.2), 1.2)
        evaluate(series, n, tau, row)
        prepare(kind, row, size, prepared, 0, n)
        for x in range(limits[0], limits[2]):
            if 0 <= x < width and 0 <= y < height:
                continue
            rx, ry, _, _, _, _ = undistort_point(float(x), float(y), intrinsics)
            if math.isnan(rx):
                continue
            t = hit(kind, prepared, 0, n, rx, ry)
            if t < NO_HIT:
                if partly:
                    along, across, above = local_point(kind, prepared, 0, n, rx, ry, t)
                    if not is_painted(paint, n, along, across, above):
                        continue
                area += 1.0
    return area
