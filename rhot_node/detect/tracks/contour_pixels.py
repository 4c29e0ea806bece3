"""Sort the pixels about an outline: the paint's inside, the surroundings, and those near it (`contour`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

# -- columns of the arrays ---------------------------------------------------------------------------------------------

NODES = 24
STEP_RAD = 2.0 * math.pi / NODES
COSINES = np.cos(STEP_RAD * np.arange(NODES))
SINES = np.sin(STEP_RAD * np.arange(NODES))
HALF_COSINES = np.cos(STEP_RAD * (np.arange(NODES) + 0.5))
HALF_SINES = np.sin(STEP_RAD * (np.arange(NODES) + 0.5))

BAND = 1.5  # px on either side of the outline that its blurred edge reaches
RING_NEAR, RING_FAR = 1.4, 2.8  # px outside the outline: what surrounds the marker
FLATNESS = 4.0  # grey levels^2 that surroundings are taken to vary by at least, as in `coverage`
INSIDE_MIN = 4  # pixels that the paint's level is taken from at least
BLUR_START, BLUR_LEAST, BLUR_MOST = 0.455, 0.38, 0.9  # px: point spread of 0.7 luma px and the 2x2 mean
SLOW = 0.1  # gain of what changes slowly: shading, rim, blur
SETTLED, RESTING = 9.0, 3.0  # frames until rim and blur are learnt, and the luma read, in every third frame only
RIM_PRIOR = 0.2  # pixels' worth of believing that paint and surroundings are at the edge as they are further off
BARE = 0.02  # of a node's mean information: nodes with hardly any pixel stay where they were
PIXELS_MAX = 4096  # near an outline

FAST: Any = {"cache": True, "error_model": "numpy", "fastmath": {"nsz", "arcp", "contract", "afn", "reassoc"}}

# Columns of a marker's look: projection, levels, shape of the coordinates.
PAINT_U, PAINT_V, AROUND_U, AROUND_V, C_UU, C_UV, C_VV = range(7)
SLOPE_X, SLOPE_Y, BLUR, AXIS_X, AXIS_Y, LONG, HIGH, AGE = range(7, 15)
W_U, W_V, GAIN = range(15, 18)  # the projection: a = W . (chroma - around); GAIN is |W|
PAINT_Y, INSIDE, BEND, WIDTH = range(18, 22)
LOOK_COLUMNS = 22
# Columns of a pixel near the outline.
AT_NODE, PART, RHO, COVER, DX, DY = range(6)
PIXEL_COLUMNS = 6
# Columns of the work space by node: sums of a step, sums of the surroundings, and what is interpolated between nodes.
G2, GE, GP, P2, PE, GQ, Q2, QE, RING_SUM, RING_COUNT, RADIUS, SCALE, OUT, CONTRAST = range(14)
WORK_COLUMNS = 14
ONE = np.uint64(1)
# Columns of a fit.
X, Y, AREA, V_XX, V_XY, V_YY, M_XX, M_XY, M_YY, MISFIT, DENT, LEVEL = range(12)
FIT_COLUMNS = 12


# -- pixels inside, outside and near an outline ------------------------------------------------------------------------

@njit(**FAST)
def project(look):
    """Set the projection that lets least of the surroundings' variation through, paint - around = 1."""
    du, dv = look[PAINT_U] - look[AROUND_U], look[PAINT_V] - look[AROUND_V]
    uu, uv, vv = look[C_UU] + FLATNESS, look[C_UV], look[C_VV] + FLATNESS
    wu, wv = vv * du - uv * dv, uu * dv - uv * du
    norm = wu * du + wv * dv
    look[W_U], look[W_V] = wu / norm, wv / norm
    look[GAIN] = math.hypot(look[W_U], look[W_V])


@njit(**FAST)
def _turn(u, v):
    """The angle of (u, v) in steps of NODES per turn, 0 <= turn <= NODES, to 1e-3 of a step's tenth."""
    a, b = abs(u), abs(v)
    low, high = min(a, b), max(a, b)
    z = low / high
    z2 = z * z
    angle = z * (0.99997726 + z2 * (-0.33262347 + z2 * (0.19354346 + z2 * (-0.11643287
                                                                         + z2 * (0.05265332 - z2 * 0.01172120)))))
    if b > a:
        angle = 0.5 * math.pi - angle
    if u < 0.0:
        angle = math.pi - angle
    if v < 0.0:
        angle = 2.0 * math.pi - angle
    return min(angle * (NODES / (2.0 * math.pi)), NODES - 1e-9)


