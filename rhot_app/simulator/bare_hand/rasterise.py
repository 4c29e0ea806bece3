"""Triangles to pixels (numba): an accumulation buffer over a pixel's area and exposure (Haeberli and Akeley 1990).

Each of the samples is a whole picture at its own sub-pixel offset and its own instant of the exposure; a vertex takes
the time of the row on which it is seen. Their mean is antialiased and blurred by motion.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import REACH, project_ray
from rhot_app.simulator.render.exposure_samples import STILL_PX

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Image = NDArray[np.float32]

SAMPLES: Final = 16
_STEP_Y, _STEP_T = 5, 7  # of the rank-1 lattice (1, 5, 7) / 16 in x, y and time, as in `render.rays`
NEAREST_M: Final = 0.05
_OUTSIDE_PX: Final = 64.0  # vertices farther from the picture do not bound what is drawn


@njit(cache=True, fastmath=True)
def project_at(series: Array, timing: Array, offset: float, intrinsics: Array, used: NDArray[np.uint8],
               steps: int | np.int64, rows: Array, out: Array) -> None:
    """Fill `out` (V, 3): px, px and 1/z of vertices whose camera coordinates are `series` (V, 3, NODES) in tau, at
    `offset` in tau from the mid-exposure of their own rows; `rows` (V,) is where they were seen, and are seen now
    after `steps` of iteration. Only vertices that are `used` (V,) count."""
    for n in range(len(series)):
        if not used[n]:
            continue
        for _ in range(steps):
            tau = min(max(timing[0] + rows[n] * timing[1] + offset, -1.0), 1.0)
            x = (((series[n, 0, 4] * tau + series[n, 0, 3]) * tau + series[n, 0, 2]) * tau + series[n, 0, 1]) * tau
            y = (((series[n, 1, 4] * tau + series[n, 1, 3]) * tau + series[n, 1, 2]) * tau + series[n, 1, 1]) * tau
            z = (((series[n, 2, 4] * tau + series[n, 2, 3]) * tau + series[n, 2, 2]) * tau + series[n, 2, 1]) * tau
            x, y, z = x + series[n, 0, 0], y + series[n, 1, 0], z + series[n, 2, 0]
            if z < NEAREST_M:
                out[n, 2] = 0.0
                break
            inverse = 1.0 / z
            xn, yn = x * inverse, y * inverse
            radius = math.sqrt((xn * xn + yn * yn) / intrinsics[REACH])
            inside = 0.9999 / radius if radius > 0.9999 else 1.0  # what is beyond the lens is drawn further out
            u, v, _, _, _, _ = project_ray(inside * xn, inside * yn, intrinsics)
            out[n, 0] = (u - intrinsics[2]) / inside + intrinsics[2]
            out[n, 1] = (v - intrinsics[3]) / inside + intrinsics[3]
            out[n, 2] = inverse
            rows[n] = out[n, 1]


@njit(cache=True, fastmath=True)
def draw(points: Array, triangles: Indices, colours: Image, ox: float, oy: float, box: Indices, depth: Image,
         shown: Image) -> None:
    """One sample: draw triangles whose vertices are seen at `points` (V, 3) px, px, 1/z with `colours` (V, 3), at the
    offset (ox, oy) px from the pixels' centres, into `depth` (H, W) of 1/z and `shown` (H, W, 3) inside the `box`."""
    x0, y0, x1, y1 = box[0], box[1], box[2], box[3]
    depth[y0:y1, x0:x1] = 0.0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if points[a, 2] == 0.0 or points[b, 2] == 0.0 or points[c, 2] == 0.0:
            continue
        ax, ay = points[a, 0] - ox, points[a, 1] - oy
        bx, by = points[b, 0] - ox, points[b, 1] - oy
        cx, cy = points[c, 0] - ox, points[c, 1] - oy
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area >= 0.0:  # y points down: what faces the camera runs the other way round
            continue
        left, right = max(math.ceil(min(ax, bx, cx)), x0), min(math.floor(max(ax, bx, cx)) + 1, x1)
        top, bottom = max(math.ceil(min(ay, by, cy)), y0), min(math.floor(max(ay, by, cy)) + 1, y1)
        if left >= right or top >= bottom:
            continue
        inverse = 1.0 / area
        for y in range(top, bottom):
            for x in range(left, right):
                wb = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) * inverse
                wc = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) * inverse
                wa = 1.0 - wb - wc
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                near = np.float32(wa * points[a, 2] + wb * points[b, 2] + wc * points[c, 2])
                if near > depth[y, x]:
                    depth[y, x] = near
                    for k in range(3):
                        shown[y, x, k] = wa * colours[a, k] + wb * colours[b, k] + wc * colours[c, k]


