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

from rhot_node.detect.region.outline import EDGE, HOLE, INTERIOR, OUTSIDE, RING

REACH = 5  # half-width of the neighbourhood that paint and surroundings are averaged over
PAD = RING + REACH  # region around the component that coverage needs
CLIP = 0.3  # coverage is clipped to -CLIP..1 + CLIP: noise must stay unbiased, glints must not count
CONTRAST_MIN = 0.3  # of the marker's level; with less between paint and surroundings an edge cannot be unmixed
FLATNESS = 4.0  # grey levels^2 that surroundings are taken to vary by at least, in every channel
SLOPE_PIXELS = 4  # interior pixels that a shading slope is fitted to at least

# Columns of what `_look_around` finds: the paint's colour, and mean and covariance of the surroundings.
PAINT, MEAN, C00, C11, C22, C10, C20, C21 = 0, 3, 6, 7, 8, 9, 10, 11
NEAR_COLUMNS = 12
SUM_COLUMNS = 16  # of the summed-area table, see `_sum_areas`


@njit(cache=True)
def unmix(y, u, v, region, level, kind, colour, sums, coverage, gain, paint):
    """Write `coverage` and its noise `gain` (d coverage / d grey level, 0 where it is fixed) over `region`, and the
    `paint` (3, 3): by channel (Y, U, V) the mean of its interior, or of its edge when it has none, and its slopes
    along x and y.

    Scratch: `colour`, (..., 3) of the chroma planes' size, mean luma and chroma of the region's pixels; `sums`, one
    larger both ways and SUM_COLUMNS deep, their summed-area table.
    """
    _gather_colour(y, u, v, region, colour)
    paint[:] = 0.0
    origin = _paint_plane(region, kind, colour, paint)
    backdrop = np.zeros(3)
    _mean_outside(region, kind, colour, backdrop)
    _sum_areas(region, kind, colour, backdrop, sums)
    box, near = np.zeros(SUM_COLUMNS), np.zeros(NEAR_COLUMNS)
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
            _look_around(row, column, region, sums, paint, origin, backdrop, box, near)
            for channel in range(3):
                contrast[channel] = near[PAINT + channel] - near[MEAN + channel]
            slope = _least_noise(contrast, near, weight)
            if slope > 1.0 / (CONTRAST_MIN * level):
                coverage[row, column] = 1.0 if code == EDGE else 0.0
                continue
            value = 0.0
            for channel in range(3):
                value += weight[channel] * (colour[row, column, channel] - near[MEAN + channel])
            coverage[row, column] = min(max(value, -CLIP), 1.0 + CLIP)
            gain[row, column] = slope


@njit(cache=True)
def _gather_colour(y, u, v, region, colour):
    x0, x1, y0, y1 = region
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            total = (np.int64(y[2 * row, 2 * column]) + np.int64(y[2 * row, 2 * column + 1])
                     + np.int64(y[2 * row + 1, 2 * column]) + np.int64(y[2 * row + 1, 2 * column + 1]))
            colour[row, column, 0] = 0.25 * total
            colour[row, column, 1] = u[row, column]
            colour[row, column, 2] = v[row, column]


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
                    paint[channel, 0] += colour[row, column, channel]
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
                    c_x[channel] += dx * (colour[row, column, channel] - paint[channel, 0])
                    c_y[channel] += dy * (colour[row, column, channel] - paint[channel, 0])
    determinant = s_xx * s_yy - s_xy * s_xy
    if determinant > 0.01 * s_xx * s_yy:
        for channel in range(3):
            paint[channel, 1] = (s_yy * c_x[channel] - s_xy * c_y[channel]) / determinant
            paint[channel, 2] = (s_xx * c_y[channel] - s_xy * c_x[channel]) / determinant


@njit(cache=True)
def _magnitude(colour, row, column):
    return np.hypot(colour[row, column, 1] - 128.0, colour[row, column, 2] - 128.0)


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
                    mean[channel] += colour[row, column, channel]
    for channel in range(3):
        mean[channel] = mean[channel] / count if count > 0 else 128.0


