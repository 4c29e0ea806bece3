"""Occluding contours of the hand's capsules in one camera: where edges are expected, and their derivatives by the
state.

A point of a ball's surface is on its contour where its normal n is perpendicular to the line of sight. This is n . (c -
o) = -r for a centre c, a radius r and the camera's centre o. A plane tangent to both balls of a capsule makes a
straight contour between them. The derivative of a contour point along its normal is that of a point fixed to the bone:
the point slides on the surface too, but along the line of sight (envelope theorem).
"""

from __future__ import annotations

import math
from typing import NamedTuple

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
    place_capsules,
    ray_to_capsule,
)
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.se3 import exponential
from rhot_app.geometry.camera import REACH, project_ray
from rhot_app.hand.motion.hand_state import POSE, SHAPE, STATE

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

STEP_M = 4e-3
"""m: spacing of contour points. Skin's creases and nails are as long, so errors of nearer points are correlated."""

OUTSIDE_M = 1e-3
"""m: distance outside of the capsule at which a ray tests what lies behind a contour."""

GRAZE_M = 1e-4
"""m: the same for a neighbouring phalanx that hides a contour and protrudes by less than OUTSIDE_M beyond it."""

JUMP_M = 6e-3
"""m: smallest step in depth that makes a contour; flesh fills smaller ones."""

SIDE, OTHER_SIDE, START_BALL, END_BALL = range(4)
"""Kinds of contour points: the two straight contours of a capsule and those of its balls."""

SILHOUETTE, INNER = 0, 1
"""What lies behind a contour: something other than the hand, or another part of it."""

COLUMNS = POSE + SHAPE
NEAREST_M = 0.02  # near plane: the camera's housing
_MAX_POINTS = 1500
_MARGIN_PX = 3.0


class ContourPoints(NamedTuple):
    """K visible contour points of one camera. `capsule` (K,); `kind` (K,); `along` (K,): position between the balls,
    0..1; `behind` (K,): SILHOUETTE or INNER; `pixel` (K, 2) px; `normal` (K, 2) unit, outwards; `scale` (K,) px/m."""

    capsule: Indices
    kind: Indices
    along: Array
    behind: Indices
    pixel: Array
    normal: Array
    scale: Array


def contour_points(surface: Surface, state: Array, size: Array, pose: Array, intrinsics: Array,
                   image_size: tuple[int, int], step_m: float = STEP_M) -> ContourPoints:
    """The visible contour, a point every `step_m`, of a hand in `state` (`hand_process`) with shape `size` (SHAPE,).

    `pose` (3, 4): camera_from_world; `intrinsics` (13,); `image_size`: width and height, px.
    """
    ints, floats = np.empty((_MAX_POINTS, 3), np.int64), np.empty((_MAX_POINTS, 6))
    count = _contours(surface, state, size, pose, intrinsics, image_size[0], image_size[1], step_m, ints, floats)
    ints, floats = ints[:count], floats[:count]
    return ContourPoints(ints[:, 0].copy(), ints[:, 1].copy(), floats[:, 0].copy(), ints[:, 2].copy(),
                         floats[:, 1:3].copy(), floats[:, 3:5].copy(), floats[:, 5].copy())


@njit(cache=True)
def project(x, y, z, pose, intrinsics, pixel, slope):
    """Fill `pixel` (2,) of a world point and its Jacobian `slope` (2, 3) px/m; False where the camera cannot see it."""
    a = pose[0, 3] + pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z
    b = pose[1, 3] + pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z
    c = pose[2, 3] + pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z
    if not c > NEAREST_M:
        return False
    a, b = a / c, b / c
    if not a * a + b * b <= intrinsics[REACH]:
        return False
    pixel[0], pixel[1], ux, uy, vx, vy = project_ray(a, b, intrinsics)
    for k in range(3):
        dx, dy = (pose[0, k] - a * pose[2, k]) / c, (pose[1, k] - b * pose[2, k]) / c
        slope[0, k] = ux * dx + uy * dy
        slope[1, k] = vx * dx + vy * dy
    return True


