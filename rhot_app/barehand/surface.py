"""The hand's surface: tapered capsules, each the convex hull of two balls fixed to one link of the hand's DH table.

The radii are those of the hand file. Neighbouring phalanges share the ball at their joint, so a bent finger has no
gap. The forearm rotates about the wrist.

The shape is the part of the state by which a hand may differ from its file: logarithms of lengths and radii, and the
forearm's rotation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.se3 import exponential
from rhot_app.estimation.vectors import dot, minus, norm, turned
from rhot_app.hand.dh import ROOT, DhArrays
from rhot_app.hand.kinematics import forward_arrays
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import STATE
from rhot_app.hand.shape import FLESH
from rhot_app.hand.skeleton import FINGERS

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

PALM = len(FINGERS)
FOREARM = PALM + 1
"""Groups of capsules after the fingers 0..4."""

_BONES = 3 * len(FINGERS)
HAND_SIZE, FINGER_SIZE, THICKNESS = range(3)
LENGTH = THICKNESS + 1
RADIUS = LENGTH + _BONES
FOREARM_RADIUS = RADIUS + _BONES
FOREARM_TURN = FOREARM_RADIUS + 1
"""Indices into a shape. Each is relative to the hand file and to those before it.

HAND_SIZE, FINGER_SIZE, THICKNESS: logarithms of the hand's size, of all phalanges' length, and of all radii but the
forearm's. LENGTH, RADIUS: logarithms of the length and radius of each of the 15 phalanges. FOREARM_RADIUS: its
logarithm. FOREARM_TURN: flexion and deviation, a rotation vector (0, y, z) rad about the wrist in the palm's frame."""

TIP_TAPER = 0.85
"""Ratio of the radius at a fingertip's end to that of its last segment: fingertips are round, not flat."""

HYPOTHENAR = 0.22
"""Offset of the hypothenar muscles beyond the little finger's metacarpal, relative to the palm's thickness: 6 mm of 28.
In a video of a real hand the palm's contour lies 5.3 mm beyond the metacarpal's, in the mean over its length, where
no muscle is modelled (`python benchmarks/contour_offsets.py`)."""


class Surface(NamedTuple):
    """N capsules. `row` (N,): of the hand's DH table, ROOT for the palm. `ends` (N, 2, 3): centres of their balls in
    that row's frame, m. `radii` (N, 2): m. `group` (N,): finger, PALM or FOREARM. `open_ends` (N, 2): whether an end's
    ball may make a contour. `dh`: the hand's table without points. `bone` (R,): the phalanx, 0..14, of each of its
    rows, else -1.
    """

    dh: DhArrays
    row: Indices
    ends: Array
    radii: Array
    group: Indices
    open_ends: NDArray[np.bool_]
    bone: Indices


class _Capsule(NamedTuple):
    """One capsule of a `Surface`."""

    row: int
    ends: tuple[Array, Array]
    radii: tuple[float, float]
    group: int
    open_ends: tuple[bool, bool]


def surface_of(model: HandModel) -> Surface:
    """The capsules of a hand."""
    parts, bones = [], np.full(len(model.dh.parent), -1)
    for finger in range(5):
        radii = model.radii[finger]
        joints = [radii[0], 0.5 * (radii[0] + radii[1]), 0.5 * (radii[1] + radii[2]), TIP_TAPER * radii[2]]
        for k in range(3):
            row = int(model.dh.point_row[2 + 4 * finger + k])
            bones[row] = 3 * finger + k
            start, end = np.array([[-model.bones[finger, k], 0.0, 0.0], [-joints[3] if k == 2 else 0.0, 0.0, 0.0]])
            parts.append(_Capsule(row, (start, end), (joints[k], joints[k + 1]), finger, (k == 0, True)))
    dh = model.dh._replace(point_row=np.empty(0, np.int64), point_offset=np.empty((0, 3)))
    rows, ends, thick, groups, opened = (np.array(column) for column in zip(*parts, *_palm(model), strict=True))
    return Surface(dh, rows, ends, thick, groups, opened, bones)


