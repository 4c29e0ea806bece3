"""The surface of a bare hand: a triangle mesh round a hand's bones, and how each vertex follows them.

The mesh is the zero level of a field of tapered limbs, polygonised once at a rest pose (naive surface nets, Gibson
1998) and then moved by linear blend skinning. Flesh that no tracker's capsule has is part of it: joint bulges, finger
pads, thenar and hypothenar muscles, webs, a waisted wrist and a widening forearm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import msgspec
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.kinematics import frames_and_points
from rhot_app.hand.model import HandModel, build_model

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

PALM, FOREARM, BONES = 0, 16, 17
"""Bones that carry the skin: the palm, three segments of each finger (1 + 3 f ...), the forearm."""

PALM_GROUP, WEB_GROUP, FOREARM_GROUP, SLEEVE_GROUP, GROUPS = 5, 6, 7, 8, 9
"""Groups of limbs; 0..4 are the fingers. Limbs of a finger meet sharply, everything else with flesh between."""

REST_DEG: Final = (15.0, -8.0, 0.0, 12.0, 14.0, 9.0, 18.0, 24.0, 14.0, 0.0, 18.0, 24.0, 14.0, -9.0, 18.0, 24.0, 14.0,
                   -18.0, 18.0, 24.0, 14.0)
"""Pose at which the surface is made, degrees in the order of `skeleton.ANGLES`: fingers apart, half way to a fist."""

FOREARM_M: Final = 0.30
"""Length of the forearm: it leaves the picture, as forearms do."""

_FLESH_M: Final = 6e-3  # radius of the flesh in the corner where a finger meets the palm
_WRIST_FLESH_M: Final = 12e-3
_LIMB = 14  # numbers of a limb: ends (6), radii (2), waist (1), flattening axis (3), flattening (1), group (1)


@dataclass(frozen=True, slots=True)
class Surface:
    """A mesh of V vertices and T triangles at rest, in the palm frame, m, and its B bones.

    `vertices` (V, 3); `triangles` (T, 3), counter-clockwise from outside; `weights` (V, B), rows sum to 1; `rows`
    (B,) kinematic rows of the bones, -1: palm or forearm; `bone_from_palm` (B, 3, 4) at rest. `right` (V, 3): the
    vertices of the right hand of which a left one is the mirror image. `group` (V,): the limb group that a vertex lies
    on.
    """

    model: HandModel
    vertices: Array
    triangles: Indices
    weights: Array
    rows: Indices
    bone_from_palm: Array
    right: Array
    group: Indices


def build_surface(anatomy: HandAnatomy, *, spacing_m: float = 2.0e-3, sleeve_from_m: float | None = None,
                  forearm: bool = True) -> Surface:
    """The surface of this hand. `spacing_m`: edge of a grid cell. `sleeve_from_m`: how far behind the wrist a sleeve
    begins, None: a bare arm. Without a `forearm` the hand ends at the wrist."""
    right = build_model(msgspec.structs.replace(anatomy, side="right"))
    frames, points = rest_frames(right)
    limbs = _limbs(right, frames, points, sleeve_from_m, forearm)
    vertices, triangles = _polygonised(limbs.tobytes(), spacing_m)
    nearest = distances(vertices, limbs)
    weights = _weights(right, points, vertices, nearest)
    group = np.argmin(nearest, axis=1)
    model = build_model(anatomy)
    mirrored = vertices * np.array([1.0, model.mirror, 1.0])
    rows = np.full(BONES, -1, np.int64)
    for finger in range(5):
        rows[1 + 3 * finger:4 + 3 * finger] = model.dh.point_row[2 + 4 * finger:5 + 4 * finger]
    own_frames, _ = rest_frames(model)
    bone_from_palm = np.tile(np.eye(4)[:3], (BONES, 1, 1))
    for bone in np.flatnonzero(rows >= 0):
        rotation, origin = own_frames[rows[bone], :, :3], own_frames[rows[bone], :, 3]
        bone_from_palm[bone, :, :3], bone_from_palm[bone, :, 3] = rotation.T, -rotation.T @ origin
    return Surface(model, mirrored, triangles if model.mirror > 0.0 else triangles[:, ::-1].copy(), weights, rows,
                   bone_from_palm, vertices, group)


def rest_frames(model: HandModel) -> tuple[Array, Array]:
    """(R + 1, 3, 4) frames and (26, 3) m points of the hand at rest in its palm frame."""
    frames, points = frames_and_points(model.dh, np.eye(4)[None], np.radians(REST_DEG)[None])
    return frames[0], points[0]


# -- limbs ------------------------------------------------------------------------------------------------------------


def _limb(group: int, start: Array, end: Array, radii: tuple[float, float], waist: float = 0.0,
          flat_axis: Array | None = None, flat: float = 1.0) -> Array:
    axis = np.array([0.0, 0.0, 1.0]) if flat_axis is None else flat_axis
    return np.array([*start, *end, *radii, waist, *axis, flat, group])


def _limbs(model: HandModel, frames: Array, points: Array, sleeve_from_m: float | None, forearm: bool) -> Array:
    """(L, _LIMB) all limbs of a right hand at rest."""
    limbs = []
    for finger in range(5):
        limbs += _finger(model, frames, points, finger)
    limbs += _palm(model, points)
    limbs += _webs(model, points)
    if forearm:
        limbs += _forearm(model, sleeve_from_m)
    return np.array(limbs)


def _finger(model: HandModel, frames: Array, points: Array, finger: int) -> list[Array]:
    """Three segments with bulges at the joints and a waist between, the pad of the tip, and the ball of the thumb."""
    first, second, third = (float(radius) for radius in model.radii[finger])
    joints = points[1 + 4 * finger:5 + 4 * finger]
    up = [frames[model.dh.point_row[2 + 4 * finger + k], :, 1] for k in range(3)]  # a hinge's y is across its bone
    palmar = [_palmar(joints, k, axis) for k, axis in enumerate(up)]
    knuckle, last = 0.5 * (first + second), 0.5 * (second + third)
    tip = joints[3] - third * 0.86 * _unit(joints[3] - joints[2])
    limbs = [_limb(finger, joints[0], joints[1], (1.02 * first, 1.03 * knuckle), 0.06 * first),
             _limb(finger, joints[1], joints[2], (1.03 * knuckle, 1.02 * last), 0.07 * second),
             _limb(finger, joints[2], tip, (1.02 * last, 0.86 * third), -0.03 * third, palmar[2], 0.92),
             _limb(finger, joints[2] + 0.35 * (tip - joints[2]) + 0.22 * third * palmar[2],
                   tip + 0.10 * third * palmar[2], (0.80 * third, 0.78 * third))]
    for k in (0, 1):  # pads between the creases of the palmar side
        start, end = joints[k], joints[k + 1]
        radius = 0.82 * (first, second)[k]
        offset = 0.24 * radius * palmar[k]
        limbs.append(_limb(finger, start + 0.3 * (end - start) + offset, start + 0.72 * (end - start) + offset,
                           (radius, radius)))
    if finger == 0:
        thick = 0.5e-3 * model.anatomy.palm_thickness_mm
        limbs.append(_limb(0, np.array([0.020, 0.35 * joints[0, 1], -0.007]),
                           joints[0] + 0.75 * (joints[1] - joints[0]) + 0.15 * first * palmar[0],
                           (1.0 * thick, 0.95 * first)))
    return limbs


def _palmar(joints: Array, bone: int, across: Array) -> Array:
    """Unit vector out of a segment's palmar side: across the bone, to where the finger bends."""
    along = _unit(joints[bone + 1] - joints[bone])
    side = across - (across @ along) * along
    side = _unit(side)
    bend = (joints[3] - joints[2]) - (joints[1] - joints[0])
    return np.asarray(side if side @ bend > 0.0 else -side)


