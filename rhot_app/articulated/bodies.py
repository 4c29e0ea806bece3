"""The convex bodies of an articulated object, and the layers that they make: what one template order is about.

A body is a tapered capsule or a box and rides on one row of the object's table. A layer is what moves as one: a link,
or the palm with its nine capsules. Capsules that share a joint overlap in it. Each ends at the plane through the joint
that bisects their angle: beyond it lies the other one's flesh. So links are convex and disjoint.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.surface import FOREARM, PALM, Surface, ray_to_capsule
from rhot_app.geometry.camera import CameraModel, undistort_points
from rhot_app.hand.articulated import Box, Capsule
from rhot_app.hand.articulated_model import ArticulatedModel
from rhot_app.hand.dh import FIXED, ROOT, DhArrays
from rhot_app.hand.kinematics import forward_arrays
from rhot_app.hand.skeleton import BONES, FINGERS

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CAPSULE, BOX = range(2)

FLESH = 2.0
"""Radii: where several bodies carry a link, what lies so near to its joint, beyond the plane, is the link's. Chosen: a
knuckle's own radius, and as much of the flesh about it."""

ROOT_POSE = 6
"""Columns of a tangent space before the angles: the root's translation, m, and rotation, rad, along world axes."""

ANGLES = 12
"""Numbers of a state before the angles: world_from_root (3, 4), row by row."""


class Bodies(NamedTuple):
    """N bodies in L layers. `dh`: the object's table, R rows.

    `row` (N,): that carries a body, ROOT: the root. `kind` (N,): CAPSULE or BOX. `ends` (N, 2, 3) and `radii` (N, 2)
    m of capsules; `box` (N, 3, 4) row_from_box and `half` (N, 3) m of boxes. `layer` (N,), ascending.
    `layer_row` (L,): as `row`; `carrier` (L,): the layer on which a layer hangs, -1; `hinge` (L,): the row whose angle
    turns it last, -1; `first` (L + 1,): its first body, and that of the next.
    """

    dh: DhArrays
    row: Indices
    kind: Indices
    ends: Array
    radii: Array
    box: Array
    half: Array
    layer: Indices
    layer_row: Indices
    carrier: Indices
    hinge: Indices
    first: Indices


class Placed(NamedTuple):
    """Bodies in the world, m: `root` (4, 4), `frames` (R, 3, 4), `ends` (N, 2, 3), `box` (N, 3, 4) world_from_box;
    `plane` (L, 4): at a layer's joint, unit normal and offset; n . p > offset on the layer's side; zeros: no plane."""

    root: Array
    frames: Array
    ends: Array
    box: Array
    plane: Array


def bodies_of(model: ArticulatedModel) -> tuple[Bodies, tuple[str, ...]]:
    """The bodies of an object, each a layer, and the layers' names."""
    shaped = [body for body in model.bodies if body.shape is not None]
    count = len(shaped)
    row, kind = np.empty(count, np.int64), np.zeros(count, np.int64)
    ends, radii = np.zeros((count, 2, 3)), np.ones((count, 2))
    box, half = np.tile(np.eye(4)[:3], (count, 1, 1)), np.ones((count, 3))
    mirrored = model.document.side == "left"
    for k, body in enumerate(shaped):
        row[k] = body.row
        if isinstance(body.shape, Capsule):
            end = body.shape.end_radius_mm
            ends[k, 0, 0] = -body.link
            radii[k] = 1e-3 * body.shape.radius_mm, 1e-3 * (body.shape.radius_mm if end is None else end)
        elif isinstance(body.shape, Box):
            c, s = math.cos(body.twist), math.sin(body.twist)
            turn = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
            centre = 1e-3 * np.array(body.shape.centre_mm)
            if mirrored:
                centre[0 if body.row == ROOT and model.document.mirror_axis == "x" else 1] *= -1.0
            kind[k], half[k], box[k, :, :3] = BOX, 0.5e-3 * np.array(body.shape.size_mm), turn
            box[k, :, 3] = np.array([-0.5 * body.link, 0.0, 0.0]) + turn @ centre
    dh = model.dh._replace(point_row=np.empty(0, np.int64), point_offset=np.empty((0, 3)))
    return (_layered(dh, row, kind, ends, radii, box, half, np.arange(count)), tuple(body.name for body in shaped))


def hand_bodies(surface: Surface) -> tuple[Bodies, tuple[str, ...]]:
    """The bodies of a hand: a layer for each phalanx, one for the palm and one for the forearm; and their names."""
    count, layer = len(surface.row), np.empty(len(surface.row), np.int64)
    bones = [f"{finger}_{bone}" for finger, own in zip(FINGERS, BONES, strict=True) for bone in own]
    for k in range(count):
        group = int(surface.group[k])
        layer[k] = len(bones) + group - PALM if group >= PALM else 3 * group + k % 3
    return (_layered(surface.dh, surface.row, np.zeros(count, np.int64), surface.ends, surface.radii,
                     np.tile(np.eye(4)[:3], (count, 1, 1)), np.ones((count, 3)), layer),
            (*bones, "palm", "forearm")[:len(bones) + 1 + FOREARM - PALM])


