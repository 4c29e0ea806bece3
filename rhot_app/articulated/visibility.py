"""Which link hides which: occlusion relations, their graph, the visibility order, and the image by layers (Rehg 1995,
3.1, 3.2, 3.3.4 and 3.4).

Two convex bodies hide each other one way only: any line of sight through both decides (binary occlusion). Links that
share a joint are decided by the angles in the plane of the joint (eq. 3.1). The order is a topological sort of the
graph. A cycle is cut where the least of the image is hidden, and the order says so.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.articulated.bodies import CAPSULE, Bodies, Placed, hit_layer, joint_of
from rhot_app.barehand.contours import NEAREST_M, camera_centre
from rhot_app.geometry.camera import REACH, project_ray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LINES = 8
"""Lines of sight across the common rectangle of two layers, in each direction."""

SAME_M = 1e-6
"""m: nearer surfaces are one, such as the ball that two links share."""

NONE = -1
"""Label of a pixel that shows no layer."""


class Visibility(NamedTuple):
    """`order` (L,): layers, the one that nothing hides first. `weight` (L, L): normalised image area in which layer i
    hides layer j, less that in which j hides i. `cut` (L,): the layer was taken although another hides it, to end a
    cycle."""

    order: Indices
    weight: Array
    cut: NDArray[np.bool_]

    @property
    def cyclic(self) -> bool:
        """Whether there is no order that all relations agree with."""
        return bool(self.cut.any())


def visibility(bodies: Bodies, placed: Placed, pose: Array, margin_m: float = 0.0) -> Visibility:
    """The visibility order before a camera of `pose` (3, 4) camera_from_world. `margin_m`: bodies are taken for so much
    thicker, so that the order holds before they meet: for motions of half as much each (eq. 3.2)."""
    count = len(bodies.layer_row)
    weight, depth = np.zeros((count, count)), np.empty(count)
    _relate(bodies, placed, pose, margin_m, weight, depth)
    order, cut = np.empty(count, np.int64), np.zeros(count, np.bool_)
    sort_layers(weight, depth, order, cut)
    return Visibility(order, weight, cut)


@njit(cache=True)
def revolute_relation(to_carrier, to_link, to_eye, axis):
    """Of a link on a revolute joint and its carrier (eq. 3.1): 1 where the link hides the carrier, -1 where the carrier
    hides the link, 0 where they are on both sides of the eye's line. Vectors (3,) from the joint; `axis` (3,) unit."""
    view, angle = _turn(to_carrier, to_eye, axis), _turn(to_carrier, to_link, axis)
    if view < 0.0:
        view, angle = -view, -angle
    if 0.0 <= angle <= view:
        return 1
    if view - math.pi <= angle < 0.0:
        return -1
    return 0


@njit(cache=True)
def _turn(a, b, axis):
    """Angle, rad, about `axis` from the direction of `a` to that of `b`, both in the plane square to it."""
    p = a[0] * axis[0] + a[1] * axis[1] + a[2] * axis[2]
    q = b[0] * axis[0] + b[1] * axis[1] + b[2] * axis[2]
    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - p * q
    sine = (axis[0] * (a[1] * b[2] - a[2] * b[1]) + axis[1] * (a[2] * b[0] - a[0] * b[2])
            + axis[2] * (a[0] * b[1] - a[1] * b[0]))
    return math.atan2(sine, dot)


@njit(cache=True)
def rectangle(bodies, placed, pose, layer, margin, out):
    """Fill `out` (4,): x0, y0, x1, y1 of a layer in normalised image coordinates. False when it is not before the
    camera."""
    out[0], out[1], out[2], out[3] = 1e9, 1e9, -1e9, -1e9
    for k in range(bodies.first[layer], bodies.first[layer + 1]):
        capsule = bodies.kind[k] == CAPSULE
        for corner in range(2 if capsule else 8):
            if capsule:
                p, radius = placed.ends[k, corner], bodies.radii[k, corner] + margin
                x, y, z = p[0], p[1], p[2]
            else:
                b, radius = placed.box[k], 0.0
                h0 = (bodies.half[k, 0] + margin) * (1.0 if corner & 1 else -1.0)
                h1 = (bodies.half[k, 1] + margin) * (1.0 if corner & 2 else -1.0)
                h2 = (bodies.half[k, 2] + margin) * (1.0 if corner & 4 else -1.0)
                x = b[0, 3] + b[0, 0] * h0 + b[0, 1] * h1 + b[0, 2] * h2
                y = b[1, 3] + b[1, 0] * h0 + b[1, 1] * h1 + b[1, 2] * h2
                z = b[2, 3] + b[2, 0] * h0 + b[2, 1] * h1 + b[2, 2] * h2
            a = pose[0, 3] + pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z
            b_ = pose[1, 3] + pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z
            c = pose[2, 3] + pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z
            if not c - radius > NEAREST_M:
                return False
            for i in range(2):  # tangents of the ball, seen in the plane of the optical axis and one image axis
                v = a if i == 0 else b_
                square = v * v + c * c
                away = math.atan2(v, c)
                half = math.asin(min(radius / math.sqrt(square), 1.0))
                out[i] = min(out[i], math.tan(away - half))
                out[2 + i] = max(out[2 + i], math.tan(away + half))
    return True


