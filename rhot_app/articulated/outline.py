"""The visible outline of layers in one camera: points of their occluding contours, and which layer lies behind.

An outline point is taken as fixed to its link: what it slides along the surface, it slides along the line of sight
(Rehg 1995, eq. 3.12; the envelope theorem).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.articulated.bodies import CAPSULE, Bodies, Placed, hit_layer
from rhot_app.articulated.visibility import NONE, front_layer
from rhot_app.barehand.contours import JUMP_M, OUTSIDE_M, STEP_M, camera_centre, image_normal, project, side_normals

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_MOST = 3000


class Outline(NamedTuple):
    """K points. `layer` (K,); `behind` (K,): the layer seen beside it, NONE: the background; `point` (K, 3) m in the
    frame of the layer's row; `pixel` (K, 2) px; `across` (K, 2): unit, outwards."""

    layer: Indices
    behind: Indices
    point: Array
    pixel: Array
    across: Array


def outline_of(bodies: Bodies, placed: Placed, order: Indices, pose: Array, intrinsics: Array,
               image_size: tuple[int, int], step_m: float = STEP_M) -> Outline:
    """The visible outline before a camera of `pose` (3, 4) and `intrinsics` (13,); `image_size` width and height px;
    a point every `step_m`. Without an `order`, each layer is taken as if it were alone."""
    ints, floats = np.empty((_MOST, 2), np.int64), np.empty((_MOST, 7))
    count = _outline(bodies, placed, order, pose, intrinsics, image_size[0], image_size[1], step_m, ints, floats)
    ints, floats = ints[:count], floats[:count]
    return Outline(ints[:, 0].copy(), ints[:, 1].copy(), floats[:, :3].copy(), floats[:, 3:5].copy(),
                   floats[:, 5:].copy())


@njit(cache=True)
def _outline(bodies, placed, order, pose, intrinsics, width, height, step_m, ints, floats):
    o, sides, n, p = np.empty(3), np.empty((2, 3)), np.empty(3), np.empty(3)
    camera_centre(pose, o)
    used = 0
    for k in range(bodies.row.shape[0]):
        if bodies.kind[k] == CAPSULE:
            c, r = placed.ends[k], bodies.radii[k]
            if side_normals(c[0], c[1], r[0], r[1], o, sides):
                length = 0.0
                for i in range(3):
                    length += (c[1, i] - c[0, i]) ** 2
                number = max(int(math.sqrt(length) / step_m + 0.5), 1)
                for side in range(2):
                    for j in range(number):
                        t = (j + 0.5) / number
                        for i in range(3):
                            n[i] = sides[side, i]
                            p[i] = c[0, i] + t * (c[1, i] - c[0, i]) + (r[0] + t * (r[1] - r[0])) * n[i]
                        used = _keep(bodies, placed, order, pose, intrinsics, o, width, height, k, p, n, used, ints,
                                     floats)
            for end in range(2):
                used = _circle(bodies, placed, order, pose, intrinsics, o, width, height, k, c[end], r[end], step_m,
                               used, ints, floats)
        else:
            used = _edges(bodies, placed, order, pose, intrinsics, o, width, height, k, step_m, used, ints, floats)
    return used


@njit(cache=True)
def _circle(bodies, placed, order, pose, intrinsics, o, width, height, k, c, r, step_m, used, ints, floats):
    """Points of the circle on which lines of sight touch a ball."""
    u, a, b, n, p = np.empty(3), np.zeros(3), np.empty(3), np.empty(3), np.empty(3)
    far = math.sqrt((c[0] - o[0]) ** 2 + (c[1] - o[1]) ** 2 + (c[2] - o[2]) ** 2)
    if not far > r:
        return used
    least = 0
    for i in range(3):
        u[i] = (c[i] - o[i]) / far
        if abs(u[i]) < abs(u[least]):
            least = i
    a[least] = 1.0
    length = math.sqrt(1.0 - u[least] ** 2)
    dot = u[least]
    for i in range(3):
        a[i] = (a[i] - dot * u[i]) / length
    b[0], b[1], b[2] = u[1] * a[2] - u[2] * a[1], u[2] * a[0] - u[0] * a[2], u[0] * a[1] - u[1] * a[0]
    sine = r / far
    cosine = math.sqrt(1.0 - sine * sine)
    number = max(int(2.0 * math.pi * r / step_m), 6)
    for j in range(number):
        x, y = math.cos(2.0 * math.pi * j / number), math.sin(2.0 * math.pi * j / number)
        for i in range(3):
            n[i] = cosine * (x * a[i] + y * b[i]) - sine * u[i]
            p[i] = c[i] + r * n[i]
        used = _keep(bodies, placed, order, pose, intrinsics, o, width, height, k, p, n, used, ints, floats)
    return used


