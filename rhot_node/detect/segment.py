"""Measure one marker in a window: choose the component that belongs to the prediction, and place it to sub-pixel.

All coordinates are chroma pixels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.band import band_center
from rhot_node.detect.coverage import (
    PAD,
    Areas,
    Scratch,
    centroid,
    chroma_noise,
    classify,
    mask_centroid,
    unmix,
)
from rhot_node.detect.follow import learn_noise
from rhot_node.detect.image import GREY, table_of
from rhot_node.detect.track import GROWTH_MAX

ATTEMPTS = 5  # windows and levels tried before the marker counts as lost
LEVEL_TOLERANCE = 0.08  # a local level further off than this from the assumed one is used for another attempt
SEAM = 16  # chroma pixels; a component this large without any interior is a seam where two other colours mix
SIZE_SIGMA = 0.35  # of the log area from one frame to the next
FRAGMENT_REACH = 1.0  # diameters from the prediction within which pieces of a marker are put together


COMPONENTS_MAX = 64
SPECK = 3  # chroma pixels; smaller components are noise


class Paint(NamedTuple):
    """The colour to measure: labels of chroma pairs by hue alone (256, 256), the marker's label, and the unit vector of
    its hue (cb, cr)."""

    sector: NDArray[np.uint8]
    label: int
    direction: NDArray[np.float64]


class Component(NamedTuple):
    """A connected piece: area, sums of places over its pixels, and its box."""

    area: float
    sum_x: float
    sum_y: float
    x_min: float
    x_max: float
    y_min: float
    y_max: float


def scratch(height: int, width: int) -> Scratch:
    """To measure in chroma planes of this size."""
    size = height, width
    return Scratch(np.zeros(size, np.int16), np.zeros(size, np.uint8), np.zeros((*size, 3), np.float32),
                   Areas(np.zeros((height + 1, width + 1, 6)), np.zeros((height + 1, width + 1, 10))),
                   np.zeros(size, np.float32), np.zeros(size, np.float32),
                   np.zeros(height * width, np.int32), np.zeros(COMPONENTS_MAX, table_of(Component)),
                   np.zeros(COMPONENTS_MAX, np.bool_))


@njit(cache=True)
def measure(image, paint, request, scratch, careful, noises, measured):
    """Fill `measured` (1,) for the marker of a `paint`, and learn the chroma noise from that.

    False when the window of the `request` (1,) does not show it.

    `careful` False: by the pixels that are more than half paint, without partial coverage. The paint's
    shading and a band's sag are then 0, its colour is not set, and no noise is learnt.
    """
    expected, result = request[0], measured[0]
    components, own = scratch.components, scratch.own
    level = expected.level
    half_x, half_y = expected.half_x, expected.half_y
    own[:] = False
    found = False
    for attempt in range(ATTEMPTS):
        window = _clamp(expected.x - half_x, expected.x + half_x, expected.y - half_y, expected.y + half_y, image.u)
        if window[0] > window[1] or window[2] > window[3]:
            return False
        count = segment(image, paint, level, window, scratch)
        if count == 0:
            if attempt > 0:
                return False
            level *= 0.5  # a lamp went out?
            continue
        best = _choose(components, count, expected, own, result)
        found = True
        here = interior_level(image, paint.direction, components[best], best, scratch.mask)
        if here > 0.0 and abs(here / level - 1.0) > LEVEL_TOLERANCE:
            level = here
        elif _cut_by_window(components[best], window, image.u):
            half_x = half_x + 0.5 * (window[1] - window[0] + 1)
            half_y = half_y + 0.5 * (window[3] - window[2] + 1)
        else:
            break
        if attempt + 1 < ATTEMPTS:
            found = False
    if not found or (here == 0.0 and components[best].area >= SEAM):
        return False
    result.level, result.careful = level, careful
    if careful:
        return _place(image, window, count, expected, scratch, noises, result)
    result.v_xx = result.v_xy = result.v_yy = result.sag = result.sag_variance = result.fit = result.round = 0.0
    result.soft = result.paint_pixels = result.slope_x = result.slope_y = 0.0
    result.at_border = mask_centroid(scratch.mask, components, own, count, result)
    return True


@njit(cache=True)
def _place(image, window, count, request, scratch, noises, result):
    """Coverage, position and noise of the components marked in `own`."""
    u, v, own, kind = image.u, image.v, scratch.own, scratch.kind
    x0 = y0 = 1e9
    x1 = y1 = -1.0
    for number in range(count):
        if own[number]:
            part = scratch.components[number]
            x0, x1 = min(x0, part.x_min), max(x1, part.x_max)
            y0, y1 = min(y0, part.y_min), max(y1, part.y_max)
    region = _clamp(x0 - PAD, x1 + PAD, y0 - PAD, y1 + PAD, u)
    _clear_beyond(region, window, scratch.mask)
    interior = classify(region, own, scratch.mask, kind, scratch.stack)
    paint = np.empty((3, 3))
    unmix(image, region, result.level, scratch, paint)
    _note_paint(paint, interior, result)
    if not centroid(region, scratch.coverage, scratch.gain, result):
        return False
    at_border = x0 == 0 or y0 == 0 or x1 == u.shape[1] - 1 or y1 == u.shape[0] - 1
    if request.band > 0.0 and not at_border:
        band_center(region, scratch.coverage, scratch.gain, result)
    result.at_border = 1.0 if at_border else 0.0
    total, blocks = chroma_noise(u, v, region, kind)
    learn_noise(noises, total, blocks)
    return True


@njit(cache=True)
def _note_paint(paint, interior, result):
    cb, cr = paint[1, 0] - GREY, paint[2, 0] - GREY
    result.paint_pixels, result.paint_y, result.paint_cb, result.paint_cr = interior, paint[0, 0], cb, cr
    square = max(cb * cb + cr * cr, 1.0)
    result.slope_x = (cb * paint[1, 1] + cr * paint[2, 1]) / square
    result.slope_y = (cb * paint[1, 2] + cr * paint[2, 2]) / square


@njit(cache=True)
def _clamp(x0, x1, y0, y1, plane):
    height, width = plane.shape
    return (max(int(np.floor(x0)), 0), min(int(np.ceil(x1)), width - 1),
            max(int(np.floor(y0)), 0), min(int(np.ceil(y1)), height - 1))


@njit(cache=True)
def _clear_beyond(region, window, mask):
    """The mask outside the window is from some other marker: nothing of this one is there."""
    for row in range(region[2], region[3] + 1):
        for column in range(region[0], region[1] + 1):
            if row < window[2] or row > window[3] or column < window[0] or column > window[1]:
                mask[row, column] = 0


@njit(cache=True)
def _cut_by_window(component, window, plane):
    """Does the component reach a side of the window that is not the frame's border?"""
    height, width = plane.shape
    return ((component.x_min == window[0] and window[0] > 0)
            or (component.x_max == window[1] and window[1] < width - 1)
            or (component.y_min == window[2] and window[2] > 0)
            or (component.y_max == window[3] and window[3] < height - 1))


