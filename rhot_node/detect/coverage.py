"""How much of each chroma pixel the marker's paint covers, by unmixing paint and surroundings at the marker's edge.

An edge pixel's chroma is c = a M + (1 - a) B. The paint M is the mean of the marker's own interior nearby, so that
shading and lamp changes cancel; the surroundings B are the mean just outside, so that skin on one side and cloth, or
another marker, on the other do not shift the edge. Then a = (c - B).(M - B) / |M - B|^2: an unbiased edge wherever
the half level is, and no hue gate at the edge. All coordinates are chroma pixels.
"""

from __future__ import annotations

import numpy as np
from numba import njit

RING = 2  # chroma pixels around the half level that an edge may reach (lens, 2x2 chroma mean, some motion)
REACH = 3  # half-width of the neighbourhood that paint and surroundings are averaged over
PAD = RING + REACH  # region around the component that coverage needs
CLIP = 0.3  # coverage is clipped to -CLIP..1 + CLIP: noise must stay unbiased, glints must not count
HOLES_MAX = 0.3  # holes (glints, noise) are filled up to this fraction of the component
CONTRAST_MIN = 0.3  # of the marker's level; with less between paint and surroundings an edge cannot be unmixed

# Kinds of pixels in the scratch plane `kind`.
OUTSIDE, INTERIOR, HOLE, EDGE, RIM, _REACHED = range(6)


@njit(cache=True)
def classify(region, own, mask, kind, stack):  # type: ignore[no-untyped-def]
    """Sort the pixels of `region` (x0, x1, y0, y1) into interior, filled hole, edge (in), rim (out) and outside.

    `own[n]` says whether component n belongs to the marker.
    """
    x0, x1, y0, y1 = region
    area = 0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            number = mask[row, column]
            inside = number >= 2 and own[number - 2]
            kind[row, column] = INTERIOR if inside else OUTSIDE
            area += 1 if inside else 0
    _fill_holes(region, area, kind, stack)
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
                kind[row, column] = EDGE
                for near_y in range(max(row - RING, y0), min(row + RING, y1) + 1):
                    for near_x in range(max(column - RING, x0), min(column + RING, x1) + 1):
                        if kind[near_y, near_x] == OUTSIDE:
                            kind[near_y, near_x] = RIM


@njit(cache=True)
def _fill_holes(region, area, kind, stack):  # type: ignore[no-untyped-def]
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


@njit(cache=True)
def unmix(u, v, region, level, kind, coverage, gain):  # type: ignore[no-untyped-def]
    """Write `coverage` and its noise `gain` (d coverage / d chroma, 1 / grey level; 0 where fixed) over `region`."""
    x0, x1, y0, y1 = region
    paint_u, paint_v, around_u, around_v = _regional_means(u, v, region, kind)
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            code = kind[row, column]
            gain[row, column] = 0.0
            if code == OUTSIDE:
                coverage[row, column] = 0.0
                continue
            if code == INTERIOR or code == HOLE:
                coverage[row, column] = 1.0
                continue
            m_u = m_v = b_u = b_v = 0.0
            m_n = b_n = 0
            for near_y in range(max(row - REACH, y0), min(row + REACH, y1) + 1):
                for near_x in range(max(column - REACH, x0), min(column + REACH, x1) + 1):
                    near = kind[near_y, near_x]
                    if near == INTERIOR:
                        m_u += u[near_y, near_x]
                        m_v += v[near_y, near_x]
                        m_n += 1
                    elif near == OUTSIDE:
                        b_u += u[near_y, near_x]
                        b_v += v[near_y, near_x]
                        b_n += 1
            m_u, m_v = (m_u / m_n, m_v / m_n) if m_n > 0 else (paint_u, paint_v)
            b_u, b_v = (b_u / b_n, b_v / b_n) if b_n > 0 else (around_u, around_v)
            span = (m_u - b_u) ** 2 + (m_v - b_v) ** 2
            if span < (CONTRAST_MIN * level) ** 2:
                coverage[row, column] = 1.0 if code == EDGE else 0.0
                continue
            value = ((u[row, column] - b_u) * (m_u - b_u) + (v[row, column] - b_v) * (m_v - b_v)) / span
            coverage[row, column] = min(max(value, -CLIP), 1.0 + CLIP)
            gain[row, column] = 1.0 / np.sqrt(span)


@njit(cache=True)
def _regional_means(u, v, region, kind):  # type: ignore[no-untyped-def]
    """Mean chroma of the paint (of its most saturated edge pixels when it has no interior) and of the surroundings."""
    x0, x1, y0, y1 = region
    sums = np.zeros((3, 3))  # interior, edge, outside; u, v, count
    strongest = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            code = kind[row, column]
            if code == EDGE:
                strongest = max(strongest, _magnitude(u, v, row, column))
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            code = kind[row, column]
            if code == INTERIOR:
                slot = 0
            elif code == EDGE and _magnitude(u, v, row, column) >= 0.85 * strongest:
                slot = 1
            elif code == OUTSIDE:
                slot = 2
            else:
                continue
            sums[slot, 0] += u[row, column]
            sums[slot, 1] += v[row, column]
            sums[slot, 2] += 1.0
    paint = sums[0] if sums[0, 2] > 0 else sums[1]
    around = sums[2]
    if around[2] == 0:
        return paint[0] / paint[2], paint[1] / paint[2], 128.0, 128.0
    return paint[0] / paint[2], paint[1] / paint[2], around[0] / around[2], around[1] / around[2]


@njit(cache=True)
def _magnitude(u, v, row, column):  # type: ignore[no-untyped-def]
    return np.hypot(np.float64(u[row, column]) - 128.0, np.float64(v[row, column]) - 128.0)


@njit(cache=True)
def chroma_noise(u, v, region, kind):  # type: ignore[no-untyped-def]
    """(sum, count): squared mixed second differences / 4 inside the paint; their mean is one chroma plane's variance.

    The mixed difference of a 2x2 block cancels any linear shading.
    """
    x0, x1, y0, y1 = region
    total = 0.0
    count = 0
    for row in range(y0, y1):
        for column in range(x0, x1):
            if (kind[row, column] == INTERIOR and kind[row, column + 1] == INTERIOR
                    and kind[row + 1, column] == INTERIOR and kind[row + 1, column + 1] == INTERIOR):
                du = (np.float64(u[row, column]) - u[row, column + 1]
                      - u[row + 1, column] + u[row + 1, column + 1])
                dv = (np.float64(v[row, column]) - v[row, column + 1]
                      - v[row + 1, column] + v[row + 1, column + 1])
                total += (du * du + dv * dv) * 0.125
                count += 1
    return total, count
