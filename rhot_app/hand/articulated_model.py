"""An articulated object ready to move: its file compiled for the kinematics, its state vector, and its bodies.

The state of an object with A angles has 7 + A numbers (Rehg 1995, 2.2.2): the root's quaternion wxyz, of any length
but zero; the root's translation, m; the angles, rad. A hand's 21 angles make it 28 numbers for 27 degrees of freedom.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.se3 import fill_rotation
from rhot_app.hand.articulated import Articulated, ArticulatedFrame, Box, Capsule
from rhot_app.hand.dh import FIXED, ROOT, DhArrays, DhRow, compile_table
from rhot_app.hand.kinematics import TWIST, empty_frames, forward_arrays, point_jacobian
from rhot_app.hand.model import Variant, linear_variant

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body: `row` of the table that carries it (ROOT: the root), its `shape`, and `link`: metres from its
    joint to its frame's origin along the frame's x; `twist`: rad from the shape frame's axes to the frame's, about x.
    """

    name: str
    row: int
    shape: Capsule | Box | None
    link: float
    twist: float


@dataclass(frozen=True, slots=True)
class ArticulatedModel:
    """A compiled object. `dh`: its table, R rows, with its P named points; `limits` (A, 2) rad; `rest` (7 + A,) the
    state in which the file shows it; `coupled`: its couplings as a linear map; `bodies`: the root, then every row that
    has a shape, in the order of the file."""

    document: Articulated
    dh: DhArrays
    angle_names: tuple[str, ...]
    row_names: tuple[str, ...]
    point_names: tuple[str, ...]
    bodies: tuple[Body, ...]
    limits: Array
    rest: Array
    coupled: Variant


@dataclass(frozen=True, slots=True)
class PosedObject:
    """A posed object, world frame, m: `root` (4, 4), `frames` (R, 3, 4) world_from_row, `points` (P, 3)."""

    root: Array
    frames: Array
    points: Array

    def world_from(self, body: Body) -> Array:
        """(3, 4) world_from_body of one of the model's bodies: the frame that its row leaves behind."""
        return np.asarray(self.root[:3] if body.row == ROOT else self.frames[body.row])


def build_articulated(document: Articulated) -> ArticulatedModel:
    """Compile an object's file. A ``left`` one becomes the mirror image of what its rows say."""
    angles = tuple(angle.name for angle in document.angles)
    rows = {frame.name: row for row, frame in enumerate(document.frames)} | {document.root.name: ROOT}
    table = [_row(frame, rows, angles) for frame in document.frames]
    points = [(rows[point.frame], _metres(point.offset_mm)) for point in document.points]
    if document.side == "left":
        table = [_mirrored(row, document.mirror_axis) for row in table]
        points = [(row, _mirrored_offset(offset, document.mirror_axis if row == ROOT else "y"))
                  for row, offset in points]
    quaternion = np.array(document.root.quaternion_wxyz, dtype=np.float64)
    rest = np.concatenate([quaternion / np.linalg.norm(quaternion), _metres(document.root.translation_mm),
                           np.radians([angle.rest_deg for angle in document.angles])])
    return ArticulatedModel(
        document=document, dh=compile_table(table, points), angle_names=angles,
        row_names=tuple(frame.name for frame in document.frames),
        point_names=tuple(point.name for point in document.points), bodies=_bodies(document, table),
        limits=np.radians([angle.limits_deg for angle in document.angles]).reshape(-1, 2), rest=rest,
        coupled=linear_variant("coupled", angles, document.couplings))


def forward_state(model: ArticulatedModel, state: Array) -> PosedObject:
    """Every frame and point of the object in `state` (7 + A,)."""
    posed = PosedObject(np.eye(4), empty_frames(model.dh), np.empty((len(model.dh.point_row), 3)))
    forward_state_arrays(model.dh, state, posed.root, posed.frames, posed.points)
    return posed