@njit(cache=True)
def _sum_areas(region, kind, colour, backdrop, sums):
    """Summed-area table of the interior's places and colours and of the surroundings' colours and their products.

    Row and column 0 are zero; the surroundings count from their overall mean, which keeps products small.
    """
    x0, x1, y0, y1 = region
    line = np.zeros(SUM_COLUMNS)
    sums[0, :x1 - x0 + 2] = 0.0
    for row in range(y0, y1 + 1):
        line[:] = 0.0
        sums[row - y0 + 1, 0] = 0.0
        for column in range(x0, x1 + 1):
            code = kind[row, column]
            if code == INTERIOR:
                line[0] += 1.0
                line[1] += column
                line[2] += row
                line[3] += colour[row, column, 0]
                line[4] += colour[row, column, 1]
                line[5] += colour[row, column, 2]
            elif code == OUTSIDE:
                d0 = colour[row, column, 0] - backdrop[0]
                d1 = colour[row, column, 1] - backdrop[1]
                d2 = colour[row, column, 2] - backdrop[2]
                line[6] += 1.0
                line[7] += d0
                line[8] += d1
                line[9] += d2
                line[10] += d0 * d0
                line[11] += d1 * d1
                line[12] += d2 * d2
                line[13] += d1 * d0
                line[14] += d2 * d0
                line[15] += d2 * d1
            for k in range(SUM_COLUMNS):
                sums[row - y0 + 1, column - x0 + 1, k] = sums[row - y0, column - x0 + 1, k] + line[k]


@njit(cache=True)
def _look_around(row, column, region, sums, paint, origin, backdrop, box, near):
    """Fill `near` with the paint's colour at a pixel, and mean and covariance of the surroundings near it.

    The paint is the mean of the interior nearby, carried here along the marker's overall slopes. Scratch: `box`.
    """
    x0, x1, y0, y1 = region
    top, bottom = max(row - REACH, y0) - y0, min(row + REACH, y1) - y0 + 1
    left, right = max(column - REACH, x0) - x0, min(column + REACH, x1) - x0 + 1
    for k in range(SUM_COLUMNS):
        box[k] = sums[bottom, right, k] - sums[top, right, k] - sums[bottom, left, k] + sums[top, left, k]
    if box[0] > 0.5:
        dx, dy = column - box[1] / box[0], row - box[2] / box[0]
        for channel in range(3):
            near[PAINT + channel] = box[3 + channel] / box[0]
    else:
        dx, dy = column - origin[0], row - origin[1]
        for channel in range(3):
            near[PAINT + channel] = paint[channel, 0]
    for channel in range(3):
        near[PAINT + channel] += paint[channel, 1] * dx + paint[channel, 2] * dy
    n = max(box[6], 1.0)
    m0, m1, m2 = box[7] / n, box[8] / n, box[9] / n
    near[MEAN], near[MEAN + 1], near[MEAN + 2] = backdrop[0] + m0, backdrop[1] + m1, backdrop[2] + m2
    near[C00], near[C11], near[C22] = box[10] / n - m0 * m0, box[11] / n - m1 * m1, box[12] / n - m2 * m2
    near[C10], near[C20], near[C21] = box[13] / n - m1 * m0, box[14] / n - m2 * m0, box[15] / n - m2 * m1


@njit(cache=True)
def _least_noise(contrast, near, weight):
    """Weights w with w.contrast = 1 that let the least of the surroundings' variation through; returns |w|.

    w = S^-1 d / (d' S^-1 d), S = covariance + FLATNESS I.
    """
    a, b, c = near[C00] + FLATNESS, near[C11] + FLATNESS, near[C22] + FLATNESS
    d, e, f = near[C10], near[C20], near[C21]
    x, y, z = contrast[0], contrast[1], contrast[2]
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
