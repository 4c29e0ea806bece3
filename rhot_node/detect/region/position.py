"""From a coverage plane to a position with covariance: the centroid, and the centre of a tilted band.

All coordinates are chroma pixels; covariances are per unit variance of the chroma noise.
"""

from __future__ import annotations

import numpy as np
from numba import njit

BLUR_VARIANCE = 0.2  # px^2: point spread of about 0.7 luma px and the 2x2 chroma mean
BAND_HALF_WIDTH_MIN = 3.5  # px; a narrower band shows no curvature
CROSS_MOMENT_MIN = 0.92
"""Least normalised cross moment E[u^2 w^2] / (E[u^2] E[w^2]) of a band. It is 1 for a rectangle, 2/3 for an ellipse and
at most 0.84 for a capsule of any length."""

# Columns of the result row.
X, Y, AREA, COV_XX, COV_XY, COV_YY, VAR_MAJOR, VAR_MINOR, AXIS_X, AXIS_Y = range(10)
SAG, SAG_VARIANCE, FIT, SOFT, ROUND = range(10, 15)
RESULT_COLUMNS = 15


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
    result[X], result[Y], result[AREA] = center_x, center_y, area
    result[COV_XX], result[COV_XY], result[COV_YY] = v_xx / area**2, v_xy / area**2, v_yy / area**2
    _principal_axes(m_xx / area, m_xy / area, m_yy / area, result)
    result[SAG] = result[SAG_VARIANCE] = result[FIT] = result[ROUND] = 0.0
    result[SOFT] = soft / area
    return True


@njit(cache=True)
def mask_centroid(mask, components, own, count, result):
    """Fill `result` with centroid, area and principal axes of the components marked in `own`, which `mask` numbers from
    2 on. Returns whether they touch the frame's border. Columns of components: see rhot_node.detect.region.measure.
    """
    height, width = mask.shape
    n = s_x = s_y = s_xx = s_xy = s_yy = 0.0
    at_border = False
    for number in range(count):
        if not own[number]:
            continue
        x0, x1 = int(components[number, 3]), int(components[number, 4])
        y0, y1 = int(components[number, 5]), int(components[number, 6])
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
    result[X], result[Y], result[AREA] = x, y, n
    _principal_axes(s_xx / n - x * x, s_xy / n - x * y, s_yy / n - y * y, result)
    return at_border


@njit(cache=True)
def _principal_axes(m_xx, m_xy, m_yy, result):
    half = 0.5 * (m_xx + m_yy)
    spread = np.hypot(0.5 * (m_xx - m_yy), m_xy)
    angle = 0.5 * np.arctan2(2.0 * m_xy, m_xx - m_yy)
    result[VAR_MAJOR] = max(half + spread, 0.0)
    result[VAR_MINOR] = max(half - spread, 0.0)
    result[AXIS_X], result[AXIS_Y] = np.cos(angle), np.sin(angle)


@njit(cache=True)
def band_center(region, coverage, gain, result):
    """Replace the centroid in `result` by the projection of the band's centre on its axis; True when the fit holds.

    Both rims of a band tilted by theta are half-ellipse arcs, so the mid of the coverage at u (-1..1 across) is
    m(u) = c + k u + s sqrt(1 - u^2), s = R sin(theta): its centroid lies (pi / 4) s off the axis point. Least squares
    of the pixels' axial coordinate on (1, u, sqrt(1 - u^2)), weighted by coverage, is least squares of the column mids
    weighted by column height. Across is the major axis of the second moments, so a band must look wider than long; k
    mends the axis's error. Sets ROUND for what has no straight rims at all, whose centroid is what it is.
    """
    if _cross_moment(region, coverage, result) < CROSS_MOMENT_MIN:
        result[ROUND] = 1.0
        return False
    half_width = np.sqrt(max(3.0 * (result[VAR_MAJOR] - BLUR_VARIANCE), 0.0))
    if half_width < BAND_HALF_WIDTH_MIN:
        return False
    length = result[AREA] / (2.0 * half_width)
    normal = np.zeros((3, 3))
    right = np.zeros(3)
    moments = np.zeros(4)
    x0, x1, y0, y1 = region
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            a = coverage[row, column]
            if a == 0.0:
                continue
            across, along = _band_coordinates(column, row, result)
            u = across / half_width
            basis = (1.0, u, _arc(u, half_width))
            for i in range(3):
                right[i] += a * basis[i] * along
                for j in range(3):
                    normal[i, j] += a * basis[i] * basis[j]
            moments[0] += a
            moments[1] += a * u**3
            moments[2] += a * u**4
            moments[3] += a * along * along
    inverse, determinant = _inverse(normal)
    if determinant < 1e-6 * moments[0] ** 3:
        return False
    solution = np.zeros(3)
    for i in range(3):
        for j in range(3):
            solution[i] += inverse[i, j] * right[j]
    explained = solution[0] * right[0] + solution[1] * right[1] + solution[2] * right[2]
    residual = (moments[3] - explained) / moments[0]
    if not _is_a_band(moments, residual, length, half_width, solution[2]):
        return False
    _band_result(region, coverage, gain, half_width, inverse, solution, result)
    return True


