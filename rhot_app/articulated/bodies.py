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
from rhot_app.estimation.layout import SE3, Layout
from rhot_app.estimation.vectors import (
    along,
    axis_of,
    dot,
    minus,
    norm,
    origin_of,
    to_outer,
    turned,
    turned_back,
    unit,
)
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

_ROOT = Layout(root=SE3)
ROOT_POSE = _ROOT.tangent_size
"""Columns of a tangent space before the angles: the root's translation, m, and rotation, rad, along world axes."""

ANGLES = _ROOT.size
"""Numbers of a state before the angles: world_from_root (3, 4), row by row."""

_SAME = 1e-9  # m, or of a direction: as good as nothing


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


def place(bodies: Bodies, root: Array, angles: Array) -> Placed:
    """The bodies of an object at `root` (4, 4) with `angles` (A,) rad."""
    placed = Placed(np.ascontiguousarray(root), np.empty((len(bodies.dh.parent), 3, 4)), np.empty_like(bodies.ends),
                    np.empty_like(bodies.box), np.zeros((len(bodies.layer_row), 4)))
    _place(bodies, np.ascontiguousarray(angles), placed)
    return placed


@njit(cache=True)
def frame_of(placed, row):
    """(3, 4) world_from_row, or (4, 4) of the root."""
    return placed.root if row < 0 else placed.frames[row]


@njit(cache=True)
def _place(bodies, angles, placed):
    forward_arrays(bodies.dh, placed.root, angles, placed.frames, bodies.dh.point_offset)
    for k in range(len(bodies.row)):
        base = frame_of(placed, bodies.row[k])
        for end in range(2):
            placed.ends[k, end] = to_outer(base, bodies.ends[k, end])
        for j in range(4):
            column = to_outer(base, bodies.box[k, :, 3]) if j == 3 else turned(base, bodies.box[k, :, j])
            for i in range(3):
                placed.box[k, i, j] = column[i]
    for layer in range(len(bodies.carrier)):
        placed.plane[layer] = 0.0
        if bodies.carrier[layer] >= 0 and bodies.hinge[layer] >= 0:
            _bisect(bodies, placed, layer, placed.plane[layer])


@njit(cache=True)
def joint_of(bodies, placed, layer):
    """World_from_joint of a layer that has a hinge: z is the axis of the joint."""
    return frame_of(placed, bodies.dh.parent[bodies.hinge[layer]])


@njit(cache=True)
def _bisect(bodies, placed, layer, plane):
    """Fill `plane` (4,) of a layer's joint; leave it where either is no capsule."""
    joint, sides = origin_of(joint_of(bodies, placed, layer)), np.zeros((2, 3))
    for side in range(2):
        which, far = layer if side == 0 else bodies.carrier[layer], 0.0
        for k in range(bodies.first[which], bodies.first[which + 1]):
            if bodies.kind[k] != CAPSULE:
                return
            for end in range(2):
                away = minus(placed.ends[k, end], joint)
                if norm(away) > far:
                    far = norm(away)
                    sides[side] = unit(away)
    across = minus(sides[0], sides[1])
    if norm(across) > _SAME:
        normal = unit(across)
        plane[:3], plane[3] = normal, dot(normal, joint)


@njit(cache=True)
def _ray_to_box(o, u, pose, half, margin):
    """Distance along the ray from o with unit direction u to a box grown by `margin`; -1 for none."""
    at, slope, enter, leave = turned_back(pose, minus(o, origin_of(pose))), turned_back(pose, u), -np.inf, np.inf
    for i in range(3):
        wide = half[i] + margin
        if abs(slope[i]) < _SAME:
            if abs(at[i]) > wide:
                return -1.0
            continue
        first, second = (-wide - at[i]) / slope[i], (wide - at[i]) / slope[i]
        enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
    return enter if 0.0 < enter <= leave else -1.0


@njit(cache=True)
def layer_distances(bodies, placed, layer, o, rays, margin):
    """(N,) m along rays (N, 3), of unit length, from o to the bodies of a layer, grown by `margin` m: to the nearest,
    if that is on the layer's side of its joints; -1 for none."""
    ends, radii, kinds, planes, carrier = placed.ends, bodies.radii, bodies.kind, placed.plane, bodies.carrier
    start, stop, found = bodies.first[layer], bodies.first[layer + 1], np.full(len(rays), -1.0)
    joints, reach = np.zeros((len(carrier), 3)), np.full(len(carrier), np.inf)
    for other in range(len(carrier)):
        if carrier[other] == layer and bodies.hinge[other] >= 0 and stop > start + 1:
            # of several bodies, only what lies so near to the joint is the link's
            joints[other], reach[other] = origin_of(joint_of(bodies, placed, other)), FLESH * radii[
                bodies.first[other], 0]
    for n in range(len(rays)):
        u, best = (rays[n, 0], rays[n, 1], rays[n, 2]), -1.0
        for k in range(start, stop):
            t = (ray_to_capsule(o, u, ends, radii, k, margin) if kinds[k] == CAPSULE else
                 _ray_to_box(o, u, placed.box[k], bodies.half[k], margin))
            if t > 0.0 and (best < 0.0 or t < best):
                best = t
        if best > 0.0:
            p = along(o, best, u)
            for other in range(len(carrier)):
                if other == layer or carrier[other] == layer:
                    beyond = dot(planes[other], p) - planes[other, 3]
                    if (beyond < -margin if other == layer else
                            beyond > margin and norm(minus(p, joints[other])) < reach[other]):
                        best = -1.0
                        break
        found[n] = best
    return found


@njit(cache=True)
def normals_at(bodies, placed, layer, points):
    """(N, 3) outward normals of a layer's surface at points (N, 3) on it."""
    normals = np.empty((len(points), 3))
    for n in range(len(points)):
        _fill_normal(bodies, placed, layer, points[n], normals[n])
    return normals


@njit(cache=True)
def _fill_normal(bodies, placed, layer, p, out):
    best, v, away = 1e9, (0.0, 0.0, 0.0), 0.0
    for k in range(bodies.first[layer], bodies.first[layer + 1]):
        if bodies.kind[k] == CAPSULE:
            a, rod = placed.ends[k, 0], minus(placed.ends[k, 1], placed.ends[k, 0])
            length, from_a = norm(rod), minus(p, a)
            # where the cone's normal meets the axis
            taper = bodies.radii[k, 0] - bodies.radii[k, 1]
            t = dot(from_a, rod) / length**2 if length > _SAME else 0.0
            if length > max(abs(taper), _SAME):
                t -= norm(along(from_a, -t, rod)) * taper / math.sqrt(length**2 - taper**2) / length
            t = min(max(t, 0.0), 1.0)
            v = along(from_a, -t, rod)
            away = abs(norm(v) - bodies.radii[k, 0] + t * taper)
            v = unit(v)
        else:
            pose, away = placed.box[k], 1e9
            at = turned_back(pose, minus(p, origin_of(pose)))
            for i in range(3):
                if abs(abs(at[i]) - bodies.half[k, i]) < away:
                    away = abs(abs(at[i]) - bodies.half[k, i])
                    v = along((0.0, 0.0, 0.0), 1.0 if at[i] > 0.0 else -1.0, axis_of(pose, i))
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
