"""The window of one tracked marker: connected components of its hue at half its local chroma level.

All coordinates are chroma pixels. The full-size `mask` is scratch: only the window is written.
"""

from __future__ import annotations

import numpy as np
from numba import njit

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
    count = 0
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
