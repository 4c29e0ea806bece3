"""The axis of a tilted band: from its coverage, and from frame to frame from its outline.

Both rims of a band tilted by theta are half-ellipse arcs, so the mid of the band at u (-1..1 across) is
m(u) = c + k u + s sqrt(1 - u^2), with the sag s = R sin(theta): its centroid lies (pi / 4) s off the axis point.

All coordinates are chroma pixels; covariances are per unit variance of the chroma noise.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot_node.detect import outline_pixels as c
from rhot_node.detect.image import EVEN

BAND_HALF_WIDTH_MIN = 3.5  # px; a narrower band shows no curvature
CROSS_MOMENT_MIN = 0.92
"""Least normalised cross moment E[u^2 w^2] / (E[u^2] E[w^2]) of a band. It is 1 for a rectangle, 2/3 for an ellipse and
at most 0.84 for a capsule of any length."""

ARC = 0.25 * math.pi  # mean of sqrt(1 - u^2) over -1..1: a band's centroid lies so much of its sag off the axis
SAG_MOST = 0.3  # of half the band's length: what the sag may change before the outline is straightened anew
SAG_SETTLE = 4.0  # frames that say what is no sag
GAUSS_AT, GAUSS_WEIGHT = 0.5 * np.array(np.polynomial.legendre.leggauss(4)) + [[0.5], [0.0]]


NEXT = (1, 2, 0)  # axes in cyclic order


@njit(cache=True)
def length_of(variance):
    """Of a bar whose second moment along it is `variance`."""
    return math.sqrt(variance / EVEN)


# -- from the coverage ------------------------------------------------------------------------------------------------

@njit(cache=True)
def band_center(region, coverage, gain, result):
    """Replace the centroid in `result` by the projection of the band's centre on its axis; True when the fit holds.

    Least squares of the pixels' axial coordinate on (1, u, sqrt(1 - u^2)), weighted by coverage, is least squares of
    the column mids m(u) weighted by column height. Across is the major axis of the second moments, so a band must look
    wider than long; k mends the axis's error. Sets `round` for what has no straight rims at all, whose centroid is
    what it is.
    """
    if _cross_moment(region, coverage, result) < CROSS_MOMENT_MIN:
        result.round = 1.0
        return False
    half_width = 0.5 * length_of(max(result.var_major - c.BLUR_VARIANCE, 0.0))
    if half_width < BAND_HALF_WIDTH_MIN:
        return False
    normal = np.zeros((3, 3))
    right = np.zeros(3)
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
    inverse, determinant = _inverse(normal)
    if not determinant > 0.0:
        return False
    solution = np.zeros(3)
    for i in range(3):
        for j in range(3):
            solution[i] += inverse[i, j] * right[j]
    if abs(solution[2]) > half_width:
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
            a, b = NEXT[j], NEXT[NEXT[j]]
            c, d = NEXT[i], NEXT[NEXT[i]]
            inverse[i, j] = m[a, c] * m[b, d] - m[a, d] * m[b, c]
    determinant = m[0, 0] * inverse[0, 0] + m[0, 1] * inverse[1, 0] + m[0, 2] * inverse[2, 0]
    if determinant != 0.0:
        inverse /= determinant
    return inverse, determinant


@njit(cache=True)
def _band_coordinates(column, row, result):
    """(across, along) of a pixel in the band's own axes, from its centroid."""
    dx = column - result.x
    dy = row - result.y
    return dx * result.axis_x + dy * result.axis_y, dy * result.axis_x - dx * result.axis_y


@njit(cache=True)
def _arc(u, half_width):
    """sqrt(1 - u^2), averaged over a box as wide as the blur, as far as it falls on the band."""
    spread = 0.5 * length_of(c.BLUR_VARIANCE) / half_width
    low, high = max(u - spread, -1.0), min(u + spread, 1.0)
    if high - low < 1e-6:
        return 0.0
    return (_arc_integral(high) - _arc_integral(low)) / (high - low)


