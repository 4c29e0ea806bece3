"""The free outline of a marker, fitted to its edge pixels in one projection of the chroma plane.

The outline is a radius at every one of NODES angles about the marker's middle, linear in between, in axes along and
across the marker in which it is about as long as wide: discs, painted fingertips - rounded, cut or tapered - and bands
alike. A band bent by its tilt is straightened: along it, BEND sqrt(1 - (across / WIDTH)^2) is taken off
(`position.band_center`); WIDTH is 0 for what is no band.
A pixel at the signed distance d from it is modelled as

    a = out + (in - out) Phi(-d / blur),

a: its chroma projected so that the surroundings become 0 and the paint 1 (`project`). `out` is what lies around there,
`in` the paint's level with its shading; what both differ by right at the edge is learnt slowly, at every angle.
Gauss-Newton steps move each radius; only pixels near the outline count. The centroid of a free outline is, for a disc,
as precise as that of a fitted circle, whose position is the outline's first harmonic too; nearly so for a capsule.

All coordinates are chroma pixels.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

NODES = 24
STEP_RAD = 2.0 * math.pi / NODES
COSINES = np.cos(STEP_RAD * np.arange(NODES))
SINES = np.sin(STEP_RAD * np.arange(NODES))
HALF_COSINES = np.cos(STEP_RAD * (np.arange(NODES) + 0.5))
HALF_SINES = np.sin(STEP_RAD * (np.arange(NODES) + 0.5))

BAND = 1.75  # px on either side of the outline that its blurred edge reaches
RING_NEAR, RING_FAR = 1.5, 3.5  # px outside the outline: what surrounds the marker
FLATNESS = 4.0  # grey levels^2 that surroundings are taken to vary by at least, as in `coverage`
INSIDE_MIN = 8  # pixels that the paint's level is taken from at least
BLUR_START, BLUR_LEAST, BLUR_MOST = 0.455, 0.38, 0.9  # px: point spread of 0.7 luma px and the 2x2 mean
SLOW = 0.1  # gain per frame of what changes slowly: shading, rim, blur
RIM_PRIOR = 0.2  # pixels' worth of believing that paint and surroundings are at the edge as they are further off
BARE = 0.02  # of a node's mean information: nodes with hardly any pixel stay where they were
PIXELS_MAX = 4096  # near an outline

FAST = {"cache": True, "error_model": "numpy", "fastmath": {"nsz", "arcp", "contract", "afn", "reassoc"}}

# Columns of a marker's look: projection, levels, shape of the coordinates.
PAINT_U, PAINT_V, AROUND_U, AROUND_V, C_UU, C_UV, C_VV = range(7)
SLOPE_X, SLOPE_Y, BLUR, AXIS_X, AXIS_Y, LONG, HIGH, AGE = range(7, 15)
W_U, W_V, GAIN = range(15, 18)  # the projection: a = W . (chroma - around); GAIN is |W|
PAINT_Y, INSIDE, BEND, WIDTH = range(18, 22)
LOOK_COLUMNS = 22
# Columns of a pixel near the outline.
_NODE, _PART, _RHO, _A, _DX, _DY = range(6)
PIXEL_COLUMNS = 6
# Rows of the sums by node.
_G2, _GE, _GP, _P2, _PE, _GQ, _Q2, _QE, _OUT, _OUT_N, _SCALE = range(11)
SUM_ROWS = 11
# Columns of a fit.
X, Y, AREA, V_XX, V_XY, V_YY, M_XX, M_XY, M_YY, MISFIT, DENT, LEVEL = range(12)
FIT_COLUMNS = 12

_TABLE_HALF, _TABLE_STEPS = 4.0, 128  # the edge's profile, tabulated to 4 blurs on either side
_AT = (np.arange(2 * int(_TABLE_HALF) * _TABLE_STEPS + 2) / _TABLE_STEPS - _TABLE_HALF)
PROFILE = np.stack([[0.5 * math.erfc(x / math.sqrt(2.0)) for x in _AT],
                    np.exp(-0.5 * _AT**2) / math.sqrt(2.0 * math.pi)], axis=1)
"""Phi(-x) and its slope phi(x)."""


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
    return angle * (NODES / (2.0 * math.pi))


@njit(**FAST)
def fit(y, u, v, cx, cy, look, radius, rim, steps, pixels, sums, result):
    """Fit the outline about (cx, cy), starting from `radius` (NODES + 1,), the first repeated at the end.

    `rim` (2, NODES + 1): by how much the paint's level at the rim, and that of what adjoins, differ from the levels
    further in and out. Updates `radius`, `rim` and `look`; moves the outline's origin to its centroid. False when it
    cannot be fitted.
    """
    count = _gather(y, u, v, cx, cy, look, radius, pixels, sums)
    if count < NODES:
        return False
    _smooth_around(sums)
    result[DENT] = 0.0
    for step in range(steps):
        misfit = _step(look, radius, rim, pixels, count, sums, step == steps - 1, result)
    result[MISFIT] = math.sqrt(max(misfit, 0.0) / count)
    return _centre(cx, cy, look, radius, sums, result)


@njit(**FAST)
def _gather(y, u, v, cx, cy, look, radius, pixels, sums):
    """Sort the pixels about the outline: the paint's inside and the surroundings are summed, those near it listed."""
    sums[:] = 0.0
    ax, ay, long, high = look[AXIS_X], look[AXIS_Y], 1.0 / look[LONG], 1.0 / look[HIGH]
    bend, width = look[BEND], 1.0 / max(look[WIDTH], 1.0)
    wu, wv, bu, bv = look[W_U], look[W_V], look[AROUND_U], look[AROUND_V]
    least, most = _slopes(look, radius, sums)
    short = max(long, high)
    deep, beyond = least - (BAND + 0.7) * short, most + (RING_FAR + 0.5) * short
    reach_x = beyond * math.sqrt((ax / long) ** 2 + (ay / high) ** 2) + abs(ay * bend)
    reach_y = beyond * math.sqrt((ay / long) ** 2 + (ax / high) ** 2) + abs(ax * bend)
    x0, x1 = max(int(cx - reach_x), 0), min(int(cx + reach_x) + 1, u.shape[1] - 1)
    y0, y1 = max(int(cy - reach_y), 0), min(int(cy + reach_y) + 1, u.shape[0] - 1)
    deep2, beyond2 = deep * deep if deep > 0.0 else 0.0, beyond * beyond
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
                j = min(int(turn), NODES - 1)
                part = turn - j
                d = ((rho - radius[j] - part * (radius[j + 1] - radius[j]))
                     * (sums[_SCALE, j] + part * (sums[_SCALE, j + 1] - sums[_SCALE, j])))
                if d > RING_FAR:
                    continue
                if d > RING_NEAR:
                    sums[_OUT_N, j] += 1.0 - part
                    sums[_OUT, j] += (1.0 - part) * a
                    k = j + 1 if j + 1 < NODES else 0
                    sums[_OUT_N, k] += part
                    sums[_OUT, k] += part * a
                    r_n += 1.0
                    r_u += pu
                    r_v += pv
                    r_uu += pu * pu
                    r_uv += pu * pv
                    r_vv += pv * pv
                if abs(d) <= BAND:
                    if count == pixels.shape[0]:
                        return 0
                    pixels[count, _NODE], pixels[count, _PART], pixels[count, _RHO] = j, part, rho
                    pixels[count, _A], pixels[count, _DX], pixels[count, _DY] = a, dx, dy
                    count += 1
                inside = d < -BAND
            if inside:
                n += 1.0
                s_a += a
                s_x += dx
                s_y += dy
                s_ax += a * dx
                s_ay += a * dy
                s_xx += dx * dx
                s_xy += dx * dy
                s_yy += dy * dy
                s_u += pu
                s_v += pv
                s_l += y[2 * row, 2 * column]
    if n < INSIDE_MIN or r_n < NODES:
        return 0
    gain = max(SLOW, 1.0 / (look[AGE] + 1.0))
    xx, xy, yy = s_xx - s_x * s_x / n, s_xy - s_x * s_y / n, s_yy - s_y * s_y / n
    xa, ya = s_ax - s_x * s_a / n, s_ay - s_y * s_a / n
    determinant = xx * yy - xy * xy
    if determinant > 0.05 * xx * yy:
        look[SLOPE_X] += gain * ((yy * xa - xy * ya) / determinant - look[SLOPE_X])
        look[SLOPE_Y] += gain * ((xx * ya - xy * xa) / determinant - look[SLOPE_Y])
    # The paint's level, carried to the outline's origin.
    look[INSIDE] = (s_a - look[SLOPE_X] * s_x - look[SLOPE_Y] * s_y) / n
    sums[_OUT_N, NODES], sums[_OUT, NODES] = r_n, wu * r_u + wv * r_v
    look[PAINT_U], look[PAINT_V], look[PAINT_Y] = bu + s_u / n, bv + s_v / n, s_l / n
    m_u, m_v = r_u / r_n, r_v / r_n
    look[AROUND_U], look[AROUND_V] = bu + m_u, bv + m_v
    look[C_UU], look[C_UV], look[C_VV] = r_uu / r_n - m_u * m_u, r_uv / r_n - m_u * m_v, r_vv / r_n - m_v * m_v
    return count


