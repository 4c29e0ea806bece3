"""The free outline of a marker, fitted to its edge pixels in one projection of the chroma plane.

The outline is a radius at every one of NODES angles about the marker's middle, linear in between, in axes along and
across the marker in which it is about as long as wide: discs, painted fingertips - rounded, cut or tapered - and bands
alike. A band bent by its tilt is straightened: along it, BEND sqrt(1 - (across / WIDTH)^2) is taken off
(`band.band_center`); WIDTH is 0 for what is no band.
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

from rhot_node.detect.outline_pixels import (
    BAND,
    BARE,
    BLUR_LEAST,
    BLUR_MOST,
    COSINES,
    FAST,
    NODES,
    ONE,
    RESTING,
    RIM_PRIOR,
    SETTLED,
    SINES,
    SLOW,
    STEP_RAD,
    gather,
    smooth_around,
)

_TABLE_HALF, _TABLE_STEPS = 4.0, 128  # the edge's profile, tabulated to 4 blurs on either side
_AT = (np.arange(2 * int(_TABLE_HALF) * _TABLE_STEPS + 2) / _TABLE_STEPS - _TABLE_HALF)
PROFILE = np.stack([[0.5 * math.erfc(x / math.sqrt(2.0)) for x in _AT],
                    np.exp(-0.5 * _AT**2) / math.sqrt(2.0 * math.pi)], axis=1)
"""Phi(-x) and its slope phi(x)."""


@njit(**FAST)
def fit(image, cx, cy, outline, steps, work):
    """Fit the outline about (cx, cy), starting from its radii, in `steps` steps.

    Updates the outline, moves its origin to its centroid, and fills `work.fitted`. False when it cannot be fitted.
    """
    pixels, nodes, results = work
    result = results[0]
    count = gather(image, cx, cy, outline, pixels, nodes)
    if count < NODES:
        return False
    smooth_around(nodes)
    result.dent = 0.0
    for step in range(steps):
        learns = step == steps - 1 and (outline.age < SETTLED or outline.age % RESTING == 0.0)
        misfit = _step(outline, pixels, count, nodes, learns, result)
    result.misfit = math.sqrt(max(misfit, 0.0) / count)
    return _centre(cx, cy, outline, nodes, result)


@njit(**FAST)
def _step(outline, pixels, count, nodes, learns, result):
    """One Gauss-Newton step of the radii, which may learn the rim and the blur as well. Returns the squared misfit."""
    _set_levels(outline, nodes)
    blur, slope_x, slope_y = outline.blur, outline.slope_x, outline.slope_y
    sharp = 1.0 / blur
    to_table = _TABLE_STEPS * sharp
    middle = _TABLE_HALF * _TABLE_STEPS + 0.5
    top = PROFILE.shape[0] - 1.0
    misfit = blur_e = blur_2 = 0.0
    for i in range(count):
        pixel = pixels[i]
        node = np.uint64(pixel.node)
        before, after = nodes[node], nodes[node + ONE]
        part = pixel.part
        rest = 1.0 - part
        scale = rest * before.scale + part * after.scale
        d = (pixel.rho - rest * before.radius - part * after.radius) * scale
        around = rest * before.out + part * after.out
        contrast = rest * before.contrast + part * after.contrast + slope_x * pixel.dx + slope_y * pixel.dy
        at = np.uint64(min(max(d * to_table + middle, 0.0), top))
        cover, peak = PROFILE[at, 0], PROFILE[at, 1]
        e = pixel.cover - around - contrast * cover
        g = contrast * peak * sharp * scale
        misfit += e * e
        before.g2 += rest * g * g
        before.ge += rest * g * e
        after.g2 += part * g * g
        after.ge += part * g * e
        if learns:
            q = 1.0 - cover
            _add(before, rest, g, cover, q, e)
            _add(after, part, g, cover, q, e)
            h = contrast * peak * d * sharp * sharp
            blur_e += h * e
            blur_2 += h * h
    # At a band's corners levels and bends would be confused.
    gain = max(SLOW, 0.5 / (outline.age + 1.0)) if learns and outline.width == 0.0 else 0.0
    if gain > 0.0 and blur_2 > 0.0:
        outline.blur = min(max(blur + 0.5 * gain * blur_e / blur_2, BLUR_LEAST), BLUR_MOST)
    return misfit - _move(outline, gain, nodes, result)


@njit(**FAST)
def _set_levels(outline, nodes):
    """Empty a step's sums; set the level outside and the contrast at every node."""
    radius, rim = outline.radius, outline.rim
    for j in range(NODES + 1):
        node, at = nodes[j], j if j < NODES else 0
        node.g2 = node.ge = node.gp = node.p2 = node.pe = node.gq = node.q2 = node.qe = 0.0
        node.radius, node.out = radius[at], nodes[at].around + rim[1, at]
        node.contrast = outline.inside + rim[0, at] - node.out


