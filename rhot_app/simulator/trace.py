"""Ray tracing of one frame's hand (numba): rolling shutter by row, exposure by time samples, edges supersampled.

Two passes. The first sends one ray through each pixel's centre at its row's mid-exposure and notes what it meets.
Pixels near a change between skin, paint and background - as near as the solids move while exposed - are then sampled
again by 16 rays. The 16 samples are a rank-1 lattice in (x, y, time), shifted at random for each pixel: stratified in
every coordinate, and no sub-pixel position prefers a time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import distort, undistort_point
from rhot_app.simulator.body import CAPSULE, PALM_GROUP
from rhot_app.simulator.raycast import NO_HIT, PREPARED, hit, lambert, prepare

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Image = NDArray[np.float32]

SAMPLES = 16
_STEP_Y, _STEP_T = 5, 7  # lattice generator (1, 5, 7) / 16: no two samples are close in any pair of coordinates
_STILL_PX = 0.02  # what moves less while exposed is taken to stand still
_SKIN, _PAINT = 1, 20  # ids: background 0, skin of the hand, of the forearm (its far end sweeps far), first marker
NEAR_M = 0.03  # what comes nearer to the camera's plane is not drawn
NODES = 5
"""A solid's parameters over a frame are a polynomial of this many coefficients in tau, -1..1 over the frame."""


class Moving(NamedTuple):
    """N solids during one frame, painted ones first.

    `series` (N, 12, NODES): their parameters in the camera's frame. `meta` (N, 3): kind, group, marker. `size` (N, 3),
    `rgb` (N, 3), `margin` (N,) as in `HandBody`. `sweep` (N, 2): px travelled in x and y during the exposure.
    """

    series: Array
    meta: Indices
    size: Array
    rgb: Array
    margin: Array
    sweep: Array


class View(NamedTuple):
    """A camera during one frame.

    `rays` (H + 2, W + 2, 2): normalised coordinates of the pixel centres with a border of one. `intrinsics` (9,).
    `timing` (3,): tau of row 0's mid-exposure, tau per row, exposure in tau. `light` (3,): unit vector towards the
    lamp, camera frame; `shading` 0..1: its share of the brightness.
    """

    rays: Array
    intrinsics: Array
    timing: Array
    light: Array
    shading: float


class Canvas(NamedTuple):
    """Images and work space of one camera, H x W; see `canvas`.

    `background` and `image` (3, H, W). `ids` and `masks` (H, W): what a pixel's centre shows, and bits of the markers
    behind it, hidden or not. `edges` (H, W): pixels to sample again. `spans` (H, N, 2) and `rows` (H, 2): half-open
    x ranges of each solid and of all. `visible` and `whole` (M,): each marker's seen and unhidden area, px^2.
    """

    background: Image
    image: Image
    ids: NDArray[np.int8]
    masks: Indices
    edges: NDArray[np.uint8]
    spans: Indices
    rows: Indices
    visible: Array
    whole: Array


def canvas(background: Image, solids: int, markers: int) -> Canvas:
    """A canvas whose image is the `background` (3, H, W)."""
    _, height, width = background.shape
    size = (height, width)
    return Canvas(background, background.copy(), np.zeros(size, np.int8), np.zeros(size, np.int64),
                  np.zeros(size, np.uint8), np.zeros((height, solids, 2), np.int64),
                  np.zeros((height, 2), np.int64), np.zeros(markers), np.zeros(markers))


@njit(cache=True)
def trace(moving: Moving, view: View, canvas: Canvas, seed: int) -> tuple[int, int, int, int]:
    """Paint the hand over the background into the canvas's image; count the markers' areas inside the image.

    Returns the box (x0, y0, x1, y1) of pixels that may differ from the background, half open; (0, 0, 0, 0): none.
    """
    canvas.visible[:] = 0.0
    canvas.whole[:] = 0.0
    canvas.ids[:] = 0
    canvas.edges[:] = 0
    top, bottom = _trace_centres(moving, view, canvas)
    if top >= bottom:
        return 0, 0, 0, 0
    _mark_edges(canvas.ids, canvas.edges, canvas.rows, top, bottom, _reach(moving.meta, moving.sweep))
    _trace_edges(moving, view, canvas, top, bottom, seed)
    left, right = canvas.rows[top, 0], canvas.rows[top, 1]
    for y in range(top, bottom):
        if canvas.rows[y, 0] < canvas.rows[y, 1]:
            left, right = min(left, canvas.rows[y, 0]), max(right, canvas.rows[y, 1])
    return left, top, right, bottom