@njit(cache=True, fastmath=True)
def accumulate(series: Array, timing: Array, intrinsics: Array, triangles: Indices, colours: Image, samples: int,
               work: tuple[Array, Array, Array, NDArray[np.uint8], Indices], box: Indices, depth: Image, shown: Image,
               total: Image, cover: Image) -> None:
    """Sum `samples` pictures into `total` (H, W, 3) and count in `cover` (H, W) how many show the hand, inside the
    `box` (4,) that is filled with what any of them may touch. `work`: (V,), (V, 3), (V, 3), (V,) and (T, 3)."""
    height, width = depth.shape
    rows, points, others, used, kept = work
    rows[:] = 0.5 * height
    used[:] = 1
    project_at(series, timing, -0.5 * timing[2], intrinsics, used, np.int64(3), rows, others)
    project_at(series, timing, 0.5 * timing[2], intrinsics, used, np.int64(2), rows, points)
    sweep = _bound(others, points, width, height, box)
    if box[0] >= box[2] or box[1] >= box[3]:
        box[:] = 0
        return
    count = _keep(triangles, others, points, box, used, kept)
    total[box[1]:box[3], box[0]:box[2]] = 0.0
    cover[box[1]:box[3], box[0]:box[2]] = 0.0
    for k in range(samples):
        ox = (k + 0.5) / samples - 0.5
        oy = (((_STEP_Y * k) % samples) + 0.5) / samples - 0.5
        moment = (((_STEP_T * k) % samples) + 0.5) / samples - 0.5
        if sweep > STILL_PX:
            project_at(series, timing, moment * timing[2], intrinsics, used, np.int64(1), rows, points)
        draw(points, kept[:count], colours, ox, oy, box, depth, shown)
        for y in range(box[1], box[3]):
            for x in range(box[0], box[2]):
                if depth[y, x] > 0.0:
                    cover[y, x] += np.float32(1.0)
                    for c in range(3):
                        total[y, x, c] += shown[y, x, c]


@njit(cache=True)
def _bound(before: Array, after: Array, width: int, height: int, box: Indices) -> float:
    """Fill the `box` (4,) of pixels that vertices touch between two views (V, 3); returns how far one goes, px."""
    low_x, low_y, high_x, high_y, sweep = width, height, 0, 0, 0.0
    for points in (before, after):
        for n in range(len(points)):
            if points[n, 2] > 0.0 and -_OUTSIDE_PX < points[n, 0] < width + _OUTSIDE_PX:
                low_x, high_x = min(low_x, int(points[n, 0]) - 2), max(high_x, int(points[n, 0]) + 3)
                low_y, high_y = min(low_y, int(points[n, 1]) - 2), max(high_y, int(points[n, 1]) + 3)
                sweep = max(sweep, abs(after[n, 0] - before[n, 0]), abs(after[n, 1] - before[n, 1]))
    box[0], box[1], box[2], box[3] = max(low_x, 0), max(low_y, 0), min(high_x, width), min(high_y, height)
    return sweep


