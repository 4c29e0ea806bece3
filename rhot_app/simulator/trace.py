"""Ray tracing of one frame's hand (numba): rolling shutter by row, exposure by time samples, edges supersampled.

Two passes. The first sends one ray through each pixel's centre at its row's mid-exposure and notes what it meets.
Pixels near a change of id - as near as the solids move while exposed - are then sampled again by 16 rays. The 16
samples are a rank-1 lattice in (x, y, time), shifted at random for each pixel: stratified in every coordinate, and
no sub-pixel position prefers a time.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import distort, undistort_point
from rhot_app.simulator.body import CAPSULE, PALM_GROUP
from rhot_app.simulator.raycast import NO_HIT, PREPARED, hit, lambert, prepare

Array = NDArray[np.float64]
Image = NDArray[np.float32]

SAMPLES = 16
_BLOCK = 8  # px of a row that share one list of solids
_STEP_Y, _STEP_T = 5, 7  # lattice generator (1, 5, 7) / 16: no two samples are close in any pair of coordinates
NODES = 5
"""A solid's parameters over a frame are a polynomial of this many coefficients in tau, -1..1 over the frame."""


@njit(cache=True)
def trace(coefficients: Array, kind: NDArray[np.int64], group: NDArray[np.int64], marker: NDArray[np.int64],
          size: Array, rgb: Array, margin: Array, sweep: Array, rays: Array, intrinsics: Array, timing: Array,
          light: Array, shading: float, seed: int, background: Image, image: Image, ids: NDArray[np.int8],
          edges: NDArray[np.uint8], masks: NDArray[np.int64], visible: Array,
          whole: Array) -> tuple[int, int, int, int]:
    """Paint the hand over `background` into `image`, both (3, H, W), only inside the box that is returned.

    `coefficients` (N, 12, NODES): parameters of the N solids in the camera's frame. `sweep` (N, 2): px that a solid
    moves in x and y during the exposure. `rays` (H + 2, W + 2, 2): normalised coordinates of the pixel centres with a
    border of one. `timing`: (tau of row 0's mid-exposure, tau per row, exposure in tau). `light` (3,) unit vector,
    `shading` 0..1 its share. `ids` (H, W), `edges` (H, W) and `masks` (H, W) are work space. `visible` and `whole`
    (M,) receive each marker's seen and unhidden area inside the image, px^2. Returns the box (x0, y0, x1, y1) of
    changed pixels, half open; an empty box is (0, 0, 0, 0).
    """
    height, width = ids.shape
    count = len(kind)
    ids[:] = 0
    edges[:] = 0
    visible[:] = 0.0
    whole[:] = 0.0
    row = np.empty(12)
    prepared = np.empty((SAMPLES, count, PREPARED))
    active, near, nears = np.empty(count, np.int64), np.empty(count, np.int64), 0
    spans = np.empty((height, count, 2), np.int64)
    rows = np.zeros((height, 2), np.int64)  # half-open x range of each row
    tied = np.zeros(PALM_GROUP + 1)
    top, bottom = height, 0
    for y in range(height):
        tau = timing[0] + y * timing[1]
        left, right, actives = width, 0, 0
        for n in range(count):
            _evaluate(coefficients, n, tau, kind[n], row)
            x0, x1 = _span(kind[n], row, size, sweep, n, intrinsics, y, width)
            spans[y, n, 0], spans[y, n, 1] = x0, x1
            if x0 < x1:
                prepare(kind[n], row, size, prepared, 0, n)
                active[actives] = n
                actives += 1
                left, right = min(left, x0), max(right, x1)
        rows[y, 0], rows[y, 1] = left, max(left, right)
        if actives == 0:
            continue
        top, bottom = min(top, y), y + 1
        for x in range(left, right):
            if (x - left) % _BLOCK == 0:
                nears = _in_block(active, actives, spans, y, x, near)
            rx, ry = rays[y + 1, x + 1, 0], rays[y + 1, x + 1, 1]
            winner, depth, mask = _nearest(near, nears, prepared, 0, kind, group, marker, margin, tied, rx, ry)
            masks[y, x] = mask
            if winner < 0:
                for c in range(3):
                    image[c, y, x] = background[c, y, x]
                continue
            ids[y, x] = 1 + group[winner] if marker[winner] < 0 else 20 + marker[winner]
            shade = 1.0 - shading * (1.0 - lambert(kind[winner], prepared, 0, winner, rx, ry, depth, light))
            for c in range(3):
                image[c, y, x] = shade * rgb[winner, c]
    if top >= bottom:
        return 0, 0, 0, 0
    _mark_edges(ids, edges, rows, top, bottom, _reach(group, marker, sweep))
    slots = SAMPLES if np.max(sweep) > 0.02 else 1
    box_left, box_right = width, 0
    for y in range(top, bottom):
        if rows[y, 0] >= rows[y, 1]:
            continue
        box_left, box_right = min(box_left, rows[y, 0]), max(box_right, rows[y, 1])
        actives = 0
        for n in range(count):
            if spans[y, n, 0] < spans[y, n, 1]:
                active[actives] = n
                actives += 1
                for slot in range(slots):
                    offset = ((slot + 0.5) / slots - 0.5) * timing[2]
                    _evaluate(coefficients, n, timing[0] + y * timing[1] + offset, kind[n], row)
                    prepare(kind[n], row, size, prepared, slot, n)
        block = -1
        for x in range(rows[y, 0], rows[y, 1]):
            if edges[y, x]:
                if x // _BLOCK != block:
                    block = x // _BLOCK
                    nears = _in_block(active, actives, spans, y, block * _BLOCK, near)
                _supersample(x, y, near, nears, prepared, slots, kind, group, marker, margin, rgb, tied, rays, light,
                             shading, seed, background, image, visible, whole)
            else:
                if ids[y, x] >= 20:
                    visible[ids[y, x] - 20] += 1.0
                _count(masks[y, x], 1.0, whole)
    return box_left, top, box_right, bottom