def _palm(model: HandModel, points: Array) -> list[Array]:
    thick = 0.5e-3 * model.anatomy.palm_thickness_mm
    wide = 0.5e-3 * model.anatomy.wrist_breadth_mm
    limbs = []
    for k in range(4):
        knuckle = points[5 + 4 * k]
        first = float(model.radii[1 + k, 0])
        carpal = np.array([0.010, 0.62 * wide * (1.0, 0.35, -0.3, -0.95)[k], -0.002])
        limbs.append(_limb(PALM_GROUP, carpal, knuckle + np.array([-0.004, 0.0, -0.0015]),
                           (0.92 * thick, 0.5 * (first + 0.9 * thick)), 0.02 * thick))
    ulnar, radial = points[17], points[5]
    limbs.append(_limb(PALM_GROUP, np.array([0.018, 0.62 * ulnar[1], -0.008]),
                       np.array([0.70 * ulnar[0], 1.02 * ulnar[1], -0.009]), (0.85 * thick, 0.72 * thick)))
    limbs.append(_limb(PALM_GROUP, np.array([0.86 * ulnar[0], 0.92 * ulnar[1], -0.010]),
                       np.array([0.82 * radial[0], 0.9 * radial[1], -0.008]), (0.62 * thick, 0.66 * thick)))
    return limbs


