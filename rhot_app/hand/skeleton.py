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
"""21 joint centres; finger f (0..4) owns rows 1 + 4 f .. 4 + 4 f: base, second, third, tip."""

THUMB_ANGLES = ("thumb_cmc_abduction", "thumb_cmc_flexion", "thumb_mcp_abduction", "thumb_mcp_flexion",
                "thumb_ip_flexion")
ANGLES: tuple[str, ...] = (
    *THUMB_ANGLES,
    *(f"{finger}_{angle}" for finger in FINGERS[1:]
      for angle in ("mcp_abduction", "mcp_flexion", "pip_flexion", "dip_flexion")),
)
"""21 joint angles, rad: 5 of the thumb, then 4 of each finger."""

ANGLE_SLICES: tuple[slice, ...] = (slice(0, 5), *(slice(5 + 4 * k, 9 + 4 * k) for k in range(4)))
"""Slice of `ANGLES` that belongs to each finger, in the order of `FINGERS`."""

FLEXIONS: tuple[tuple[int, int, int], ...] = ((1, 3, 4), *((6 + 4 * k, 7 + 4 * k, 8 + 4 * k) for k in range(4)))
"""Indices into `ANGLES` of the flexions at the beginning of each finger's three bones, in the order of `FINGERS`."""

JOINT_SLICES: tuple[slice, ...] = tuple(slice(1 + 4 * k, 5 + 4 * k) for k in range(5))
"""Slice of `JOINTS` that belongs to each finger, in the order of `FINGERS`."""

FINGER_OF_JOINT = np.repeat((-1, 0, 1, 2, 3, 4), (1, 4, 4, 4, 4, 4))
FINGER_OF_ANGLE = np.repeat((0, 1, 2, 3, 4), (5, 4, 4, 4, 4))
"""Finger of each of `JOINTS`, -1 for the wrist, and of `ANGLES`."""

BONES: tuple[tuple[str, str, str], ...] = (("metacarpal", "proximal", "distal"),
                                           *(("proximal", "medial", "distal"),) * 4)
"""Names of each finger's three bones from its root to its tip, in the order of `FINGERS`."""

TIP_ROLES: tuple[str, ...] = tuple(f"{finger}_tip" for finger in FINGERS)
WRIST_ROLE = "wrist"


@dataclass(frozen=True, slots=True)
class HandPose:
    """A posed hand: `world_from_palm` (4, 4) rigid transform, m; `angles` (21,) rad in the order of `ANGLES`."""

    world_from_palm: Array
    angles: Array
