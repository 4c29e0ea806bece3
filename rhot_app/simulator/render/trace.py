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

from rhot_app.simulator.render.body import BOUNDS, GROUP, KIND, MARKER, PARAMETERS, PLAIN, REST_GROUP, UNEVEN, Solids
from rhot_app.simulator.render.exposure_samples import STILL_PX, evaluate
from rhot_app.simulator.render.paint import is_painted, local_point, paint_level
from rhot_app.simulator.render.painter import LitImage
from rhot_app.simulator.render.raycast import NO_HIT, PREPARED, hit, lambert, prepare
from rhot_app.simulator.render.rays import SAMPLES, scatter
from rhot_app.simulator.render.scanline_bounds import in_block, span

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Image = NDArray[np.float32]

SKIN_ID, PAINT_ID = 1, 20
"""What a pixel shows: 0 background, then skin of the hand and of the forearm (its far end sweeps far), tape and bands
in other colours than a marker's, then markers."""


@njit(cache=True, inline="always")
def id_of(what: Indices, n: int) -> int:
    """What a pixel shows where solid `n` is: `Solids.what` (N, 3)."""
    if what[n, MARKER] >= 0:
        return PAINT_ID + what[n, MARKER]
    return SKIN_ID + what[n, KIND] + (2 if what[n, GROUP] == REST_GROUP else 0)


@njit(cache=True)
def reach_by_id(what: Indices, sweep: Array) -> Indices:
    """(128, 2) px around a change of id, by id, that the exposure may sweep."""
    reach = np.zeros((128, 2), np.int64)
    for n in range(len(sweep)):
        code = id_of(what, n)
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


class Moving(NamedTuple):
    """N `solids` during one frame. `series` (N, PARAMETERS, NODES): their parameters in the camera's frame. `sweep`
    (N, 2): px travelled in x and y during the exposure."""

    series: Array
    solids: Solids
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


