"""Measure one marker in a window: choose the component that belongs to the prediction, and place it to sub-pixel.

All coordinates are chroma pixels.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot_node.detect.region.coverage import PAD, SUM_COLUMNS, chroma_noise, unmix
from rhot_node.detect.region.outline import classify
from rhot_node.detect.region.position import RESULT_COLUMNS, band_center, centroid, mask_centroid

# Columns of a request: where the marker is expected, how far to look, how big and how saturated it was.
PX, PY, HALF_X, HALF_Y, SIGMA, AREA_REF, LEVEL_REF, IS_BAND = range(8)
REQUEST_COLUMNS = 8
# Columns of a result, after those of rhot_node.detect.region.position.
# The paint: how many pixels are all paint, and its mean luma and chroma (minus 128).
LEVEL, AT_BORDER, FRAGMENTS, COST, RIVAL_COST, NOISE_SUM, NOISE_COUNT = range(RESULT_COLUMNS, RESULT_COLUMNS + 7)
PAINT_PIXELS, PAINT_Y, PAINT_CB, PAINT_CR = range(RESULT_COLUMNS + 7, RESULT_COLUMNS + 11)
SLOPE_X, SLOPE_Y = range(RESULT_COLUMNS + 11, RESULT_COLUMNS + 13)  # of the paint's chroma, of itself per px
MEASURE_COLUMNS = RESULT_COLUMNS + 13

ATTEMPTS = 5  # windows and levels tried before the marker counts as lost
LEVEL_TOLERANCE = 0.08  # a local level further off than this from the assumed one is used for another attempt
SHRINK_SIGMA = 0.6  # of the log area, towards smaller: hidden markers are common
GROW_SIGMA = 0.35  # and towards larger: markers do not grow in one frame
SEAM = 16  # chroma pixels; a component this large without any interior is a seam where two other colours mix
FRAGMENT_REACH = 1.0  # diameters from the prediction within which pieces of a marker are put together
FRAGMENT_AREA = 1.2  # of the expected area: more is another object


class Scratch:
    """Planes and tables that `measure` works in, for chroma planes of one size."""

    def __init__(self, height: int, width: int) -> None:
        self.mask = np.zeros((height, width), dtype=np.int16)
        self.kind = np.zeros((height, width), dtype=np.uint8)
        self.colour = np.zeros((height, width, 3), dtype=np.float32)
        self.sums = np.zeros((height + 1, width + 1, SUM_COLUMNS))
        self.coverage = np.zeros((height, width), dtype=np.float32)
        self.gain = np.zeros((height, width), dtype=np.float32)
        self.stack = np.zeros(height * width, dtype=np.int32)
        self.components = np.zeros((COMPONENTS_MAX, COMPONENT_COLUMNS))
        self.own = np.zeros(COMPONENTS_MAX, dtype=np.bool_)

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """In the order `measure` takes them."""
        return (self.mask, self.kind, self.colour, self.sums, self.coverage, self.gain, self.stack, self.components,
                self.own)


@njit(cache=True)
def measure(y, u, v, sector, label, direction, request, scratch, careful, result):
    """Fill `result` (MEASURE_COLUMNS) for the marker `label`; False when the window does not show it.

    `careful` False: by the pixels that are more than half paint, without partial coverage. The columns of the paint,
    its noise and shading, and of a band's sag are then 0.
    """
    mask, _kind, _colour, _sums, _coverage, _gain, stack, components, own = scratch
    level = request[LEVEL_REF]
    half_x, half_y = request[HALF_X], request[HALF_Y]
    own[:] = False
    found = False
    for attempt in range(ATTEMPTS):
        window = _clamp(request[PX] - half_x, request[PX] + half_x, request[PY] - half_y, request[PY] + half_y, u)
        if window[0] > window[1] or window[2] > window[3]:
            return False
        count = segment(u, v, sector, label, direction, level, window, mask, stack, components)
        if count == 0:
            if attempt > 0:
                return False
            level *= 0.6  # a lamp went out?
            continue
        best = _choose(components, count, request, own, result)
        found = True
        here = interior_level(u, v, direction, components[best], best, mask)
        if here > 0.0 and abs(here / level - 1.0) > LEVEL_TOLERANCE:
            level = here
        elif _cut_by_window(components[best], window, u):
            half_x = half_x + 0.5 * (window[1] - window[0] + 1)
            half_y = half_y + 0.5 * (window[3] - window[2] + 1)
        else:
            break
        if attempt + 1 < ATTEMPTS:
            found = False
    if not found:
        return False
    if careful:
        return _place(y, u, v, window, count, level, request, scratch, result)
    if here == 0.0 and components[best, AREA] >= SEAM:
        return False
    result[:LEVEL] = result[PAINT_PIXELS:] = result[NOISE_SUM] = result[NOISE_COUNT] = 0.0
    result[LEVEL] = level
    result[AT_BORDER] = mask_centroid(mask, components, own, count, result)
    return True


@njit(cache=True)
def _place(y, u, v, window, count, level, request, scratch, result):
    """Coverage, position and noise of the components marked in `own`."""
    mask, kind, colour, sums, coverage, gain, stack, components, own = scratch
    x0 = y0 = 1e9
    x1 = y1 = -1.0
    for number in range(count):
        if own[number]:
            x0, x1 = min(x0, components[number, X_MIN]), max(x1, components[number, X_MAX])
            y0, y1 = min(y0, components[number, Y_MIN]), max(y1, components[number, Y_MAX])
    region = _clamp(x0 - PAD, x1 + PAD, y0 - PAD, y1 + PAD, u)
    _clear_beyond(region, window, mask)
    area, interior = classify(region, own, mask, kind, stack)
    if interior == 0 and area >= SEAM:
        return False
    paint = np.empty((3, 3))
    unmix(y, u, v, region, level, kind, colour, sums, coverage, gain, paint)
    _note_paint(paint, interior, result)
    if not centroid(region, coverage, gain, result):
        return False
    at_border = x0 == 0 or y0 == 0 or x1 == u.shape[1] - 1 or y1 == u.shape[0] - 1
    if request[IS_BAND] > 0.0 and not at_border:
        band_center(region, coverage, gain, result)
    result[LEVEL] = level
    result[AT_BORDER] = 1.0 if at_border else 0.0
    result[NOISE_SUM], result[NOISE_COUNT] = chroma_noise(u, v, region, kind)
    return True


@njit(cache=True)
def _note_paint(paint, interior, result):
    luma, cb, cr = paint[0, 0], paint[1, 0] - 128.0, paint[2, 0] - 128.0
    result[PAINT_PIXELS], result[PAINT_Y], result[PAINT_CB], result[PAINT_CR] = interior, luma, cb, cr
    square = max(cb * cb + cr * cr, 1.0)
    result[SLOPE_X] = (cb * paint[1, 1] + cr * paint[2, 1]) / square
    result[SLOPE_Y] = (cb * paint[1, 2] + cr * paint[2, 2]) / square


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
    return ((component[X_MIN] == window[0] and window[0] > 0)
            or (component[X_MAX] == window[1] and window[1] < width - 1)
            or (component[Y_MIN] == window[2] and window[2] > 0)
            or (component[Y_MAX] == window[3] and window[3] < height - 1))


@njit(cache=True)
def _cost(component, request):
    """How far a component is from the hypothesis, in squared standard deviations of motion and size."""
    dx = component[SUM_X] / component[AREA] - request[PX]
    dy = component[SUM_Y] / component[AREA] - request[PY]
    size = np.log(component[AREA] / request[AREA_REF])
    size /= GROW_SIGMA if size > 0.0 else SHRINK_SIGMA
    return (dx * dx + dy * dy) / request[SIGMA] ** 2 + size * size


@njit(cache=True)
def _choose(components, count, request, own, result):
    """Mark the component nearest to the hypothesis, and its fragments, in `own`; return the former.

    Pieces of a marker that a finger crosses count as one, as long as they are together no larger than the marker was.
    """
    best = 0
    best_cost = np.inf
    for number in range(count):
        own[number] = False
        cost = _cost(components[number], request)
        if cost < best_cost:
            best, best_cost = number, cost
    own[best] = True
    total = components[best, AREA]
    reach = FRAGMENT_REACH * np.sqrt(4.0 / np.pi * request[AREA_REF])
    fragments = 1
    rival_cost = np.inf
    for number in range(count):
        if number == best:
            continue
        component = components[number]
        away = np.hypot(component[SUM_X] / component[AREA] - request[PX],
                        component[SUM_Y] / component[AREA] - request[PY])
        if away < reach and total + component[AREA] <= FRAGMENT_AREA * request[AREA_REF]:
            own[number] = True
            total += component[AREA]
            fragments += 1
        else:
            rival_cost = min(rival_cost, _cost(component, request))
    result[COST], result[RIVAL_COST], result[FRAGMENTS] = best_cost, rival_cost, fragments
    return best


# -- the window of one tracked marker ----------------------------------------------------------------------------------

COMPONENTS_MAX = 64
SPECK = 3  # chroma pixels; smaller components are noise

# Columns of a component row. SUM_X and SUM_Y are sums over its pixels.
AREA, SUM_X, SUM_Y, X_MIN, X_MAX, Y_MIN, Y_MAX = range(7)
COMPONENT_COLUMNS = 7

_NEW = 1  # mask value of a pixel not yet in a component; component n is written as n + 2


@njit(cache=True)
def segment(u, v, sector, label, direction, level, window, mask, stack, components):
    """Label the components of `label` in `window` (x0, x1, y0, y1, inclusive); return how many.

    A pixel belongs when its hue is in the marker's sector and its chroma, projected on `direction` (cb, cr), reaches
    half of `level`. `mask` becomes 0 outside components and n + 2 in component n.
    """
    x0, x1, y0, y1 = window
    threshold = 0.5 * level
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            cb = np.float64(u[row, column]) - 128.0
            cr = np.float64(v[row, column]) - 128.0
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
            _flood(row, column, window, mask, stack, components, count)
            if components[count, AREA] >= SPECK:
                count += 1
            else:
                _erase(components[count], mask, count)
    return count


@njit(cache=True)
def _flood(row, column, window, mask, stack, components, number):
    """Take the 8-connected component of (row, column) into `components[number]`."""
    x0, x1, y0, y1 = window
    width = mask.shape[1]
    component = components[number]
    component[:] = 0.0
    component[X_MIN] = component[X_MAX] = column
    component[Y_MIN] = component[Y_MAX] = row
    mask[row, column] = number + 2
    stack[0] = row * width + column
    depth = 1
    while depth > 0:
        depth -= 1
        here_y = stack[depth] // width
        here_x = stack[depth] - here_y * width
        component[AREA] += 1.0
        component[SUM_X] += here_x
        component[SUM_Y] += here_y
        component[X_MIN] = min(component[X_MIN], here_x)
        component[X_MAX] = max(component[X_MAX], here_x)
        component[Y_MIN] = min(component[Y_MIN], here_y)
        component[Y_MAX] = max(component[Y_MAX], here_y)
        for near_y in range(max(here_y - 1, y0), min(here_y + 1, y1) + 1):
            for near_x in range(max(here_x - 1, x0), min(here_x + 1, x1) + 1):
                if mask[near_y, near_x] == _NEW:
                    mask[near_y, near_x] = number + 2
                    stack[depth] = near_y * width + near_x
                    depth += 1


@njit(cache=True)
def _erase(component, mask, number):
    for row in range(int(component[Y_MIN]), int(component[Y_MAX]) + 1):
        for column in range(int(component[X_MIN]), int(component[X_MAX]) + 1):
            if mask[row, column] == number + 2:
                mask[row, column] = 0


@njit(cache=True)
def interior_level(u, v, direction, component, number, mask):
    """Mean projected chroma of the component's pixels whose four neighbours belong to it too; 0 when it has none."""
    total = 0.0
    count = 0
    own = number + 2
    for row in range(int(component[Y_MIN]) + 1, int(component[Y_MAX])):
        for column in range(int(component[X_MIN]) + 1, int(component[X_MAX])):
            if (mask[row, column] == own and mask[row - 1, column] == own and mask[row + 1, column] == own
                    and mask[row, column - 1] == own and mask[row, column + 1] == own):
                total += ((np.float64(u[row, column]) - 128.0) * direction[0]
                          + (np.float64(v[row, column]) - 128.0) * direction[1])
                count += 1
    return total / count if count > 0 else 0.0
