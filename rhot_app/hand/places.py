"""Where on the hand a marker sits, by its role: fixed to one row of the hand's kinematic table.

Roles: the five ``<finger>_tip`` (the last segment, painted as the marker's `patch` says), ``wrist`` (a band),
``palm_<finger>`` (a painted knuckle, which moves with the palm), ``<finger>_<bone>`` for the inner bones (a ball
glued to the back of the finger, half-way), and ``hand_1`` to ``hand_3`` (balls on the back of the hand: below index
and little knuckle, and near the wrist). ``landmark_<joint>`` is a joint's centre or a finger's end, which no marker
shows but a landmark detector reports.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RigError
from rhot_app.hand.dh import ROOT
from rhot_app.hand.kinematics import forward_arrays
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, BONES, FINGERS, JOINTS, TIP_ROLES, WRIST_ROLE
from rhot_app.hand.tables import TABLES
from rhot_node.markers import FLAT_PATCHES, Marker, MarkerSet

# -- painted part of a fingertip ---------------------------------------------------------------------------------------
# The last segment is a capsule (`rhot_app.hand.shape`). A point of its surface has three coordinates in the frame of
# the bone's end: `along` the bone (0 at the end of the tip, negative towards the joint), `across` (positive towards
# the thumb's side of a right hand) and `up`, out of the back of the finger.

Array = NDArray[np.float64]

_GRID = 40  # points per axis of the integration over a patch: its middle is exact to some micrometres


@dataclass(frozen=True, slots=True)
class PaintedPatch:
    """The painted part of a fingertip, m.

    `middle` and `half` length along the bone; `half_across` and `corners`, the exponent of the outline, of a flat
    patch. `side`: +1 on the back (nail), -1 on the palmar side (pulp), 0 all round.
    """

    middle: float
    half: float
    half_across: float
    corners: float
    side: float


def segment_axis(model: HandModel, finger: int) -> tuple[float, float]:
    """Middle of the axis of the last segment's capsule, along the bone from its end, and half the axis' length, m.

    It is the capsule of `shape.segments`.
    """
    behind = float(model.bones[finger, 2] - model.marker[finger])
    return -behind, max(behind - float(model.radii[finger, 2]), 0.0)


def patch_of(marker: Marker, model: HandModel, finger: int) -> PaintedPatch | None:
    """The painted part of a finger's last segment; None when all of it is painted."""
    if marker.patch == "segment":
        return None
    paint = TABLES.paint
    half = 0.5e-3 * (marker.length_mm or paint.lengths_mm[marker.patch])
    if marker.patch == "nail":
        return PaintedPatch(-1e-3 * paint.nail_edge_mm - half, half,
                            paint.nail_breadth * float(model.radii[finger, 2]), paint.nail_corners, 1.0)
    middle, _ = segment_axis(model, finger)
    if marker.patch == "pulp":
        return PaintedPatch(middle, half, half, paint.dot_corners, -1.0)
    return PaintedPatch(middle, half, 0.0, paint.dot_corners, 0.0)


def paint_middle(marker: Marker, model: HandModel, finger: int) -> tuple[float, float]:
    """The marker's position on a finger's last segment, m: along the bone from its end, and up, out of the back.

    Paint all round has its position on the bone's axis. A nail or a dot has it in the plane of the patch's rim, under
    the skin, because the image of a patch is the area within the image of its rim. Its centroid is therefore that of
    the rim's plane, from whichever side the whole patch is visible.

    Let z be the height of the skin over the patch, and (v, 0, 1) a line of sight. The centroid lies at
    mean((x - v z) (1 - v z_x)) / mean(1 - v z_x). To first order in v that is the image of a point at mean(x) and at
    the height mean(z) + cov(x, z_x). The heights of the skin's two directions are averaged.
    """
    along, half_axis = segment_axis(model, finger)
    patch = patch_of(marker, model, finger)
    if patch is None or marker.patch not in FLAT_PATCHES:
        return along, 0.0
    steps = (2.0 * np.arange(_GRID) + 1.0) / _GRID - 1.0
    x, y = np.meshgrid(patch.middle + patch.half * steps, patch.half_across * steps, indexing="ij")
    beyond = np.sign(x - along) * np.maximum(np.abs(x - along) - half_axis, 0.0)  # 0 on the capsule's straight part
    height2 = float(model.radii[finger, 2]) ** 2 - beyond**2 - y**2
    inside = (np.abs(steps[:, None]) ** patch.corners + np.abs(steps) ** patch.corners <= 1.0) & (height2 > 0.0)
    if not inside.any():  # the patch lies beyond the segment
        return along, 0.0
    x, y, beyond, z = x[inside], y[inside], beyond[inside], np.sqrt(height2[inside])
    bulge = 0.5 * (np.mean((x - x.mean()) * beyond / z) + np.mean((y - y.mean()) * y / z))
    return float(x.mean()), patch.side * float(z.mean() - bulge)


def gap_middle(marker: Marker, mirror: float) -> float:
    """Angle about the bone of the middle of a marker's gap, rad: 0 is up, out of the back, pi/2 is `across`.

    `mirror`: +1 of a right hand, -1 of a left one, whose thumb is on the other side.
    """
    return {"dorsal": 0.0, "radial": 0.5 * math.pi * mirror, "palmar": math.pi,
            "ulnar": -0.5 * math.pi * mirror}[marker.gap_side]


# -- position of a marker by its role ----------------------------------------------------------------------------------