def _layered(dh: DhArrays, row: Indices, kind: Indices, ends: Array, radii: Array, box: Array, half: Array,
             layer: Indices) -> Bodies:
    count = int(layer.max()) + 1 if len(layer) else 0
    layer_row = np.array([row[np.flatnonzero(layer == k)[0]] for k in range(count)], np.int64)
    of_row = {int(row): k for k, row in reversed(list(enumerate(layer_row)))}
    carrier, hinge = np.full(count, -1), np.full(count, -1)
    for k in range(count):
        at = int(layer_row[k])
        while at != ROOT:
            if hinge[k] < 0 and dh.angle[at] != FIXED:
                hinge[k] = at
            at = int(dh.parent[at])
            if at in of_row:
                carrier[k] = of_row[at]
                break
    return Bodies(dh, row.astype(np.int64), kind, ends.copy(), radii.copy(), box, half, layer, layer_row, carrier,
                  hinge, np.searchsorted(layer, np.arange(count + 1)))


def root_of(state: Array) -> Array:
    """(4, 4) world_from_root of a state (12 + A + ...,)."""
    root = np.eye(4)
    root[:3] = state[:ANGLES].reshape(3, 4)
    return root


def place(bodies: Bodies, root: Array, angles: Array) -> Placed:
    """The bodies of an object at `root` (4, 4) with `angles` (A,) rad."""
    placed = Placed(np.ascontiguousarray(root), np.empty((len(bodies.dh.parent), 3, 4)), np.empty_like(bodies.ends),
                    np.empty_like(bodies.box), np.zeros((len(bodies.layer_row), 4)))
    _place(bodies, np.ascontiguousarray(angles), placed)
    return placed


@njit(cache=True)
def _place(bodies, angles, placed):
    forward_arrays(bodies.dh, placed.root, angles, placed.frames, bodies.dh.point_offset)
    for k in range(bodies.row.shape[0]):
        base = placed.root if bodies.row[k] < 0 else placed.frames[bodies.row[k]]
        for i in range(3):
            for end in range(2):
                placed.ends[k, end, i] = (base[i, 3] + base[i, 0] * bodies.ends[k, end, 0]
                                          + base[i, 1] * bodies.ends[k, end, 1] + base[i, 2] * bodies.ends[k, end, 2])
            for j in range(4):
                placed.box[k, i, j] = (base[i, 0] * bodies.box[k, 0, j] + base[i, 1] * bodies.box[k, 1, j]
                                       + base[i, 2] * bodies.box[k, 2, j])
            placed.box[k, i, 3] += base[i, 3]
    for layer in range(bodies.carrier.shape[0]):
        placed.plane[layer] = 0.0
        if bodies.carrier[layer] >= 0 and bodies.hinge[layer] >= 0:
            _bisect(bodies, placed, layer, placed.plane[layer])


@njit(cache=True)
def joint_of(bodies, placed, layer):
    """(3, 4) world_from_joint of a layer that has a hinge: z is the axis of the joint."""
    parent = bodies.dh.parent[bodies.hinge[layer]]
    return placed.root[:3] if parent < 0 else placed.frames[parent]


@njit(cache=True)
def _bisect(bodies, placed, layer, plane):
    """Fill `plane` (4,) of a layer's joint; leave it where either is no capsule."""
    joint, sides = joint_of(bodies, placed, layer), np.zeros((2, 3))
    for side in range(2):
        which, far = layer if side == 0 else bodies.carrier[layer], 0.0
        for k in range(bodies.first[which], bodies.first[which + 1]):
            if bodies.kind[k] != CAPSULE:
                return
            for end in range(2):
                square = 0.0
                for i in range(3):
                    square += (placed.ends[k, end, i] - joint[i, 3]) ** 2
                if square > far:
                    far = square
                    for i in range(3):
                        sides[side, i] = (placed.ends[k, end, i] - joint[i, 3]) / math.sqrt(square)
    length = 0.0
    for i in range(3):
        length += (sides[0, i] - sides[1, i]) ** 2
    if length > 1e-12:
        for i in range(3):
            plane[i] = (sides[0, i] - sides[1, i]) / math.sqrt(length)
            plane[3] += plane[i] * joint[i, 3]