@njit(cache=True)
def camera_centre(pose, out):
    """Fill `out` (3,): the centre of a camera, world."""
    for k in range(3):
        out[k] = -(pose[0, k] * pose[0, 3] + pose[1, k] * pose[1, 3] + pose[2, k] * pose[2, 3])


@njit(cache=True)
def side_normals(c0, c1, r0, r1, o, normals):
    """Fill `normals` (2, 3) of the planes through `o` that are tangent to both balls; False when one ball hides the
    other."""
    px, py, pz = c0[0] - o[0], c0[1] - o[1], c0[2] - o[2]
    qx, qy, qz = c1[0] - o[0], c1[1] - o[1], c1[2] - o[2]
    a, b, c = px * px + py * py + pz * pz, px * qx + py * qy + pz * qz, qx * qx + qy * qy + qz * qz
    sx, sy, sz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
    square = sx * sx + sy * sy + sz * sz
    if not square > 1e-16 * a * c:
        return False
    p, q = (-r0 * c + r1 * b) / square, (-r1 * a + r0 * b) / square
    rest = 1.0 - (p * p * a + 2.0 * p * q * b + q * q * c)
    if not rest > 1e-9:
        return False
    s = math.sqrt(rest / square)
    for kind in range(2):
        sign = s if kind == 0 else -s
        normals[kind, 0] = p * px + q * qx + sign * sx
        normals[kind, 1] = p * py + q * qy + sign * sy
        normals[kind, 2] = p * pz + q * qz + sign * sz
    return True


@njit(cache=True)
def image_normal(slope, n, u, out):
    """Fill `out` (2,): the outward unit normal, in the image, of the contour with surface normal `n` seen along `u`."""
    tx, ty, tz = n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0]
    a = slope[0, 0] * tx + slope[0, 1] * ty + slope[0, 2] * tz
    b = slope[1, 0] * tx + slope[1, 1] * ty + slope[1, 2] * tz
    length = math.sqrt(a * a + b * b)
    if not length > 0.0:
        return False
    nx, ny = -b / length, a / length
    dx = slope[0, 0] * n[0] + slope[0, 1] * n[1] + slope[0, 2] * n[2]
    dy = slope[1, 0] * n[0] + slope[1, 1] * n[1] + slope[1, 2] * n[2]
    sign = 1.0 if nx * dx + ny * dy >= 0.0 else -1.0
    out[0], out[1] = sign * nx, sign * ny
    return True