@njit(**FAST)
def _move(outline, gain, nodes, result):
    """Move the radii, and the rim's levels by `gain`, as the step's sums say. Returns by how much the misfit falls."""
    radius, rim = outline.radius, outline.rim
    first, last = nodes[0], nodes[NODES]
    first.g2, first.ge = first.g2 + last.g2, first.ge + last.ge
    first.gp, first.p2, first.pe = first.gp + last.gp, first.p2 + last.p2, first.pe + last.pe
    first.gq, first.q2, first.qe = first.gq + last.gq, first.q2 + last.q2, first.qe + last.qe
    mean = 0.0
    for j in range(NODES):
        mean += nodes[j].g2 / NODES
    shift = fall = 0.0
    for j in range(NODES):
        node = nodes[j]
        node.g2 += BARE * mean
        node.ge /= node.g2
        shift += node.ge / NODES
    for j in range(NODES):
        node = nodes[j]
        inside, taken = _learn(gain, node, node.gp, node.p2, node.pe)
        outside, more = _learn(gain, node, node.gq, node.q2, node.qe)
        rim[0, j] += inside
        rim[1, j] += outside
        fall += node.ge * node.ge * node.g2
        result.dent = max(result.dent, abs(node.ge - shift))
        radius[j] += min(max(node.ge - taken - more, -BAND), BAND)
    radius[NODES], rim[0, NODES], rim[1, NODES] = radius[0], rim[0, 0], rim[1, 0]
    return fall


@njit(**FAST)
def _add(node, weight, g, p, q, e):
    node.gp += weight * g * p
    node.p2 += weight * p * p
    node.pe += weight * p * e
    node.gq += weight * g * q
    node.q2 += weight * q * q
    node.qe += weight * q * e


@njit(**FAST)
def _learn(gain, node, mixed, square, error):
    """How much a level at the edge changes, which is learnt together with the radius (its step is in `ge`); and how
    much that takes from the radius."""
    room = square - mixed * mixed / node.g2
    change = gain * (error - mixed * node.ge) / (room + RIM_PRIOR)
    return change, change * mixed / node.g2


@njit(**FAST)
def _centre(cx, cy, outline, nodes, result):
    """Centroid, area, second moments, the centroid's covariance per unit noise variance; moves the origin there."""
    radius = outline.radius
    area = mu = mv = uu = uv = vv = 0.0
    for j in range(NODES):
        r, c, s = radius[j], COSINES[j], SINES[j]
        if not r > 0.5:
            return False
        r2 = r * r
        area += 0.5 * r2
        mu += r * r2 * c
        mv += r * r2 * s
        uu += r2 * r2 * c * c
        uv += r2 * r2 * c * s
        vv += r2 * r2 * s * s
    third, fourth = 3.0 * area, 4.0 * area
    mu, mv = mu / third, mv / third
    uu, uv, vv = uu / fourth - mu * mu, uv / fourth - mu * mv, vv / fourth - mv * mv
    area *= STEP_RAD
    v_uu = v_uv = v_vv = 0.0
    for j in range(NODES):
        lever = radius[j] * STEP_RAD / area
        on_u = lever * (radius[j] * COSINES[j] - mu)
        on_v = lever * (radius[j] * SINES[j] - mv)
        v_uu += on_u * on_u / nodes[j].g2
        v_uv += on_u * on_v / nodes[j].g2
        v_vv += on_v * on_v / nodes[j].g2
    long, high, ax, ay = outline.long, outline.high, outline.axis_x, outline.axis_y
    result.x, result.y = cx + ax * long * mu - ay * high * mv, cy + ay * long * mu + ax * high * mv
    result.area = area * long * high
    square = outline.gain ** 2
    result.v_xx, result.v_xy, result.v_yy = _turned(long * long * v_uu * square, long * high * v_uv * square,
                                                    high * high * v_vv * square, ax, ay)
    result.m_xx, result.m_xy, result.m_yy = _turned(long * long * uu, long * high * uv, high * high * vv, ax, ay)
    result.level = outline.inside
    _move_origin(radius, mu, mv)
    outline.age += 1.0
    return True


@njit(**FAST)
def _turned(uu, uv, vv, ax, ay):
    """xx, xy and yy of a covariance in axes along (ax, ay) and across."""
    return (ax * ax * uu - 2.0 * ax * ay * uv + ay * ay * vv,
            ax * ay * (uu - vv) + (ax * ax - ay * ay) * uv,
            ay * ay * uu + 2.0 * ax * ay * uv + ax * ax * vv)


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
