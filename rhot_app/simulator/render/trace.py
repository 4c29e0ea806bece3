"""Ray tracing of one frame's hand (numba): rolling shutter by row, exposure by time samples, edges supersampled.

Two passes. The first sends one ray through each pixel's centre at its row's mid-exposure and notes what it meets.
Pixels near a change between skin, paint and background - as near as the solids move while exposed - are then sampled
again by 16 rays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.simulator.render.body import BOUNDS, PLAIN, REST_GROUP, UNEVEN
from rhot_app.simulator.render.exposure_samples import STILL_PX, evaluate
from rhot_app.simulator.render.paint import is_painted, local_point, paint_level
from rhot_app.simulator.render.raycast import NO_HIT, PREPARED, hit, lambert, prepare
from rhot_app.simulator.render.rays import SAMPLES, scatter
from rhot_app.simulator.render.scanline_bounds import in_block, parameters_of, span

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Image = NDArray[np.float32]

SKIN_ID, PAINT_ID = 1, 20
"""What a pixel shows: 0 background, then skin of the hand and of the forearm (its far end sweeps far), tape and bands
in other colours than a marker's, then markers."""


@njit(cache=True, inline="always")
def id_of(meta: Indices, n: int) -> int:
    """What a pixel shows where solid `n` is: `meta` (N, 3) kind, group, marker."""
    if meta[n, 2] >= 0:
        return PAINT_ID + meta[n, 2]
    return SKIN_ID + meta[n, 0] + (2 if meta[n, 1] == REST_GROUP else 0)


@njit(cache=True)
def reach_by_id(meta: Indices, sweep: Array) -> Indices:
    """(128, 2) px around a change of id, by id, that the exposure may sweep."""
    reach = np.zeros((128, 2), np.int64)
    for n in range(len(meta)):
        code = id_of(meta, n)
        for axis in range(2):
            pixels = math.ceil(0.5 * sweep[n, axis]) if sweep[n, axis] > STILL_PX else 0
            reach[code, axis] = max(reach[code, axis], pixels)
    return reach


@njit(cache=True)
def mark_edges(ids: NDArray[np.int8], edges: NDArray[np.uint8], rows: Indices, top: int, bottom: int,
                reach: Indices) -> None:
    """Mark in `edges` (H, W) what lies within a body's `reach` (codes, 2) px of a border between two of `ids` (H, W).

    `rows` (H, 2): first and last column of each row in which anything is; rows from `top` to before `bottom` count.
    """
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


# -- two passes --------------------------------------------------------------------------------------------------------

class Moving(NamedTuple):
    """N solids during one frame, painted ones first.

    `series` (N, 12, NODES): their parameters in the camera's frame. `meta` (N, 3): kind, group, marker. `size` (N,
    3), `rgb` (N, 3), `margin` (N,), `paint` (N, PAINT_FIELDS) as in `HandBody`. `sweep` (N, 2): px travelled in x
    and y during the exposure.
    """

    series: Array
    meta: Indices
    size: Array
    rgb: Array
    margin: Array
    paint: Array
    sweep: Array


