"""Occluding contours of the hand's capsules in one camera: where edges are expected, and their derivatives by the
state.

A point of a ball's surface is on its contour where its normal n is perpendicular to the line of sight. This is n . (c -
o) = -r for a centre c, a radius r and the camera's centre o. A plane tangent to both balls of a capsule makes a
straight contour between them. The derivative of a contour point along its normal is that of a point fixed to the bone:
the point slides on the surface too, but along the line of sight (envelope theorem).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.surface import (
    FINGER_SIZE,
    FOREARM,
    FOREARM_RADIUS,
    FOREARM_TURN,
    HAND_SIZE,
    LENGTH,
    RADIUS,
    THICKNESS,
    Surface,
    posed_in,
    ray_to_capsule,
)
from rhot_app.estimation.se3 import exponential
from rhot_app.estimation.vectors import along, axis, axis_of, cross, dot, minus, norm, origin_of, turned_back, unit
from rhot_app.geometry.camera import CameraRecord, project_point
from rhot_app.hand.kinematics import chain_row
from rhot_app.hand.motion.hand_state import POSE, SHAPE, STATE

Array = NDArray[np.float64]

STEP_M = 4e-3
"""m: spacing of contour points. Skin's creases and nails are as long, so errors of nearer points are correlated."""

OUTSIDE_M = 1e-3
"""m: distance outside of the capsule at which a ray tests what lies behind a contour."""

GRAZE_M = 1e-4
"""m: the same for a neighbouring phalanx that hides a contour and protrudes by less than OUTSIDE_M beyond it."""

JUMP_M = 6e-3
"""m: smallest step in depth that makes a contour; flesh fills smaller ones."""

SHORTEST_PX = 3.0
"""px: half of the shortest slice, and so the least distance of a contour point from the image's border."""

SIDE, OTHER_SIDE, START_BALL, END_BALL = range(4)
"""Kinds of contour points: the two straight contours of a capsule and those of its balls."""

SILHOUETTE, INNER, HIDDEN = 0, 1, -1
"""What lies behind a contour: something other than the hand, or another part of it. HIDDEN: the point is occluded or
makes no contour."""

COLUMNS = POSE + SHAPE

POINT = np.dtype([("capsule", np.int64), ("kind", np.int64), ("along", np.float64), ("behind", np.int64),
                  ("pixel", np.float64, 2), ("normal", np.float64, 2), ("scale", np.float64)])
"""A visible contour point in one camera: `capsule`; `kind`; `along`, position between the balls, 0..1; `behind`,
SILHOUETTE or INNER; `pixel` (2,) px; `normal` (2,) unit, outwards; `scale` px/m."""

_MOST = 1500  # points of one camera


def contour_points(surface: Surface, state: Array, camera: CameraRecord, step_m: float = STEP_M) -> np.recarray:
    """The visible contour (K,) POINT, a point every `step_m`, of a hand in `state` (`hand_state`, with shape)."""
    points = np.recarray(_MOST, POINT)
    return points[:_contours(surface, state, camera, step_m, points)].view(np.recarray)


@njit(cache=True)
def tangent_planes(ends, radii, o, normals):
    """Fill `normals` (2, 3): the outward normals of the planes through `o` that are tangent to both balls of a capsule,
    `ends` (2, 3) and `radii` (2,); NaN when one ball hides the other."""
    p, q = minus(ends[0], o), minus(ends[1], o)
    a, b, c, s = dot(p, p), dot(p, q), dot(q, q), cross(p, q)
    square = dot(s, s)
    normals[:] = math.nan
    if square > 1e-16 * a * c:
        on_p, on_q = (-radii[0] * c + radii[1] * b) / square, (-radii[1] * a + radii[0] * b) / square
        rest = 1.0 - (on_p * on_p * a + 2.0 * on_p * on_q * b + on_q * on_q * c)
        if rest > 1e-9:
            across = math.sqrt(rest / square)
            for i in range(3):
                normals[0, i] = on_p * p[i] + on_q * q[i] + across * s[i]
                normals[1, i] = on_p * p[i] + on_q * q[i] - across * s[i]


