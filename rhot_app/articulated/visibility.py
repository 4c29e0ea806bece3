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
from scipy.sparse.csgraph import connected_components

from rhot_app.articulated.bodies import CAPSULE, Bodies, Placed, joint_of, layer_distances
from rhot_app.estimation.vectors import axis_of, cross, dot, minus, origin_of, to_outer, turned_back, unit
from rhot_app.geometry.camera import NEAREST_M, CameraRecord

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


def visibility(bodies: Bodies, placed: Placed, camera: CameraRecord, margin_m: float = 0.0) -> Visibility:
    """The visibility order before a camera. `margin_m`: bodies are taken for so much thicker, so that the order holds
    before they meet: for motions of half as much each (eq. 3.2)."""
    count = len(bodies.layer_row)
    weight, depth = np.zeros((count, count)), np.empty(count)
    _relate(bodies, placed, camera, margin_m, weight, depth)
    order, cut = sort_layers(weight, depth)
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
    return math.atan2(dot(axis, cross(a, b)), dot(a, b) - dot(a, axis) * dot(b, axis))


@njit(cache=True)
def rectangle(bodies, placed, pose, layer, margin, out):
    """Fill `out` (4,): x0, y0, x1, y1 of a layer in normalised image coordinates. False when it is not before the
    camera."""
    out[:2], out[2:] = 1e9, -1e9
    for k in range(bodies.first[layer], bodies.first[layer + 1]):
        capsule, half = bodies.kind[k] == CAPSULE, bodies.half[k]
        for corner in range(2 if capsule else 8):
            if capsule:
                p, radius = to_outer(pose, placed.ends[k, corner]), bodies.radii[k, corner] + margin
            else:
                p, radius = to_outer(pose, to_outer(placed.box[k], (
                    (half[0] + margin) * (1.0 if corner & 1 else -1.0),
                    (half[1] + margin) * (1.0 if corner & 2 else -1.0),
                    (half[2] + margin) * (1.0 if corner & 4 else -1.0)))), 0.0
            if not p[2] - radius > NEAREST_M:
                return False
            for i in range(2):  # tangents of the ball, seen in the plane of the optical axis and one image axis
                away = math.atan2(p[i], p[2])
                wide = math.asin(min(radius / math.sqrt(p[i] * p[i] + p[2] * p[2]), 1.0))
                out[i] = min(out[i], math.tan(away - wide))
                out[2 + i] = max(out[2 + i], math.tan(away + wide))
    return True


@njit(cache=True)
def _relate(bodies, placed, camera, margin, weight, depth):
    """Fill `weight` (L, L) as `Visibility` says, and `depth` (L,): distance of a layer's middle from the camera."""
    count, pose = len(bodies.layer_row), camera.pose
    boxes, shown, middle = np.empty((count, 4)), np.empty(count, np.bool_), np.zeros((count, 3))
    for layer in range(count):
        shown[layer] = rectangle(bodies, placed, pose, layer, margin, boxes[layer])
        for k in range(bodies.first[layer], bodies.first[layer + 1]):
            if bodies.kind[k] == CAPSULE:
                middle[layer] += 0.5 * (placed.ends[k, 0] + placed.ends[k, 1])
            else:
                middle[layer] += placed.box[k, :, 3]
        middle[layer] /= bodies.first[layer + 1] - bodies.first[layer]
        depth[layer] = to_outer(pose, middle[layer])[2]
    for a in range(count):
        for b in range(a):
            if not shown[a] or not shown[b]:
                continue
            link, carrier = (a, b) if bodies.carrier[a] == b else (b, a)
            single = bodies.first[carrier + 1] == bodies.first[carrier] + 1
            x0, x1 = max(boxes[a, 0], boxes[b, 0]), min(boxes[a, 2], boxes[b, 2])
            y0, y1 = max(boxes[a, 1], boxes[b, 1]), min(boxes[a, 3], boxes[b, 3])
            area = max(x1 - x0, 0.0) * max(y1 - y0, 0.0)
            if bodies.carrier[link] == carrier and single and np.any(placed.plane[link] != 0.0):
                base = joint_of(bodies, placed, link)
                joint = origin_of(base)
                sign = revolute_relation(minus(middle[carrier], joint), minus(middle[link], joint),
                                         minus(camera.centre, joint), axis_of(base, 2))
                area *= sign if link == a else -sign
            elif area > 0.0:
                area *= _lead(bodies, placed, camera, a, b, (x0, y0, x1 - x0, y1 - y0), margin)
            weight[a, b], weight[b, a] = area, -area


