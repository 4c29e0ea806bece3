"""Where a hand's markers should be at many instants, and how that changes with poses and shape (numpy and numba)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.calibration.hand.shape import MARKERS, ROOTS, TURNS, HandUnknowns
from rhot_app.estimation.se3 import left_jacobian
from rhot_app.hand.dh import ROOT, DhArrays
from rhot_app.hand.kinematics import TWIST, forward_arrays, jacobian_arrays, move
from rhot_app.hand.skeleton import ANGLES, FLEXIONS

Array = NDArray[np.float64]

POSE = TWIST + len(ANGLES)
"""Unknowns of one pose: twist in world axes, then the angles."""

_SEGMENT_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""A bone's row has its hinge along z and the palm along y; a marker's place is along, towards the thumb, out of the
back. Not so the thumb's metacarpal, whose row is turned on already for the next joint's abduction."""


@dataclass(frozen=True, slots=True)
class Poses:
    """F poses: `world` (F, 4, 4) world_from_palm, `angles` (F, 21) rad."""

    world: Array
    angles: Array

    def moved(self, steps: Array) -> Poses:
        """These poses after steps (F, 27) of twist and angles."""
        world, angles = np.empty_like(self.world), np.empty_like(self.angles)
        _move_all(self.world, self.angles, steps, world, angles)
        return Poses(world, angles)

    def of(self, chosen: NDArray[np.int64]) -> Poses:
        """Some of the poses."""
        return Poses(self.world[chosen], self.angles[chosen])

    def where(self, chosen: NDArray[np.bool_], others: Poses) -> Poses:
        """These poses where `chosen` (F,), the others' elsewhere."""
        return Poses(np.where(chosen[:, None, None], self.world, others.world),
                     np.where(chosen[:, None], self.angles, others.angles))


@dataclass(frozen=True, slots=True)
class Linearised:
    """`points` (F, M, 3) m, and their change per pose (F, M, 3, 27) and per shape (F, M, 3, G), empty when not asked
    for."""

    points: Array
    per_pose: Array
    per_shape: Array


def expected(unknowns: HandUnknowns, vector: Array, poses: Poses) -> Array:
    """(F, M, 3) m, world: where the markers of the hand `vector` (G,) are in these poses."""
    dh = _table(unknowns, vector)
    points = np.empty((len(poses.angles), len(unknowns.places), 3))
    frames = np.empty((len(poses.angles), len(dh.parent), 3, 4))
    _forward_all(dh, poses.world, poses.angles, frames, points)
    _slide(unknowns, vector, poses, frames, points)
    return points


def linearise(unknowns: HandUnknowns, vector: Array, poses: Poses, *, per_shape: bool = True) -> Linearised:
    """The markers and their derivatives; those by the shape, which take longest, only if `per_shape`."""
    dh = _table(unknowns, vector)
    count, places = len(poses.angles), unknowns.places
    frames = np.empty((count, len(dh.parent), 3, 4))
    points = np.empty((count, len(places), 3))
    per_pose = np.empty((count, len(places), 3, POSE))
    _forward_all(dh, poses.world, poses.angles, frames, points)
    _slide(unknowns, vector, poses, frames, points)
    _jacobian_all(dh, poses.world, frames, points, per_pose)
    _add_sliding(unknowns, vector, poses, frames, per_pose)
    return Linearised(points, per_pose, _per_shape(unknowns, vector, poses, frames, points) if per_shape
                      else np.empty((*points.shape, 0)))


def in_segments(unknowns: HandUnknowns, vector: Array, poses: Poses, offsets: Array) -> Array:
    """Offsets (F, M, 3) m in the world as (F, M, 3) along, across and above each marker's own segment."""
    axes = linearise(unknowns, vector, poses).per_shape[..., MARKERS:unknowns.slides]
    own = np.stack([axes[:, m, :, 3 * m:3 * m + 3] for m in range(len(unknowns.places))], axis=1)
    return np.asarray(np.einsum("fmij,fmi->fmj", own, offsets))