@njit(cache=True, fastmath=True)
def _evaluate(series: Array, n: int, tau: float, kind: int, row: Array) -> None:
    for k in range(6 if kind == CAPSULE else 12):
        row[k] = (((series[n, k, 4] * tau + series[n, k, 3]) * tau + series[n, k, 2]) * tau
                  + series[n, k, 1]) * tau + series[n, k, 0]


@njit(cache=True)
def _span(kind: int, row: Array, size: Array, sweep: Array, n: int, intrinsics: Array, y: int,
          width: int) -> tuple[int, int]:
    """Half-open range of pixels of row `y` that a solid may touch; generous, (0, 0) when none."""
    x_low, x_high, y_low, y_high = extent(kind, row, size, n, intrinsics)
    pad_y = 0.5 * sweep[n, 1] + 1.0
    if y < y_low - pad_y or y > y_high + pad_y:
        return 0, 0
    pad_x = 0.5 * sweep[n, 0] + 1.0
    x0 = int(max(0.0, min(float(width), math.floor(x_low - pad_x))))
    x1 = int(max(0.0, min(float(width), math.ceil(x_high + pad_x) + 1.0)))
    return (x0, x1) if x0 < x1 else (0, 0)


@njit(cache=True)
def extent(kind: int, row: Array, size: Array, n: int, intrinsics: Array) -> tuple[float, float, float, float]:
    """(x low, x high, y low, y high) px that surely contain a solid; empty when it is behind the camera."""
    radius = size[n, 0] if kind == CAPSULE else max(size[n, 1], size[n, 2])
    x_low, x_high, y_low, y_high = 1e9, -1e9, 1e9, -1e9
    lens = intrinsics[4:9]
    for end in range(2):
        if kind == CAPSULE:
            px, py, pz = row[3 * end], row[3 * end + 1], row[3 * end + 2]
        else:
            sign = (2.0 * end - 1.0) * size[n, 0]
            px, py, pz = row[0] + sign * row[3], row[1] + sign * row[4], row[2] + sign * row[5]
        if pz < 0.02:
            continue
        depth = max(pz - radius, 0.02)
        xd, yd, _, _, _, _ = distort(px / pz, py / pz, lens)
        rx, ry = 1.1 * intrinsics[0] * radius / depth, 1.1 * intrinsics[1] * radius / depth
        u, v = intrinsics[0] * xd + intrinsics[2], intrinsics[1] * yd + intrinsics[3]
        x_low, x_high = min(x_low, u - rx), max(x_high, u + rx)
        y_low, y_high = min(y_low, v - ry), max(y_high, v + ry)
    return x_low, x_high, y_low, y_high