@njit(cache=True)
def _cost(component, request):
    """How far a component is from the hypothesis, in squared standard deviations of motion and size."""
    dx = component.sum_x / component.area - request.x
    dy = component.sum_y / component.area - request.y
    size = np.log(component.area / request.area) / SIZE_SIGMA
    return (dx * dx + dy * dy) / request.sigma ** 2 + size * size


@njit(cache=True)
def _choose(components, count, request, own, result):
    """Mark the component nearest to the hypothesis, and its fragments, in `own`; return the former.

    Pieces of a marker that a finger crosses count as one: those with which the area is nearer to that of the whole, by
    its logarithm, than without, and no larger than the marker may have become since the last frame. Anything else of
    its colour is another object.
    """
    best = 0
    best_cost = np.inf
    for number in range(count):
        own[number] = False
        cost = _cost(components[number], request)
        if cost < best_cost:
            best, best_cost = number, cost
    own[best] = True
    total = components[best].area
    largest = request.area * np.exp(GROWTH_MAX)
    reach = FRAGMENT_REACH * 2.0 * np.sqrt(request.area / np.pi)
    fragments = 1
    rival_cost = np.inf
    for number in range(count):
        if number == best:
            continue
        component = components[number]
        away = np.hypot(component.sum_x / component.area - request.x,
                        component.sum_y / component.area - request.y)
        joined = total + component.area
        if away < reach and joined < min(largest, request.area ** 2 / total):
            own[number] = True
            total = joined
            fragments += 1
        else:
            rival_cost = min(rival_cost, _cost(component, request))
    result.cost, result.rival_cost, result.fragments = best_cost, rival_cost, fragments
    return best


