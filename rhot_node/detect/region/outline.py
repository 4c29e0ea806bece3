"""Sort the pixels of a marker and of what surrounds it: inside, filled holes, both sides of the edge, outside.

All coordinates are chroma pixels.
"""

from __future__ import annotations

import numpy as np
from numba import njit

RING = 2  # chroma pixels around the half level that an edge may reach (lens, 2x2 chroma mean, some motion)
HOLES_MAX = 0.3  # holes (glints, noise) are filled up to this fraction of the component

# Kinds of pixels in the scratch plane `kind`.
OUTSIDE, INTERIOR, HOLE, EDGE, RIM, _REACHED = range(6)


@njit(cache=True)
def classify(region, own, mask, kind, stack):
    """Sort the pixels of `region` (x0, x1, y0, y1) into interior, filled hole, edge (in), rim (out) and outside.

    `own[n]` says whether component n belongs to the marker. Returns its area and how much of that is interior.
    """
    x0, x1, y0, y1 = region
    area = np.int64(0)
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            number = mask[row, column]
            inside = number >= 2 and own[number - 2]
            kind[row, column] = INTERIOR if inside else OUTSIDE
            area += 1 if inside else 0
    if _has_holes(region, np.sum(own), kind):
        _fill_holes(region, area, kind, stack)
    interior = area
    height, width = kind.shape
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if kind[row, column] != INTERIOR and kind[row, column] != HOLE:
                continue
            on_edge = False
            for near_y in range(max(row - 1, 0), min(row + 1, height - 1) + 1):
                for near_x in range(max(column - 1, 0), min(column + 1, width - 1) + 1):
                    if kind[near_y, near_x] == OUTSIDE or kind[near_y, near_x] == RIM:
                        on_edge = True
            if on_edge:
                interior -= kind[row, column] == INTERIOR
                kind[row, column] = EDGE
                for near_y in range(max(row - RING, y0), min(row + RING, y1) + 1):
                    for near_x in range(max(column - RING, x0), min(column + RING, x1) + 1):
                        if kind[near_y, near_x] == OUTSIDE:
                            kind[near_y, near_x] = RIM
    return area, interior


@njit(cache=True)
def _has_holes(region, pieces, kind):
    """Does the interior enclose outside? By the Euler number of `pieces` 8-connected pieces, from its 2x2 patterns."""
    x0, x1, y0, y1 = region
    quads = 0  # four times the Euler number
    for row in range(y0 - 1, y1 + 1):
        for column in range(x0 - 1, x1 + 1):
            a = row >= y0 and column >= x0 and kind[row, column] == INTERIOR
            b = row >= y0 and column < x1 and kind[row, column + 1] == INTERIOR
            c = row < y1 and column >= x0 and kind[row + 1, column] == INTERIOR
            d = row < y1 and column < x1 and kind[row + 1, column + 1] == INTERIOR
            count = a + b + c + d
            if count == 1:
                quads += 1
            elif count == 3:
                quads -= 1
            elif count == 2 and a == d:
                quads -= 2
    return quads < 4 * pieces


@njit(cache=True)
def _fill_holes(region, area, kind, stack):
    """Outside pixels that are not connected (4) to the region's border become HOLE, unless they are too many."""
    x0, x1, y0, y1 = region
    width = kind.shape[1]
    depth = 0
    for row in range(y0, y1 + 1):
        step = 1 if row in (y0, y1) else max(x1 - x0, 1)
        for column in range(x0, x1 + 1, step):
            if kind[row, column] == OUTSIDE:
                kind[row, column] = _REACHED
                stack[depth] = row * width + column
                depth += 1
    while depth > 0:
        depth -= 1
        row = stack[depth] // width
        column = stack[depth] - row * width
        for side in range(4):
            near_y = row + (side == 0) - (side == 1)
            near_x = column + (side == 2) - (side == 3)
            if y0 <= near_y <= y1 and x0 <= near_x <= x1 and kind[near_y, near_x] == OUTSIDE:
                kind[near_y, near_x] = _REACHED
                stack[depth] = near_y * width + near_x
                depth += 1
    holes = 0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            holes += kind[row, column] == OUTSIDE
    fill = HOLE if holes <= HOLES_MAX * area else OUTSIDE
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if kind[row, column] == OUTSIDE:
                kind[row, column] = fill
            elif kind[row, column] == _REACHED:
                kind[row, column] = OUTSIDE