def _webs(model: HandModel, points: Array) -> list[Array]:
    """Skin between neighbouring fingers, to two fifths of their first bones, and between thumb and index finger."""
    webs = []
    for k in range(3):
        here, beside = points[5 + 4 * k], points[9 + 4 * k]
        ends = [base + 0.30 * (second - base) + np.array([0.0, 0.0, -0.002])
                for base, second in ((here, points[6 + 4 * k]), (beside, points[10 + 4 * k]))]
        webs.append(_limb(WEB_GROUP, ends[0], ends[1], (0.62 * model.radii[1 + k, 0], 0.62 * model.radii[2 + k, 0])))
        webs.append(_limb(WEB_GROUP, here, beside, (0.95 * model.radii[1 + k, 0], 0.95 * model.radii[2 + k, 0])))
    thumb, mcp, index = points[1], points[2], points[5]
    start = thumb + 0.55 * (mcp - thumb)
    webs.append(_limb(WEB_GROUP, start, 0.35 * points[0] + 0.65 * index, (0.010, 0.009)))
    webs.append(_limb(WEB_GROUP, thumb + 0.85 * (mcp - thumb), 0.2 * points[0] + 0.8 * index, (0.0065, 0.0065)))
    return webs


def _forearm(model: HandModel, sleeve_from_m: float | None) -> list[Array]:
    """Limbs side by side along the two bones, flesh between them, and perhaps a sleeve round all."""
    wide, flat = 0.5e-3 * model.anatomy.wrist_breadth_mm, 0.5e-3 * model.anatomy.wrist_thickness_mm
    limbs = []
    for side in (1.0, 0.0, -1.0):
        wrist = np.array([0.012, side * (wide - flat), -0.001])
        narrow = np.array([-0.015, side * (wide - 0.95 * flat), 0.0])
        middle = np.array([-0.16, side * 1.25 * (wide - 0.75 * flat), 0.0])
        elbow = np.array([-FOREARM_M, side * 1.3 * (wide - 0.7 * flat), 0.0])
        limbs += [_limb(FOREARM_GROUP, wrist, narrow, (0.86 * flat, 0.90 * flat)),
                  _limb(FOREARM_GROUP, narrow, middle, (0.90 * flat, 1.5 * flat)),
                  _limb(FOREARM_GROUP, middle, elbow, (1.5 * flat, 1.6 * flat))]
        if sleeve_from_m is not None:
            at = np.array([-sleeve_from_m, 0.6 * side * wide, 0.0])
            limbs.append(_limb(SLEEVE_GROUP, at, elbow, (1.25 * flat + 0.004, 1.6 * flat + 0.012)))
    return limbs


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


# -- the field and its zero level -------------------------------------------------------------------------------------


@njit(cache=True, fastmath=True)
def _limb_distance(x: float, y: float, z: float, limbs: Array, n: int) -> float:
    """About the signed distance to a limb, m: exact for a straight unflattened one."""
    ax, ay, az = x - limbs[n, 0], y - limbs[n, 1], z - limbs[n, 2]
    bx, by, bz = limbs[n, 3] - limbs[n, 0], limbs[n, 4] - limbs[n, 1], limbs[n, 5] - limbs[n, 2]
    along = (ax * bx + ay * by + az * bz) / (bx * bx + by * by + bz * bz + 1e-18)
    along = min(max(along, 0.0), 1.0)
    dx, dy, dz = ax - along * bx, ay - along * by, az - along * bz
    high = dx * limbs[n, 9] + dy * limbs[n, 10] + dz * limbs[n, 11]
    squeeze = 1.0 / (limbs[n, 12] * limbs[n, 12]) - 1.0
    reach = math.sqrt(dx * dx + dy * dy + dz * dz + squeeze * high * high)
    return reach - (limbs[n, 6] + along * (limbs[n, 7] - limbs[n, 6]) - limbs[n, 8] * 4.0 * along * (1.0 - along))