@njit(**FAST)
def gather(y, u, v, cx, cy, look, radius, pixels, work):
    """Sort the pixels about the outline: the paint's inside and the surroundings are summed, those near it listed.

    Returns how many are listed; 0 when there are too few to fit anything, or more than `pixels` holds.
    """
    work[:] = 0.0
    least, most = _slopes(look, radius, work)
    ax, ay, long, high = look[AXIS_X], look[AXIS_Y], 1.0 / look[LONG], 1.0 / look[HIGH]
    bend, width = look[BEND], 1.0 / max(look[WIDTH], 1.0)
    wu, wv, bu, bv = look[W_U], look[W_V], look[AROUND_U], look[AROUND_V]
    deep, beyond = least - (BAND + 0.2) * max(long, high), most + RING_FAR * max(long, high)
    deep2, beyond2 = deep * deep if deep > 0.0 else 0.0, beyond * beyond
    x0, x1, y0, y1 = _box(cx, cy, look, beyond, u.shape)
    with_luma = look[AGE] % RESTING == 0.0
    count = 0
    n = s_a = s_x = s_y = s_ax = s_ay = s_xx = s_xy = s_yy = s_u = s_v = s_l = 0.0
    r_n = r_u = r_v = r_uu = r_uv = r_vv = 0.0
    for row in range(y0, y1 + 1):
        dy = row - cy
        for column in range(x0, x1 + 1):
            dx = column - cx
            across, along = dx * ax + dy * ay, dy * ax - dx * ay
            if bend != 0.0:
                along -= bend * math.sqrt(max(1.0 - (across * width) ** 2, 0.0))
            un, vn = across * long, along * high
            square = un * un + vn * vn
            if square > beyond2:
                continue
            pu, pv = np.float64(u[row, column]) - bu, np.float64(v[row, column]) - bv
            a = wu * pu + wv * pv
            inside = square < deep2
            if not inside:
                rho = math.sqrt(square)
                turn = _turn(un, vn)
                node = np.uint64(turn)
                part = turn - node
                d = _outside(work, node, part, rho)
                if d > RING_FAR:
                    continue
                if d > RING_NEAR:
                    _add_around(work, node, part, a)
                    r_n, r_u, r_v = r_n + 1.0, r_u + pu, r_v + pv
                    r_uu, r_uv, r_vv = r_uu + pu * pu, r_uv + pu * pv, r_vv + pv * pv
                if abs(d) <= BAND:
                    if count == pixels.shape[0]:
                        return 0
                    pixels[count, AT_NODE], pixels[count, PART], pixels[count, RHO] = node, part, rho
                    pixels[count, COVER], pixels[count, DX], pixels[count, DY] = a, dx, dy
                    count += 1
                inside = d < -BAND
            if inside:
                n, s_a, s_x, s_y, s_u, s_v = n + 1.0, s_a + a, s_x + dx, s_y + dy, s_u + pu, s_v + pv
                s_ax, s_ay = s_ax + a * dx, s_ay + a * dy
                s_xx, s_xy, s_yy = s_xx + dx * dx, s_xy + dx * dy, s_yy + dy * dy
                if with_luma:
                    s_l += y[2 * row, 2 * column]
    if n < INSIDE_MIN or r_n < NODES:
        return 0
    _learn_slope(look, n, s_a, s_x, s_y, s_ax, s_ay, s_xx, s_xy, s_yy)
    _learn_colours(look, n, s_u, s_v, r_n, r_u, r_v, r_uu, r_uv, r_vv)
    if with_luma:
        look[PAINT_Y] = s_l / n
    return count


@njit(**FAST)
def _box(cx, cy, look, beyond, shape):
    """First and last column, first and last row that may lie within `beyond` units of radius."""
    ax, ay, bend = look[AXIS_X], look[AXIS_Y], look[BEND]
    reach_x = beyond * math.sqrt((ax * look[LONG]) ** 2 + (ay * look[HIGH]) ** 2) + abs(ay * bend)
    reach_y = beyond * math.sqrt((ay * look[LONG]) ** 2 + (ax * look[HIGH]) ** 2) + abs(ax * bend)
    return (max(int(cx - reach_x), 0), min(int(cx + reach_x) + 1, shape[1] - 1),
            max(int(cy - reach_y), 0), min(int(cy + reach_y) + 1, shape[0] - 1))


