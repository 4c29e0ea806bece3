"""The hand as a skeleton of turning joints, as animation formats have it: BVH and glTF share it.

The rest pose is the hand at zero angles in the palm frame, with every joint's axes parallel to the palm's. So a joint's
rotation is the turn of its bone out of the rest pose, expressed in its parent's rotated axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.dh import ROOT
from rhot_app.hand.kinematics import frames_and_points
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, JOINTS

Array = NDArray[np.float64]

TURNING: Final = tuple(index for index, name in enumerate(JOINTS) if not name.endswith("_tip"))
"""Indices into JOINTS of the 16 joints that turn: the wrist (the whole hand), then three per finger."""

PARENTS: Final = tuple(-1 if joint == 0 else 0 if (joint - 1) % 4 == 0 else TURNING.index(joint - 1)
                       for joint in TURNING)
"""Each turning joint's parent, an index into TURNING; -1 for the wrist."""

TIPS: Final = tuple(index for index, name in enumerate(JOINTS) if name.endswith("_tip"))


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The rest pose of one hand. `offsets` (16, 3) m from each turning joint's parent, palm axes (the wrist's are 0);
    `tips` (5, 3) m from each finger's last joint; `rest` (21, 3) m, all joints in the palm frame."""

    model: HandModel
    rest: Array
    offsets: Array
    tips: Array
    rest_rotations: Array  # (16, 3, 3) palm_from_row of the row that carries each bone, at zero angles

    def rotations(self, angles: Array) -> Array:
        """(N, 15, 3, 3): how the joints behind the wrist are turned, each in its parent's turned axes, at `angles`
        (N, 21) rad."""
        palms = np.tile(np.eye(4), (len(angles), 1, 1))
        frames, _ = frames_and_points(self.model.dh, palms, angles.astype(np.float64))
        turned = frames[:, _rows(self.model), :, :3] @ self.rest_rotations.transpose(0, 2, 1)
        return np.asarray(turned[:, PARENTS[1:]].swapaxes(-1, -2) @ turned[:, 1:])


def skeleton_of(model: HandModel) -> Skeleton:
    """The skeleton of a hand."""
    (frames,), (points,) = frames_and_points(model.dh, np.eye(4)[None], np.zeros((1, len(ANGLES))))
    rest = points[:len(JOINTS)]
    parents = [0 if parent < 0 else TURNING[parent] for parent in PARENTS]
    tips = rest[list(TIPS)] - rest[[tip - 1 for tip in TIPS]]
    return Skeleton(model, rest, rest[list(TURNING)] - rest[parents], tips, frames[_rows(model), :, :3])


def _rows(model: HandModel) -> NDArray[np.int64]:
    """(16,) the row of the table that carries the bone behind each turning joint: the one that the next joint rides
    on; ROOT for the wrist."""
    return np.array([ROOT, *model.dh.point_row[[joint + 1 for joint in TURNING[1:]]]])
