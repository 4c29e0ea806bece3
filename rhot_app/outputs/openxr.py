"""The hand as the 26 joints of OpenXR (XR_EXT_hand_tracking): positions, orientations and radii.

A joint stands at the wrist-side end of the bone whose name it has; its -z points along that bone to the fingertip, its
+y out of the back of the finger, +x follows from both, the same way on both hands. A tip has the orientation of its
distal bone. The wrist looks to the middle metacarpal; the palm joint is the middle of that bone. Our model has no
metacarpals in the palm: they are laid from each knuckle towards the carpus, as long as X-rays of adults have them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.se3 import fill_quaternion
from rhot_app.hand.dh import ROOT
from rhot_app.hand.kinematics import frames_and_points
from rhot_app.hand.model import HandModel
from rhot_app.hand.shape import FLESH
from rhot_app.hand.skeleton import ANGLES, FINGERS, THUMB_JOINTS, HandPose

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

OPENXR_JOINTS: tuple[str, ...] = (
    "palm", "wrist", "thumb_metacarpal", "thumb_proximal", "thumb_distal", "thumb_tip",
    *(f"{finger}_{bone}" for finger in FINGERS[1:]
      for bone in ("metacarpal", "proximal", "intermediate", "distal", "tip")),
)
"""In the order of XrHandJointEXT."""

OUR_JOINTS: tuple[str | None, ...] = (
    None, "wrist", *THUMB_JOINTS,
    *(joint for finger in FINGERS[1:]
      for joint in (None, f"{finger}_mcp", f"{finger}_pip", f"{finger}_dip", f"{finger}_tip")),
)
"""Which of `skeleton.JOINTS` each OpenXR joint is; None: the palm and the four metacarpals, which we make up."""

_METACARPAL_PART: Final = (0.776, 0.742, 0.704, 0.680)
"""Metacarpal II to V per distance from knuckle to wrist: Buryanov and Kotiuk 2010 in the shipped hands."""


class OpenXrMap(NamedTuple):
    """How the 26 joints ride on a hand's kinematic rows: `row` (26,), ROOT for the palm; `turn` (26, 3, 3)
    row_from_joint; `offset` (26, 3) m in the row's frame; `radius` (26,) m, from the joint to the skin."""

    row: Indices
    turn: Array
    offset: Array
    radius: Array


@dataclass(frozen=True, slots=True)
class OpenXrHand:
    """26 joints in the order of OPENXR_JOINTS, world frame: `positions` (26, 3) m; `orientations` (26, 4) unit
    quaternions world_from_joint, wxyz (XrQuaternionf is xyzw), w >= 0; `radii` (26,) m."""

    positions: Array
    orientations: Array
    radii: Array


def openxr_map(model: HandModel) -> OpenXrMap:
    """Where the 26 joints are on this hand."""
    frames = frames_and_points(model.dh, np.eye(4)[None], np.zeros((1, len(ANGLES))))[0][0]
    mirror = np.array([1.0, model.mirror, 1.0])
    places = _palm_places(model, mirror)
    for finger in range(5):
        straight = _looking(mirror * model.base_rotation[finger][:, 0], mirror * model.base_rotation[finger][:, 2])
        if finger > 0:
            places.append(_metacarpal(model, finger, mirror))
        for bone in (0, 1, 2, 2):
            row = int(model.dh.point_row[2 + 4 * finger + bone])  # the row that ends the bone
            places.append((row, frames[row, :, :3].T @ straight, np.array([-model.bones[finger, bone], 0.0, 0.0]),
                           float(model.radii[finger, bone])))
        places[-1] = (*places[-1][:2], np.zeros(3), places[-1][3])
    return OpenXrMap(np.array([place[0] for place in places]), np.array([place[1] for place in places]),
                     np.array([place[2] for place in places]), np.array([place[3] for place in places]))


def openxr_hand(model: HandModel, mapping: OpenXrMap, pose: HandPose) -> OpenXrHand:
    """The 26 joints of a posed hand; `mapping` as `openxr_map` made it for the same model."""
    frames = frames_and_points(model.dh, pose.world_from_palm[None], pose.angles[None])[0][0]
    hand = OpenXrHand(np.empty((len(OPENXR_JOINTS), 3)), np.empty((len(OPENXR_JOINTS), 4)), mapping.radius)
    openxr_arrays(mapping, frames, hand.positions, hand.orientations)
    return hand


@njit(cache=True)
def openxr_arrays(mapping: OpenXrMap, frames: Array, positions: Array, orientations: Array) -> None:
    """Fill `positions` (26, 3) and `orientations` (26, 4) from the `frames` (R + 1, 3, 4) of `frames_and_points`."""
    turned = np.empty((3, 3))
    for joint in range(mapping.row.shape[0]):
        base = frames[mapping.row[joint]]
        turn, offset = mapping.turn[joint], mapping.offset[joint]
        for i in range(3):
            positions[joint, i] = (base[i, 3] + base[i, 0] * offset[0] + base[i, 1] * offset[1]
                                   + base[i, 2] * offset[2])
            for j in range(3):
                turned[i, j] = base[i, 0] * turn[0, j] + base[i, 1] * turn[1, j] + base[i, 2] * turn[2, j]
        fill_quaternion(turned, orientations[joint])


_Place = tuple[int, Array, Array, float]


def _palm_places(model: HandModel, mirror: Array) -> list[_Place]:
    """Palm and wrist."""
    base, up = _metacarpal_base(model, 2), np.array([0.0, 0.0, 1.0])
    knuckle, anatomy = model.base[2], model.anatomy
    return [(ROOT, _looking(mirror * (knuckle - base), up), mirror * 0.5 * (knuckle + base),
             0.5e-3 * anatomy.palm_thickness_mm),
            (ROOT, _looking(mirror * base, up), np.zeros(3), 0.5e-3 * anatomy.wrist_thickness_mm)]


def _metacarpal(model: HandModel, finger: int, mirror: Array) -> _Place:
    base = _metacarpal_base(model, finger)
    up = mirror * model.base_rotation[finger][:, 2]
    return (ROOT, _looking(mirror * (model.base[finger] - base), up), mirror * base,
            0.5e-3 * model.anatomy.palm_thickness_mm)


def _metacarpal_base(model: HandModel, finger: int) -> Array:
    """(3,) m in a right hand's palm frame."""
    knuckle = model.base[finger]
    towards = np.array([FLESH.carpal_x_m, FLESH.carpal_spread * knuckle[1], FLESH.carpal_z_m]) - knuckle
    length = _METACARPAL_PART[finger - 1] * float(np.linalg.norm(knuckle))
    return np.asarray(knuckle + length * towards / np.linalg.norm(towards))


def _looking(forward: Array, up: Array) -> Array:
    """(3, 3) rotation whose -z is `forward` and whose +y is as near to `up` as that allows."""
    z = -forward / np.linalg.norm(forward)
    y = up - z * (z @ up)
    y /= np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])