def state_jacobian(model: ArticulatedModel, state: Array) -> Array:
    """(P, 3, 7 + A): change of the object's points, m, per state number (Rehg eq. 2.16)."""
    posed = forward_state(model, state)
    out = np.empty((len(posed.points), 3, STATE_ROOT + len(model.angle_names)))
    state_jacobian_arrays(model.dh, state, posed.root, posed.frames, posed.points, out)
    return out


def _row(frame: ArticulatedFrame, rows: dict[str, int], angles: tuple[str, ...]) -> DhRow:
    return DhRow(rows[frame.parent], math.radians(frame.theta_deg), 1e-3 * frame.d_mm, 1e-3 * frame.a_mm,
                 math.radians(frame.alpha_deg), FIXED if frame.angle is None else angles.index(frame.angle),
                 float(frame.sign))


def _mirrored(row: DhRow, axis: str) -> DhRow:
    """Mirrored in the root's y; for its x another half turn, which the rows that hang on the root take."""
    mirrored = row.mirrored()
    return replace(mirrored, theta=mirrored.theta + math.pi) if axis == "x" and row.parent == ROOT else mirrored


def _mirrored_offset(offset: tuple[float, float, float], axis: str) -> tuple[float, float, float]:
    x, y, z = offset
    return (-x, y, z) if axis == "x" else (x, -y, z)


def _metres(vector_mm: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = vector_mm
    return 1e-3 * x, 1e-3 * y, 1e-3 * z


def _bodies(document: Articulated, table: list[DhRow]) -> tuple[Body, ...]:
    root = Body(document.root.name, ROOT, document.root.shape, 0.0, 0.0)
    links = (Body(frame.name, row, frame.shape, table[row].a, table[row].alpha)
             for row, frame in enumerate(document.frames) if frame.shape is not None)
    return root, *links


# -- kinematics of the state vector ------------------------------------------------------------------------------------

STATE_ROOT = 7
"""State numbers before the angles: the root's quaternion and translation."""


@njit(cache=True)
def forward_state_arrays(dh: DhArrays, state: Array, root: Array, frames: Array, points: Array) -> None:
    """Fill `root` (4, 4) world_from_root, `frames` (R, 3, 4) and `points` (P, 3) m, for a state (7 + A,)."""
    root_arrays(state, root)
    forward_arrays(dh, root, state[STATE_ROOT:], frames, points)


@njit(cache=True)
def root_arrays(state: Array, root: Array) -> None:
    """Fill `root` (4, 4) world_from_root from the first seven numbers of a state."""
    fill_rotation(state, root)
    for i in range(3):
        root[i, 3] = state[4 + i]
        root[3, i] = 0.0
    root[3, 3] = 1.0


@njit(cache=True)
def state_jacobian_arrays(dh: DhArrays, state: Array, root: Array, frames: Array, points: Array, out: Array) -> None:
    """Fill `out` (P, 3, 7 + A) from what `forward_state_arrays` filled: change of the points, m, per state number.

    A change dq of the quaternion turns the object by the vector part of 2 dq q* / |q|^2.
    """
    w, x, y, z = state[0], state[1], state[2], state[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    by_twist = np.empty((3, TWIST + state.shape[0] - STATE_ROOT))
    for point in range(points.shape[0]):
        by_twist[:] = 0.0
        point_jacobian(dh, root, frames, dh.point_row[point], points[point, 0], points[point, 1], points[point, 2],
                       by_twist)
        for i in range(3):
            one, row = by_twist[i], out[point, i]
            rx, ry, rz = s * one[3], s * one[4], s * one[5]
            row[0], row[1] = -x * rx - y * ry - z * rz, w * rx + z * ry - y * rz
            row[2], row[3] = w * ry + x * rz - z * rx, y * rx - x * ry + w * rz
            row[4], row[5], row[6] = one[0], one[1], one[2]
            for angle in range(STATE_ROOT, state.shape[0]):
                row[angle] = one[angle - STATE_ROOT + TWIST]
