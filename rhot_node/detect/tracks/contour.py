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

from rhot_node.detect.tracks.contour_pixels import (
    AGE,
    AREA,
    AT_NODE,
    AXIS_X,
    AXIS_Y,
    BARE,
    BLUR,
    BLUR_LEAST,
    BLUR_MOST,
    CONTRAST,
    COSINES,
    COVER,
    DENT,
    DX,
    DY,
    FAST,
    G2,
    GAIN,
    GE,
    GP,
    GQ,
    HIGH,
    INSIDE,
    LEVEL,
    LONG,
    M_XX,
    MISFIT,
    NODES,
    ONE,
    OUT,
    P2,
    PART,
    PE,
    Q2,
    QE,
    RADIUS,
    RESTING,
    RHO,
    RIM_PRIOR,
    RING_SUM,
    SCALE,
    SETTLED,
    SINES,
    SLOPE_X,
    SLOPE_Y,
    SLOW,
    STEP_RAD,
    V_XX,
    WIDTH,
    X,
    Y,
    gather,
    smooth_around,
)

_TABLE_HALF, _TABLE_STEPS = 4.0, 128  # the edge's profile, tabulated to 4 blurs on either side
_AT = (np.arange(2 * int(_TABLE_HALF) * _TABLE_STEPS + 2) / _TABLE_STEPS - _TABLE_HALF)
PROFILE = np.stack([[0.5 * math.erfc(x / math.sqrt(2.0)) for x in _AT],
                    np.exp(-0.5 * _AT**2) / math.sqrt(2.0 * math.pi)], axis=1)
"""Phi(-x) and its slope phi(x)."""


@njit(**FAST)
def fit(y, u, v, cx, cy, look, radius, rim, steps, pixels, work, result):
    """Fit the outline about (cx, cy), starting from `radius` (NODES + 1,), the first repeated at the end.

    `rim` (2, NODES + 1): by how much the paint's level at the rim, and that of what adjoins, differ from the levels
    further in and out. Updates `radius`, `rim` and `look`; moves the outline's origin to its centroid. False when it
    cannot be fitted.
    """
    count = gather(y, u, v, cx, cy, look, radius, pixels, work)
    if count < NODES:
        return False
    smooth_around(work)
    result[DENT] = 0.0
    for step in range(steps):
        learns = step == steps - 1 and (look[AGE] < SETTLED or look[AGE] % RESTING == 0.0)
        misfit = _step(look, radius, rim, pixels, count, work, learns, result)
    result[MISFIT] = math.sqrt(max(misfit, 0.0) / count)
    return _centre(cx, cy, look, radius, work, result)


@njit(**FAST)
def _step(look, radius, rim, pixels, count, work, learns, result):
    """One Gauss-Newton step of the radii, which may learn the rim and the blur as well. Returns the squared misfit."""
    _set_levels(look[INSIDE], radius, rim, work)
    blur, slope_x, slope_y = look[BLUR], look[SLOPE_X], look[SLOPE_Y]
    sharp = 1.0 / blur
    to_table = _TABLE_STEPS * sharp
    middle = _TABLE_HALF * _TABLE_STEPS + 0.5
    top = PROFILE.shape[0] - 1.0
    misfit = blur_e = blur_2 = 0.0
    for i in range(count):
        node = np.uint64(pixels[i, AT_NODE])
        after = node + ONE
        part = pixels[i, PART]
        rest = 1.0 - part
        scale = rest * work[node, SCALE] + part * work[after, SCALE]
        d = (pixels[i, RHO] - rest * work[node, RADIUS] - part * work[after, RADIUS]) * scale
        around = rest * work[node, OUT] + part * work[after, OUT]
        contrast = (rest * work[node, CONTRAST] + part * work[after, CONTRAST]
                    + slope_x * pixels[i, DX] + slope_y * pixels[i, DY])
        at = np.uint64(min(max(d * to_table + middle, 0.0), top))
        cover, peak = PROFILE[at, 0], PROFILE[at, 1]
        e = pixels[i, COVER] - around - contrast * cover
        g = contrast * peak * sharp * scale
        misfit += e * e
        work[node, G2] += rest * g * g
        work[node, GE] += rest * g * e
        work[after, G2] += part * g * g
        work[after, GE] += part * g * e
        if learns:
            q = 1.0 - cover
            _add(work, node, rest, g, cover, q, e)
            _add(work, after, part, g, cover, q, e)
            h = contrast * peak * d * sharp * sharp
            blur_e += h * e
            blur_2 += h * h
    # At a band's corners levels and bends would be confused.
    gain = max(SLOW, 0.5 / (look[AGE] + 1.0)) if learns and look[WIDTH] == 0.0 else 0.0
    if gain > 0.0 and blur_2 > 0.0:
        look[BLUR] = min(max(blur + 0.5 * gain * blur_e / blur_2, BLUR_LEAST), BLUR_MOST)
    return misfit - _move(radius, rim, gain, work, result)


@njit(**FAST)
def _set_levels(level, radius, rim, work):
    """Empty a step's sums; set the level outside and the contrast at every node."""
    for j in range(NODES):
        work[j, :RING_SUM] = 0.0
        work[j, RADIUS], work[j, OUT] = radius[j], work[j, RING_SUM] + rim[1, j]
        work[j, CONTRAST] = level + rim[0, j] - work[j, OUT]
    work[NODES, :RING_SUM] = 0.0
    work[NODES, RADIUS], work[NODES, OUT], work[NODES, CONTRAST] = radius[0], work[0, OUT], work[0, CONTRAST]


@njit(**FAST)
def _move(radius, rim, gain, work, result):
    """Move the radii, and the rim's levels by `gain`, as the step's sums say. Returns by how much the misfit falls."""
    for k in range(RING_SUM):
        work[0, k] += work[NODES, k]
    mean = 0.0
    for j in range(NODES):
        mean += work[j, G2] / NODES
    shift = fall = 0.0
    for j in range(NODES):
        work[j, G2] += BARE * mean
        work[j, GE] /= work[j, G2]
        work[j, PE] = (_learn(rim, 0, j, gain, work, GP, P2, PE)
                        + _learn(rim, 1, j, gain, work, GQ, Q2, QE))
        shift += work[j, GE] / NODES
    for j in range(NODES):
        move = work[j, GE]
        fall += move * move * work[j, G2]
        result[DENT] = max(result[DENT], abs(move - shift))
        radius[j] += min(max(move - work[j, PE], -1.5), 1.5)
    radius[NODES], rim[0, NODES], rim[1, NODES] = radius[0], rim[0, 0], rim[1, 0]
    return fall


@njit(**FAST)
def _add(work, j, weight, g, p, q, e):
    work[j, GP] += weight * g * p
    work[j, P2] += weight * p * p
    work[j, PE] += weight * p * e
    work[j, GQ] += weight * g * q
    work[j, Q2] += weight * q * q
    work[j, QE] += weight * q * e


@njit(**FAST)
def _learn(rim, side, j, gain, work, mixed, square, error):
    """Learn a level at the edge together with the radius (its step is in GE); returns what that takes from it."""
    room = work[j, square] - work[j, mixed] ** 2 / work[j, G2]
    change = gain * (work[j, error] - work[j, mixed] * work[j, GE]) / (room + RIM_PRIOR)
    rim[side, j] += change
    return change * work[j, mixed] / work[j, G2]


@njit(**FAST)
def _centre(cx, cy, look, radius, work, result):
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
        v_uu += on_u * on_u / work[j, G2]
        v_uv += on_u * on_v / work[j, G2]
        v_vv += on_v * on_v / work[j, G2]
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