def _per_shape(unknowns: HandUnknowns, vector: Array, poses: Poses, frames: Array, points: Array) -> Array:
    shape = unknowns.shape(vector)
    palm = poses.world[:, :3, :3]
    out = np.zeros((*points.shape, unknowns.size))
    for m, place in enumerate(unknowns.places):
        own = slice(MARKERS + 3 * m, MARKERS + 3 * m + 3)
        if place.on_palm:
            out[:, m, :, own] = palm
            continue
        finger = place.finger
        rows = unknowns.bone_rows[finger]
        for bone in range(place.segment):
            out[:, m, :, 3 * finger + bone] = frames[:, rows[bone], :, 0]
        out[:, m, :, own] = frames[:, rows[place.segment], :, :3] @ segment_axes(finger, place.segment)
        root = slice(ROOTS + 3 * finger, ROOTS + 3 * finger + 3)
        out[:, m, :, root] = palm
        lever = np.einsum("fji,fj->fi", palm, points[:, m] - poses.world[:, :3, 3]) - shape.roots[finger]
        turn = slice(TURNS + 3 * finger, TURNS + 3 * finger + 3)
        columns = np.cross(left_jacobian(vector[turn]).T[None], lever[:, None])  # (F, 3 of the turn, 3)
        out[:, m, :, turn] = np.einsum("fij,fkj->fik", palm, columns)
    for k, m in enumerate(unknowns.sliding):
        first = unknowns.slides + 2 * k
        out[:, m, :, first:first + 2] = _slide_slopes(unknowns, m, poses, frames)
    return out


def _slide(unknowns: HandUnknowns, vector: Array, poses: Poses, frames: Array, points: Array) -> None:
    """Move the markers that slide, in place."""
    for k, m in enumerate(unknowns.sliding):
        first = unknowns.slides + 2 * k
        points[:, m] += _slide_slopes(unknowns, m, poses, frames) @ vector[first:first + 2]


def _add_sliding(unknowns: HandUnknowns, vector: Array, poses: Poses, frames: Array, per_pose: Array) -> None:
    """Add to the change per pose (F, M, 3, 27) that a joint which bends slides the skin besides turning it."""
    for k, m in enumerate(unknowns.sliding):
        first = unknowns.slides + 2 * k
        along, joints = _slide_course(unknowns, m, frames)
        amount = vector[first:first + 2] * np.cos(poses.angles[:, joints])
        for joint, moved in zip(joints, amount.T, strict=True):
            per_pose[:, m, :, TWIST + joint] += moved[:, None] * along


def _slide_slopes(unknowns: HandUnknowns, marker: int, poses: Poses, frames: Array) -> Array:
    """(F, 3, 2): the bone's direction times the sines of the flexions at its beginning and its end."""
    along, joints = _slide_course(unknowns, marker, frames)
    return np.asarray(along[:, :, None] * np.sin(poses.angles[:, joints])[:, None, :])


def _slide_course(unknowns: HandUnknowns, marker: int, frames: Array) -> tuple[Array, list[int]]:
    """The direction (F, 3) of a marker's bone, along which it slides, and the flexions at both its ends."""
    place = unknowns.places[marker]
    along = frames[:, unknowns.bone_rows[place.finger, place.segment], :, 0]
    return np.asarray(along), list(FLEXIONS[place.finger][place.segment:place.segment + 2])


def segment_axes(finger: int, segment: int) -> Array:
    """(3, 3): a bone's row from a marker's axes along, towards the thumb, out of the back."""
    return np.eye(3) if finger == 0 and segment == 0 else _SEGMENT_AXES


def _table(unknowns: HandUnknowns, vector: Array) -> DhArrays:
    """The hand's table with its markers as points."""
    shape = unknowns.shape(vector)
    model = unknowns.model(vector)
    rows, offsets = [], []
    for place, marker in zip(unknowns.places, shape.markers, strict=True):
        if place.on_palm:
            rows.append(ROOT)
            offsets.append(marker)
            continue
        rows.append(unknowns.bone_rows[place.finger, place.segment])
        bone = np.array([shape.bones[place.finger, place.segment], 0.0, 0.0])
        offsets.append(segment_axes(place.finger, place.segment) @ marker - bone)
    return model.dh._replace(point_row=np.array(rows, dtype=np.int64), point_offset=np.array(offsets))


@njit(cache=True)
def _forward_all(dh: DhArrays, world: Array, angles: Array, frames: Array, points: Array) -> None:
    for k in range(world.shape[0]):
        forward_arrays(dh, world[k], angles[k], frames[k], points[k])


@njit(cache=True)
def _jacobian_all(dh: DhArrays, world: Array, frames: Array, points: Array, out: Array) -> None:
    for k in range(world.shape[0]):
        jacobian_arrays(dh, world[k], frames[k], points[k], out[k])


@njit(cache=True)
def _move_all(world: Array, angles: Array, steps: Array, out_world: Array, out_angles: Array) -> None:
    for k in range(world.shape[0]):
        move(world[k], angles[k], steps[k], out_world[k], out_angles[k])