@njit(cache=True)
def _arc_integral(u):
    return 0.5 * (u * np.sqrt(1.0 - u * u) + np.arcsin(u))


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
            on_across = across / result.area
            v_uu += g2 * on_across * on_across
            v_uv += g2 * on_across * on_along
            v_vv += g2 * on_along * on_along
            v_ss += g2 * on_sag * on_sag
    ax, ay = result.axis_x, result.axis_y
    result.x -= ay * solution[0]
    result.y += ax * solution[0]
    result.v_xx = ax * ax * v_uu - 2.0 * ax * ay * v_uv + ay * ay * v_vv
    result.v_xy = ax * ay * v_uu + (ax * ax - ay * ay) * v_uv - ax * ay * v_vv
    result.v_yy = ay * ay * v_uu + 2.0 * ax * ay * v_uv + ax * ax * v_vv
    result.sag = solution[2]
    result.sag_variance = v_ss
    result.fit = 1.0


# -- from frame to frame ----------------------------------------------------------------------------------------------

@njit(**c.FAST)
def mend_band(outline, fitted, track):
    """Place a band on its axis: by what its sag differs from that which its outline is straightened by.

    The corners, which the outline rounds, look like a bend of their own: that is what the first frames measure, and
    it is taken off. False when the sag differs too much.
    """
    half = 0.5 * (fitted.m_xx + fitted.m_yy)
    spread = math.hypot(0.5 * (fitted.m_xx - fitted.m_yy), fitted.m_xy)
    ax, ay = outline.axis_x, outline.axis_y
    measured = sag_of(outline)
    outline.sag_frames += 1.0
    if outline.sag_frames <= SAG_SETTLE:
        outline.sag_zero += (measured - outline.sag_zero) / outline.sag_frames
    else:
        outline.sag = measured - outline.sag_zero
    rest = ARC * outline.sag
    sag = ARC * (outline.bend + outline.sag)
    fitted.x += ay * rest
    fitted.y -= ax * rest
    track.sag_x, track.sag_y = -ay * sag, ax * sag
    # Of the sag in this frame, of that which was there at first, and of its share that the first frames' mean has.
    along = ARC * ARC * outline.sag_variance * (2.0 + 1.0 / SAG_SETTLE)
    fitted.v_xx += ay * ay * along
    fitted.v_xy -= ax * ay * along
    fitted.v_yy += ax * ax * along
    return abs(outline.sag) < SAG_MOST * 0.5 * length_of(max(half - spread, 0.0))


@njit(**c.FAST)
def sag_of(outline):
    """s of `band_center`, of the area inside the outline, which is straightened already: what is left of it.

    Least squares of the axial coordinate on (1, u, sqrt(1 - u^2)), by angle and, with Gauss's points, by radius.
    """
    radius = outline.radius
    to_u = outline.long / outline.width
    n = n_u = n_b = uu = ub = bb = s_v = uv = bv = 0.0
    for j in range(c.NODES):
        for half in range(2):
            r = radius[j] + 0.5 * half * (radius[j + 1] - radius[j])
            cosine, sine = c.COSINES[j], c.SINES[j]
            if half == 1:
                cosine, sine = c.HALF_COSINES[j], c.HALF_SINES[j]
            for k in range(4):
                rho = r * GAUSS_AT[k]
                weight = GAUSS_WEIGHT[k] * rho * r
                across, along = to_u * rho * cosine, outline.high * rho * sine
                arc = math.sqrt(max(1.0 - across * across, 0.0))
                n += weight
                n_u += weight * across
                n_b += weight * arc
                uu += weight * across * across
                ub += weight * across * arc
                bb += weight * arc * arc
                s_v += weight * along
                uv += weight * across * along
                bv += weight * arc * along
    uu, ub, bb = uu - n_u * n_u / n, ub - n_u * n_b / n, bb - n_b * n_b / n
    uv, bv = uv - n_u * s_v / n, bv - n_b * s_v / n
    return (uu * bv - ub * uv) / (uu * bb - ub * ub)
