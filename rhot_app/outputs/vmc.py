"""The Virtual Motion Capture protocol: the bones of a hand for avatars (VRM, Unity), as OSC by UDP.

A bone's rotation is against its parent's, from the T-pose of VRM: arms along x, palms down, the thumb half-way between
the fingers and forward, its nail up the radial side. Axes are Unity's: left-handed, x right, y up, z forward.
https://protocol.vmc.info/english, and VRM 1.0, tpose.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import quaternion_from_rotation, rotation_from_quaternion
from rhot_app.outputs.joints import HandSample, Sample
from rhot_app.outputs.openxr import OPENXR_JOINTS
from rhot_app.outputs.osc import UdpSink, bundles, osc_message
from rhot_app.project import OutputSettings

Array = NDArray[np.float64]

_MIRROR: Final = np.array([1.0, 1.0, -1.0])  # from OpenXR's axes (z backward) to Unity's (z forward)
_UNITY_BONES: Final = {"metacarpal": "Proximal", "proximal": "Intermediate", "distal": "Distal"}  # the thumb's


@dataclass(frozen=True, slots=True)
class Bones:
    """The 16 bones of one side: Unity's `names`; `joints`, their rows in OPENXR_JOINTS; `parents`, rows in here (-1 for
    the hand itself); `rest` (16, 3, 3): along the bone, out of its back, and their cross product, in the T-pose."""

    names: tuple[str, ...]
    joints: NDArray[np.int64]
    parents: tuple[int, ...]
    rest: Array


def bones_of(side: str) -> Bones:
    """The bones of a "left" or "right" hand."""
    along = 1.0 if side == "right" else -1.0
    names, joints, parents = [f"{side.capitalize()}Hand"], [OPENXR_JOINTS.index("wrist")], [-1]
    for finger in ("thumb", "index", "middle", "ring", "little"):
        thumb = finger == "thumb"
        kinds = _UNITY_BONES if thumb else {kind: kind.capitalize() for kind in ("proximal", "intermediate", "distal")}
        for kind, name in kinds.items():
            parents.append(0 if name == "Proximal" else len(names) - 1)
            joints.append(OPENXR_JOINTS.index(f"{finger}_{kind}"))
            names.append(f"{side.capitalize()}{finger.capitalize()}{name}")
    straight = _basis(np.array([along, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    half = math.sqrt(0.5)
    thumb_rest = _basis(half * np.array([along, 0.0, 1.0]), half * np.array([-along, 0.0, 1.0]))
    rest = np.array([thumb_rest if "Thumb" in name else straight for name in names])
    return Bones(tuple(names), np.array(joints), tuple(parents), rest)


def bone_poses(hand: HandSample, bones: Bones) -> tuple[Array, Array]:
    """Each bone's position (16, 3) m and rotation (16, 4) xyzw against its parent's, in Unity's axes.

    The hand's own are in the room, as if nothing stood above it. `hand` has the joints of OpenXR.
    """
    assert hand.orientations is not None
    turned = rotation_from_quaternion(np.roll(hand.orientations[bones.joints], 1, axis=-1))
    forward, up = -_MIRROR * turned[:, :, 2], _MIRROR * turned[:, :, 1]
    world = np.stack([forward, up, np.cross(forward, up)], axis=2) @ bones.rest.transpose(0, 2, 1)
    places = _MIRROR * hand.positions[bones.joints]
    local, offsets = world.copy(), places.copy()
    for row, parent in enumerate(bones.parents):
        if parent >= 0:
            local[row] = world[parent].T @ world[row]
            offsets[row] = world[parent].T @ (places[row] - places[parent])
    return offsets, np.roll(quaternion_from_rotation(local), -1, axis=-1)


class VmcSink(UdpSink):
    """A performer, which a marionette (an avatar program) listens to."""

    def __init__(self, settings: OutputSettings) -> None:
        super().__init__(settings)
        self._bones = {side: bones_of(side) for side in ("left", "right")}
        self._begun_s = time.monotonic()

    def write(self, sample: Sample) -> None:
        """Send one state; a hand that is unknown is left out, so that the avatar keeps the last one."""
        for datagram in bundles(self._messages(sample), sample.t_unix_ns):
            self.send(datagram)

    def _messages(self, sample: Sample) -> Iterator[bytes]:
        yield osc_message("/VMC/Ext/OK", 1)
        yield osc_message("/VMC/Ext/T", time.monotonic() - self._begun_s)
        for hand in sample.hands:
            bones = self._bones[hand.side]
            positions, rotations = bone_poses(hand, bones)
            for name, row in zip(bones.names, np.hstack([positions, rotations]).tolist(), strict=True):
                if all(map(math.isfinite, row)):
                    yield osc_message("/VMC/Ext/Bone/Pos", name, *row)


def _basis(forward: Array, up: Array) -> Array:
    return np.stack([forward, up, np.cross(forward, up)], axis=1)
