"""Sort the pixels about an outline: the paint's inside, the surroundings, and those near it (`outline`)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.coverage import COLLINEAR, FLATNESS, PIXELS_LEAST
from rhot_node.detect.image import EVEN, table_of

# -- records -----------------------------------------------------------------------------------------------------------

NODES = 24
STEP_RAD = 2.0 * math.pi / NODES
COSINES = np.cos(STEP_RAD * np.arange(NODES))
SINES = np.sin(STEP_RAD * np.arange(NODES))
HALF_COSINES = np.cos(STEP_RAD * (np.arange(NODES) + 0.5))
HALF_SINES = np.sin(STEP_RAD * (np.arange(NODES) + 0.5))

FINE = 256
ANGLES = np.arctan(np.arange(FINE + 2.0) / FINE)  # rad, by the tangent in FINE steps

BAND = 1.5  # px on either side of the outline that its blurred edge reaches
RING_NEAR, RING_FAR = 1.4, 2.8  # px outside the outline: what surrounds the marker
BLUR_VARIANCE = (0.5 * 0.7) ** 2 + EVEN  # px^2: point spread of about 0.7 luma px and the 2x2 chroma mean
BLUR_LEAST, BLUR_MOST = 0.38, 0.9  # px
SLOW = 0.1  # gain of what changes slowly: shading, rim, blur
SETTLED, RESTING = 9.0, 3.0  # frames until rim and blur are learnt, and the luma read, in every third frame only
RIM_PRIOR = 0.2  # pixels' worth of believing that paint and surroundings are at the edge as they are further off
BARE = 0.02  # of a node's mean information: nodes with hardly any pixel stay where they were
CORNER = 0.97  # of half a band's width: beyond, the slope of its bend grows without limit
PIXELS_MAX = 4096  # near an outline

FAST: Any = {"cache": True, "error_model": "numpy", "fastmath": {"nsz", "arcp", "contract", "afn", "reassoc"}}

ONE = np.uint64(1)

OUTLINE = np.dtype([
    *((name, np.float64) for name in (
        "ready",  # whether it is followed
        "paint_y", "paint_u", "paint_v", "around_u", "around_v", "c_uu", "c_uv", "c_vv",  # colours, covariance
        "w_u", "w_v", "gain",  # the projection: a = w . (chroma - around); gain is |w|
        "inside", "slope_x", "slope_y", "blur", "age",  # level at the origin, and its slopes; px; frames
        "axis_x", "axis_y", "long", "high", "bend", "width",  # the coordinates that it is written in
        "rims", "sag", "sag_variance", "sag_zero", "sag_frames",  # of a band (`band`): whether its rims are visible
        "off_axis")),  # of a band without visible rims: standard deviation about its axis, as a share of its extent
    ("radius", np.float64, (NODES + 1,)),  # at every node, the first repeated at the end
    ("rim", np.float64, (2, NODES + 1))])  # by how much the paint's level at the rim, and that of what adjoins, differ
"""What is kept of an outline from frame to frame."""

_PIXEL = np.dtype([(name, np.float64) for name in ("node", "part", "rho", "cover", "dx", "dy")])
"""A pixel near the outline: the node before it and the part of a step to the next one, its radius, its projected
colour, its place about the origin."""

_NODE = np.dtype([(name, np.float64) for name in (
    "g2", "ge", "gp", "p2", "pe", "gq", "q2", "qe",  # sums of a step over the pixels
    "ring_sum", "ring_count", "around",  # of the surroundings, and their level
    "radius", "scale", "out", "contrast")])  # what is interpolated between nodes


class Fitted(NamedTuple):
    """An outline's fit: centroid, area, covariance per unit variance of the noise, second moments, misfit, the farthest
    that a radius moved against the others, and the paint's level. Chroma px."""

    x: float
    y: float
    area: float
    v_xx: float
    v_xy: float
    v_yy: float
    m_xx: float
    m_xy: float
    m_yy: float
    misfit: float
    dent: float
    level: float


class Workspace(NamedTuple):
    """Records that a fit works in: pixels near the outline, nodes, and the fit (1,)."""

    pixels: NDArray[np.void]
    nodes: NDArray[np.void]
    fitted: NDArray[np.void]


def workspace() -> Workspace:
    """One for any number of markers."""
    return Workspace(np.zeros(PIXELS_MAX, _PIXEL), np.zeros(NODES + 1, _NODE), np.zeros(1, table_of(Fitted)))


