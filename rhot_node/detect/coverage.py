"""How much of each chroma pixel the marker's paint covers, by unmixing paint and surroundings at the marker's edge; and
the centroid of what it covers.

An edge pixel's colour (luma and chroma) is c = a M + (1 - a) B. The paint M is the marker's own interior nearby,
carried to the pixel along its shading, so that shading and lamp changes cancel. The surroundings B have a mean and a
covariance just outside: where skin and cloth, or another marker, meet at the marker's edge, a = w.(c - B) with
w = S^-1 d / (d' S^-1 d), d = M - B, S the covariance, is measured along the direction in which they do not differ
(Bayesian matting, Chuang 2001, in its linear form). So an edge is where half the paint is, whatever lies around it.
All coordinates are chroma pixels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.image import GREY

RING = 2  # chroma pixels around the half level that an edge may reach (lens, 2x2 chroma mean, some motion)
HOLES_MAX = 0.3  # holes (glints, noise) are filled up to this fraction of the component
REACH = 5  # half-width of the neighbourhood that paint and surroundings are averaged over
PAD = RING + REACH  # region around the component that coverage needs
CLIP = 0.25
"""Coverage is clipped to -CLIP..1 + CLIP: noise must stay unbiased, glints and other paints must not count. Two
standard deviations of the most noise that an outline is fitted in (`follow.NOISE_MOST`)."""
CONTRAST_MIN = 0.3  # of the marker's level; with less between paint and surroundings an edge cannot be unmixed
FLATNESS = 4.0  # grey levels^2 that surroundings are taken to vary by at least, in every channel
PIXELS_LEAST = 4  # pixels that are all paint: fewer show no colour and no shading to rely on
COLLINEAR = 0.05  # of the product of both variances: with less determinant, pixels on one line show no slope

# Kinds of pixels in the plane `kind`.
OUTSIDE, INTERIOR, HOLE, EDGE, RIM, _REACHED = range(6)


class Near(NamedTuple):
    """Near a pixel: the paint's colour (3,), and mean (3,) and covariance (3, 3) of the surroundings, luma, U, V; the
    sums that they are taken from, as in `Areas`."""

    paint: NDArray[np.float64]
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    inside: NDArray[np.float64]
    outside: NDArray[np.float64]


class Areas(NamedTuple):
    """Summed-area tables (H + 1, W + 1, n): of the interior number, x, y and colour; of the surroundings the lower
    triangle, row by row, of the products of 1 and the colour."""

    paint: NDArray[np.float64]
    around: NDArray[np.float64]


class Measured(NamedTuple):
    """A measured marker; chroma px, covariances per unit variance of the noise.

    Centroid, area, covariance; second moments along and across the major axis, and that; a band's sag (`band`) with its
    variance, and whether its rims were found (`fit`), or are none (`round`); `soft`: the mean of a (1 - a) over the
    area, a the coverage; `level`: of the chroma, grey levels; whether it is at the frame's border; pieces; costs of it
    and of what else is in the window; how many pixels are all paint, its mean luma and chroma (minus 128), and
    the slope of its chroma, of itself per px; `careful`: as in `measure`.
    """

    x: float
    y: float
    area: float
    v_xx: float
    v_xy: float
    v_yy: float
    var_major: float
    var_minor: float
    axis_x: float
    axis_y: float
    sag: float
    sag_variance: float
    fit: float
    round: float
    soft: float
    level: float
    at_border: float
    fragments: float
    cost: float
    rival_cost: float
    paint_pixels: float
    paint_y: float
    paint_cb: float
    paint_cr: float
    slope_x: float
    slope_y: float
    careful: float


class Scratch(NamedTuple):
    """Planes and tables to measure in, for chroma planes of one size (H, W): see `scratch`."""

    mask: NDArray[np.int16]
    kind: NDArray[np.uint8]
    colour: NDArray[np.float32]
    sums: Areas
    coverage: NDArray[np.float32]
    gain: NDArray[np.float32]
    stack: NDArray[np.int32]
    components: NDArray[np.void]
    own: NDArray[np.bool_]


# -- chroma pixels -----------------------------------------------------------------------------------------------------

@njit(cache=True)
def luma_at(y, row, column):
    """Mean luma of a chroma pixel."""
    top, bottom = y[2 * row], y[2 * row + 1]
    left, right = 2 * column, 2 * column + 1
    return 0.5 * 0.5 * (np.float64(top[left]) + top[right] + bottom[left] + bottom[right])


@njit(cache=True)
def block_noise(u, v, row, column):
    """Variance of the noise of one chroma plane by a 2x2 block, grey levels^2: the mean square of both planes' mixed
    differences, which cancel any linear shading, is four times as much."""
    du = np.float64(u[row, column]) - u[row, column + 1] - u[row + 1, column] + u[row + 1, column + 1]
    dv = np.float64(v[row, column]) - v[row, column + 1] - v[row + 1, column] + v[row + 1, column + 1]
    return 0.5 * 0.5 * 0.5 * (du * du + dv * dv)


# -- kinds of pixels ---------------------------------------------------------------------------------------------------

@njit(cache=True)
def classify(region, own, mask, kind, stack):
    """Sort the pixels of `region` (x0, x1, y0, y1) into interior, filled hole, edge (in), rim (out) and outside.

    `own[n]` says whether component n belongs to the marker. Returns how much of its area is interior.
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
    return interior


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
            if count % 2 == 1:
                quads += 2 - count
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
        for near_y, near_x in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
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