@njit(cache=True)
def hit(bodies, placed, k, ox, oy, oz, ux, uy, uz, margin):
    """Distance, m, along the ray from o with unit direction u to body `k` grown by `margin` m; -1 for none."""
    if bodies.kind[k] == CAPSULE:
        a, b = placed.ends[k, 0], placed.ends[k, 1]
        ra, rb = bodies.radii[k, 0] + margin, bodies.radii[k, 1] + margin
        mx, my, mz = 0.5 * (a[0] + b[0]) - ox, 0.5 * (a[1] + b[1]) - oy, 0.5 * (a[2] + b[2]) - oz
        along = mx * ux + my * uy + mz * uz
        reach = 0.5 * math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2) + max(ra, rb)
        if mx * mx + my * my + mz * mz - along * along > reach * reach:
            return -1.0
        if reach <= max(ra, rb) + 1e-12:  # a ball
            rest = mx * mx + my * my + mz * mz - along * along
            return along - math.sqrt(ra * ra - rest)
        return ray_to_capsule(ox, oy, oz, ux, uy, uz, a, b, ra, rb)
    pose = placed.box[k]
    enter, leave = -1e9, 1e9
    for i in range(3):
        at = pose[0, i] * (ox - pose[0, 3]) + pose[1, i] * (oy - pose[1, 3]) + pose[2, i] * (oz - pose[2, 3])
        slope = pose[0, i] * ux + pose[1, i] * uy + pose[2, i] * uz
        half = bodies.half[k, i] + margin
        if abs(slope) < 1e-12:
            if abs(at) > half:
                return -1.0
            continue
        first, second = (-half - at) / slope, (half - at) / slope
        enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
    return enter if 0.0 < enter <= leave else -1.0


@njit(cache=True)
def hit_layer(bodies, placed, layer, ox, oy, oz, ux, uy, uz, margin):
    """As `hit`, of all bodies of a layer: the nearest, on the layer's side of its joints."""
    best = -1.0
    for k in range(bodies.first[layer], bodies.first[layer + 1]):
        t = hit(bodies, placed, k, ox, oy, oz, ux, uy, uz, margin)
        if t > 0.0 and (best < 0.0 or t < best):
            best = t
    if best > 0.0:
        x, y, z = ox + best * ux, oy + best * uy, oz + best * uz
        for other in range(bodies.carrier.shape[0]):
            if other == layer or bodies.carrier[other] == layer:
                n = placed.plane[other]
                beyond = n[0] * x + n[1] * y + n[2] * z - n[3]
                if other == layer:
                    if beyond < -margin:
                        return -1.0
                elif beyond > margin and (bodies.first[layer + 1] == bodies.first[layer] + 1
                                          or _in_joint(bodies, placed, other, x, y, z)):
                    return -1.0
    return best


@njit(cache=True)
def _in_joint(bodies, placed, layer, x, y, z):
    """Whether a point lies within the thickness of a link from its joint: of a palm, only that is the link's."""
    joint = joint_of(bodies, placed, layer)
    reach = FLESH * bodies.radii[bodies.first[layer], 0]
    return (x - joint[0, 3]) ** 2 + (y - joint[1, 3]) ** 2 + (z - joint[2, 3]) ** 2 < reach * reach


@njit(cache=True)
def normal_at(bodies, placed, layer, px, py, pz, out):
    """Fill `out` (3,), the outward normal of a layer's surface at the point p on it."""
    best = 1e9
    v = np.empty(3)
    for k in range(bodies.first[layer], bodies.first[layer + 1]):
        if bodies.kind[k] == CAPSULE:
            a, b = placed.ends[k, 0], placed.ends[k, 1]
            length = dot = 0.0
            for i in range(3):
                p = px if i == 0 else (py if i == 1 else pz)
                length += (b[i] - a[i]) ** 2
                dot += (p - a[i]) * (b[i] - a[i])
            # where the cone's normal meets the axis
            taper = bodies.radii[k, 0] - bodies.radii[k, 1]
            t = dot / length if length > 1e-18 else 0.0
            square = 0.0
            for i in range(3):
                p = px if i == 0 else (py if i == 1 else pz)
                square += (p - a[i] - t * (b[i] - a[i])) ** 2
            if length > taper * taper and length > 1e-18:
                t -= math.sqrt(square) * taper / math.sqrt(length - taper * taper) / math.sqrt(length)
            t = min(max(t, 0.0), 1.0)
            radius, square = bodies.radii[k, 0] - t * taper, 0.0
            for i in range(3):
                p = px if i == 0 else (py if i == 1 else pz)
                v[i] = p - a[i] - t * (b[i] - a[i])
                square += v[i] * v[i]
            away = abs(math.sqrt(square) - radius)
            for i in range(3):
                v[i] /= max(math.sqrt(square), 1e-12)
        else:
            pose, away, face, side = placed.box[k], 1e9, 0, 1.0
            for i in range(3):
                at = pose[0, i] * (px - pose[0, 3]) + pose[1, i] * (py - pose[1, 3]) + pose[2, i] * (pz - pose[2, 3])
                if abs(abs(at) - bodies.half[k, i]) < away:
                    away, face, side = abs(abs(at) - bodies.half[k, i]), i, (1.0 if at > 0.0 else -1.0)
            for i in range(3):
                v[i] = side * pose[i, face]
        if away < best:
            best = away
            out[:] = v


def camera_rays(camera: CameraModel) -> Array:
    """(H, W, 3) unit directions of all pixels in the camera's frame; NaN beyond the lens model."""
    columns, rows = np.meshgrid(np.arange(camera.width, dtype=np.float64), np.arange(camera.height, dtype=np.float64))
    flat = undistort_points(np.column_stack([columns.ravel(), rows.ravel()]), camera.intrinsics)
    rays = np.column_stack([flat, np.ones(len(flat))])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return rays.reshape(camera.height, camera.width, 3)