def _palm(model: HandModel) -> list[_Capsule]:
    """Capsules of palm, ball of the thumb and wrist, by the dimensions of `hand.shape`."""
    anatomy, mirror = model.anatomy, np.array([1.0, model.mirror, 1.0])
    thick, knuckles, thumb = 0.5e-3 * anatomy.palm_thickness_mm, model.base[1:], model.base[0]
    parts: list[_Capsule] = []
    roots = []

    def add(start: Array, end: Array, first: float, second: float, group: int = PALM) -> None:
        parts.append(_Capsule(ROOT, (mirror * start, mirror * end), (first, second), group, (group == PALM,) * 2))

    for k in range(4):
        radius = thick * (1.0 - (1.0 - FLESH.ulnar_taper) * k / 3.0)
        carpal = np.array([FLESH.carpal_x_m, FLESH.carpal_spread * knuckles[k, 1], FLESH.carpal_z_m])
        # The knuckle is thinner than the palm, whose flesh lies on the palmar side.
        sunk = np.array([0.0, 0.0, float(model.radii[k + 1, 0]) - radius])
        roots.append(knuckles[k] + 0.5 * sunk)
        add(carpal, roots[k], radius, 0.5 * (radius + float(model.radii[k + 1, 0])))
    for k in range(3):
        add(roots[k], roots[k + 1], float(model.radii[k + 1, 0]), float(model.radii[k + 2, 0]))
    # The hypothenar: a capsule along 0.7 of the last one, a little thinner at its end. Chosen by that video.
    ulnar = np.array([0.0, -HYPOTHENAR * 2.0 * thick, 0.0])
    add(carpal + ulnar, carpal + 0.7 * (roots[3] - carpal) + ulnar, radius, 0.9 * radius)
    heel = np.array([FLESH.carpal_x_m, FLESH.thenar_spread * thumb[1], FLESH.thenar_z_m])
    add(heel, thumb, thick, float(model.radii[0, 0]))
    add(thumb, 0.5 * (parts[0].ends[0] * mirror + knuckles[0]), FLESH.web_thickness * thick, thick)
    wide, flat = 0.5e-3 * anatomy.wrist_breadth_mm, 0.5e-3 * anatomy.wrist_thickness_mm
    side = max(wide - flat, 0.0)
    for y in (side, -side):
        near, far = FLESH.forearm_breadths
        add(np.array([0.004, near * y, 0.0]), np.array([-FLESH.forearm_length_m, far * y, 0.0]), 1.05 * flat,
            1.05 * flat, FOREARM)
    return parts


class Posed(NamedTuple):
    """A surface in the world, m. `table`: the DH table of a hand of its shape; `world` (4, 4) world_from_palm; `frames`
    (R, 3, 4); the balls' `centres` (N, 2, 3) and `radii` (N, 2)."""

    table: DhArrays
    world: Array
    frames: Array
    centres: Array
    radii: Array


@njit(cache=True)
def sized(dh, bone, shape):
    """The DH table `dh` of a hand of `shape` (SHAPE,), its points too; `bone` (R,): as in `Surface`."""
    whole = np.exp(shape[HAND_SIZE])
    a, d = np.empty(dh.a.shape[0]), np.empty(dh.a.shape[0])
    for row in range(a.shape[0]):
        a[row] = dh.a[row] * whole * (np.exp(shape[FINGER_SIZE] + shape[LENGTH + bone[row]]) if bone[row] >= 0 else 1.0)
        d[row] = dh.d[row] * whole
    return DhArrays(dh.parent, dh.theta, d, a, dh.cos_alpha, dh.sin_alpha, dh.angle, dh.sign, dh.point_row,
                    whole * dh.point_offset)