# -- coverage ----------------------------------------------------------------------------------------------------------

@njit(cache=True)
def unmix(image, region, level, scratch, paint):
    """Write coverage and its noise `gain` (d coverage / d grey level, 0 where it is fixed) over `region`, and the
    `paint` (3, 3): by channel (Y, U, V) the mean of its interior, or of its edge when it has none, and its slopes
    along x and y. The pixels of the region are sorted already (`classify`).
    """
    kind, colour, sums, coverage, gain = scratch.kind, scratch.colour, scratch.sums, scratch.coverage, scratch.gain
    near = Near(np.empty(3), np.empty(3), np.empty((3, 3)), np.empty(6), np.empty(10))
    _gather_colour(image, region, colour)
    paint[:] = 0.0
    origin = _paint_plane(region, kind, colour, paint)
    backdrop = np.zeros(3)
    _mean_outside(region, kind, colour, backdrop)
    _sum_areas(region, kind, colour, backdrop, sums)
    weight = np.zeros(3)
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
            _fill_near((row, column), region, sums, paint, origin, backdrop, near)
            slope = _least_noise(near, weight)
            if slope > 1.0 / (CONTRAST_MIN * level):
                coverage[row, column] = 1.0 if code == EDGE else 0.0
                continue
            value = 0.0
            for channel in range(3):
                value += weight[channel] * (colour[row, column, channel] - near.mean[channel])
            coverage[row, column] = min(max(value, -CLIP), 1.0 + CLIP)
            gain[row, column] = slope


@njit(cache=True)
def _gather_colour(image, region, colour):
    y, u, v = image
    x0, x1, y0, y1 = region
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            colour[row, column, 0] = luma_at(y, row, column)
            colour[row, column, 1] = u[row, column]
            colour[row, column, 2] = v[row, column]


@njit(cache=True)
def _paint_plane(region, kind, colour, paint):
    """Fit mean and slopes of the paint's colour over its interior, or its edge when it has none.

    Returns the interior's centre, which the mean belongs to. Slopes stay 0 for fewer than PIXELS_LEAST pixels.
    """
    x0, x1, y0, y1 = region
    wanted = INTERIOR if np.any(kind[y0:y1 + 1, x0:x1 + 1] == INTERIOR) else EDGE
    count = 0
    center_x = center_y = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if kind[row, column] == wanted:
                count += 1
                center_x += column
                center_y += row
                for channel in range(3):
                    paint[channel, 0] += colour[row, column, channel]
    center_x /= count
    center_y /= count
    paint[:, 0] /= count
    if wanted == INTERIOR and count >= PIXELS_LEAST:
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
    if determinant > COLLINEAR * s_xx * s_yy:
        for channel in range(3):
            paint[channel, 1] = (s_yy * c_x[channel] - s_xy * c_y[channel]) / determinant
            paint[channel, 2] = (s_xx * c_y[channel] - s_xy * c_x[channel]) / determinant


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
        mean[channel] = mean[channel] / count if count > 0 else GREY


