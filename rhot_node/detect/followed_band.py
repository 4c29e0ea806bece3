"""A followed band: from the middle of its straightened outline to the axis that it is painted round.

All coordinates are chroma pixels.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot_node.detect import contour_columns as c
from rhot_node.detect import track as t

# The wrist band's sag (`position.band_center`): a measured value within so many standard deviations of the last one is
# taken in with this gain, any other as it is.
SAG_GAIN, SAG_STEADY = 0.25, 5.0
SAG_MOST = 0.3  # of half the band's length: what the sag may change before the outline is straightened anew
SAG_SETTLE, SAG_JUMP = 4.0, 0.35  # frames that say what is no sag; px that it may jump in them
GAUSS_AT = 0.5 + 0.5 * np.polynomial.legendre.leggauss(4)[0]
GAUSS_WEIGHT = 0.5 * np.polynomial.legendre.leggauss(4)[1]

# Columns of `marks`: how a marker is followed.
# LIMB_TAKEN, LIMB_LEFT: `stated.LIMB_OF_SHAPE`. IS_BAND: a band with visible rims, which give a point on its axis.
# OFF_AXIS: of a band without visible rims, the standard deviation of its centroid about its axis, as a share of its
# extent.
READY, IS_BAND, SAG, SAG_VARIANCE, SAG_ZERO, SAG_FRAMES, LIMB_TAKEN, LIMB_LEFT, OFF_AXIS = range(9)
MARK_COLUMNS = 9


@njit(**c.FAST)
def mend_band(look, radius, mark, noise, fitted, track):
    """Place a band on its axis: by what its sag, smoothed, differs from that which its outline is straightened by.

    The corners, which the outline rounds, look like a bend of their own: that is what the first frames measure, and it
    is taken off. False when the sag differs too much.
    """
    half = 0.5 * (fitted[c.M_XX] + fitted[c.M_YY])
    spread = math.hypot(0.5 * (fitted[c.M_XX] - fitted[c.M_YY]), fitted[c.M_XY])
    ax, ay = look[c.AXIS_X], look[c.AXIS_Y]
    measured = sag_of(radius, look)
    mark[SAG_FRAMES] += 1.0
    if mark[SAG_FRAMES] <= SAG_SETTLE:
        if mark[SAG_FRAMES] > 1.0 and abs(measured - mark[SAG_ZERO]) > SAG_JUMP:
            return False
        mark[SAG_ZERO] += (measured - mark[SAG_ZERO]) / mark[SAG_FRAMES]
    away = measured - mark[SAG_ZERO] - mark[SAG]
    steady = SAG_STEADY * noise * math.sqrt(mark[SAG_VARIANCE])
    if mark[SAG_FRAMES] > SAG_SETTLE:
        mark[SAG] += (SAG_GAIN if abs(away) < steady else 1.0) * away
    rest = 0.25 * math.pi * mark[SAG]
    sag = 0.25 * math.pi * (look[c.BEND] + mark[SAG])
    fitted[c.X] += ay * rest
    fitted[c.Y] -= ax * rest
    track[t.SAG_X], track[t.SAG_Y] = -ay * sag, ax * sag
    # (pi / 4)^2 of the smoothed sag's, and of that which was there at first, which no later frame tells anew.
    along = 0.6 * mark[SAG_VARIANCE] * (1.0 + 1.0 / SAG_SETTLE + SAG_GAIN)
    fitted[c.V_XX] += ay * ay * along
    fitted[c.V_XY] -= ax * ay * along
    fitted[c.V_YY] += ax * ax * along
    return abs(mark[SAG]) < SAG_MOST * math.sqrt(max(3.0 * (half - spread), 0.0))


@njit(**c.FAST)
def sag_of(radius, look):
    """s of `position.band_center`, of the area inside the outline, which is straightened already: what is left of it.

    Least squares of the axial coordinate on (1, u, sqrt(1 - u^2)), by angle and, with Gauss's points, by radius.
    """
    to_u = look[c.LONG] / look[c.WIDTH]
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
                across, along = to_u * rho * cosine, look[c.HIGH] * rho * sine
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