@njit(cache=True)
def posed(surface, world, angles, shape):
    """The `Posed` surface of a hand at `world` (4, 4) with `angles` (21,) rad and `shape` (SHAPE,)."""
    table, count = sized(surface.dh, surface.bone, shape), surface.row.shape[0]
    frames, centres, radii = np.empty((len(table.parent), 3, 4)), np.empty((count, 2, 3)), np.empty((count, 2))
    forward_arrays(table, world, angles, frames, table.point_offset)
    whole, forearm, left = np.exp(shape[HAND_SIZE]), np.empty((3, 3)), np.empty((3, 3))
    exponential(0.0, shape[FOREARM_TURN], shape[FOREARM_TURN + 1], forearm, left)
    forearm = np.dot(np.ascontiguousarray(world[:3, :3]), forearm)
    for k in range(count):
        row, arm = surface.row[k], surface.group[k] == FOREARM
        thick, longer = np.exp(shape[FOREARM_RADIUS] if arm else shape[THICKNESS]), 1.0
        if row >= 0:
            thick *= np.exp(shape[RADIUS + surface.bone[row]])
            longer = np.exp(shape[FINGER_SIZE] + shape[LENGTH + surface.bone[row]])
        base = world if row < 0 else frames[row]
        for end in range(2):
            radii[k, end] = surface.radii[k, end] * whole * thick
            x, y, z = surface.ends[k, end]
            lever = turned(forearm, (x, y, z)) if arm else turned(base, (x * longer, y, z))
            for i in range(3):
                centres[k, end, i] = base[i, 3] + whole * lever[i]
    return Posed(table, world, frames, centres, radii)


@njit(cache=True)
def posed_in(surface, state):
    """The `Posed` surface of the hand in a state that has a shape."""
    return posed(surface, pose_matrix(state), state[STATE.angles], state[STATE.shape])


@njit(cache=True, inline="always")  # the test of most capsules is shorter than a call
def ray_to_capsule(o, u, centres, radii, k, margin=0.0):
    """Distance along the ray from o (3,) with unit direction u (3,) to capsule `k` of those with balls at `centres`
    (N, 2, 3) and with `radii` (N, 2), grown by `margin`; -1 for none."""
    a = centres[k, 0, 0], centres[k, 0, 1], centres[k, 0, 2]
    b = centres[k, 1, 0], centres[k, 1, 1], centres[k, 1, 2]
    ra, rb = radii[k, 0] + margin, radii[k, 1] + margin
    to_middle = minus(((a[0] + b[0]) * 0.5, (a[1] + b[1]) * 0.5, (a[2] + b[2]) * 0.5), o)
    reach = 0.5 * norm(minus(a, b)) + max(ra, rb)
    if dot(to_middle, to_middle) - dot(to_middle, u) ** 2 > reach * reach:
        return -1.0
    return _first_root(u, minus(b, a), minus(o, a), minus(o, b), ra, rb)


@njit(cache=True)
def _first_root(u, ba, oa, ob, ra, rb):
    """The smallest positive t at which o + t u lies on the capsule, from the vectors between o and its ends a and b."""
    taper = ra - rb
    m0, m1, m2 = dot(ba, ba), dot(ba, oa), dot(ba, u)
    m3, m5, m6, m7 = dot(u, oa), dot(oa, oa), dot(u, ob), dot(ob, ob)
    d2 = m0 - taper * taper
    k2 = d2 - m2 * m2
    k1 = d2 * m3 - m1 * m2 + m2 * taper * ra
    k0 = d2 * m5 - m1 * m1 + 2.0 * m1 * taper * ra - m0 * ra * ra
    h = k1 * k1 - k0 * k2
    if d2 > 0.0 and h < 0.0:
        return -1.0
    if d2 > 0.0 and k2 != 0.0:
        t = (-np.sqrt(h) - k1) / k2
        y = m1 - ra * taper + t * m2
        if 0.0 < y < d2:
            return t
    h1, h2, best = m3 * m3 - m5 + ra * ra, m6 * m6 - m7 + rb * rb, -1.0
    if h1 > 0.0:
        best = -m3 - np.sqrt(h1)
    if h2 > 0.0:
        t = -m6 - np.sqrt(h2)
        if best < 0.0 or t < best:
            best = t
    return best