@njit(cache=True)
def capsule_contour(ends, radii, open_ends, o, step_m, side_m, kinds, positions, points, normals):
    """The contour of one capsule before a camera at `o`, as if it were alone: fill `kinds` (M,), `positions` (M,) 0..1
    between its balls, `points` (M, 3) m and outward `normals` (M, 3); returns how many. Sides have a point every
    `side_m` across the line of sight; balls with `open_ends` every `step_m`, beyond the cone that both balls share."""
    used, sides = 0, np.empty((2, 3))
    tangent_planes(ends, radii, o, sides)
    for kind in range(4):
        end = kind - 2
        if kind < 2:
            n = (sides[kind, 0], sides[kind, 1], sides[kind, 2])
            if math.isnan(n[0]):
                continue
            line = minus(along(ends[1], radii[1], n), along(ends[0], radii[0], n))
            ray = minus((0.5 * (ends[0, 0] + ends[1, 0]), 0.5 * (ends[0, 1] + ends[1, 1]),
                         0.5 * (ends[0, 2] + ends[1, 2])), o)
            seen = math.sqrt(max(dot(line, line) - dot(line, ray) ** 2 / dot(ray, ray), 0.0))
            number = max(int(seen / side_m + 0.5), 1)
        else:
            ray = minus(ends[end], o)
            distance = norm(ray)
            if not open_ends[end] or not distance > radii[end]:
                continue
            number = max(int(2.0 * math.pi * radii[end] / step_m + 0.5), 6)
            u, sine = unit(ray), radii[end] / distance
            least = 0
            for i in range(1, 3):
                if abs(u[i]) < abs(u[least]):
                    least = i
            e1 = unit(along(axis(least), -u[least], u))
            e2, cosine = cross(u, e1), math.sqrt(1.0 - sine * sine)
        for j in range(number):
            t = (j + 0.5) / number
            if kind < 2:
                c, r = along(ends[0], t, minus(ends[1], ends[0])), radii[0] + t * (radii[1] - radii[0])
            else:
                c, r, turn = along(ends[end], 0.0, u), radii[end], 2.0 * math.pi * t
                n = along((-sine * u[0], -sine * u[1], -sine * u[2]), cosine,
                          along((math.cos(turn) * e1[0], math.cos(turn) * e1[1], math.cos(turn) * e1[2]),
                                math.sin(turn), e2))
                t = float(end)
                if dot(n, minus(ends[1 - end], ends[end])) > r - radii[1 - end]:
                    continue
            kinds[used], positions[used], points[used], normals[used] = kind, t, along(c, r, n), n
            used += 1
    return used


@njit(cache=True)
def image_normal(slope, n, u, out):
    """Fill `out` (2,): the outward unit normal, in the image, of the contour with surface normal `n` seen along `u`."""
    t = cross(n, u)
    a, b = dot(slope[0], t), dot(slope[1], t)
    length = math.sqrt(a * a + b * b)
    if not length > 0.0:
        return False
    nx, ny = -b / length, a / length
    sign = 1.0 if nx * dot(slope[0], n) + ny * dot(slope[1], n) >= 0.0 else -1.0
    out[0], out[1] = sign * nx, sign * ny
    return True


@njit(cache=True)
def image_normals(slopes, normals, rays):
    """(N, 2) `image_normal` of N points; NaN without any."""
    out = np.full((len(rays), 2), np.nan)
    for n in range(len(rays)):
        image_normal(slopes[n], normals[n], rays[n], out[n])
    return out


@njit(cache=True)
def _contours(surface, state, camera, step_m, points):
    hand, o, used, slope = posed_in(surface, state), camera.centre, 0, np.empty((2, 3))
    most = 2 * len(points)
    kinds, positions, places, normals = (np.empty(most, np.int64), np.empty(most), np.empty((most, 3)),
                                         np.empty((most, 3)))
    for k in range(len(surface.row)):
        spacing = 2.0 * step_m if surface.group[k] == FOREARM else step_m  # smoother than fingers
        count = capsule_contour(hand.centres[k], hand.radii[k], surface.open_ends[k], o, step_m, spacing, kinds,
                                positions, places, normals)
        for j in range(count):
            p, n = places[j], normals[j]
            if used == len(points):
                return used
            point = points[used]
            if not project_point(p[0], p[1], p[2], camera.pose, camera.intrinsics, point.pixel, slope):
                continue
            if not (SHORTEST_PX < point.pixel[0] < camera.size[0] - 1 - SHORTEST_PX
                    and SHORTEST_PX < point.pixel[1] < camera.size[1] - 1 - SHORTEST_PX):
                continue
            behind = what_is_behind(hand.centres, hand.radii, o, p, n, OUTSIDE_M)
            if behind == HIDDEN or what_is_behind(hand.centres, hand.radii, o, p, n, GRAZE_M) == HIDDEN:
                continue
            if not image_normal(slope, n, unit(minus(p, o)), point.normal):
                continue
            point.capsule, point.kind, point.along, point.behind = k, kinds[j], positions[j], behind
            point.scale = point.normal[0] * dot(slope[0], n) + point.normal[1] * dot(slope[1], n)
            used += 1
    return used


@njit(cache=True)
def what_is_behind(centres, radii, o, p, n, outside):
    """What lies on the line of sight `outside` m from a contour point p with normal n: SILHOUETTE, INNER or HIDDEN."""
    ray, out = minus(along(p, outside, n), o), SILHOUETTE
    far, u = norm(ray), unit(ray)
    for k in range(len(radii)):
        t = ray_to_capsule(o, u, centres, radii, k)
        if t > 0.0:
            if t < far + JUMP_M:
                return HIDDEN
            out = INNER
    return out