@njit(cache=True)
def _relate(bodies, placed, pose, margin, weight, depth):
    """Fill `weight` (L, L) as `Visibility` says, and `depth` (L,): distance of a layer's middle from the camera."""
    count = bodies.layer_row.shape[0]
    boxes, shown = np.empty((count, 4)), np.empty(count, np.bool_)
    middle, o = np.zeros((count, 3)), np.empty(3)
    camera_centre(pose, o)
    for layer in range(count):
        shown[layer] = rectangle(bodies, placed, pose, layer, margin, boxes[layer])
        for k in range(bodies.first[layer], bodies.first[layer + 1]):
            for i in range(3):
                if bodies.kind[k] == CAPSULE:
                    middle[layer, i] += 0.5 * (placed.ends[k, 0, i] + placed.ends[k, 1, i])
                else:
                    middle[layer, i] += placed.box[k, i, 3]
        middle[layer] /= bodies.first[layer + 1] - bodies.first[layer]
        depth[layer] = (pose[2, 3] + pose[2, 0] * middle[layer, 0] + pose[2, 1] * middle[layer, 1]
                        + pose[2, 2] * middle[layer, 2])
    weight[:] = 0.0
    joint, eye = np.empty(3), np.empty(3)
    axis = np.empty(3)
    for a in range(count):
        for b in range(a):
            if not shown[a] or not shown[b]:
                continue
            link, carrier = (a, b) if bodies.carrier[a] == b else (b, a)
            single = bodies.first[carrier + 1] == bodies.first[carrier] + 1
            if bodies.carrier[link] == carrier and single and np.any(placed.plane[link] != 0.0):
                base = joint_of(bodies, placed, link)
                for i in range(3):
                    joint[i], axis[i] = base[i, 3], base[i, 2]
                    eye[i] = o[i] - joint[i]
                sign = revolute_relation(middle[carrier] - joint, middle[link] - joint, eye, axis)
                area = (sign if link == a else -sign) * _overlap(boxes[a], boxes[b])
            else:
                area = _common(bodies, placed, pose, o, a, b, boxes[a], boxes[b], margin)
            weight[a, b], weight[b, a] = area, -area


@njit(cache=True)
def _overlap(a, b):
    """Area that two rectangles have in common."""
    return max(min(a[2], b[2]) - max(a[0], b[0]), 0.0) * max(min(a[3], b[3]) - max(a[1], b[1]), 0.0)


@njit(cache=True)
def _common(bodies, placed, pose, o, a, b, box_a, box_b, margin):
    """Area in which layer `a` is before `b`, less that in which it is behind; normalised image coordinates."""
    x0, x1 = max(box_a[0], box_b[0]), min(box_a[2], box_b[2])
    y0, y1 = max(box_a[1], box_b[1]), min(box_a[3], box_b[3])
    if x0 >= x1 or y0 >= y1:
        return 0.0
    votes = 0
    for i in range(LINES):
        for j in range(LINES):
            x, y = x0 + (i + 0.5) / LINES * (x1 - x0), y0 + (j + 0.5) / LINES * (y1 - y0)
            ux, uy, uz = (pose[0, 0] * x + pose[1, 0] * y + pose[2, 0], pose[0, 1] * x + pose[1, 1] * y + pose[2, 1],
                          pose[0, 2] * x + pose[1, 2] * y + pose[2, 2])
            far = math.sqrt(ux * ux + uy * uy + uz * uz)
            ux, uy, uz = ux / far, uy / far, uz / far
            first = hit_layer(bodies, placed, a, o[0], o[1], o[2], ux, uy, uz, margin)
            if first < 0.0:
                continue
            second = hit_layer(bodies, placed, b, o[0], o[1], o[2], ux, uy, uz, margin)
            if second > 0.0 and abs(first - second) > SAME_M:
                votes += 1 if first < second else -1
    return votes * (x1 - x0) * (y1 - y0) / LINES**2