@njit(**FAST)
def _outside(work, node, part, rho):
    """How far outside the outline, px square to it, a radius between two nodes ends."""
    after = node + ONE
    return ((rho - work[node, RADIUS] - part * (work[after, RADIUS] - work[node, RADIUS]))
            * (work[node, SCALE] + part * (work[after, SCALE] - work[node, SCALE])))


@njit(**FAST)
def _add_around(work, node, part, a):
    after = node + ONE
    work[node, RING_SUM] += (1.0 - part) * a
    work[node, RING_COUNT] += 1.0 - part
    work[after, RING_SUM] += part * a
    work[after, RING_COUNT] += part


@njit(**FAST)
def _learn_slope(look, n, s_a, s_x, s_y, s_ax, s_ay, s_xx, s_xy, s_yy):
    """Set the paint's slope, slowly, and its level, carried to the outline's origin, from the sums over n pixels."""
    gain = max(SLOW, 1.0 / (look[AGE] + 1.0))
    xx, xy, yy = s_xx - s_x * s_x / n, s_xy - s_x * s_y / n, s_yy - s_y * s_y / n
    xa, ya = s_ax - s_x * s_a / n, s_ay - s_y * s_a / n
    determinant = xx * yy - xy * xy
    if determinant > 0.05 * xx * yy:
        look[SLOPE_X] += gain * ((yy * xa - xy * ya) / determinant - look[SLOPE_X])
        look[SLOPE_Y] += gain * ((xx * ya - xy * xa) / determinant - look[SLOPE_Y])
    look[INSIDE] = (s_a - look[SLOPE_X] * s_x - look[SLOPE_Y] * s_y) / n


@njit(**FAST)
def _learn_colours(look, n, s_u, s_v, r_n, r_u, r_v, r_uu, r_uv, r_vv):
    """Set the paint's chroma and that of the surroundings, with its spread, from sums about the last one."""
    m_u, m_v = r_u / r_n, r_v / r_n
    look[PAINT_U], look[PAINT_V] = look[AROUND_U] + s_u / n, look[AROUND_V] + s_v / n
    look[AROUND_U], look[AROUND_V] = look[AROUND_U] + m_u, look[AROUND_V] + m_v
    look[C_UU], look[C_UV], look[C_VV] = r_uu / r_n - m_u * m_u, r_uv / r_n - m_u * m_v, r_vv / r_n - m_v * m_v


@njit(**FAST)
def _slopes(look, radius, work):
    """Set px per unit of radius, square to the outline, at every node; returns the least and the greatest radius."""
    least = most = radius[0]
    for j in range(NODES):
        here = radius[j]
        slope = (radius[j + 1] - radius[j - 1 if j > 0 else NODES - 1]) / (2.0 * STEP_RAD * here)
        gu = (COSINES[j] + slope * SINES[j]) / look[LONG]
        gv = (SINES[j] - slope * COSINES[j]) / look[HIGH]
        if look[BEND] != 0.0:
            across = min(max(here * COSINES[j] * look[LONG] / look[WIDTH], -0.97), 0.97)
            gu += gv * look[BEND] * across / (look[WIDTH] * math.sqrt(1.0 - across * across))
        work[j, RADIUS], work[j, SCALE] = here, 1.0 / math.sqrt(gu * gu + gv * gv)
        least, most = min(least, here), max(most, here)
    work[NODES, RADIUS], work[NODES, SCALE] = radius[0], work[0, SCALE]
    return least, most


@njit(**FAST)
def smooth_around(work):
    """Turn the surroundings' sums by node into levels, each with half of its neighbours."""
    work[0, RING_SUM] += work[NODES, RING_SUM]
    work[0, RING_COUNT] += work[NODES, RING_COUNT]
    total = count = 0.0
    for j in range(NODES):
        total += work[j, RING_SUM]
        count += work[j, RING_COUNT]
    mean = total / count
    for j in range(NODES):
        before, after = j - 1 if j > 0 else NODES - 1, j + 1 if j + 1 < NODES else 0
        weight = work[j, RING_COUNT] + 0.5 * (work[before, RING_COUNT] + work[after, RING_COUNT])
        total = work[j, RING_SUM] + 0.5 * (work[before, RING_SUM] + work[after, RING_SUM])
        work[j, OUT] = (total + 0.5 * mean) / (weight + 0.5)
    for j in range(NODES):
        work[j, RING_SUM] = work[j, OUT]