KNUCKLE_ROLES = tuple(f"palm_{finger}" for finger in FINGERS)
INNER_ROLES = tuple(f"{finger}_{bone}" for finger, bones in zip(FINGERS, BONES, strict=True) for bone in bones[:2])
BACK_ROLES = tuple(TABLES.back)
LANDMARK_ROLES = tuple(f"landmark_{joint}" for joint in JOINTS)
ROLES = (*TIP_ROLES, WRIST_ROLE, *KNUCKLE_ROLES, *INNER_ROLES, *BACK_ROLES, *LANDMARK_ROLES)

_POSES = 2000  # random ones: of which two places get farthest apart


@dataclass(frozen=True, slots=True)
class Place:
    """A marker's centre: `point` (3,) m in the frame of kinematic row `row`; `finger` indexes FINGERS, -1: the palm."""

    row: int
    point: Array
    finger: int


def place_of(marker: Marker, model: HandModel) -> Place:
    """Where the marker sits; raises RigError when its role is no place on the hand."""
    role = marker.role or ""
    dh = model.dh
    mirrored = np.array([1.0, model.mirror, 1.0])
    if role == WRIST_ROLE:
        return Place(ROOT, np.zeros(3), -1)
    if role in TIP_ROLES:
        finger = TIP_ROLES.index(role)
        row = int(dh.point_row[len(JOINTS) + finger])
        along, out = paint_middle(marker, model, finger)
        point = dh.point_offset[len(JOINTS) + finger].copy()
        if out:
            point = np.array([along, 0.0, 0.0]) + out * dorsal(model, finger, row)
        return Place(row, point, finger)
    if role in KNUCKLE_ROLES:
        return Place(ROOT, mirrored * model.base[KNUCKLE_ROLES.index(role)], -1)
    if role in BACK_ROLES:
        knuckle, along, across = TABLES.back[role]
        finger = FINGERS.index(knuckle)
        skin = 0.5e-3 * model.anatomy.palm_thickness_mm
        return Place(ROOT, mirrored * (along * model.base[finger, 0], across * model.base[finger, 1], skin), -1)
    if role in LANDMARK_ROLES:
        joint = LANDMARK_ROLES.index(role)
        finger, along = divmod(joint - 1, 4)
        if joint == 0 or along == 0:  # the wrist and the fingers' roots
            return Place(ROOT, mirrored * model.base[finger] if joint else np.zeros(3), -1)
        return Place(int(dh.point_row[joint]), dh.point_offset[joint].copy(), finger)
    if role in INNER_ROLES:
        finger, bone = divmod(INNER_ROLES.index(role), 2)
        row = int(dh.point_row[1 + 4 * finger + bone + 1])
        skin = model.radii[finger, bone] * dorsal(model, finger, row)
        return Place(row, np.array([-0.5 * model.bones[finger, bone], 0.0, 0.0]) + skin, finger)
    said = f"the role {marker.role!r}" if marker.role else "no role"
    raise RigError(f"marker {marker.id!r} has {said}; a hand wears markers at "
                   f"{', '.join(ROLES)}.")


def farthest_apart(model: HandModel, places: Sequence[Place]) -> Array:
    """(P, P) m: how far two places on the hand get from each other in any pose, of a person's hand at most.

    Over random poses within the joints' limits, and three standard deviations of hands' lengths.
    """
    rng, dh = np.random.default_rng(0), model.dh
    rows, offsets = [place.row for place in places], np.array([place.point for place in places])
    frames = np.zeros((len(dh.parent) + 1, 3, 4))
    frames[ROOT] = np.eye(4)[:3]
    points, found = np.empty((len(dh.point_row), 3)), np.empty((_POSES, len(places), 3))
    for pose in found:
        forward_arrays(dh, np.eye(4), rng.uniform(model.limits[:, 0], model.limits[:, 1]), frames[:-1], points)
        pose[:] = np.einsum("pij,pj->pi", frames[rows, :, :3], offsets) + frames[rows, :, 3]
    apart = np.linalg.norm(found[:, :, None] - found[:, None], axis=3)
    return np.asarray((1.0 + 3.0 * TABLES.length_sd) * apart.max(axis=0))


def with_markers(model: HandModel, markers: MarkerSet) -> HandModel:
    """The model whose five marker centres, and the chains that solvers bring there, are where the fingertips of
    `markers` are painted; fingers without paint keep theirs."""
    offsets, chain, bend = model.dh.point_offset.copy(), model.chain.copy(), model.chain_bend.copy()
    for marker in markers.markers:
        if marker.role not in TIP_ROLES:
            continue
        finger = TIP_ROLES.index(marker.role)
        along, out = paint_middle(marker, model, finger)
        offsets[len(JOINTS) + finger] = place_of(marker, model).point
        if out:
            reach = float(model.bones[finger, 2]) + along
            chain[finger, 2], bend[finger] = math.hypot(reach, out), -math.atan2(out, reach)
    return replace(model, dh=model.dh._replace(point_offset=offsets), chain=chain, chain_bend=bend)


def dorsal(model: HandModel, finger: int, row: int) -> Array:
    """(3,) unit vector out of the back of a finger, in the frame of one of its rows."""
    frames = np.empty((len(model.dh.parent), 3, 4))
    points = np.empty((len(model.dh.point_row), 3))
    forward_arrays(model.dh, np.eye(4), np.zeros(len(ANGLES)), frames, points)
    dorsal = model.base_rotation[finger][:, 2] * np.array([1.0, model.mirror, 1.0])
    return np.asarray(frames[row, :, :3].T @ dorsal)