@njit(cache=True)
def _lead(bodies, placed, camera, a, b, box, margin):
    """Part of the rectangle `box`, x, y, width, height in normalised image coordinates, in which layer `a` is before
    `b`, less that in which it is behind."""
    rays = np.empty((LINES**2, 3))
    for k in range(len(rays)):
        x, y = box[0] + (k // LINES + 0.5) / LINES * box[2], box[1] + (k % LINES + 0.5) / LINES * box[3]
        rays[k] = unit(turned_back(camera.pose, (x, y, 1.0)))
    first = layer_distances(bodies, placed, a, camera.centre, rays, margin)
    rays, first = rays[first > 0.0], first[first > 0.0]
    second = layer_distances(bodies, placed, b, camera.centre, rays, margin)
    apart = np.where((second > 0.0) & (np.abs(first - second) > SAME_M), np.sign(second - first), 0.0)
    return apart.sum() / LINES**2


def sort_layers(weight: Array, depth: Array) -> tuple[Indices, NDArray[np.bool_]]:
    """Topological sort: `order` (L,) and `cut` (L,) from `weight` (L, L) and, among layers of which none hides
    another, `depth` (L,).

    In a cycle no layer is free. Then the one is taken of which the least is hidden, among those that only layers of
    their own cycle hide.
    """
    hides, rest, order, cut = weight > 0.0, np.arange(len(depth)), [], np.zeros(len(depth), np.bool_)
    while len(rest):
        left = hides[np.ix_(rest, rest)]
        free = np.flatnonzero(~left.any(axis=0))
        if len(free):
            best = rest[free[np.argmin(depth[rest[free]])]]
        else:
            _, cycle = connected_components(left, connection="strong")
            first = np.flatnonzero(~(left & (cycle[:, None] != cycle)).any(axis=0))
            hidden = np.where(left, weight[np.ix_(rest, rest)], 0.0).sum(axis=0)
            best = rest[first[np.argmin(hidden[first])]]
            cut[best] = True
        order.append(best)
        rest = rest[rest != best]
    return np.array(order, np.int64), cut


def front_layers(bodies: Bodies, placed: Placed, order: Indices, o: Array, rays: Array) -> Indices:
    """(N,) the first layer in `order` that each ray (N, 3) from `o` (3,) meets, NONE without: where its window function
    is 1 and those before it are 0 (eq. 3.6)."""
    found = np.full(len(rays), NONE)
    for layer in order:
        left = np.flatnonzero(found == NONE)
        found[left[layer_distances(bodies, placed, layer, o, rays[left], 0.0) > 0.0]] = layer
    return found


def segment(bodies: Bodies, placed: Placed, order: Indices, camera: CameraRecord, rays: Array) -> Indices:
    """(H, W) the layer that each pixel shows, NONE for none: list-priority, the last layer in `order` painted first.
    `rays` (H, W, 3): `camera_rays` of the camera."""
    labels, box, flat = np.full(rays.shape[:2], NONE), np.empty(4), rays[..., :2] / rays[..., 2:]
    for layer in order[::-1]:
        if rectangle(bodies, placed, camera.pose, layer, 0.0, box):
            y, x = np.nonzero(np.all((flat >= box[:2]) & (flat <= box[2:]), axis=2))
            met = layer_distances(bodies, placed, layer, camera.centre, rays[y, x] @ camera.pose[:, :3], 0.0) > 0.0
            labels[y[met], x[met]] = layer
    return labels