@njit(cache=True)
def _contours(surface, state, size, pose, intrinsics, width, height, step_m, ints, floats):
    world, frames = pose_matrix(state), np.empty((surface.dh.parent.shape[0], 3, 4))
    count = surface.row.shape[0]
    centres, radii = np.empty((count, 2, 3)), np.empty((count, 2))
    place_capsules(surface, world, state[STATE.angles], size, frames, centres, radii)
    o, normals, u = np.empty(3), np.empty((2, 3)), np.empty(3)
    pixel, slope, normal, n = np.empty(2), np.empty((2, 3)), np.empty(2), np.empty(3)
    camera_centre(pose, o)
    used = 0
    e1, e2 = np.empty(3), np.empty(3)
    for k in range(count):
        c0, c1, r0, r1 = centres[k, 0], centres[k, 1], radii[k, 0], radii[k, 1]
        spacing = 2.0 * step_m if surface.group[k] == FOREARM else step_m  # smoother than fingers
        for kind in range(4):
            straight = kind < 2
            if straight:
                if kind == 0 and not side_normals(c0, c1, r0, r1, o, normals):
                    normals[0, 0] = math.nan
                if math.isnan(normals[0, 0]):
                    continue
                n[:] = normals[kind]
                along, dot, square = 0.0, 0.0, 0.0
                for i in range(3):
                    line = c1[i] + r1 * n[i] - c0[i] - r0 * n[i]
                    ray = 0.5 * (c0[i] + c1[i]) - o[i]
                    along += line * line
                    dot += line * ray
                    square += ray * ray
                number = max(int(math.sqrt(max(along - dot * dot / square, 0.0)) / spacing + 0.5), 1)
            else:
                if not surface.open_ends[k, kind - 2]:
                    continue
                number = max(int(2.0 * math.pi * radii[k, kind - 2] / step_m + 0.5), 6)
                c, other = centres[k, kind - 2], centres[k, 3 - kind]
                distance = math.sqrt((c[0] - o[0]) ** 2 + (c[1] - o[1]) ** 2 + (c[2] - o[2]) ** 2)
                if not distance > radii[k, kind - 2]:
                    continue
                for i in range(3):
                    u[i] = (c[i] - o[i]) / distance
                _orthogonal_to(u, e1, e2)
            for j in range(number):
                along = (j + 0.5) / number
                if straight:
                    r = r0 + along * (r1 - r0)
                    c = centres[k, 0] + along * (centres[k, 1] - centres[k, 0])
                else:
                    c, r = centres[k, kind - 2], radii[k, kind - 2]
                    sine = r / distance
                    cosine = math.sqrt(1.0 - sine * sine)
                    turn = 2.0 * math.pi * along
                    for i in range(3):
                        n[i] = -sine * u[i] + cosine * (math.cos(turn) * e1[i] + math.sin(turn) * e2[i])
                    # beyond the cone that the two balls have in common
                    towards = (n[0] * (other[0] - c[0]) + n[1] * (other[1] - c[1]) + n[2] * (other[2] - c[2]))
                    if towards > r - radii[k, 3 - kind]:
                        continue
                px, py, pz = c[0] + r * n[0], c[1] + r * n[1], c[2] + r * n[2]
                if not project(px, py, pz, pose, intrinsics, pixel, slope):
                    continue
                if not (_MARGIN_PX < pixel[0] < width - 1 - _MARGIN_PX
                        and _MARGIN_PX < pixel[1] < height - 1 - _MARGIN_PX):
                    continue
                behind = link_behind(surface, centres, radii, o, px, py, pz, n, OUTSIDE_M)
                if behind < 0 or used == ints.shape[0]:
                    continue
                if link_behind(surface, centres, radii, o, px, py, pz, n, GRAZE_M) < 0:
                    continue
                far = math.sqrt((px - o[0]) ** 2 + (py - o[1]) ** 2 + (pz - o[2]) ** 2)
                if not straight:
                    along = float(kind - 2)
                for i in range(3):
                    e = px if i == 0 else (py if i == 1 else pz)
                    normals_u = (e - o[i]) / far
                    floats[used, i] = normals_u
                if not image_normal(slope, n, floats[used, :3], normal):
                    continue
                scale = 0.0
                for i in range(3):
                    scale += (normal[0] * slope[0, i] + normal[1] * slope[1, i]) * n[i]
                ints[used, 0], ints[used, 1], ints[used, 2] = k, kind, behind
                floats[used, 0], floats[used, 1], floats[used, 2] = along, pixel[0], pixel[1]
                floats[used, 3], floats[used, 4], floats[used, 5] = normal[0], normal[1], scale
                used += 1
    return used


@njit(cache=True)
def _orthogonal_to(u, e1, e2):
    """Fill two unit vectors perpendicular to `u` (3,) and to each other."""
    least = 0
    for i in range(1, 3):
        if abs(u[i]) < abs(u[least]):
            least = i
    e1[:] = 0.0
    e1[least] = 1.0
    dot = u[least]
    length = 0.0
    for i in range(3):
        e1[i] -= dot * u[i]
        length += e1[i] * e1[i]
    length = math.sqrt(length)
    for i in range(3):
        e1[i] /= length
    e2[0], e2[1], e2[2] = u[1] * e1[2] - u[2] * e1[1], u[2] * e1[0] - u[0] * e1[2], u[0] * e1[1] - u[1] * e1[0]


