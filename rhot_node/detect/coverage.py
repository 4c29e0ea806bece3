"""How much of each chroma pixel the marker's paint covers, by unmixing paint and surroundings at the marker's edge.

An edge pixel's colour (luma and chroma) is c = a M + (1 - a) B. The paint M is the marker's own interior nearby,
carried to the pixel along its shading, so that shading and lamp changes cancel. The surroundings B have a mean and a
covariance just outside: where skin and cloth, or another marker, meet at the marker's edge, a = w.(c - B) with
w = S^-1 d / (d' S^-1 d), d = M - B, S the covariance, looks along the direction in which they do not differ
(Bayesian matting, Chuang 2001, in its linear form). So an edge is where half the paint is, whatever lies around it.
All coordinates are chroma pixels.
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
FLATNESS = 4.0  # grey levels^2 that surroundings are taken to vary by at least, in every channel
SLOPE_PIXELS = 9  # interior pixels that a shading slope is fitted to at least

# Kinds of pixels in the scratch plane `kind`.
OUTSIDE, INTERIOR, HOLE, EDGE, RIM, _REACHED = range(6)


@njit(cache=True)
def classify(region, own, mask, kind, stack):
    """Sort the pixels of `region` (x0, x1, y0, y1) into interior, filled hole, edge (in), rim (out) and outside.

    `own[n]` says whether component n belongs to the marker. Returns its area and how much of that is interior.
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


@njit(cache=True)
def unmix(y, u, v, region, level, kind, colour, coverage, gain):
    """Write `coverage` and its noise `gain` (d coverage / d grey level, 0 where it is fixed) over `region`.

    `colour` is scratch, (3, ...) of the chroma planes' size: mean luma and chroma of the region's pixels.
    """
    _gather_colour(y, u, v, region, colour)
    paint = np.zeros((3, 3))  # per channel: mean, slope along x, slope along y
    origin = _paint_plane(region, kind, colour, paint)
    backdrop = np.zeros(3)
    _mean_outside(region, kind, colour, backdrop)
    near_paint, near_backdrop, covariance = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    contrast, weight = np.zeros(3), np.zeros(3)
    x0, x1, y0, y1 = region
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            code = kind[row, column]
            gain[row, column] = 0.0
            if code == OUTSIDE:
                coverage[row, column] = 0.0
                continue
            if code in (INTERIOR, HOLE):
                coverage[row, column] = 1.0
                continue
            _local_paint(row, column, region, kind, colour, paint, origin, near_paint)
            _local_backdrop(row, column, region, kind, colour, backdrop, near_backdrop, covariance)
            for channel in range(3):
                contrast[channel] = near_paint[channel] - near_backdrop[channel]
            slope = _least_noise(contrast, covariance, weight)
            if slope > 1.0 / (CONTRAST_MIN * level):
                coverage[row, column] = 1.0 if code == EDGE else 0.0
                continue
            value = 0.0
            for channel in range(3):
                value += weight[channel] * (colour[channel, row, column] - near_backdrop[channel])
            coverage[row, column] = min(max(value, -CLIP), 1.0 + CLIP)
            gain[row, column] = slope


@njit(cache=True)
def _gather_colour(y, u, v, region, colour):
    x0, x1, y0, y1 = region
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            total = (np.int64(y[2 * row, 2 * column]) + np.int64(y[2 * row, 2 * column + 1])
                     + np.int64(y[2 * row + 1, 2 * column]) + np.int64(y[2 * row + 1, 2 * column + 1]))
            colour[0, row, column] = 0.25 * total
            colour[1, row, column] = u[row, column]
            colour[2, row, column] = v[row, column]


@njit(cache=True)
def _paint_plane(region, kind, colour, paint):
    """Fit mean and slopes of the paint's colour over its interior (its most saturated edge pixels when it has none).

    Returns the interior's centre, which the mean belongs to. Slopes stay 0 for fewer than SLOPE_PIXELS pixels.
    """
    x0, x1, y0, y1 = region
    wanted, threshold = INTERIOR, 0.0
    count = 0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if kind[row, column] == INTERIOR:
                count += 1
            elif kind[row, column] == EDGE:
                threshold = max(threshold, 0.85 * _magnitude(colour, row, column))
    if count == 0:
        wanted = EDGE
    else:
        threshold = 0.0
    count = 0
    center_x = center_y = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if kind[row, column] == wanted and _magnitude(colour, row, column) >= threshold:
                count += 1
                center_x += column
                center_y += row
                for channel in range(3):
                    paint[channel, 0] += colour[channel, row, column]
    center_x /= count
    center_y /= count
    paint[:, 0] /= count
    if wanted == INTERIOR and count >= SLOPE_PIXELS:
        _paint_slopes(region, kind, colour, paint, center_x, center_y)
    return center_x, center_y