@njit(cache=True)
def _smooth_min(a: float, b: float, reach: float) -> float:
    """The smaller one, with a fillet of about this radius where they are alike (Quilez 2013)."""
    h = max(reach - abs(a - b), 0.0) / reach
    return min(a, b) - 0.25 * h * h * reach


@njit(cache=True, fastmath=True)
def _by_group(x: float, y: float, z: float, limbs: Array, out: Array) -> float:
    """Fill `out` (GROUPS,) with the distance to each group, and return the field of them all."""
    for k in range(GROUPS):
        out[k] = 1.0
    for n in range(len(limbs)):
        group = int(limbs[n, 13])
        distance = _limb_distance(x, y, z, limbs, n)
        if group in (PALM_GROUP, FOREARM_GROUP):
            out[group] = _smooth_min(out[group], distance, _FLESH_M) if out[group] < 1.0 else distance
        else:
            out[group] = min(out[group], distance)
    body = _smooth_min(out[PALM_GROUP], out[FOREARM_GROUP], _WRIST_FLESH_M)
    body = _smooth_min(body, out[WEB_GROUP], _FLESH_M)
    nearest = min(body, out[SLEEVE_GROUP])
    for finger in range(5):
        nearest = min(nearest, _smooth_min(out[finger], body, _FLESH_M))
    return nearest


@njit(cache=True)
def distances(points: Array, limbs: Array) -> Array:
    """(N, GROUPS) m, signed distances of points (N, 3) from the groups of limbs; 1 from one that is not there."""
    out = np.empty((len(points), GROUPS))
    for k in range(len(points)):
        _by_group(points[k, 0], points[k, 1], points[k, 2], limbs, out[k])
    return out


@njit(cache=True, nogil=True)  # it takes a second, and the live twin's cameras go on meanwhile
def _field(xs: Array, ys: Array, zs: Array, limbs: Array) -> NDArray[np.float32]:
    out, groups = np.empty((len(xs), len(ys), len(zs)), np.float32), np.empty(GROUPS)
    for i in range(len(xs)):
        for j in range(len(ys)):
            for k in range(len(zs)):
                out[i, j, k] = _by_group(xs[i], ys[j], zs[k], limbs, groups)
    return out


@lru_cache(maxsize=2)  # the live twin shows the same hand in other motions
def _polygonised(packed_limbs: bytes, spacing_m: float) -> tuple[Array, Indices]:
    """Vertices and triangles of the field's zero level; behind the wrist the cells are four times as long."""
    limbs = np.frombuffer(packed_limbs).reshape(-1, _LIMB).copy()
    reach = 1.2 * np.maximum(limbs[:, 6], limbs[:, 7]) + 3.0 * spacing_m
    low = np.minimum(limbs[:, :3], limbs[:, 3:6]).min(axis=0, initial=0.0) - reach.max()
    high = np.maximum(limbs[:, :3], limbs[:, 3:6]).max(axis=0) + reach.max()
    fine = np.arange(max(low[0], -0.03), high[0], spacing_m)
    coarse = np.arange(fine[0] - 4.0 * spacing_m, low[0], -4.0 * spacing_m)[::-1]
    axes = (np.concatenate([coarse, fine]), np.arange(low[1], high[1], spacing_m),
            np.arange(low[2], high[2], spacing_m))
    return surface_nets(_field(*axes, limbs), axes)