@njit(cache=True)
def _sum_areas(region, kind, colour, backdrop, sums):
    """Fill the summed-area tables; row and column 0 are zero.

    The surroundings count from their overall mean, which keeps products small.
    """
    x0, x1, y0, y1 = region
    paint, around = sums
    inside, outside = np.zeros(6), np.zeros(10)
    paint[0, :x1 - x0 + 2] = 0.0
    around[0, :x1 - x0 + 2] = 0.0
    for row in range(y0, y1 + 1):
        inside[:] = 0.0
        outside[:] = 0.0
        below = row - y0 + 1
        paint[below, 0] = 0.0
        around[below, 0] = 0.0
        for column in range(x0, x1 + 1):
            code = kind[row, column]
            if code == INTERIOR:
                inside[0] += 1.0
                inside[1] += column
                inside[2] += row
                for i in range(3):
                    inside[2 + 1 + i] += colour[row, column, i]
            elif code == OUTSIDE:
                a, b, c = (colour[row, column, 0] - backdrop[0], colour[row, column, 1] - backdrop[1],
                           colour[row, column, 2] - backdrop[2])
                for k, product in enumerate((1.0, a, a * a, b, b * a, b * b, c, c * a, c * b, c * c)):
                    outside[k] += product
            right = column - x0 + 1
            for k in range(6):
                paint[below, right, k] = paint[below - 1, right, k] + inside[k]
            for k in range(10):
                around[below, right, k] = around[below - 1, right, k] + outside[k]


@njit(cache=True)
def _fill_near(pixel, region, sums, paint, origin, backdrop, near):
    """Fill `near` with the paint's colour at a pixel, and mean and covariance of the surroundings near it.

    The paint is the mean of the interior nearby, carried here along the marker's overall slopes.
    """
    x0, x1, y0, y1 = region
    row, column = pixel
    left, right = max(column - REACH, x0) - x0, min(column + REACH, x1) - x0 + 1
    top, bottom = max(row - REACH, y0) - y0, min(row + REACH, y1) - y0 + 1
    inside, outside = near.inside, near.outside
    for k in range(6):
        inside[k] = (sums.paint[bottom, right, k] - sums.paint[top, right, k] - sums.paint[bottom, left, k]
                     + sums.paint[top, left, k])
    for k in range(10):
        outside[k] = (sums.around[bottom, right, k] - sums.around[top, right, k] - sums.around[bottom, left, k]
                      + sums.around[top, left, k])
    own, n = inside[0], max(outside[0], 1.0)
    dx, dy = column - origin[0], row - origin[1]
    if own > 0.5:
        dx, dy = column - inside[1] / own, row - inside[2] / own
    k = 1
    for i in range(3):
        near.paint[i] = (inside[2 + 1 + i] / own if own > 0.5 else paint[i, 0]) + paint[i, 1] * dx + paint[i, 2] * dy
        near.mean[i] = outside[k] / n
        for j in range(i + 1):
            near.covariance[i, j] = outside[k + 1 + j] / n - near.mean[i] * near.mean[j]
        k += i + 2
    for i in range(3):
        near.mean[i] += backdrop[i]


@njit(cache=True)
def _least_noise(near, weight):
    """Weights w with w.d = 1, d = paint - surroundings, that let the least of their variation through; returns |w|.

    w = S^-1 d / (d' S^-1 d), S = covariance + FLATNESS I.
    """
    s = near.covariance
    a, b, c = s[0, 0] + FLATNESS, s[1, 1] + FLATNESS, s[2, 2] + FLATNESS
    d, e, f = s[1, 0], s[2, 0], s[2, 1]
    x, y, z = near.paint[0] - near.mean[0], near.paint[1] - near.mean[1], near.paint[2] - near.mean[2]
    weight[0] = (b * c - f * f) * x + (e * f - d * c) * y + (d * f - e * b) * z
    weight[1] = (e * f - d * c) * x + (a * c - e * e) * y + (d * e - a * f) * z
    weight[2] = (d * f - e * b) * x + (d * e - a * f) * y + (a * b - d * d) * z
    norm = weight[0] * x + weight[1] * y + weight[2] * z
    if norm <= 0.0:
        return np.inf
    weight /= norm
    return np.sqrt(weight[0] ** 2 + weight[1] ** 2 + weight[2] ** 2)


