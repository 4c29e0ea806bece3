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

from rhot_app.estimation.se3 import exponential
from rhot_app.hand.dh import ROOT, DhArrays
from rhot_app.hand.kinematics import forward_arrays
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import SHAPE
from rhot_app.hand.shape import FLESH

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

PALM, FOREARM = 5, 6
"""Groups of capsules after the fingers 0..4."""

HAND_SIZE, FINGER_SIZE, THICKNESS, LENGTH, RADIUS, FOREARM_RADIUS, FOREARM_TURN = 0, 1, 2, 3, 18, 33, 34
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


def surface_of(model: HandModel) -> Surface:
    """The capsules of a hand."""
    parts: list[tuple[int, Array, Array, float, float, int, bool, bool]] = []
    bones = np.full(len(model.dh.parent), -1)
    for finger in range(5):
        radii = model.radii[finger]
        joints = [radii[0], 0.5 * (radii[0] + radii[1]), 0.5 * (radii[1] + radii[2]), TIP_TAPER * radii[2]]
        for k in range(3):
            row = int(model.dh.point_row[2 + 4 * finger + k])
            bones[row] = 3 * finger + k
            end = -joints[3] if k == 2 else 0.0
            parts.append((row, np.array([-model.bones[finger, k], 0.0, 0.0]), np.array([end, 0.0, 0.0]), joints[k],
                          joints[k + 1], finger, k == 0, True))
    parts += _palm(model)
    dh = model.dh._replace(point_row=np.empty(0, np.int64), point_offset=np.empty((0, 3)))
    return Surface(dh, np.array([part[0] for part in parts]), np.array([[part[1], part[2]] for part in parts]),
                   np.array([[part[3], part[4]] for part in parts]), np.array([part[5] for part in parts]),
                   np.array([[part[6], part[7]] for part in parts]), bones)


def _palm(model: HandModel) -> list[tuple[int, Array, Array, float, float, int, bool, bool]]:
    """Capsules of palm, ball of the thumb and wrist, by the dimensions of `hand.shape`."""
    anatomy, mirror = model.anatomy, np.array([1.0, model.mirror, 1.0])
    thick, knuckles, thumb = 0.5e-3 * anatomy.palm_thickness_mm, model.base[1:], model.base[0]
    parts, roots = [], []

    def add(start: Array, end: Array, first: float, second: float, group: int = PALM) -> None:
        parts.append((ROOT, mirror * start, mirror * end, first, second, group, group == PALM, group == PALM))

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
    add(thumb, 0.5 * (parts[0][1] * mirror + knuckles[0]), FLESH.web_thickness * thick, thick)
    wide, flat = 0.5e-3 * anatomy.wrist_breadth_mm, 0.5e-3 * anatomy.wrist_thickness_mm
    side = max(wide - flat, 0.0)
    for y in (side, -side):
        near, far = FLESH.forearm_breadths
        add(np.array([0.004, near * y, 0.0]), np.array([-FLESH.forearm_length_m, far * y, 0.0]), 1.05 * flat,
            1.05 * flat, FOREARM)
    return parts


@njit(cache=True)
def sized_table(dh, bone, shape, a, d):
    """Fill `a` (R,) and `d` (R,), the DH lengths of a hand of `shape` (SHAPE,), m."""
    whole = np.exp(shape[HAND_SIZE])
    for row in range(a.shape[0]):
        a[row] = dh.a[row] * whole * (np.exp(shape[FINGER_SIZE] + shape[LENGTH + bone[row]]) if bone[row] >= 0 else 1.0)
        d[row] = dh.d[row] * whole