@njit(cache=True)
def _in_block(active: NDArray[np.int64], actives: int, spans: NDArray[np.int64], y: int, x: int,
              near: NDArray[np.int64]) -> int:
    """Fill `near` with the active solids that touch pixels x .. x + _BLOCK of row `y`; returns how many."""
    nears = 0
    for k in range(actives):
        n = active[k]
        if spans[y, n, 0] < x + _BLOCK and x < spans[y, n, 1]:
            near[nears] = n
            nears += 1
    return nears


@njit(cache=True, fastmath=True, inline="always")
def _nearest(near: NDArray[np.int64], nears: int, prepared: Array, slot: int, kind: NDArray[np.int64],
             group: NDArray[np.int64], marker: NDArray[np.int64], margin: Array, tied: Array, rx: float,
             ry: float) -> tuple[int, float, int]:
    """(solid or -1, depth, bit mask of the markers on the ray, hidden or not). Markers come first among solids."""
    winner, depth, nearest, mask = -1, NO_HIT, NO_HIT, 0
    for k in range(nears):
        n = near[k]
        t = hit(kind[n], prepared, slot, n, rx, ry)
        if t == NO_HIT:
            continue
        rank = t
        if marker[n] >= 0:
            mask |= 1 << marker[n]
            tied[group[n]] = margin[n]
        elif mask:
            rank += tied[group[n]]
        if rank < nearest:
            winner, depth, nearest = n, t, rank
    if mask:
        tied[:] = 0.0
    return winner, depth, mask


@njit(cache=True)
def _reach(group: NDArray[np.int64], marker: NDArray[np.int64], sweep: Array) -> NDArray[np.int64]:
    """(128, 2) px around a change of id, by id, that the exposure may sweep."""
    reach = np.zeros((128, 2), np.int64)
    for n in range(len(group)):
        code = 1 + group[n] if marker[n] < 0 else 20 + marker[n]
        for axis in range(2):
            pixels = math.ceil(0.5 * sweep[n, axis]) if sweep[n, axis] > 0.02 else 0
            reach[code, axis] = max(reach[code, axis], pixels)
    return reach


@njit(cache=True)
def _mark_edges(ids: NDArray[np.int8], edges: NDArray[np.uint8], rows: NDArray[np.int64], top: int, bottom: int,
                reach: NDArray[np.int64]) -> None:
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
def _supersample(x: int, y: int, near: NDArray[np.int64], nears: int, prepared: Array, slots: int,
                 kind: NDArray[np.int64], group: NDArray[np.int64], marker: NDArray[np.int64], margin: Array,
                 rgb: Array, tied: Array, rays: Array, light: Array, shading: float, seed: int, background: Image,
                 image: Image, visible: Array, whole: Array) -> None:
    random = _hash(x, y, seed)
    shift_x, shift_y = (random & 0xFFFF) / 65536.0, ((random >> 16) & 0xFFFF) / 65536.0
    shift_t = (random >> 32) & (SAMPLES - 1)
    j, i = y + 1, x + 1
    xx, xy = 0.5 * (rays[j, i + 1, 0] - rays[j, i - 1, 0]), 0.5 * (rays[j + 1, i, 0] - rays[j - 1, i, 0])
    yx, yy = 0.5 * (rays[j, i + 1, 1] - rays[j, i - 1, 1]), 0.5 * (rays[j + 1, i, 1] - rays[j - 1, i, 1])
    red, green, blue = 0.0, 0.0, 0.0
    for k in range(SAMPLES):
        ox = (k + shift_x) / SAMPLES
        oy = ((_STEP_Y * k) % SAMPLES + shift_y) / SAMPLES
        ox, oy = ox - 0.5, oy - 0.5
        slot = (_STEP_T * k + shift_t) % slots
        rx = rays[j, i, 0] + ox * xx + oy * xy
        ry = rays[j, i, 1] + ox * yx + oy * yy
        winner, depth, mask = _nearest(near, nears, prepared, slot, kind, group, marker, margin, tied, rx, ry)
        if mask:
            _count(mask, 1.0 / SAMPLES, whole)
        if winner < 0:
            red += background[0, y, x]
            green += background[1, y, x]
            blue += background[2, y, x]
            continue
        if marker[winner] >= 0:
            visible[marker[winner]] += 1.0 / SAMPLES
        shade = 1.0 - shading * (1.0 - lambert(kind[winner], prepared, slot, winner, rx, ry, depth, light))
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
                 height: int, limits: NDArray[np.int64]) -> float:
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