def surface_nets(field: NDArray[np.float32], axes: tuple[Array, Array, Array]) -> tuple[Array, Indices]:
    """Vertices (V, 3) and triangles (T, 3) of the zero level of a `field` (X, Y, Z) on grid lines `axes`, negative
    inside: a vertex in each cell that the level crosses, the mean of its crossings of the cell's edges."""
    inside = field < 0.0
    shape = tuple(count - 1 for count in field.shape)
    corners = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    view = {corner: tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True)) for corner in corners}
    count = sum(inside[view[corner]].astype(np.int8) for corner in corners)
    cells = np.argwhere((count > 0) & (count < 8))
    values = {corner: field[tuple((cells + corner).T)].astype(np.float64) for corner in corners}
    total, crossings = np.zeros((len(cells), 3)), np.zeros(len(cells))
    for corner in corners:
        for axis in range(3):
            if corner[axis]:
                continue
            other = (corner[0] + (axis == 0), corner[1] + (axis == 1), corner[2] + (axis == 2))
            a, b = values[corner], values[other]
            crossed = (a < 0.0) != (b < 0.0)
            part = np.where(crossed, a / np.where(crossed, a - b, 1.0), 0.0)
            at = np.tile(np.array(corner, dtype=np.float64), (len(cells), 1))
            at[:, axis] += part
            total[crossed] += at[crossed]
            crossings += crossed
    at = cells + total / crossings[:, None]
    vertices = np.column_stack([np.interp(at[:, k], np.arange(len(axes[k])), axes[k]) for k in range(3)])
    number = np.full(shape, -1, np.int64)
    number[tuple(cells.T)] = np.arange(len(cells))
    return vertices, _quads(inside, number)


def _quads(inside: NDArray[np.bool_], number: Indices) -> Indices:
    """Two triangles round every grid edge that the surface crosses."""
    triangles = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        before, after = [slice(None)] * 3, [slice(None)] * 3
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        edges = np.argwhere(inside[tuple(before)] != inside[tuple(after)])
        edges = edges[(edges[:, u] > 0) & (edges[:, v] > 0)]
        edges = edges[(edges < np.array(number.shape)).all(axis=1)]
        step_u, step_v = np.eye(3, dtype=np.int64)[[u, v]]
        ring = [number[tuple((edges - a * step_u - b * step_v).T)] for a, b in ((1, 1), (0, 1), (0, 0), (1, 0))]
        out = inside[tuple(edges.T)]  # the surface's normal points along the axis
        one, three = np.where(out, ring[1], ring[3]), np.where(out, ring[3], ring[1])
        triangles += [np.stack([ring[0], one, ring[2]], axis=1), np.stack([ring[0], ring[2], three], axis=1)]
    found = np.concatenate(triangles)
    return np.ascontiguousarray(found[(found >= 0).all(axis=1)])


# -- skinning ---------------------------------------------------------------------------------------------------------


def _weights(model: HandModel, points: Array, vertices: Array, nearest: Array) -> Array:
    """(V, BONES): how far each vertex follows each bone, smooth across joints and between fingers."""
    weights = np.zeros((len(vertices), BONES))
    back = smooth_step((-0.004 - vertices[:, 0]) / 0.03)  # the wrist bends over three centimetres
    fingers = np.exp(-np.clip(nearest[:, 1:5] - nearest[:, 1:5].min(axis=1, keepdims=True), 0.0, 0.05) / 2.0e-3)
    fingers /= fingers.sum(axis=1, keepdims=True)
    others = np.minimum(nearest[:, 1:5].min(axis=1), nearest[:, PALM_GROUP])
    thumb = smooth_step(0.5 + (others - nearest[:, 0]) / 0.016)
    for finger in range(5):
        part = thumb if finger == 0 else (1.0 - thumb) * fingers[:, finger - 1]
        joints = points[1 + 4 * finger:5 + 4 * finger]
        before = _unit(joints[0]) if finger else _unit(joints[0] + np.array([0.02, 0.0, 0.0]))
        left = part
        for k in range(3):
            after = _unit(joints[k + 1] - joints[k])
            width = (1.2 if k == 0 else 0.85) * float(model.radii[finger, k])
            passed = smooth_step(0.5 + 0.5 * ((vertices - joints[k]) @ _unit(before + after)) / width)
            if finger == 0 and k == 0:
                passed = smooth_step(0.5 + 0.5 * ((vertices - joints[0]) @ after) / 0.014)
            weights[:, PALM if k == 0 else 3 * finger + k] += left * (1.0 - passed)
            left, before = left * passed, after
        weights[:, 3 + 3 * finger] += left
    weights *= (1.0 - back)[:, None]
    weights[:, FOREARM] += back
    return weights


def smooth_step(x: Array) -> Array:
    """0 below 0, 1 above 1, without a corner between."""
    t = np.clip(x, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