@njit(cache=True)
def place_capsules(surface, world, angles, shape, frames, centres, radii):
    """Fill frames (R, 3, 4), the balls' `centres` (N, 2, 3) m and `radii` (N, 2) m of a hand at `world` (4, 4)."""
    dh = surface.dh
    a, d = np.empty(dh.a.shape[0]), np.empty(dh.a.shape[0])
    sized_table(dh, surface.bone, shape, a, d)
    table = DhArrays(dh.parent, dh.theta, d, a, dh.cos_alpha, dh.sin_alpha, dh.angle, dh.sign, dh.point_row,
                     dh.point_offset)
    forward_arrays(table, world, angles, frames, dh.point_offset)
    whole, turned, left = np.exp(shape[HAND_SIZE]), np.empty((3, 3)), np.empty((3, 3))
    exponential(0.0, shape[FOREARM_TURN], shape[FOREARM_TURN + 1], turned, left)
    forearm = np.dot(np.ascontiguousarray(world[:3, :3]), turned)
    for k in range(centres.shape[0]):
        row = surface.row[k]
        thick = np.exp(shape[FOREARM_RADIUS] if surface.group[k] == FOREARM else shape[THICKNESS])
        longer = 1.0
        if row >= 0:
            thick *= np.exp(shape[RADIUS + surface.bone[row]])
            longer = np.exp(shape[FINGER_SIZE] + shape[LENGTH + surface.bone[row]])
        base = world if row < 0 else frames[row]
        for end in range(2):
            radii[k, end] = surface.radii[k, end] * whole * thick
            x, y, z = surface.ends[k, end, 0], surface.ends[k, end, 1], surface.ends[k, end, 2]
            for i in range(3):
                if surface.group[k] == FOREARM:
                    along = forearm[i, 0] * x + forearm[i, 1] * y + forearm[i, 2] * z
                else:
                    along = base[i, 0] * x * longer + base[i, 1] * y + base[i, 2] * z
                centres[k, end, i] = base[i, 3] + whole * along


def capsules_of(surface: Surface, world: Array, angles: Array, shape: Array | None = None) -> tuple[Array, Array]:
    """`centres` (N, 2, 3) m and `radii` (N, 2) m of a posed hand: `world` (4, 4), `angles` (21,) rad."""
    frames = np.empty((len(surface.dh.parent), 3, 4))
    centres, radii = np.empty_like(surface.ends), np.empty_like(surface.radii)
    place_capsules(surface, world, angles, np.zeros(SHAPE) if shape is None else shape, frames, centres, radii)
    return centres, radii


@njit(cache=True)
def ray_to_capsule(ox, oy, oz, ux, uy, uz, a, b, ra, rb):
    """Distance along the ray from o with unit direction u to the capsule of the balls at `a`, `b` (3,); -1 for none."""
    bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    px, py, pz = ox - a[0], oy - a[1], oz - a[2]
    qx, qy, qz = ox - b[0], oy - b[1], oz - b[2]
    taper = ra - rb
    m0 = bx * bx + by * by + bz * bz
    m1 = bx * px + by * py + bz * pz
    m2 = bx * ux + by * uy + bz * uz
    m3 = ux * px + uy * py + uz * pz
    m5 = px * px + py * py + pz * pz
    m6 = ux * qx + uy * qy + uz * qz
    m7 = qx * qx + qy * qy + qz * qz
    d2 = m0 - taper * taper
    k2 = d2 - m2 * m2
    k1 = d2 * m3 - m1 * m2 + m2 * taper * ra
    k0 = d2 * m5 - m1 * m1 + 2.0 * m1 * taper * ra - m0 * ra * ra
    h = k1 * k1 - k0 * k2
    if d2 > 0.0 and h < 0.0:
        return -1.0
    if d2 > 0.0 and abs(k2) > 1e-18:
        t = (-np.sqrt(h) - k1) / k2
        y = m1 - ra * taper + t * m2
        if 0.0 < y < d2:
            return t
    h1 = m3 * m3 - m5 + ra * ra
    h2 = m6 * m6 - m7 + rb * rb
    best = -1.0
    if h1 > 0.0:
        best = -m3 - np.sqrt(h1)
    if h2 > 0.0:
        t = -m6 - np.sqrt(h2)
        if best < 0.0 or t < best:
            best = t
    return best