@njit(**FAST)
def _slopes(look, radius, sums):
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
        sums[_SCALE, j] = 1.0 / math.sqrt(gu * gu + gv * gv)
        least, most = min(least, here), max(most, here)
    sums[_SCALE, NODES] = sums[_SCALE, 0]
    return least, most


@njit(**FAST)
def _smooth_around(sums):
    """Turn the surroundings' sums by node into levels, each with half of its neighbours."""
    mean = sums[_OUT, NODES] / sums[_OUT_N, NODES]
    for j in range(NODES):
        before, after = j - 1 if j > 0 else NODES - 1, j + 1 if j + 1 < NODES else 0
        weight = sums[_OUT_N, j] + 0.5 * (sums[_OUT_N, before] + sums[_OUT_N, after])
        total = sums[_OUT, j] + 0.5 * (sums[_OUT, before] + sums[_OUT, after])
        sums[_G2, j] = (total + 0.5 * mean) / (weight + 0.5)
    for j in range(NODES):
        sums[_OUT, j] = sums[_G2, j]
    sums[_OUT, NODES] = sums[_OUT, 0]


@njit(**FAST)
def _step(look, radius, rim, pixels, count, sums, last, result):
    """One Gauss-Newton step of the radii; the last one also learns the rim and the blur. Returns the squared misfit."""
    sums[:_OUT, :] = 0.0
    blur, level, slope_x, slope_y = look[BLUR], look[INSIDE], look[SLOPE_X], look[SLOPE_Y]
    sharp = 1.0 / blur
    to_table = _TABLE_STEPS * sharp
    middle = _TABLE_HALF * _TABLE_STEPS + 0.5
    top = PROFILE.shape[0] - 1
    misfit = blur_e = blur_2 = 0.0
    for i in range(count):
        j = int(pixels[i, _NODE])
        part = pixels[i, _PART]
        scale = sums[_SCALE, j] + part * (sums[_SCALE, j + 1] - sums[_SCALE, j])
        d = (pixels[i, _RHO] - radius[j] - part * (radius[j + 1] - radius[j])) * scale
        at = min(max(int(d * to_table + middle), 0), top)
        cover, peak = PROFILE[at, 0], PROFILE[at, 1]
        around = (sums[_OUT, j] + part * (sums[_OUT, j + 1] - sums[_OUT, j])
                  + rim[1, j] + part * (rim[1, j + 1] - rim[1, j]))
        contrast = (level + slope_x * pixels[i, _DX] + slope_y * pixels[i, _DY]
                    + rim[0, j] + part * (rim[0, j + 1] - rim[0, j]) - around)
        e = pixels[i, _A] - around - contrast * cover
        g = contrast * peak * sharp * scale
        misfit += e * e
        sums[_G2, j] += (1.0 - part) * g * g
        sums[_GE, j] += (1.0 - part) * g * e
        sums[_G2, j + 1] += part * g * g
        sums[_GE, j + 1] += part * g * e
        if last:
            q = 1.0 - cover
            _add(sums, j, 1.0 - part, g, cover, q, e)
            _add(sums, j + 1, part, g, cover, q, e)
            h = contrast * peak * d * sharp * sharp
            blur_e += h * e
            blur_2 += h * h
    for k in range(_OUT):
        sums[k, 0] += sums[k, NODES]
    mean = 0.0
    for j in range(NODES):
        mean += sums[_G2, j] / NODES
    gain = max(SLOW, 0.5 / (look[AGE] + 1.0)) if last else 0.0
    learning = gain if look[WIDTH] == 0.0 else 0.0  # at a band's corners levels and bends would be confused
    shift = 0.0
    for j in range(NODES):
        sums[_G2, j] += BARE * mean
        sums[_GE, j] /= sums[_G2, j]
        sums[_PE, j] = (_learn(rim, 0, j, learning, sums, _GP, _P2, _PE)
                        + _learn(rim, 1, j, learning, sums, _GQ, _Q2, _QE))
        shift += sums[_GE, j] / NODES
    for j in range(NODES):
        move = sums[_GE, j]
        misfit -= move * move * sums[_G2, j]
        result[DENT] = max(result[DENT], abs(move - shift))
        radius[j] += min(max(move - sums[_PE, j], -1.5), 1.5)
    radius[NODES], rim[0, NODES], rim[1, NODES] = radius[0], rim[0, 0], rim[1, 0]
    if learning > 0.0 and blur_2 > 0.0:
        look[BLUR] = min(max(blur + 0.5 * gain * blur_e / blur_2, BLUR_LEAST), BLUR_MOST)
    return misfit


