"""Names and order of the hand's joints and angles, used by every array that describes a hand.

Palm frame: origin at the wrist joint, +x distal towards the middle knuckle, +z dorsal (out of the back of the
hand), +y = z cross x: towards the thumb on a right hand. A left hand is the mirror image in y. Flexion is
positive towards the palm; abduction is positive towards the thumb side (radial), on both hands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FINGERS: tuple[str, ...] = ("thumb", "index", "middle", "ring", "little")

THUMB_JOINTS = ("thumb_cmc", "thumb_mcp", "thumb_ip", "thumb_tip")
JOINTS: tuple[str, ...] = (
    "wrist",
    *THUMB_JOINTS,
    *(f"{finger}_{joint}" for finger in FINGERS[1:] for joint in ("mcp", "pip", "dip", "tip")),
)
"""21 joint centres: the wrist, then base, second, third and tip of each finger."""

THUMB_ANGLES = ("thumb_cmc_abduction", "thumb_cmc_flexion", "thumb_mcp_abduction", "thumb_mcp_flexion",
                "thumb_ip_flexion")
ANGLES: tuple[str, ...] = (
    *THUMB_ANGLES,
    *(f"{finger}_{angle}" for finger in FINGERS[1:]
      for angle in ("mcp_abduction", "mcp_flexion", "pip_flexion", "dip_flexion")),
)
"""21 joint angles, rad: 5 of the thumb, then 4 of each finger."""


def _fingers(names: tuple[str, ...]) -> NDArray[np.int64]:
    return np.array([FINGERS.index(name.partition("_")[0]) if "_" in name else -1 for name in names])


FINGER_OF_JOINT, FINGER_OF_ANGLE = _fingers(JOINTS), _fingers(ANGLES)
"""Finger of each of `JOINTS`, -1 for the wrist, and of `ANGLES`."""

FINGER_JOINTS, FINGER_ANGLES = (np.searchsorted(owners, [(finger, finger + 1) for finger in range(len(FINGERS))])
                                for owners in (FINGER_OF_JOINT, FINGER_OF_ANGLE))
"""(5, 2) where each finger's `JOINTS` and `ANGLES` begin and end, for compiled code."""

JOINT_SLICES, ANGLE_SLICES = (tuple(slice(*map(int, ends)) for ends in each) for each in (FINGER_JOINTS, FINGER_ANGLES))
"""The same as slices."""

FLEXIONS: tuple[tuple[int, ...], ...] = tuple(
    tuple(index for index, name in enumerate(ANGLES) if name.startswith(finger) and name.endswith("flexion"))
    for finger in FINGERS)
"""Indices into `ANGLES` of the flexions at the beginning of each finger's three bones, in the order of `FINGERS`."""

BONES: tuple[tuple[str, str, str], ...] = (("metacarpal", "proximal", "distal"),
                                           *(("proximal", "medial", "distal"),) * len(FINGERS[1:]))
"""Names of each finger's three bones from its root to its tip, in the order of `FINGERS`."""

TIP_ROLES: tuple[str, ...] = tuple(f"{finger}_tip" for finger in FINGERS)
WRIST_ROLE = "wrist"


@dataclass(frozen=True, slots=True)
class HandPose:
    """A posed hand: `world_from_palm` (4, 4) rigid transform, m; `angles` (21,) rad in the order of `ANGLES`."""

    world_from_palm: Array
    angles: Array