@njit(cache=True)
def link_behind(surface, centres, radii, o, px, py, pz, n, outside):
    """What lies on the line of sight `outside` m from a contour point: SILHOUETTE, INNER, or -1 where the point is
    occluded or makes no contour."""
    px, py, pz = px + outside * n[0], py + outside * n[1], pz + outside * n[2]
    ux, uy, uz = px - o[0], py - o[1], pz - o[2]
    far = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / far, uy / far, uz / far
    out = SILHOUETTE
    for j in range(centres.shape[0]):
        # bounding ball of the capsule
        mx = 0.5 * (centres[j, 0, 0] + centres[j, 1, 0]) - o[0]
        my = 0.5 * (centres[j, 0, 1] + centres[j, 1, 1]) - o[1]
        mz = 0.5 * (centres[j, 0, 2] + centres[j, 1, 2]) - o[2]
        half = 0.5 * math.sqrt((centres[j, 0, 0] - centres[j, 1, 0]) ** 2 + (centres[j, 0, 1] - centres[j, 1, 1]) ** 2
                               + (centres[j, 0, 2] - centres[j, 1, 2]) ** 2) + max(radii[j, 0], radii[j, 1])
        dot = mx * ux + my * uy + mz * uz
        if mx * mx + my * my + mz * mz - dot * dot > half * half:
            continue
        t = ray_to_capsule(o[0], o[1], o[2], ux, uy, uz, centres[j, 0], centres[j, 1], radii[j, 0], radii[j, 1])
        if t > 0.0:
            if t < far + JUMP_M:
                return -1
            out = INNER
    return out


@njit(cache=True)
def contour_on_slices(surface, state, size, pose, intrinsics, late_s, capsule, kind, along, pixel, normal, offset, rows,
                      good):
    """Where the contour of a hand in `state` crosses K slices. Fill `offset` (K,), px along each slice's normal from
    its centre `pixel` (K, 2); `rows` (K, COLUMNS), its derivative by pose and shape; and `good` (K,), whether it
    crosses. `late_s` (K,): a slice's time less the state's, s."""
    world, frames = pose_matrix(state), np.empty((surface.dh.parent.shape[0], 3, 4))
    count = surface.row.shape[0]
    centres, radii = np.empty((count, 2, 3)), np.empty((count, 2))
    place_capsules(surface, world, state[STATE.angles], size, frames, centres, radii)
    o, normals, n, u, at = np.empty(3), np.empty((2, 3)), np.empty(3), np.empty(3), np.empty(2)
    slope, across, g, c = np.empty((2, 3)), np.empty(2), np.empty(3), np.empty(3)
    camera_centre(pose, o)
    last, straight = -1, False
    for s in range(capsule.shape[0]):
        k = capsule[s]
        good[s] = False
        if k != last:
            straight = side_normals(centres[k, 0], centres[k, 1], radii[k, 0], radii[k, 1], o, normals)
            last = k
        t = along[s]
        r = radii[k, 0] + t * (radii[k, 1] - radii[k, 0])
        for i in range(3):
            c[i] = centres[k, 0, i] + t * (centres[k, 1, i] - centres[k, 0, i])
        if kind[s] < 2:
            if not straight:
                continue
            n[:] = normals[kind[s]]
        else:
            if not project(c[0], c[1], c[2], pose, intrinsics, at, slope):
                continue
            distance = length = 0.0
            for i in range(3):
                distance += (c[i] - o[i]) ** 2
                g[i] = normal[s, 0] * slope[0, i] + normal[s, 1] * slope[1, i]
                length += g[i] * g[i]
            distance, length = math.sqrt(distance), math.sqrt(length)
            if not distance > r:
                continue
            sine = r / distance
            cosine = math.sqrt(1.0 - sine * sine)
            for i in range(3):
                n[i] = -sine * (c[i] - o[i]) / distance + cosine * g[i] / length
        px, py, pz = c[0] + r * n[0], c[1] + r * n[1], c[2] + r * n[2]
        if not project(px, py, pz, pose, intrinsics, at, slope):
            continue
        far = math.sqrt((px - o[0]) ** 2 + (py - o[1]) ** 2 + (pz - o[2]) ** 2)
        u[0], u[1], u[2] = (px - o[0]) / far, (py - o[1]) / far, (pz - o[2]) / far
        if not image_normal(slope, n, u, across):
            continue
        turned = across[0] * normal[s, 0] + across[1] * normal[s, 1]
        if turned < 0.5:  # the contour now runs along the slice
            continue
        good[s] = True
        offset[s] = (across[0] * (at[0] - pixel[s, 0]) + across[1] * (at[1] - pixel[s, 1])) / turned
        for i in range(3):
            g[i] = (across[0] * slope[0, i] + across[1] * slope[1, i]) / turned
        _point_row(surface, world, frames, k, c, px, py, pz, g, size, rows[s])
        thicker = r * (g[0] * n[0] + g[1] * n[1] + g[2] * n[2])
        rows[s, POSE + (FOREARM_RADIUS if surface.group[k] == FOREARM else THICKNESS)] = thicker
        if surface.row[k] >= 0:
            rows[s, POSE + RADIUS + surface.bone[surface.row[k]]] = thicker
        if late_s[s] != 0.0:
            for j in range(POSE):
                offset[s] += late_s[s] * rows[s, j] * state[STATE.velocity][j]