@njit(cache=True, fastmath=True)
def _trace_centres(moving: Moving, view: View, canvas: Canvas) -> tuple[int, int]:
    """First pass: one ray per pixel. Returns the range of rows that the hand may touch."""
    series, meta, size, rgb, margin, sweep = moving
    rays, intrinsics, timing, light, shading = view
    background, image, ids, masks, _, spans, rows, _, _ = canvas
    height, width = ids.shape
    row, prepared = np.empty(12), np.empty((1, len(meta), PREPARED))
    active, near = np.empty(len(meta), np.int64), np.empty(len(meta), np.int64)
    ray, slot, met, depth, tied = _ray_batch()
    top, bottom = height, 0
    for y in range(height):
        left, right, actives = width, 0, 0
        for n in range(len(meta)):
            _evaluate(series, n, timing[0] + y * timing[1], meta[n, 0], row)
            x0, x1 = _span(meta[n, 0], row, size, sweep, n, intrinsics, y, width)
            spans[y, n, 0], spans[y, n, 1] = x0, x1
            if x0 < x1:
                prepare(meta[n, 0], row, size, prepared, 0, n)
                active[actives] = n
                actives += 1
                left, right = min(left, x0), max(right, x1)
        rows[y, 0], rows[y, 1] = left, max(left, right)
        if actives:
            top, bottom = min(top, y), y + 1
        for start in range(left, right, SAMPLES):
            pixels = min(SAMPLES, right - start)
            nears = _in_block(active, actives, spans, y, start, near)
            for i in range(pixels):
                ray[i, 0], ray[i, 1] = rays[y + 1, start + i + 1, 0], rays[y + 1, start + i + 1, 1]
            _cast(pixels, ray, slot, near, nears, prepared, meta, margin, tied, met, depth)
            for i in range(pixels):
                x, winner = start + i, met[i, 0]
                masks[y, x] = met[i, 1]
                if winner < 0:
                    for c in range(3):
                        image[c, y, x] = background[c, y, x]
                    continue
                ids[y, x] = _SKIN + meta[winner, 0] if meta[winner, 2] < 0 else _PAINT + meta[winner, 2]
                cosine = lambert(meta[winner, 0], prepared, 0, winner, ray[i, 0], ray[i, 1], depth[i], light)
                shade = 1.0 - shading * (1.0 - cosine)
                for c in range(3):
                    image[c, y, x] = shade * rgb[winner, c]
    return top, bottom


@njit(cache=True, fastmath=True)
def _trace_edges(moving: Moving, view: View, canvas: Canvas, top: int, bottom: int, seed: int) -> None:
    """Second pass: the marked pixels again, by 16 rays over area and exposure; and the markers' areas."""
    series, meta, size, rgb, margin, sweep = moving
    rays, _, timing, light, shading = view
    background, image, ids, masks, edges, spans, rows, visible, whole = canvas
    slots = SAMPLES if np.max(sweep) > _STILL_PX else 1
    row, prepared = np.empty(12), np.empty((slots, len(meta), PREPARED))
    active, near = np.empty(len(meta), np.int64), np.empty(len(meta), np.int64)
    ray, slot, met, depth, tied = _ray_batch()
    for y in range(top, bottom):
        actives, nears, block = 0, 0, -1
        for n in range(len(meta)):
            if spans[y, n, 0] < spans[y, n, 1]:
                active[actives] = n
                actives += 1
                for k in range(slots):
                    offset = ((k + 0.5) / slots - 0.5) * timing[2]
                    _evaluate(series, n, timing[0] + y * timing[1] + offset, meta[n, 0], row)
                    prepare(meta[n, 0], row, size, prepared, k, n)
        for x in range(rows[y, 0], rows[y, 1]):
            if not edges[y, x]:
                if ids[y, x] >= _PAINT:
                    visible[ids[y, x] - _PAINT] += 1.0
                if masks[y, x]:
                    _count(masks[y, x], 1.0, whole)
                continue
            if x // SAMPLES != block:
                block = x // SAMPLES
                nears = _in_block(active, actives, spans, y, block * SAMPLES, near)
            _scatter(x, y, slots, seed, rays, ray, slot)
            _cast(SAMPLES, ray, slot, near, nears, prepared, meta, margin, tied, met, depth)
            _gather(x, y, ray, slot, prepared, meta, rgb, met, depth, light, shading, background, image, visible, whole)