@njit(cache=True)
def _keep(triangles: Indices, before: Array, after: Array, box: Indices, used: NDArray[np.uint8],
          kept: Indices) -> int:
    """Put the triangles that face the camera inside the box in either view first into `kept` (T, 3); returns how many.
    Marks the vertices that they `used`."""
    count = 0
    used[:] = 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for points in (before, after):
            if points[a, 2] == 0.0 or points[b, 2] == 0.0 or points[c, 2] == 0.0:
                continue
            area = ((points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1])
                    - (points[b, 1] - points[a, 1]) * (points[c, 0] - points[a, 0]))
            if area >= 0.0 or min(points[a, 1], points[b, 1], points[c, 1]) > box[3] + 2 or max(
                    points[a, 1], points[b, 1], points[c, 1]) < box[1] - 2:
                continue
            kept[count, 0], kept[count, 1], kept[count, 2] = a, b, c
            used[a], used[b], used[c] = 1, 1, 1
            count += 1
            break
    return count


@njit(cache=True, fastmath=True)
def vertex_normals(positions: Array, triangles: Indices, out: Array) -> None:
    """Fill `out` (V, 3) with unit normals of a mesh at `positions` (V, 3), the mean of its triangles' by area."""
    out[:] = 0.0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = (positions[b, 0] - positions[a, 0], positions[b, 1] - positions[a, 1],
                      positions[b, 2] - positions[a, 2])
        vx, vy, vz = (positions[c, 0] - positions[a, 0], positions[c, 1] - positions[a, 1],
                      positions[c, 2] - positions[a, 2])
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for k in (a, b, c):
            out[k, 0] += nx
            out[k, 1] += ny
            out[k, 2] += nz
    for n in range(len(out)):
        norm = math.sqrt(out[n, 0] ** 2 + out[n, 1] ** 2 + out[n, 2] ** 2) + 1e-30
        out[n, 0] /= norm
        out[n, 1] /= norm
        out[n, 2] /= norm


@njit(cache=True, fastmath=True)
def unshadowed(positions: Array, cosines: Array, light: Array, texel_m: float, bias_m: float) -> Array:
    """(V,) 0..1: how much of the lamp each vertex sees past the rest of the mesh, from a depth map of its vertices
    along `light` (3,), a unit vector towards the lamp. `cosines` (V,) between normals and light: a surface that the
    light grazes is deeper in the next texel by the tangent, and does not shadow itself."""
    u, v = np.empty(3), np.empty(3)
    u[0], u[1], u[2] = light[1], -light[0], 0.0
    norm = math.sqrt(u[0] * u[0] + u[1] * u[1]) + 1e-12
    u /= norm
    v[0], v[1], v[2] = (light[1] * u[2] - light[2] * u[1], light[2] * u[0] - light[0] * u[2],
                        light[0] * u[1] - light[1] * u[0])
    count = len(positions)
    at = np.empty((count, 3))
    for n in range(count):
        x, y, z = positions[n, 0], positions[n, 1], positions[n, 2]
        at[n, 0] = (x * u[0] + y * u[1] + z * u[2]) / texel_m
        at[n, 1] = (x * v[0] + y * v[1] + z * v[2]) / texel_m
        at[n, 2] = x * light[0] + y * light[1] + z * light[2]
    low_u, low_v = np.min(at[:, 0]) - 2.0, np.min(at[:, 1]) - 2.0
    wide, high = int(np.max(at[:, 0]) - low_u) + 3, int(np.max(at[:, 1]) - low_v) + 3
    front = np.full((wide, high), -1e9)
    for n in range(count):
        i, j = int(at[n, 0] - low_u), int(at[n, 1] - low_v)
        front[i, j] = max(front[i, j], at[n, 2])
    out = np.empty(count)
    for n in range(count):
        i, j, free = int(at[n, 0] - low_u), int(at[n, 1] - low_v), 0.0
        cosine = max(abs(cosines[n]), 0.2)
        depth = at[n, 2] + bias_m + 2.0 * texel_m * math.sqrt(1.0 - min(cosine * cosine, 1.0)) / cosine
        for di in range(-1, 2):
            for dj in range(-1, 2):
                free += 1.0 if front[i + di, j + dj] < depth else 0.0
        out[n] = free / 9.0
    return out