# -- the window of one tracked marker ----------------------------------------------------------------------------------

_NEW = 1  # mask value of a pixel not yet in a component; component n is written as n + 2


@njit(cache=True)
def segment(image, paint, level, window, scratch):
    """Label the components of a `paint` in `window` (x0, x1, y0, y1, inclusive); return how many.

    A pixel belongs when its hue is in the marker's sector and its chroma, projected on the hue's direction, reaches
    half of `level`. `scratch.mask` becomes 0 outside components and n + 2 in component n.
    """
    u, v, mask, components = image.u, image.v, scratch.mask, scratch.components
    sector, label, direction = paint
    x0, x1, y0, y1 = window
    threshold = 0.5 * level
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            cb = np.float64(u[row, column]) - GREY
            cr = np.float64(v[row, column]) - GREY
            belongs = (sector[u[row, column], v[row, column]] == label
                       and cb * direction[0] + cr * direction[1] >= threshold)
            mask[row, column] = _NEW if belongs else 0
    count = np.int64(0)
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if mask[row, column] != _NEW:
                continue
            if count == components.shape[0]:
                mask[row, column] = 0
                continue
            _flood(row, column, window, mask, scratch.stack, components[count], count)
            if components[count].area >= SPECK:
                count += 1
            else:
                _erase(components[count], mask, count)
    return count


@njit(cache=True)
def _flood(row, column, window, mask, stack, component, number):
    """Take the 8-connected component of (row, column) into `component`, of that number."""
    x0, x1, y0, y1 = window
    width = mask.shape[1]
    component.area = component.sum_x = component.sum_y = 0.0
    component.x_min = component.x_max = column
    component.y_min = component.y_max = row
    mask[row, column] = number + 2
    stack[0] = row * width + column
    depth = 1
    while depth > 0:
        depth -= 1
        here_y = stack[depth] // width
        here_x = stack[depth] - here_y * width
        component.area += 1.0
        component.sum_x += here_x
        component.sum_y += here_y
        component.x_min = min(component.x_min, here_x)
        component.x_max = max(component.x_max, here_x)
        component.y_min = min(component.y_min, here_y)
        component.y_max = max(component.y_max, here_y)
        for near_y in range(max(here_y - 1, y0), min(here_y + 1, y1) + 1):
            for near_x in range(max(here_x - 1, x0), min(here_x + 1, x1) + 1):
                if mask[near_y, near_x] == _NEW:
                    mask[near_y, near_x] = number + 2
                    stack[depth] = near_y * width + near_x
                    depth += 1


@njit(cache=True)
def _erase(component, mask, number):
    for row in range(int(component.y_min), int(component.y_max) + 1):
        for column in range(int(component.x_min), int(component.x_max) + 1):
            if mask[row, column] == number + 2:
                mask[row, column] = 0


@njit(cache=True)
def interior_level(image, direction, component, number, mask):
    """Mean projected chroma of the component's pixels whose four neighbours belong to it too; 0 when it has none."""
    u, v = image.u, image.v
    total = 0.0
    count = 0
    own = number + 2
    for row in range(int(component.y_min) + 1, int(component.y_max)):
        for column in range(int(component.x_min) + 1, int(component.x_max)):
            if (mask[row, column] == own and mask[row - 1, column] == own and mask[row + 1, column] == own
                    and mask[row, column - 1] == own and mask[row, column + 1] == own):
                total += ((np.float64(u[row, column]) - GREY) * direction[0]
                          + (np.float64(v[row, column]) - GREY) * direction[1])
                count += 1
    return total / count if count > 0 else 0.0