@njit(cache=True)
def _point_row(surface, world, frames, k, axis, px, py, pz, g, size, row):
    """Fill `row` (COLUMNS,): `g` (3,) times the derivative of the surface point p, whose axis point is `axis` (3,)."""
    dh = surface.dh
    row[:] = 0.0
    lx, ly, lz = px - world[0, 3], py - world[1, 3], pz - world[2, 3]
    row[0], row[1], row[2] = g[0], g[1], g[2]
    row[3], row[4], row[5] = ly * g[2] - lz * g[1], lz * g[0] - lx * g[2], lx * g[1] - ly * g[0]
    row[POSE + HAND_SIZE] = g[0] * lx + g[1] * ly + g[2] * lz
    if surface.group[k] == FOREARM:
        _forearm_row(world, size, lx, ly, lz, g, row)
    at, first = surface.row[k], True
    while at >= 0:
        parent, bone = dh.parent[at], surface.bone[at]
        if bone >= 0:  # lever: from its start to its end, or to the axis point
            f, length = frames[at], dh.a[at] * math.exp(size[HAND_SIZE] + size[FINGER_SIZE] + size[LENGTH + bone])
            for i in range(3):
                way = axis[i] - (f[i, 3] - length * f[i, 0]) if first else length * f[i, 0]
                row[POSE + LENGTH + bone] += g[i] * way
                row[POSE + FINGER_SIZE] += g[i] * way
        first = False
        if dh.angle[at] >= 0:
            base = world if parent < 0 else frames[parent]
            sign = dh.sign[at]
            ax, ay, az = sign * base[0, 2], sign * base[1, 2], sign * base[2, 2]
            rx, ry, rz = px - base[0, 3], py - base[1, 3], pz - base[2, 3]
            row[6 + dh.angle[at]] += (g[0] * (ay * rz - az * ry) + g[1] * (az * rx - ax * rz)
                                      + g[2] * (ax * ry - ay * rx))
        at = parent


@njit(cache=True)
def _forearm_row(world, shape, lx, ly, lz, g, row):
    """Fill the columns of the forearm's rotation: of a point at (lx, ly, lz) from the wrist, world axes. The derivative
    of R(w) e is -[R e]x J, with the left Jacobian J of the rotations (Sola 2018, eq. 145)."""
    p, n, wy, wz = np.empty(3), np.empty(3), shape[FOREARM_TURN], shape[FOREARM_TURN + 1]
    for i in range(3):  # in the palm's frame
        p[i] = world[0, i] * lx + world[1, i] * ly + world[2, i] * lz
        n[i] = world[0, i] * g[0] + world[1, i] * g[1] + world[2, i] * g[2]
    mx, my, mz = p[1] * n[2] - p[2] * n[1], p[2] * n[0] - p[0] * n[2], p[0] * n[1] - p[1] * n[0]
    turn, left = np.empty((3, 3)), np.empty((3, 3))
    exponential(0.0, wy, wz, turn, left)
    for j in range(2):
        row[POSE + FOREARM_TURN + j] = left[0, 1 + j] * mx + left[1, 1 + j] * my + left[2, 1 + j] * mz