def canvas(lit: LitImage, solids: int, markers: int) -> Canvas:
    """A canvas of the image."""
    size = height, _ = lit.image.shape[1:]
    return Canvas(lit.background, lit.image, np.zeros(size, np.int8), np.zeros(size, np.int64),
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
    mark_edges(canvas.ids, canvas.edges, canvas.rows, top, bottom, reach_by_id(moving.solids.what, moving.sweep))
    _trace_edges(moving, view, canvas, top, bottom, seed)
    left, right = canvas.rows[top, 0], canvas.rows[top, 1]
    for y in range(top, bottom):
        if canvas.rows[y, 0] < canvas.rows[y, 1]:
            left, right = min(left, canvas.rows[y, 0]), max(right, canvas.rows[y, 1])
    return left, top, right, bottom


class Batch(NamedTuple):
    """R rays: directions `ray` (R, 2) and moments `slot` (R,), what each has `met` (R, 2) - a solid or -1, and a bit
    mask of all markers on the ray, hidden or not - and at what `depth` (R,) m; `tied`: margins of paint by group, m."""

    ray: Array
    slot: Indices
    met: Indices
    depth: Array
    tied: Array


@njit(cache=True)
def _empty_batch() -> Batch:
    """Room for a block of SAMPLES pixels that are all sampled again."""
    rays = SAMPLES * SAMPLES
    return Batch(np.empty((rays, 2)), np.zeros(rays, np.int64), np.zeros((rays, 2), np.int64), np.zeros(rays),
                 np.zeros(REST_GROUP + 1))


@njit(cache=True, fastmath=True, inline="always")
def _trace_centres(moving: Moving, view: View, canvas: Canvas) -> tuple[int, int]:
    """First pass: one ray per pixel. Returns the range of rows that the hand may touch."""
    series, solids, sweep = moving
    what, size, rgb, _, paint = solids
    rays, intrinsics, timing, light, shading = view
    background, image, ids, masks, _, scanline_bounds, rows, _, _ = canvas
    height, width = ids.shape
    count, batch = len(sweep), _empty_batch()
    ray, _, met, depth, _ = batch
    row, prepared = np.empty(PARAMETERS), np.empty((1, count, PREPARED))
    active, near = np.empty(count, np.int64), np.empty(count, np.int64)
    top, bottom = height, 0
    for y in range(height):
        left, right, actives = width, 0, 0
        for n in range(count):
            evaluate(series, n, timing[0] + y * timing[1], row)
            x0, x1 = span(what[n, KIND], row, size, sweep, n, intrinsics, y, width)
            scanline_bounds[y, n, 0], scanline_bounds[y, n, 1] = x0, x1
            if x0 < x1:
                prepare(what[n, KIND], row, size, prepared, 0, n)
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
            _cast(pixels, batch, near, nears, prepared, solids)
            for i in range(pixels):
                x, winner = start + i, met[i, 0]
                masks[y, x] = met[i, 1]
                if winner < 0:
                    for c in range(3):
                        image[c, y, x] = background[c, y, x]
                    continue
                ids[y, x] = id_of(what, winner)
                shade = _shade(what[winner, KIND], prepared, 0, winner, ray[i, 0], ray[i, 1], depth[i], paint, light,
                               shading)
                for c in range(3):
                    image[c, y, x] = shade * rgb[winner, c]
    return top, bottom


@njit(cache=True, fastmath=True, inline="always")
def _trace_edges(moving: Moving, view: View, canvas: Canvas, top: int, bottom: int, seed: int) -> None:
    """Second pass: the marked pixels again, by 16 rays over area and exposure; and the markers' areas."""
    series, solids, sweep = moving
    what, size, _, _, _ = solids
    rays, _, timing, _, _ = view
    _, _, ids, masks, edges, scanline_bounds, rows, visible, whole = canvas
    slots, count = SAMPLES if np.max(sweep) > STILL_PX else 1, len(sweep)
    row, prepared, batch = np.empty(PARAMETERS), np.empty((slots, count, PREPARED)), _empty_batch()
    ray, slot = batch.ray, batch.slot
    active, near, columns = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(SAMPLES, np.int64)
    for y in range(top, bottom):
        actives = 0
        for n in range(count):
            if scanline_bounds[y, n, 0] < scanline_bounds[y, n, 1]:
                active[actives] = n
                actives += 1
                for k in range(slots):
                    offset = ((k + 0.5) / slots - 0.5) * timing[2]
                    evaluate(series, n, timing[0] + y * timing[1] + offset, row)
                    prepare(what[n, KIND], row, size, prepared, k, n)
        for start in range(rows[y, 0] // SAMPLES * SAMPLES, rows[y, 1], SAMPLES):
            pixels = 0
            for x in range(max(start, rows[y, 0]), min(start + SAMPLES, rows[y, 1])):
                if edges[y, x]:
                    scatter(x, y, slots, seed, rays, ray, slot, pixels * SAMPLES)
                    columns[pixels] = x
                    pixels += 1
                    continue
                if ids[y, x] >= PAINT_ID:
                    visible[ids[y, x] - PAINT_ID] += 1.0
                if masks[y, x]:
                    _count(masks[y, x], 1.0, whole)
            if pixels:
                nears = in_block(active, actives, scanline_bounds, y, start, near)
                _cast(pixels * SAMPLES, batch, near, nears, prepared, solids)
                _gather(y, columns, pixels, batch, prepared, solids, view, canvas)


@njit(cache=True, fastmath=True)
def _cast(rays: int, batch: Batch, near: Indices, nears: int, prepared: Array, solids: Solids) -> None:
    """What each of the first `rays` rays meets of the first `nears` solids of `near`. Many rays in one call, because
    every call counts references of all its arrays, as those of `_gather` do."""
    ray, slot, met, depth, tied = batch
    what, _, _, margin, paint = solids
    for i in range(rays):
        winner, mask, nearest = -1, 0, NO_HIT
        for k in range(nears):
            n = near[k]
            t = hit(what[n, KIND], prepared, slot[i], n, ray[i, 0], ray[i, 1])
            if t == NO_HIT:
                continue
            if paint[n, BOUNDS] != PLAIN:
                along, across, above = local_point(what[n, KIND], prepared, slot[i], n, ray[i, 0], ray[i, 1], t)
                if not is_painted(paint, n, along, across, above):
                    continue
            rank = t
            if what[n, MARKER] >= 0:  # markers come first among the solids
                mask |= 1 << what[n, MARKER]
                tied[what[n, GROUP]] = margin[n]
            elif mask:
                rank += tied[what[n, GROUP]]
            if rank < nearest:
                winner, nearest = n, rank
                depth[i] = t
        met[i, 0], met[i, 1] = winner, mask
        if mask:
            for part in range(REST_GROUP + 1):
                tied[part] = 0.0


@njit(cache=True, fastmath=True, inline="always")
def _shade(kind: int, prepared: Array, slot: int, n: int, x: float, y: float, t: float, paint: Array,
           light: Array, shading: float) -> float:
    """How bright solid `n` is at depth `t` on the ray (x, y, 1): 1 where it faces the lamp and its paint is even."""
    shade = 1.0 - shading * (1.0 - lambert(kind, prepared, slot, n, x, y, t, light))
    if paint[n, UNEVEN] > 0.0:
        along, across, above = local_point(kind, prepared, slot, n, x, y, t)
        shade *= paint_level(paint, n, along, across, above)
    return shade


@njit(cache=True, fastmath=True)
def _gather(y: int, columns: Indices, pixels: int, batch: Batch, prepared: Array, solids: Solids, view: View,
            canvas: Canvas) -> None:
    """The mean colours of the first `pixels` of a row's `columns`, of 16 rays each, and their share in the markers'
    areas."""
    ray, slot, met, depth, _ = batch
    what, _, rgb, _, paint = solids
    _, _, _, light, shading = view
    background, image, _, _, _, _, _, visible, whole = canvas
    for i in range(pixels):
        x = columns[i]
        red, green, blue = 0.0, 0.0, 0.0
        for k in range(i * SAMPLES, (i + 1) * SAMPLES):
            n, mask = met[k, 0], met[k, 1]
            if mask:
                _count(mask, 1.0 / SAMPLES, whole)
            if n < 0:
                red += background[0, y, x]
                green += background[1, y, x]
                blue += background[2, y, x]
                continue
            if what[n, MARKER] >= 0:
                visible[what[n, MARKER]] += 1.0 / SAMPLES
            shade = _shade(what[n, KIND], prepared, slot[k], n, ray[k, 0], ray[k, 1], depth[k], paint, light, shading)
            red += shade * rgb[n, 0]
            green += shade * rgb[n, 1]
            blue += shade * rgb[n, 2]
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