# -- pixels inside, outside and near an outline ------------------------------------------------------------------------

@njit(**FAST)
def project(outline):
    """Set the projection that lets least of the surroundings' variation through, paint - around = 1."""
    du, dv = outline.paint_u - outline.around_u, outline.paint_v - outline.around_v
    uu, uv, vv = outline.c_uu + FLATNESS, outline.c_uv, outline.c_vv + FLATNESS
    wu, wv = vv * du - uv * dv, uu * dv - uv * du
    norm = wu * du + wv * dv
    outline.w_u, outline.w_v = wu / norm, wv / norm
    outline.gain = math.hypot(outline.w_u, outline.w_v)


@njit(**FAST)
def _turn(u, v):
    """The angle of (u, v) in steps of NODES per turn, 0 <= turn <= NODES, to 1e-3 of a step's tenth."""
    a, b = abs(u), abs(v)
    low, high = min(a, b), max(a, b)
    place = FINE * low / high
    first = np.uint64(place)
    angle = ANGLES[first] + (place - first) * (ANGLES[first + ONE] - ANGLES[first])
    if b > a:
        angle = 0.5 * math.pi - angle
    if u < 0.0:
        angle = math.pi - angle
    if v < 0.0:
        angle = 2.0 * math.pi - angle
    return min(angle * (NODES / (2.0 * math.pi)), NODES - 1e-9)


@njit(**FAST)
def gather(image, cx, cy, outline, pixels, nodes):
    """Sort the pixels about the outline: the paint's inside and the surroundings are summed, those near it listed.

    Returns how many are listed; 0 when there are too few to fit anything, or more than `pixels` holds.
    """
    y, u, v = image
    least, most = _slopes(outline, nodes)
    ax, ay, long, high = outline.axis_x, outline.axis_y, 1.0 / outline.long, 1.0 / outline.high
    bend, width = outline.bend, 1.0 / max(outline.width, 1.0)
    wu, wv, bu, bv = outline.w_u, outline.w_v, outline.around_u, outline.around_v
    deep, beyond = least - BAND * max(long, high), most + RING_FAR * max(long, high)
    deep2, beyond2 = deep * deep if deep > 0.0 else 0.0, beyond * beyond
    x0, x1, y0, y1 = _box(cx, cy, outline, beyond, u.shape)
    with_luma = outline.age % RESTING == 0.0
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
                before, after = nodes[node], nodes[node + ONE]
                d = _outside(before, after, part, rho)
                if d > RING_FAR:
                    continue
                if d > RING_NEAR:
                    _add_around(before, after, part, a)
                    r_n, r_u, r_v = r_n + 1.0, r_u + pu, r_v + pv
                    r_uu, r_uv, r_vv = r_uu + pu * pu, r_uv + pu * pv, r_vv + pv * pv
                if abs(d) <= BAND:
                    if count == pixels.shape[0]:
                        return 0
                    pixel = pixels[count]
                    pixel.node, pixel.part, pixel.rho = node, part, rho
                    pixel.cover, pixel.dx, pixel.dy = a, dx, dy
                    count += 1
                inside = d < -BAND
            if inside:
                n, s_a, s_x, s_y, s_u, s_v = n + 1.0, s_a + a, s_x + dx, s_y + dy, s_u + pu, s_v + pv
                s_ax, s_ay = s_ax + a * dx, s_ay + a * dy
                s_xx, s_xy, s_yy = s_xx + dx * dx, s_xy + dx * dy, s_yy + dy * dy
                if with_luma:
                    s_l += y[2 * row, 2 * column]
    if n < PIXELS_LEAST or r_n < NODES:
        return 0
    _learn_slope(outline, n, (s_a, s_x, s_y), (s_ax, s_ay), (s_xx, s_xy, s_yy))
    _learn_colours(outline, n, (s_u, s_v), r_n, (r_u, r_v), (r_uu, r_uv, r_vv))
    if with_luma:
        outline.paint_y = s_l / n
    return count


@njit(**FAST)
def _box(cx, cy, outline, beyond, shape):
    """First and last column, first and last row that may lie within `beyond` units of radius."""
    ax, ay, bend = outline.axis_x, outline.axis_y, outline.bend
    reach_x = beyond * math.sqrt((ax * outline.long) ** 2 + (ay * outline.high) ** 2) + abs(ay * bend)
    reach_y = beyond * math.sqrt((ay * outline.long) ** 2 + (ax * outline.high) ** 2) + abs(ax * bend)
    return (max(int(cx - reach_x), 0), min(int(cx + reach_x) + 1, shape[1] - 1),
            max(int(cy - reach_y), 0), min(int(cy + reach_y) + 1, shape[0] - 1))