class View(NamedTuple):
    """A camera during one frame.

    `rays` (H + 2, W + 2, 2): normalised coordinates of the pixel centres with a border of one. `intrinsics` (13,).
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
    scanline_bounds: Indices
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
    mark_edges(canvas.ids, canvas.edges, canvas.rows, top, bottom, reach_by_id(moving.meta, moving.sweep))
    _trace_edges(moving, view, canvas, top, bottom, seed)
    left, right = canvas.rows[top, 0], canvas.rows[top, 1]
    for y in range(top, bottom):
        if canvas.rows[y, 0] < canvas.rows[y, 1]:
            left, right = min(left, canvas.rows[y, 0]), max(right, canvas.rows[y, 1])
    return left, top, right, bottom


@njit(cache=True, fastmath=True, inline="always")
def _trace_centres(moving: Moving, view: View, canvas: Canvas) -> tuple[int, int]:
    """First pass: one ray per pixel. Returns the range of rows that the hand may touch."""
    series, meta, size, rgb, margin, paint, sweep = moving
    rays, intrinsics, timing, light, shading = view
    background, image, ids, masks, _, scanline_bounds, rows, _, _ = canvas
    height, width = ids.shape
    row, prepared, up = np.empty(12), np.empty((1, len(meta), PREPARED)), np.zeros((1, len(meta), 3))
    active, near = np.empty(len(meta), np.int64), np.empty(len(meta), np.int64)
    ray, slot, met, depth, tied = _ray_batch()
    top, bottom = height, 0
    for y in range(height):
        left, right, actives = width, 0, 0
        for n in range(len(meta)):
            evaluate(series, n, timing[0] + y * timing[1], _parameters(meta, paint, n), row)
            x0, x1 = span(meta[n, 0], row, size, sweep, n, intrinsics, y, width)
            scanline_bounds[y, n, 0], scanline_bounds[y, n, 1] = x0, x1
            if x0 < x1:
                prepare(meta[n, 0], row, size, prepared, 0, n)
                if paint[n, BOUNDS] != PLAIN:
                    up[0, n, 0], up[0, n, 1], up[0, n, 2] = row[6], row[7], row[8]
                active[actives] = n
                actives += 1
                left, right = min(left, x0), max(right, x1)
        rows[y, 0], rows[y, 1] = left, max(left, right)
        if actives:
            top, bottom = min(top, y), y + 1
        for start in range(left, right, SAMPLES):
            pixels = min(SAMPLES, right - start)
            nears = in_block(active, actives, scanline_bounds, y, start, near)
            for i in range(pixels):
                ray[i, 0], ray[i, 1] = rays[y + 1, start + i + 1, 0], rays[y + 1, start + i + 1, 1]
            _cast(pixels, ray, slot, near, nears, prepared, meta, size, margin, paint, up, tied, met, depth)
            for i in range(pixels):
                x, winner = start + i, met[i, 0]
                masks[y, x] = met[i, 1]
                if winner < 0:
                    for c in range(3):
                        image[c, y, x] = background[c, y, x]
                    continue
                ids[y, x] = id_of(meta, winner)
                cosine = lambert(meta[winner, 0], prepared, 0, winner, ray[i, 0], ray[i, 1], depth[i], light)
                shade = 1.0 - shading * (1.0 - cosine)
                if paint[winner, UNEVEN] > 0.0:
                    along, across, above = local_point(meta[winner, 0], prepared, 0, winner, ray[i, 0], ray[i, 1],
                                                       depth[i], size, up)
                    shade *= paint_level(paint, winner, along, across, above)
                for c in range(3):
                    image[c, y, x] = shade * rgb[winner, c]
    return top, bottom


@njit(cache=True, fastmath=True, inline="always")
def _trace_edges(moving: Moving, view: View, canvas: Canvas, top: int, bottom: int, seed: int) -> None:
    """Second pass: the marked pixels again, by 16 rays over area and exposure; and the markers' areas."""
    series, meta, size, rgb, margin, paint, sweep = moving
    rays, _, timing, light, shading = view
    background, image, ids, masks, edges, scanline_bounds, rows, visible, whole = canvas
    slots = SAMPLES if np.max(sweep) > STILL_PX else 1
    row, prepared, up = np.empty(12), np.empty((slots, len(meta), PREPARED)), np.zeros((slots, len(meta), 3))
    active, near = np.empty(len(meta), np.int64), np.empty(len(meta), np.int64)
    ray, slot, met, depth, tied = _ray_batch()
    for y in range(top, bottom):
        actives, nears, block = 0, 0, -1
        for n in range(len(meta)):
            if scanline_bounds[y, n, 0] < scanline_bounds[y, n, 1]:
                active[actives] = n
                actives += 1
                for k in range(slots):
                    offset = ((k + 0.5) / slots - 0.5) * timing[2]
                    evaluate(series, n, timing[0] + y * timing[1] + offset, _parameters(meta, paint, n), row)
                    prepare(meta[n, 0], row, size, prepared, k, n)
                    if paint[n, BOUNDS] != PLAIN:
                        up[k, n, 0], up[k, n, 1], up[k, n, 2] = row[6], row[7], row[8]
        for x in range(rows[y, 0], rows[y, 1]):
            if not edges[y, x]:
                if ids[y, x] >= PAINT_ID:
                    visible[ids[y, x] - PAINT_ID] += 1.0
                if masks[y, x]:
                    _count(masks[y, x], 1.0, whole)
                continue
            if x // SAMPLES != block:
                block = x // SAMPLES
                nears = in_block(active, actives, scanline_bounds, y, block * SAMPLES, near)
            scatter(x, y, slots, seed, rays, ray, slot)
            _cast(int(SAMPLES), ray, slot, near, nears, prepared, meta, size, margin, paint, up, tied, met, depth)
            _gather(x, y, ray, slot, prepared, meta, size, rgb, paint, up, met, depth, light, shading, background,
                    image, visible, whole)


@njit(cache=True, inline="always")
def _parameters(meta: Indices, paint: Array, n: int) -> int:
    """How many numbers of a solid's row count: all of them where its paint has to know which way is up."""
    return 12 if paint[n, BOUNDS] != PLAIN else parameters_of(meta[n, 0])


@njit(cache=True)
def _ray_batch() -> tuple[Array, Indices, Indices, Array, Array]:
    """Room for SAMPLES rays: directions, moments, what they meet, at what depth; and the margins of paint by group."""
    return (np.empty((SAMPLES, 2)), np.zeros(SAMPLES, np.int64), np.zeros((SAMPLES, 2), np.int64), np.zeros(SAMPLES),
            np.zeros(REST_GROUP + 1))


@njit(cache=True, fastmath=True)
def _cast(rays: int, ray: Array, slot: Indices, near: Indices, nears: int, prepared: Array, meta: Indices,
          size: Array, margin: Array, paint: Array, up: Array, tied: Array, met: Indices, depth: Array) -> None:
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
            if paint[n, BOUNDS] != PLAIN:
                along, across, above = local_point(meta[n, 0], prepared, slot[i], n, ray[i, 0], ray[i, 1], t, size, up)
                if not is_painted(paint, n, along, across, above):
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
            for part in range(REST_GROUP + 1):
                tied[part] = 0.0


@njit(cache=True, fastmath=True)
def _gather(x: int, y: int, ray: Array, slot: Indices, prepared: Array, meta: Indices, size: Array, rgb: Array,
            paint: Array, up: Array, met: Indices, depth: Array, light: Array, shading: float, background: Image,
            image: Image, visible: Array, whole: Array) -> None:
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
        if paint[winner, UNEVEN] > 0.0:
            along, across, above = local_point(meta[winner, 0], prepared, slot[k], winner, ray[k, 0], ray[k, 1],
                                               depth[k], size, up)
            shade *= paint_level(paint, winner, along, across, above)
        red += shade * rgb[winner, 0]
        green += shade * rgb[winner, 1]
        blue += shade * rgb[winner, 2]
    image[0, y, x] = red / SAMPLES
    image[1, y, x] = green / SAMPLES
    image[2, y, x] = blue / SAMPLES


@njit(cache=True)
def _count(mask: int, area: float, whole: Array) -> None:
    index = 0
    while mask:
        if mask & 1:
            whole[index] += area
        mask >>= 1
        index += 1