@njit(cache=True)
def _paint_slopes(region, kind, colour, paint, center_x, center_y):
    x0, x1, y0, y1 = region
    s_xx = s_xy = s_yy = 1e-9
    c_x, c_y = np.zeros(3), np.zeros(3)
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if kind[row, column] == INTERIOR:
                dx, dy = column - center_x, row - center_y
                s_xx += dx * dx
                s_xy += dx * dy
                s_yy += dy * dy
                for channel in range(3):
                    c_x[channel] += dx * (colour[channel, row, column] - paint[channel, 0])
                    c_y[channel] += dy * (colour[channel, row, column] - paint[channel, 0])
    determinant = s_xx * s_yy - s_xy * s_xy
    if determinant > 0.01 * s_xx * s_yy:
        for channel in range(3):
            paint[channel, 1] = (s_yy * c_x[channel] - s_xy * c_y[channel]) / determinant
            paint[channel, 2] = (s_xx * c_y[channel] - s_xy * c_x[channel]) / determinant


@njit(cache=True)
def _magnitude(colour, row, column):
    return np.hypot(colour[1, row, column] - 128.0, colour[2, row, column] - 128.0)


@njit(cache=True)
def _mean_outside(region, kind, colour, mean):
    """Mean colour around the marker; neutral grey when nothing of it is in the picture."""
    x0, x1, y0, y1 = region
    count = 0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if kind[row, column] == OUTSIDE:
                count += 1
                for channel in range(3):
                    mean[channel] += colour[channel, row, column]
    for channel in range(3):
        mean[channel] = mean[channel] / count if count > 0 else 128.0


@njit(cache=True)
def _local_paint(row, column, region, kind, colour, paint, origin, out):
    """The paint's colour at a pixel: mean of the interior nearby, carried there along the marker's overall slopes."""
    x0, x1, y0, y1 = region
    out[:] = 0.0
    count = 0
    from_x = from_y = 0
    for near_y in range(max(row - REACH, y0), min(row + REACH, y1) + 1):
        for near_x in range(max(column - REACH, x0), min(column + REACH, x1) + 1):
            if kind[near_y, near_x] == INTERIOR:
                count += 1
                from_x += near_x
                from_y += near_y
                for channel in range(3):
                    out[channel] += colour[channel, near_y, near_x]
    dx = column - (from_x / count if count > 0 else origin[0])
    dy = row - (from_y / count if count > 0 else origin[1])
    for channel in range(3):
        mean = out[channel] / count if count > 0 else paint[channel, 0]
        out[channel] = mean + paint[channel, 1] * dx + paint[channel, 2] * dy


@njit(cache=True)
def _local_backdrop(row, column, region, kind, colour, fallback, mean, covariance):
    """Mean and covariance of the surroundings near a pixel."""
    x0, x1, y0, y1 = region
    mean[:] = 0.0
    covariance[:] = 0.0
    count = 0
    for near_y in range(max(row - REACH, y0), min(row + REACH, y1) + 1):
        for near_x in range(max(column - REACH, x0), min(column + REACH, x1) + 1):
            if kind[near_y, near_x] == OUTSIDE:
                count += 1
                for i in range(3):
                    di = colour[i, near_y, near_x] - fallback[i]
                    mean[i] += di
                    for j in range(i + 1):
                        covariance[i, j] += di * (colour[j, near_y, near_x] - fallback[j])
    n = max(count, 1)
    for i in range(3):
        mean[i] /= n
    for i in range(3):
        for j in range(i + 1):
            covariance[i, j] = covariance[i, j] / n - mean[i] * mean[j]
            covariance[j, i] = covariance[i, j]
    for i in range(3):
        mean[i] += fallback[i]


@njit(cache=True)
def _least_noise(contrast, covariance, weight):
    """Weights w with w.contrast = 1 that let the least of the surroundings' variation through; returns |w|.

    w = S^-1 d / (d' S^-1 d), S = covariance + FLATNESS I.
    """
    s = covariance
    a, b, c = s[0, 0] + FLATNESS, s[1, 1] + FLATNESS, s[2, 2] + FLATNESS
    d, e, f = s[1, 0], s[2, 0], s[2, 1]
    x, y, z = contrast
    weight[0] = (b * c - f * f) * x + (e * f - d * c) * y + (d * f - e * b) * z
    weight[1] = (e * f - d * c) * x + (a * c - e * e) * y + (d * e - a * f) * z
    weight[2] = (d * f - e * b) * x + (d * e - a * f) * y + (a * b - d * d) * z
    norm = weight[0] * x + weight[1] * y + weight[2] * z
    if norm <= 0.0:
        return np.inf
    for channel in range(3):
        weight[channel] /= norm
    return np.sqrt(weight[0] ** 2 + weight[1] ** 2 + weight[2] ** 2)


@njit(cache=True)
def chroma_noise(u, v, region, kind):
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