@njit(**FAST)
def _outside(before, after, part, rho):
    """How far outside the outline, px square to it, a radius between two nodes ends."""
    return ((rho - before.radius - part * (after.radius - before.radius))
            * (before.scale + part * (after.scale - before.scale)))


@njit(**FAST)
def _add_around(before, after, part, a):
    before.ring_sum += (1.0 - part) * a
    before.ring_count += 1.0 - part
    after.ring_sum += part * a
    after.ring_count += part


@njit(**FAST)
def _learn_slope(outline, n, first, level, second):
    """Set the paint's slope, slowly, and its level, carried to the outline's origin, from sums over n pixels: of level,
    x and y; of the level times x and y; of xx, xy and yy."""
    s_a, s_x, s_y = first
    gain = max(SLOW, 1.0 / (outline.age + 1.0))
    xx, xy, yy = second[0] - s_x * s_x / n, second[1] - s_x * s_y / n, second[2] - s_y * s_y / n
    xa, ya = level[0] - s_x * s_a / n, level[1] - s_y * s_a / n
    determinant = xx * yy - xy * xy
    if determinant > COLLINEAR * xx * yy:
        outline.slope_x += gain * ((yy * xa - xy * ya) / determinant - outline.slope_x)
        outline.slope_y += gain * ((xx * ya - xy * xa) / determinant - outline.slope_y)
    outline.inside = (s_a - outline.slope_x * s_x - outline.slope_y * s_y) / n


@njit(**FAST)
def _learn_colours(outline, n, paint, r_n, around, square):
    """Set the paint's chroma and that of the surroundings, with its spread, from sums about the last one."""
    m_u, m_v = around[0] / r_n, around[1] / r_n
    outline.paint_u, outline.paint_v = outline.around_u + paint[0] / n, outline.around_v + paint[1] / n
    outline.around_u, outline.around_v = outline.around_u + m_u, outline.around_v + m_v
    outline.c_uu, outline.c_uv = square[0] / r_n - m_u * m_u, square[1] / r_n - m_u * m_v
    outline.c_vv = square[2] / r_n - m_v * m_v


@njit(**FAST)
def _slopes(outline, nodes):
    """Set px per unit of radius, square to the outline, at every node, and empty the sums of the surroundings; returns
    the least and the greatest radius."""
    radius = outline.radius
    least = most = radius[0]
    for j in range(NODES):
        here, node = radius[j], nodes[j]
        slope = (radius[j + 1] - radius[j - 1 if j > 0 else NODES - 1]) / (2.0 * STEP_RAD * here)
        gu = (COSINES[j] + slope * SINES[j]) / outline.long
        gv = (SINES[j] - slope * COSINES[j]) / outline.high
        if outline.bend != 0.0:
            across = min(max(here * COSINES[j] * outline.long / outline.width, -CORNER), CORNER)
            gu += gv * outline.bend * across / (outline.width * math.sqrt(1.0 - across * across))
        node.radius, node.scale = here, 1.0 / math.sqrt(gu * gu + gv * gv)
        node.ring_sum = node.ring_count = 0.0
        least, most = min(least, here), max(most, here)
    last = nodes[NODES]
    last.radius, last.scale = radius[0], nodes[0].scale
    last.ring_sum = last.ring_count = 0.0
    return least, most


@njit(**FAST)
def smooth_around(nodes):
    """Turn the surroundings' sums by node into levels, each with half of its neighbours."""
    nodes[0].ring_sum += nodes[NODES].ring_sum
    nodes[0].ring_count += nodes[NODES].ring_count
    total = count = 0.0
    for j in range(NODES):
        total += nodes[j].ring_sum
        count += nodes[j].ring_count
    mean = total / count
    for j in range(NODES):
        here, before, after = nodes[j], nodes[j - 1 if j > 0 else NODES - 1], nodes[j + 1 if j + 1 < NODES else 0]
        weight = here.ring_count + 0.5 * (before.ring_count + after.ring_count)
        total = here.ring_sum + 0.5 * (before.ring_sum + after.ring_sum)
        here.around = (total + 0.5 * mean) / (weight + 0.5)