@njit(cache=True)
def _edges(bodies, placed, order, pose, intrinsics, o, width, height, k, step_m, used, ints, floats):
    """Points of the edges of a box between a face that is seen and one that is not."""
    pose_k, half = placed.box[k], bodies.half[k]
    faces, n, p = np.empty((3, 2), np.bool_), np.empty(3), np.empty(3)
    for i in range(3):
        at = 0.0
        for j in range(3):
            at += pose_k[j, i] * (o[j] - pose_k[j, 3])
        faces[i, 0], faces[i, 1] = at < -half[i], at > half[i]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        number = max(int(2.0 * half[i] / step_m + 0.5), 1)
        for sa in range(2):
            for sb in range(2):
                if faces[a, sa] == faces[b, sb]:
                    continue
                for j in range(number):
                    t = (2.0 * (j + 0.5) / number - 1.0) * half[i]
                    ta, tb = (2.0 * sa - 1.0), (2.0 * sb - 1.0)
                    for m in range(3):
                        p[m] = (pose_k[m, 3] + pose_k[m, i] * t + pose_k[m, a] * ta * half[a]
                                + pose_k[m, b] * tb * half[b])
                        n[m] = (ta * pose_k[m, a] + tb * pose_k[m, b]) / math.sqrt(2.0)
                    # square to the line of sight and to the edge
                    ux, uy, uz = p[0] - o[0], p[1] - o[1], p[2] - o[2]
                    ex, ey, ez = pose_k[0, i], pose_k[1, i], pose_k[2, i]
                    cx, cy, cz = uy * ez - uz * ey, uz * ex - ux * ez, ux * ey - uy * ex
                    length = math.sqrt(cx * cx + cy * cy + cz * cz)
                    if not length > 1e-9:
                        continue
                    sign = 1.0 if cx * n[0] + cy * n[1] + cz * n[2] > 0.0 else -1.0
                    n[0], n[1], n[2] = sign * cx / length, sign * cy / length, sign * cz / length
                    used = _keep(bodies, placed, order, pose, intrinsics, o, width, height, k, p, n, used, ints, floats)
    return used


@njit(cache=True)
def _beside(bodies, placed, order, layer, o, p, n, sign):
    """The layer that a ray just beside a point p of `layer` meets first, and how far behind p."""
    x, y, z = (p[0] + sign * OUTSIDE_M * n[0] - o[0], p[1] + sign * OUTSIDE_M * n[1] - o[1],
               p[2] + sign * OUTSIDE_M * n[2] - o[2])
    far = math.sqrt(x * x + y * y + z * z)
    if order.shape[0]:
        layer = front_layer(bodies, placed, order, o[0], o[1], o[2], x / far, y / far, z / far)
        if layer == NONE:
            return NONE, 1e9
    away = hit_layer(bodies, placed, layer, o[0], o[1], o[2], x / far, y / far, z / far, 0.0)
    return (layer, away - far) if away > 0.0 else (NONE, 1e9)


@njit(cache=True)
def _keep(bodies, placed, order, pose, intrinsics, o, width, height, k, p, n, used, ints, floats):
    """Write the point p with the outward normal n if it is on the visible outline; returns the new count."""
    layer = bodies.layer[k]
    if used == ints.shape[0]:
        return used
    if _beside(bodies, placed, order, layer, o, p, n, -1.0)[0] != layer:
        return used
    behind, deeper = _beside(bodies, placed, order, layer, o, p, n, 1.0)
    if behind == layer or deeper < JUMP_M:
        return used
    pixel, slope, u, across = np.empty(2), np.empty((2, 3)), np.empty(3), np.empty(2)
    if not project(p[0], p[1], p[2], pose, intrinsics, pixel, slope):
        return used
    if not (0.0 < pixel[0] < width - 1.0 and 0.0 < pixel[1] < height - 1.0):
        return used
    far = math.sqrt((p[0] - o[0]) ** 2 + (p[1] - o[1]) ** 2 + (p[2] - o[2]) ** 2)
    for i in range(3):
        u[i] = (p[i] - o[i]) / far
    if not image_normal(slope, n, u, across):
        return used
    base = placed.root[:3] if bodies.layer_row[layer] < 0 else placed.frames[bodies.layer_row[layer]]
    for i in range(3):
        floats[used, i] = 0.0
        for j in range(3):
            floats[used, i] += base[j, i] * (p[j] - base[j, 3])
    floats[used, 3], floats[used, 4] = pixel[0], pixel[1]
    floats[used, 5], floats[used, 6] = across[0], across[1]
    ints[used, 0], ints[used, 1] = layer, behind
    return used + 1