@njit(cache=True)
def _ray_batch() -> tuple[Array, Indices, Indices, Array, Array]:
    """Room for SAMPLES rays: directions, moments, what they meet, at what depth; and the margins of paint by group."""
    return (np.empty((SAMPLES, 2)), np.zeros(SAMPLES, np.int64), np.zeros((SAMPLES, 2), np.int64), np.zeros(SAMPLES),
            np.zeros(PALM_GROUP + 1))


@njit(cache=True, fastmath=True)
def _evaluate(series: Array, n: int, tau: float, kind: int, row: Array) -> None:
    for k in range(6 if kind == CAPSULE else 12):
        row[k] = (((series[n, k, 4] * tau + series[n, k, 3]) * tau + series[n, k, 2]) * tau
                  + series[n, k, 1]) * tau + series[n, k, 0]


@njit(cache=True)
def _span(kind: int, row: Array, size: Array, sweep: Array, n: int, intrinsics: Array, y: int,
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
    lens = intrinsics[4:9]
    x, y, _, _, _, _ = distort(ax / az, ay / az, lens)
    u0, v0 = intrinsics[0] * x + intrinsics[2], intrinsics[1] * y + intrinsics[3]
    x, y, _, _, _, _ = distort(bx / bz, by / bz, lens)
    u1, v1 = intrinsics[0] * x + intrinsics[2], intrinsics[1] * y + intrinsics[3]
    return u0, v0, u1, v1, 1.1 * max(intrinsics[0], intrinsics[1]) * radius / nearest + 1.0


@njit(cache=True)
def _in_block(active: Indices, actives: int, spans: Indices, y: int, x: int,
              near: Indices) -> int:
    """Fill `near` with the active solids that touch pixels x .. x + SAMPLES - 1 of row `y`; returns how many."""
    nears = 0
    for k in range(actives):
        n = active[k]
        if spans[y, n, 0] < x + SAMPLES and x < spans[y, n, 1]:
            near[nears] = n
            nears += 1
    return nears


@njit(cache=True, fastmath=True)
def _cast(rays: int, ray: Array, slot: Indices, near: Indices, nears: int, prepared: Array, meta: Indices,
          margin: Array, tied: Array, met: Indices, depth: Array) -> None:
    """What each of the first `rays` rays (x, y) meets: `met` (solid or -1, bit mask of all markers on the ray, hidden
    or not) and the depth. Many rays in one call, because every call counts references of all its arrays.
    """
    for i in range(rays):
        winner, mask, nearest = -1, 0, NO_HIT
        for k in range(nears):
            n = near[k]
            t = hit(meta[n, 0], prepared, slot[i], n, ray[i, 0], ray[i, 1])
            if t == NO_HIT:
                continue
            rank = t
            if meta[n, 2] >= 0:  # markers come first among the solids
                mask |= 1 << meta[n, 2]
                tied[meta[n, 1]] = margin[n]
            elif mask:
                rank += tied[meta[n, 1]]
            if rank < nearest:
                winner, nearest = n, rank
                depth[i] = t
        met[i, 0], met[i, 1] = winner, mask
        if mask:
            for part in range(PALM_GROUP + 1):
                tied[part] = 0.0


@njit(cache=True)
def _reach(meta: Indices, sweep: Array) -> Indices:
    """(128, 2) px around a change of id, by id, that the exposure may sweep."""
    reach = np.zeros((128, 2), np.int64)
    for n in range(len(meta)):
        code = _SKIN + meta[n, 0] if meta[n, 2] < 0 else _PAINT + meta[n, 2]
        for axis in range(2):
            pixels = math.ceil(0.5 * sweep[n, axis]) if sweep[n, axis] > _STILL_PX else 0
            reach[code, axis] = max(reach[code, axis], pixels)
    return reach


@njit(cache=True)
def _mark_edges(ids: NDArray[np.int8], edges: NDArray[np.uint8], rows: Indices, top: int, bottom: int,
                reach: Indices) -> None:
    height, width = ids.shape
    for y in range(max(top - 1, 0), bottom):
        below = min(y + 1, height - 1)
        left, right = min(rows[y, 0], rows[below, 0]), max(rows[y, 1], rows[below, 1])
        for x in range(max(left - 1, 0), right):
            here, beside, under = ids[y, x], ids[y, min(x + 1, width - 1)], ids[below, x]
            if here == beside and here == under:
                continue
            wide = max(reach[here, 0], reach[beside, 0], reach[under, 0])
            high = max(reach[here, 1], reach[beside, 1], reach[under, 1])
            to_x = x + wide + 2 if here != beside else x + wide + 1
            to_y = y + high + 2 if here != under else y + high + 1
            for j in range(max(y - high, 0), min(to_y, height)):
                for i in range(max(x - wide, 0), min(to_x, width)):
                    edges[j, i] = 1


@njit(cache=True, fastmath=True)
def _scatter(x: int, y: int, slots: int, seed: int, rays: Array, ray: Array, slot: Indices) -> None:
    """Fill the pixel's 16 rays and their moments."""
    random = _hash(x, y, seed)
    shift_x, shift_y = (random & 0xFFFF) / 65536.0, ((random >> 16) & 0xFFFF) / 65536.0
    shift_t = (random >> 32) & (SAMPLES - 1)
    j, i = y + 1, x + 1
    xx, xy = 0.5 * (rays[j, i + 1, 0] - rays[j, i - 1, 0]), 0.5 * (rays[j + 1, i, 0] - rays[j - 1, i, 0])
    yx, yy = 0.5 * (rays[j, i + 1, 1] - rays[j, i - 1, 1]), 0.5 * (rays[j + 1, i, 1] - rays[j - 1, i, 1])
    for k in range(SAMPLES):
        ox = (k + shift_x) / SAMPLES - 0.5
        oy = (((_STEP_Y * k) & (SAMPLES - 1)) + shift_y) / SAMPLES - 0.5
        ray[k, 0] = rays[j, i, 0] + ox * xx + oy * xy
        ray[k, 1] = rays[j, i, 1] + ox * yx + oy * yy
        slot[k] = (_STEP_T * k + shift_t) & (slots - 1)


@njit(cache=True, fastmath=True)
def _gather(x: int, y: int, ray: Array, slot: Indices, prepared: Array, meta: Indices, rgb: Array, met: Indices,
            depth: Array, light: Array, shading: float, background: Image, image: Image, visible: Array,
            whole: Array) -> None:
    """The mean colour of the pixel's 16 rays, and its share in the markers' areas."""
    red, green, blue = 0.0, 0.0, 0.0
    for k in range(SAMPLES):
        winner, mask = met[k, 0], met[k, 1]
        if mask:
            _count(mask, 1.0 / SAMPLES, whole)
        if winner < 0:
            red += background[0, y, x]
            green += background[1, y, x]
            blue += background[2, y, x]
            continue
        if meta[winner, 2] >= 0:
            visible[meta[winner, 2]] += 1.0 / SAMPLES
        cosine = lambert(meta[winner, 0], prepared, slot[k], winner, ray[k, 0], ray[k, 1], depth[k], light)
        shade = 1.0 - shading * (1.0 - cosine)
        red += shade * rgb[winner, 0]
        green += shade * rgb[winner, 1]
        blue += shade * rgb[winner, 2]
    image[0, y, x] = red / SAMPLES
    image[1, y, x] = green / SAMPLES
    image[2, y, x] = blue / SAMPLES


@njit(cache=True)
def _hash(x: int, y: int, seed: int) -> int:
    """48 well-mixed bits of three integers (a multiply and xor-shift hash)."""
    value = (x * 0x9E3779B1 + y * 0x85EBCA6B + seed * 0xC2B2AE35) & 0xFFFFFFFFFFFF
    value = ((value ^ (value >> 21)) * 0x2545F491) & 0xFFFFFFFFFFFF
    value = ((value ^ (value >> 17)) * 0x27D4EB2F) & 0xFFFFFFFFFFFF
    return value ^ (value >> 23)


@njit(cache=True)
def _count(mask: int, area: float, whole: Array) -> None:
    index = 0
    while mask:
        if mask & 1:
            whole[index] += area
        mask >>= 1
        index += 1


@njit(cache=True)
def area_outside(coefficients: Array, n: int, kind: int, size: Array, intrinsics: Array, timing: Array, width: int,
                 height: int, limits: Indices) -> float:
    """Area, px^2, of solid `n` beyond the image borders, within `limits` (x0, y0, x1, y1): one ray per pixel."""
    row, prepared = np.empty(12), np.empty((1, len(size), PREPARED))
    area = 0.0
    for y in range(limits[1], limits[3]):
        tau = min(max(timing[0] + y * timing[1], -1.2), 1.2)
        _evaluate(coefficients, n, tau, kind, row)
        prepare(kind, row, size, prepared, 0, n)
        for x in range(limits[0], limits[2]):
            if 0 <= x < width and 0 <= y < height:
                continue
            rx, ry, _, _, _, _ = undistort_point(float(x), float(y), intrinsics)
            if not math.isnan(rx) and hit(kind, prepared, 0, n, rx, ry) < NO_HIT:
                area += 1.0
    return area