@njit(**FAST)
def _add(sums, j, weight, g, p, q, e):
    sums[_GP, j] += weight * g * p
    sums[_P2, j] += weight * p * p
    sums[_PE, j] += weight * p * e
    sums[_GQ, j] += weight * g * q
    sums[_Q2, j] += weight * q * q
    sums[_QE, j] += weight * q * e


@njit(**FAST)
def _learn(rim, side, j, gain, sums, mixed, square, error):
    """Learn a level at the edge together with the radius (its step is in _GE); returns what that takes from it."""
    room = sums[square, j] - sums[mixed, j] ** 2 / sums[_G2, j]
    change = gain * (sums[error, j] - sums[mixed, j] * sums[_GE, j]) / (room + RIM_PRIOR)
    rim[side, j] += change
    return change * sums[mixed, j] / sums[_G2, j]


@njit(**FAST)
def _centre(cx, cy, look, radius, sums, result):
    """Centroid, area, second moments, the centroid's covariance per unit noise variance; moves the origin there."""
    area = mu = mv = uu = uv = vv = 0.0
    for j in range(NODES):
        r, c, s = radius[j], COSINES[j], SINES[j]
        if not r > 0.5:
            return False
        r2 = r * r
        area += 0.5 * r2
        mu += r * r2 * c / 3.0
        mv += r * r2 * s / 3.0
        uu += 0.25 * r2 * r2 * c * c
        uv += 0.25 * r2 * r2 * c * s
        vv += 0.25 * r2 * r2 * s * s
    mu, mv = mu / area, mv / area
    uu, uv, vv = uu / area - mu * mu, uv / area - mu * mv, vv / area - mv * mv
    area *= STEP_RAD
    v_uu = v_uv = v_vv = 0.0
    for j in range(NODES):
        lever = radius[j] * STEP_RAD / area
        on_u = lever * (radius[j] * COSINES[j] - mu)
        on_v = lever * (radius[j] * SINES[j] - mv)
        v_uu += on_u * on_u / sums[_G2, j]
        v_uv += on_u * on_v / sums[_G2, j]
        v_vv += on_v * on_v / sums[_G2, j]
    long, high, ax, ay = look[LONG], look[HIGH], look[AXIS_X], look[AXIS_Y]
    result[X], result[Y] = cx + ax * long * mu - ay * high * mv, cy + ay * long * mu + ax * high * mv
    result[AREA] = area * long * high
    square = look[GAIN] ** 2
    _turned(long * long * v_uu * square, long * high * v_uv * square, high * high * v_vv * square, ax, ay, result, V_XX)
    _turned(long * long * uu, long * high * uv, high * high * vv, ax, ay, result, M_XX)
    result[LEVEL] = look[INSIDE]
    _move_origin(radius, mu, mv)
    look[AGE] += 1.0
    return True


@njit(**FAST)
def _turned(uu, uv, vv, ax, ay, result, first):
    result[first] = ax * ax * uu - 2.0 * ax * ay * uv + ay * ay * vv
    result[first + 1] = ax * ay * (uu - vv) + (ax * ax - ay * ay) * uv
    result[first + 2] = ay * ay * uu + 2.0 * ax * ay * uv + ax * ax * vv


@njit(**FAST)
def _move_origin(radius, mu, mv):
    """Radii about (mu, mv), to first order: the outline itself stays."""
    before = radius[NODES - 1]
    first = radius[0]
    for j in range(NODES):
        here = radius[j]
        after = radius[j + 1] if j + 1 < NODES else first
        slope = (after - before) / (2.0 * STEP_RAD)
        radius[j] = here - (mu * COSINES[j] + mv * SINES[j]) + slope / here * (mv * COSINES[j] - mu * SINES[j])
        before = here
    radius[NODES] = radius[0]