@njit(cache=True)
def sort_layers(weight, depth, order, cut):
    """Topological sort: fill `order` (L,) and `cut` (L,) from `weight` (L, L) and, among layers of which none hides
    another, `depth` (L,).

    In a cycle no layer is free. Then the one is taken of which the least is hidden, among those that only layers of
    their own cycle hide. Ends after L rounds.
    """
    count = weight.shape[0]
    taken, reach = np.zeros(count, np.bool_), np.zeros((count, count), np.bool_)
    cut[:] = False
    for place in range(count):
        best = -1
        for i in range(count):
            if taken[i]:
                continue
            free = True
            for j in range(count):
                free = free and (taken[j] or not weight[j, i] > 0.0)
            if free and (best < 0 or depth[i] < depth[best]):
                best = i
        if best < 0:
            for i in range(count):
                for j in range(count):
                    reach[i, j] = not taken[i] and not taken[j] and weight[i, j] > 0.0
            for k in range(count):
                for i in range(count):
                    if reach[i, k]:
                        for j in range(count):
                            reach[i, j] = reach[i, j] or reach[k, j]
            least = 1e300
            for i in range(count):
                first, hidden = not taken[i], 0.0
                for j in range(count):
                    first = first and (not reach[j, i] or reach[i, j])
                    if not taken[j] and weight[j, i] > 0.0:
                        hidden += weight[j, i]
                if first and hidden < least:
                    best, least = i, hidden
            cut[best] = True
        order[place], taken[best] = best, True


@njit(cache=True)
def front_layer(bodies, placed, order, ox, oy, oz, ux, uy, uz):
    """The first layer in `order` that the ray from o along u meets, NONE without: where its window function is 1 and
    those before it are 0 (eq. 3.6)."""
    for place in range(order.shape[0]):
        if hit_layer(bodies, placed, order[place], ox, oy, oz, ux, uy, uz, 0.0) > 0.0:
            return order[place]
    return NONE


def segment(bodies: Bodies, placed: Placed, order: Indices, pose: Array, intrinsics: Array, rays: Array) -> Indices:
    """(H, W) the layer that each pixel shows, NONE for none: list-priority, the last layer in `order` painted first.
    `rays` (H, W, 3): `camera_rays` of the camera with `intrinsics` (13,) and `pose` (3, 4)."""
    labels = np.full(rays.shape[:2], NONE)
    _paint(bodies, placed, order, np.ascontiguousarray(pose), intrinsics, rays, labels)
    return labels


@njit(cache=True)
def pixel_box(box, intrinsics, width, height, out):
    """Fill `out` (4,) x0, y0, x1, y1 px: the pixels that a rectangle of normalised image coordinates may touch."""
    x0, y0, x1, y1 = 1e9, 1e9, -1e9, -1e9
    for i in range(5):
        for j in range(5):
            if 0 < i < 4 and 0 < j < 4:
                continue
            x, y = box[0] + 0.25 * i * (box[2] - box[0]), box[1] + 0.25 * j * (box[3] - box[1])
            inside = math.sqrt(min(1.0, 0.999 * intrinsics[REACH] / max(x * x + y * y, 1e-12)))
            u, v, _, _, _, _ = project_ray(inside * x, inside * y, intrinsics)
            x0, y0, x1, y1 = min(x0, u), min(y0, v), max(x1, u), max(y1, v)
    out[0], out[1] = max(int(x0) - 2, 0), max(int(y0) - 2, 0)
    out[2], out[3] = min(int(x1) + 3, width), min(int(y1) + 3, height)


@njit(cache=True)
def _paint(bodies, placed, order, pose, intrinsics, rays, labels):
    box, pixels, o = np.empty(4), np.empty(4, np.int64), np.empty(3)
    camera_centre(pose, o)
    for place in range(order.shape[0] - 1, -1, -1):
        layer = order[place]
        if not rectangle(bodies, placed, pose, layer, 0.0, box):
            continue
        pixel_box(box, intrinsics, labels.shape[1], labels.shape[0], pixels)
        for y in range(pixels[1], pixels[3]):
            for x in range(pixels[0], pixels[2]):
                r = rays[y, x]
                ux = pose[0, 0] * r[0] + pose[1, 0] * r[1] + pose[2, 0] * r[2]
                uy = pose[0, 1] * r[0] + pose[1, 1] * r[1] + pose[2, 1] * r[2]
                uz = pose[0, 2] * r[0] + pose[1, 2] * r[1] + pose[2, 2] * r[2]
                if hit_layer(bodies, placed, layer, o[0], o[1], o[2], ux, uy, uz, 0.0) > 0.0:
                    labels[y, x] = layer
