"""BVH: a skeleton whose joints turn, frame by frame. One hand a file; lengths and channel order: docs/export.md."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.errors import ExportError
from rhot_app.export.formats.bones import PARENTS, TURNING, Skeleton, skeleton_of
from rhot_app.export.frames import file_from_frame, frame_up
from rhot_app.export.plan import Format, Plan
from rhot_app.export.states import HandStates
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import JOINTS

Array = NDArray[np.float64]

ORDER = "ZXY"
"""The three angles of a joint, in the order in which they are written and multiplied: R = Rz Rx Ry."""


class BvhWriter:
    """Keeps the poses of one hand and writes them as text. BVH knows no gaps: a frame without a hand repeats the last
    pose (before the first one: that one)."""

    def __init__(self, plan: Plan) -> None:
        self.notes: list[str] = []
        self._plan = plan
        anatomy = plan.rig.hand if plan.hand == "hand" else plan.rig.other_hand
        if anatomy is None:
            raise ExportError(f"the rig {plan.rig.name!r} has no other_hand to export; leave --hand out.")
        if plan.rig.other_hand is not None:
            self.notes.append(f"BVH holds one hand a file: this is the rig's {plan.hand}")
        self._skeleton = skeleton_of(build_model(anatomy))
        self._turn = file_from_frame(frame_up(plan.rig.up, plan.frame), "y-up")
        self._frames: list[Array] = []
        self._scales: list[Array] = []

    def add(self, states: HandStates) -> None:
        """Keep these poses: (N, 51) root position (m) and 16 times three angles (degrees); NaN without a hand."""
        hand = states if self._plan.hand == "hand" or states.other is None else states.other
        palm = np.where(hand.present[:, None, None], hand.world_from_palm, np.nan)
        known = np.flatnonzero(np.isfinite(palm[:, 0, 0]) & np.isfinite(hand.angles).all(axis=1))
        out = np.full((len(hand), 3 + 3 * len(TURNING)), np.nan)
        if len(known):
            root = palm[known] if self._plan.frame == "rig" else np.tile(np.eye(4), (len(known), 1, 1))
            turned = np.concatenate([(self._turn @ root[:, :3, :3] @ self._turn.T)[:, None],
                                     self._turn @ self._skeleton.rotations(hand.angles[known]) @ self._turn.T], axis=1)
            angles = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_euler(ORDER, degrees=True)
            out[known, :3] = root[:, :3, 3] @ self._turn.T
            out[known, 3:] = angles.reshape(len(known), -1)
        self._frames.append(out)
        self._scales.append(hand.hand_scale[known])

    def finish(self) -> None:
        """Write the file."""
        frames, scales = np.concatenate(self._frames), np.concatenate(self._scales)
        held, missing = _hold(frames)
        if missing == len(frames):
            raise ExportError(f"{self._plan.log}: the hand is nowhere tracked, so there is no pose to write as BVH.")
        if missing:
            self.notes.append(f"BVH has no gaps: {missing} of {len(frames)} frames without a hand repeat the last pose")
        scale = self._plan.scale * float(np.median(scales))
        held[:, :3] *= self._plan.scale
        assert self._plan.rate_hz is not None
        with self._plan.path.open("w", encoding="ascii", newline="") as file:
            file.write("HIERARCHY\n" + "\n".join(_hierarchy(self._skeleton, scale * self._turn)) + "\n")
            file.write(f"MOTION\nFrames: {len(held)}\nFrame Time: {1.0 / self._plan.rate_hz:.9f}\n")
            line = " ".join(["%.6f"] * held.shape[1]) + "\n"
            file.writelines(line % tuple(row) for row in held.tolist())

    def close(self) -> None:
        """Let go of the poses."""
        self._frames = []


def _hold(frames: Array) -> tuple[Array, int]:
    """Frames with the missing ones filled by the last before them, and how many these are."""
    known = np.isfinite(frames[:, 0])
    if not known.any():
        return frames, len(frames)
    last = np.maximum.accumulate(np.where(known, np.arange(len(frames)), int(np.argmax(known))))
    return frames[last], int(np.count_nonzero(~known))


def _hierarchy(skeleton: Skeleton, turn: Array) -> Iterator[str]:
    """The lines of the rest pose; `turn` (3, 3) takes palm axes in metres to the file's."""
    depth: list[int] = []  # of the joints that are open
    for index, joint in enumerate(TURNING):
        while depth and depth[-1] != PARENTS[index]:
            yield "  " * (len(depth) - 1) + "}"
            depth.pop()
        indent = "  " * len(depth)
        depth.append(index)
        place = "3 Xposition Yposition Zposition "
        channels = " ".join(f"{axis}rotation" for axis in ORDER)
        yield f"{indent}{'ROOT' if index == 0 else 'JOINT'} {JOINTS[joint]}"
        yield f"{indent}{{"
        yield f"{indent}  OFFSET {_numbers(turn @ skeleton.offsets[index])}"
        yield f"{indent}  CHANNELS " + (f"6 {place[2:]}{channels}" if index == 0 else f"3 {channels}")
        if JOINTS[joint + 1].endswith("_tip"):
            yield f"{indent}  End Site"
            yield f"{indent}  {{"
            yield f"{indent}    OFFSET {_numbers(turn @ skeleton.tips[joint // 4])}"
            yield f"{indent}  }}"
    while depth:
        yield "  " * (len(depth) - 1) + "}"
        depth.pop()


def _numbers(point: Array) -> str:
    return " ".join(f"{value:.6f}" for value in point)


FORMATS = (Format("bvh", "BVH: a moving skeleton", BvhWriter, (".bvh",), "m", uniform=True),)
