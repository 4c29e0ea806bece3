"""From marker positions to a hand: palm fit, then one inverse kinematics per finger, and how each part is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.finger_ik import solve_fingers
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel
from rhot_app.hand.palm_fit import fit_palm
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES, JOINT_SLICES, JOINTS, HandPose
from rhot_app.tracking.state import Knowledge

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]

# Plain numbers: looking up a member of an enumeration costs a microsecond, and this is done for every finger.
_INFERRED, _GUESSED = int(Knowledge.INFERRED), int(Knowledge.GUESSED)

TARGET_SD_M = 1e-3
"""What a located marker is worth at working distance: a nearly stretched finger is not bent to meet noise."""

FORGET_S = 0.5
"""A hand without enough markers keeps its last pose this long, as a guess."""


@dataclass(frozen=True, slots=True)
class SolvedHand:
    """A hand as `HandState` publishes it; NaN and UNKNOWN when there is none."""

    joint_positions: Array  # (21, 3) m
    joint_knowledge: Codes
    fingertip_positions: Array  # (5, 3) m
    angles: Array  # (21,) rad
    angle_knowledge: Codes
    world_from_palm: Array  # (4, 4)
    palm_knowledge: Knowledge


def no_hand() -> SolvedHand:
    """Nothing is known of the hand."""
    return SolvedHand(np.full((len(JOINTS), 3), np.nan), np.full(len(JOINTS), Knowledge.UNKNOWN, np.uint8),
                      np.full((5, 3), np.nan), np.full(len(ANGLES), np.nan),
                      np.full(len(ANGLES), Knowledge.UNKNOWN, np.uint8), np.full((4, 4), np.nan), Knowledge.UNKNOWN)


class HandSolver:
    """Keeps the last pose: the next one starts from it, and what the markers leave open stays as it was."""

    def __init__(self, model: HandModel) -> None:
        self._model = model
        self.pose: HandPose | None = None
        self._palm: HandPose | None = None  # the last palm fit, whose own angles start the next one
        self._solved_s = 0.0

    def reset(self) -> None:
        """Forget the pose."""
        self.pose = self._palm = None

    def solve(self, t_s: float, wrist: Array, tips: Array, wrist_knowledge: int, tip_knowledge: Codes) -> SolvedHand:
        """The hand whose wrist and finger markers are at `wrist` (3,) and `tips` (5, 3), m; NaN where unknown."""
        if self.pose is not None and t_s - self._solved_s > FORGET_S:
            self.reset()
        fit = fit_palm(self._model, wrist, tips, self._palm, t_s - self._solved_s)
        if fit is not None:
            fingers = solve_fingers(self._model, fit.pose, tips, target_sd=TARGET_SD_M)
            self._palm = fit.pose
            self.pose = HandPose(fit.pose.world_from_palm, fingers.angles)
            self._solved_s = t_s
        if self.pose is None:
            return no_hand()
        points = forward(self._model, self.pose)
        joints, angles = _knowledge(wrist_knowledge, tip_knowledge, solved=fit is not None)
        return SolvedHand(points.joints, joints, points.marker_centres, self.pose.angles, angles,
                          self.pose.world_from_palm, Knowledge.GUESSED)


def _knowledge(wrist: int, tips: Codes, *, solved: bool) -> tuple[Codes, Codes]:
    """Knowledge of (21,) joints and (21,) angles.

    A finger whose marker was located is inferred from it through the bones, the others keep their last angles: a
    guess. The palm's rotation is always a guess with one wrist marker, and says so itself (`palm_knowledge`).
    """
    joints = np.full(len(JOINTS), _GUESSED, np.uint8)
    angles = np.full(len(ANGLES), _GUESSED, np.uint8)
    if solved:
        joints[0] = wrist if wrist <= _INFERRED else _GUESSED
        for finger, known in enumerate(tips):
            if known <= _INFERRED:
                joints[JOINT_SLICES[finger]] = _INFERRED
                angles[ANGLE_SLICES[finger]] = _INFERRED
    return joints, angles