@njit(cache=True)
def contour_on_slices(surface, state, camera, points, slices, late_s):
    """Where the contour of a hand in `state` crosses the `slices` (K, 5) at `points` (K,), taken `late_s` (K,) s later
    than the state. Returns the offset (K,), px along each slice's normal from its centre; its derivative (K, COLUMNS)
    by pose and shape; and whether it crosses (K,)."""
    count, hand, o = len(points), posed_in(surface, state), camera.centre
    offset, rows, good = np.zeros(count), np.zeros((count, COLUMNS)), np.zeros(count, np.bool_)
    sides, last = np.empty((2, 3)), -1
    slope, across, pixel = np.empty((2, 3)), np.empty(2), np.empty(2)
    for s in range(count):
        k, kind, t, normal = points[s].capsule, points[s].kind, points[s].along, slices[s, 2:4]
        r = hand.radii[k, 0] + t * (hand.radii[k, 1] - hand.radii[k, 0])
        c = along(hand.centres[k, 0], t, minus(hand.centres[k, 1], hand.centres[k, 0]))
        if k != last:
            tangent_planes(hand.centres[k], hand.radii[k], o, sides)
            last = k
        if kind < 2:
            n = (sides[kind, 0], sides[kind, 1], sides[kind, 2])
            if math.isnan(n[0]):
                continue
        else:
            distance = norm(minus(c, o))
            if not distance > r or not project_point(c[0], c[1], c[2], camera.pose, camera.intrinsics, pixel, slope):
                continue
            outwards, sine = unit(_weighted(normal, slope)), r / distance
            cosine, ray = math.sqrt(1.0 - sine * sine), minus(c, o)
            n = (-sine * ray[0] / distance + cosine * outwards[0], -sine * ray[1] / distance + cosine * outwards[1],
                 -sine * ray[2] / distance + cosine * outwards[2])
        p = along(c, r, n)
        if not project_point(p[0], p[1], p[2], camera.pose, camera.intrinsics, pixel, slope):
            continue
        if not image_normal(slope, n, unit(minus(p, o)), across):
            continue
        turn = across[0] * normal[0] + across[1] * normal[1]
        if turn < 0.5:  # the contour now runs along the slice
            continue
        good[s] = True
        offset[s] = (across[0] * (pixel[0] - slices[s, 0]) + across[1] * (pixel[1] - slices[s, 1])) / turn
        g = _weighted((across[0] / turn, across[1] / turn), slope)
        _surface_row(surface, hand, k, c, p, g, state[STATE.shape], rows[s])
        thicker = r * dot(g, n)
        rows[s, POSE + (FOREARM_RADIUS if surface.group[k] == FOREARM else THICKNESS)] = thicker
        if surface.row[k] >= 0:
            rows[s, POSE + RADIUS + surface.bone[surface.row[k]]] = thicker
        if late_s[s] != 0.0:
            for j in range(POSE):
                offset[s] += late_s[s] * rows[s, j] * state[STATE.velocity][j]
    return offset, rows, good


@njit(cache=True)
def _weighted(weights, slope):
    """weights (2,) times slope (2, 3)."""
    return (weights[0] * slope[0, 0] + weights[1] * slope[1, 0], weights[0] * slope[0, 1] + weights[1] * slope[1, 1],
            weights[0] * slope[0, 2] + weights[1] * slope[1, 2])


@njit(cache=True)
def _surface_row(surface, hand, k, c, p, g, shape, row):
    """Fill `row` (COLUMNS,): g (3,) times the derivative of the point p of capsule `k`'s surface, whose axis point is
    c."""
    lever = minus(p, origin_of(hand.world))
    chain_row(hand.table, hand.world, hand.frames, surface.row[k], p[0], p[1], p[2], g, row)
    row[POSE + HAND_SIZE] = dot(g, lever)
    if surface.group[k] == FOREARM:
        # the derivative of R(w) e is -[R e]x J, with the left Jacobian J of the rotations (Sola 2018, eq. 145)
        turn, left = np.empty((3, 3)), np.empty((3, 3))
        exponential(0.0, shape[FOREARM_TURN], shape[FOREARM_TURN + 1], turn, left)
        moment = cross(turned_back(hand.world, lever), turned_back(hand.world, g))
        row[POSE + FOREARM_TURN] = dot(axis_of(left, 1), moment)
        row[POSE + FOREARM_TURN + 1] = dot(axis_of(left, 2), moment)
    add_length_columns(hand.table, surface.bone, hand.frames, surface.row[k], c, g, row[POSE:])


@njit(cache=True)
def add_length_columns(table, bone, frames, row, c, g, out):
    """Add to `out`, columns as in a shape, g (3,) times the derivative by lengths of a point that rides on a `row` of a
    sized table, at c on the axis of its bone. Levers reach from a bone's start to its end, or to c."""
    end = (c[0], c[1], c[2])
    while row >= 0:
        if bone[row] >= 0:
            way = dot(g, minus(end, along(origin_of(frames[row]), -table.a[row], axis_of(frames[row], 0))))
            out[LENGTH + bone[row]] += way
            out[FINGER_SIZE] += way
        row = table.parent[row]
        if row >= 0:
            end = origin_of(frames[row])