@njit(cache=True)
def _cross_moment(region, coverage, result):
    """E[u^2 w^2] / (E[u^2] E[w^2]) of the coverage, across (u) and along (w); a band's bend raises it. 1 for a line."""
    n = uu = ww = uuww = 0.0
    x0, x1, y0, y1 = region
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            a = coverage[row, column]
            if a == 0.0:
                continue
            u, w = _band_coordinates(column, row, result)
            n += a
            uu += a * u * u
            ww += a * w * w
            uuww += a * u * u * w * w
    return uuww * n / (uu * ww) if uu * ww > 0.0 else 1.0


@njit(cache=True)
def _inverse(m):
    """Inverse and determinant of a symmetric 3x3 (numba's own linear algebra would need scipy, which a node lacks)."""
    inverse = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a, b = (j + 1) % 3, (j + 2) % 3
            c, d = (i + 1) % 3, (i + 2) % 3
            inverse[i, j] = m[a, c] * m[b, d] - m[a, d] * m[b, c]
    determinant = m[0, 0] * inverse[0, 0] + m[0, 1] * inverse[1, 0] + m[0, 2] * inverse[2, 0]
    if determinant != 0.0:
        inverse /= determinant
    return inverse, determinant


@njit(cache=True)
def _band_coordinates(column, row, result):
    """(across, along) of a pixel in the band's own axes, from its centroid."""
    dx = column - result[X]
    dy = row - result[Y]
    return dx * result[AXIS_X] + dy * result[AXIS_Y], dy * result[AXIS_X] - dx * result[AXIS_Y]


@njit(cache=True)
def _arc(u, half_width):
    """sqrt(1 - u^2), averaged over a box as wide as the blur, as far as it falls on the band."""
    spread = np.sqrt(3.0 * BLUR_VARIANCE) / half_width
    low, high = max(u - spread, -1.0), min(u + spread, 1.0)
    if high - low < 1e-6:
        return 0.0
    return (_arc_integral(high) - _arc_integral(low)) / (high - low)


@njit(cache=True)
def _arc_integral(u):
    return 0.5 * (u * np.sqrt(1.0 - u * u) + np.arcsin(u))


@njit(cache=True)
def _is_a_band(moments, residual, length, half_width, sag):
    """Does the coverage look like a whole band: even across its width, and as thick as its area says?"""
    skew = moments[1] / moments[0]
    fourth = moments[2] / moments[0]  # 1/5 for an even box
    thickness = residual / (length * length / 12.0 + BLUR_VARIANCE)
    return (abs(skew) < 0.04 and abs(fourth - 0.2) < 0.05 and 0.7 < thickness < 1.35
            and abs(sag) < 1.15 * half_width)


@njit(cache=True)
def _band_result(region, coverage, gain, half_width, inverse, solution, result):
    """Position and covariance: each pixel's influence on (mean across, c) times its noise."""
    x0, x1, y0, y1 = region
    v_uu = v_uv = v_vv = v_ss = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            g2 = gain[row, column] ** 2
            if g2 == 0.0:
                continue
            across, along = _band_coordinates(column, row, result)
            u = across / half_width
            arc = _arc(u, half_width)
            misfit = along - solution[0] - solution[1] * u - solution[2] * arc
            on_along = (inverse[0, 0] + inverse[0, 1] * u + inverse[0, 2] * arc) * misfit
            on_sag = (inverse[2, 0] + inverse[2, 1] * u + inverse[2, 2] * arc) * misfit
            on_across = across / result[AREA]
            v_uu += g2 * on_across * on_across
            v_uv += g2 * on_across * on_along
            v_vv += g2 * on_along * on_along
            v_ss += g2 * on_sag * on_sag
    ax, ay = result[AXIS_X], result[AXIS_Y]
    result[X] -= ay * solution[0]
    result[Y] += ax * solution[0]
    result[COV_XX] = ax * ax * v_uu - 2.0 * ax * ay * v_uv + ay * ay * v_vv
    result[COV_XY] = ax * ay * v_uu + (ax * ax - ay * ay) * v_uv - ax * ay * v_vv
    result[COV_YY] = ay * ay * v_uu + 2.0 * ax * ay * v_uv + ax * ax * v_vv
    result[SAG] = solution[2]
    result[SAG_VARIANCE] = v_ss
    result[FIT] = 1.0