@njit(cache=True)
def chroma_noise(u, v, region, kind):
    """(sum, count) of the noise's variance over 2x2 blocks inside the paint."""
    x0, x1, y0, y1 = region
    total = 0.0
    count = 0
    for row in range(y0, y1):
        for column in range(x0, x1):
            if (kind[row, column] == INTERIOR and kind[row, column + 1] == INTERIOR
                    and kind[row + 1, column] == INTERIOR and kind[row + 1, column + 1] == INTERIOR):
                total += block_noise(u, v, row, column)
                count += 1
    return total, count


# -- centroid ----------------------------------------------------------------------------------------------------------

@njit(cache=True)
def centroid(region, coverage, gain, result):
    """Coverage centroid, its covariance, area and principal axes; False when nothing is covered."""
    x0, x1, y0, y1 = region
    area = sum_x = sum_y = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            a = coverage[row, column]
            area += a
            sum_x += a * (column - x0)
            sum_y += a * (row - y0)
    if area <= 0.5:
        return False
    center_x = sum_x / area + x0
    center_y = sum_y / area + y0
    m_xx = m_xy = m_yy = v_xx = v_xy = v_yy = soft = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            dx = column - center_x
            dy = row - center_y
            a = coverage[row, column]
            m_xx += a * dx * dx
            m_xy += a * dx * dy
            m_yy += a * dy * dy
            soft += max(a * (1.0 - a), 0.0)
            g2 = gain[row, column] ** 2
            v_xx += g2 * dx * dx
            v_xy += g2 * dx * dy
            v_yy += g2 * dy * dy
    result.x, result.y, result.area = center_x, center_y, area
    result.v_xx, result.v_xy, result.v_yy = v_xx / area**2, v_xy / area**2, v_yy / area**2
    _principal_axes(m_xx / area, m_xy / area, m_yy / area, result)
    result.sag = result.sag_variance = result.fit = result.round = 0.0
    result.soft = soft / area
    return True


@njit(cache=True)
def mask_centroid(mask, components, own, count, result):
    """Fill `result` with centroid, area and principal axes of the components marked in `own`, which `mask` numbers from
    2 on. Returns whether they touch the frame's border.
    """
    height, width = mask.shape
    n = s_x = s_y = s_xx = s_xy = s_yy = 0.0
    at_border = False
    for number in range(count):
        if not own[number]:
            continue
        part = components[number]
        x0, x1, y0, y1 = int(part.x_min), int(part.x_max), int(part.y_min), int(part.y_max)
        at_border |= x0 == 0 or y0 == 0 or x1 == width - 1 or y1 == height - 1
        for row in range(y0, y1 + 1):
            for column in range(x0, x1 + 1):
                if mask[row, column] == number + 2:
                    n += 1.0
                    s_x += column
                    s_y += row
                    s_xx += column * column
                    s_xy += column * row
                    s_yy += row * row
    x, y = s_x / n, s_y / n
    result.x, result.y, result.area = x, y, n
    _principal_axes(s_xx / n - x * x, s_xy / n - x * y, s_yy / n - y * y, result)
    return at_border


@njit(cache=True)
def _principal_axes(m_xx, m_xy, m_yy, result):
    half = 0.5 * (m_xx + m_yy)
    spread = np.hypot(0.5 * (m_xx - m_yy), m_xy)
    angle = 0.5 * np.arctan2(2.0 * m_xy, m_xx - m_yy)
    result.var_major = max(half + spread, 0.0)
    result.var_minor = max(half - spread, 0.0)
    result.axis_x, result.axis_y = np.cos(angle), np.sin(angle)
