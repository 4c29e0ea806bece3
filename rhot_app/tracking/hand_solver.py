"""From marker positions to a hand: palm fit, then one inverse kinematics per finger, and how each part is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.finger_ik import FABRIK_ITERATIONS, TOLERANCE, solve_fingers_arrays
from rhot_app.hand.kinematics import forward_arrays
from rhot_app.hand.model import HandModel
from rhot_app.hand.palm_fit import TIPS_WITHOUT_WRIST, any_marker, fit_palm, track_arrays
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES, JOINT_SLICES, JOINTS, HandPose
from rhot_app.tracking.state import Knowledge

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]

_INFERRED, _GUESSED = int(Knowledge.INFERRED), int(Knowledge.GUESSED)
_JOINTS_OF = np.array([(joints.start, joints.stop) for joints in JOINT_SLICES])
_ANGLES_OF = np.array([(angles.start, angles.stop) for angles in ANGLE_SLICES])

TARGET_SD_M = 1e-3
"""What a located marker is worth at working distance: a nearly stretched finger is not bent to meet noise."""

FORGET_S = 0.5
"""A hand without any marker keeps its last pose this long, as a guess. Fingertips carry a hand whose wrist is out of
sight, but after this long the rest of it is a guess as well."""


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


def no_hand(tips: Array) -> SolvedHand:
    """Nothing is known of the hand but where its markers `tips` (5, 3) m are, NaN where unknown."""
    return SolvedHand(np.full((len(JOINTS), 3), np.nan), np.full(len(JOINTS), Knowledge.UNKNOWN, np.uint8),
                      tips.copy(), np.full(len(ANGLES), np.nan),
                      np.full(len(ANGLES), Knowledge.UNKNOWN, np.uint8), np.full((4, 4), np.nan), Knowledge.UNKNOWN)


class HandSolver:
    """Keeps the last pose: the next one starts from it, and what the markers leave open stays as it was.

    The model's marker centres are those of the fingertips' paint (`rhot_app.hand.places.with_markers`)."""

    def __init__(self, model: HandModel) -> None:
        self._model = model
        self.pose: HandPose | None = None
        self._palm: HandPose | None = None  # the last palm fit, whose own angles start the next one
        self._solved_s = 0.0
        self._wrist_s: float | None = None  # when the wrist was last located

    def reset(self) -> None:
        """Forget the pose."""
        self.pose = self._palm = self._wrist_s = None

    def solve(self, t_s: float, wrist: Array, tips: Array, wrist_knowledge: int, tip_knowledge: Codes) -> SolvedHand:
        """The hand whose wrist and finger markers are at `wrist` (3,) and `tips` (5, 3), m; NaN where unknown."""
        wrist_seen = bool(np.isfinite(wrist[0]))
        lost = self._wrist_s is None or t_s - self._wrist_s > FORGET_S
        # What the tips alone made of the palm meanwhile may be far off: begin anew with the wrist.
        if self.pose is not None and (t_s - self._solved_s > FORGET_S or (wrist_seen and lost)):
            self.reset()
        if wrist_seen:
            self._wrist_s = t_s
        palm, dt_s = self._palm, t_s - self._solved_s
        if palm is None:  # a cold start, from many poses: it takes milliseconds, once
            fit = fit_palm(self._model, wrist, tips, None, 0.0)
            if fit is None:
                return no_hand(tips)
            palm, dt_s = fit.pose, 0.0
        placed = wrist_seen or (not lost and int(np.count_nonzero(np.isfinite(tips[:, 0]))) >= TIPS_WITHOUT_WRIST)
        return self._follow(t_s, wrist, tips, wrist_knowledge, tip_knowledge, palm, dt_s, placed)

    def _follow(self, t_s: float, wrist: Array, tips: Array, wrist_knowledge: int, tip_knowledge: Codes,
                palm: HandPose, dt_s: float, placed: bool) -> SolvedHand:
        """One call of compiled code: between two frames the interpreter's own code and data leave the caches."""
        model, natural = self._model, self._model.natural
        last = palm if self.pose is None else self.pose
        palm_world, palm_angles = palm.world_from_palm.copy(), palm.angles.copy()
        world, angles = last.world_from_palm.copy(), last.angles.copy()
        points = np.empty((len(JOINTS) + 5, 3))
        joints, known = np.empty(len(JOINTS), np.uint8), np.empty(len(ANGLES), np.uint8)
        solved = follow(model.dh, model.limits, natural.mean, natural.information, model.mirror, model.base,
                        model.base_rotation, model.chain, model.chain_bend, wrist, tips, wrist_knowledge, tip_knowledge,
                        dt_s, self.pose is not None, placed, palm_world, palm_angles, world, angles, points, joints,
                        known)
        if solved:
            self._palm, self.pose, self._solved_s = HandPose(palm_world, palm_angles), HandPose(world, angles), t_s
        return SolvedHand(points[:len(JOINTS)], joints, points[len(JOINTS):], angles, known, world, Knowledge.GUESSED)


@njit(cache=True)
def follow(dh: DhArrays, limits: Array, mean: Array, information: Array, mirror: float, base: Array,
           base_rotation: Array, chain: Array, bends: Array, wrist: Array, tips: Array, wrist_knowledge: int,
           tip_knowledge: Codes, dt_s: float, warm: bool, placed: bool, palm_world: Array, palm_angles: Array,
           world: Array, angles: Array, points: Array, joint_knowledge: Codes, angle_knowledge: Codes) -> bool:
    """Palm fit, fingers, forward kinematics and knowledge of the next hand; returns whether it was solved.

    `palm_world` (4, 4) and `palm_angles` (21,): the palm fit `dt_s` seconds ago when `warm`, else this instant's,
    which stays. `world` (4, 4) and `angles` (21,): the last pose, kept when no marker is known. All four are updated;
    `points` (26, 3) m, `joint_knowledge` (21,) and `angle_knowledge` (21,) are filled. `placed`: the palm's place is
    known, so that what follows from it is inferred.
    """
    solved = not warm
    if warm and any_marker(wrist, tips):
        track_arrays(dh, limits, mean, information, wrist, tips, dt_s, palm_world, palm_angles)
        solved = True
    if solved:
        world[:], angles[:] = palm_world, palm_angles
        solve_fingers_arrays(angles, world, mirror, base, base_rotation, chain, bends, limits, tips, mean,
                             information, TOLERANCE, FABRIK_ITERATIONS, TARGET_SD_M, np.empty(5),
                             np.empty(5, np.int64), np.empty(5, np.uint8))
    forward_arrays(dh, world, angles, np.empty((dh.parent.shape[0], 3, 4)), points)
    _know(wrist_knowledge, tip_knowledge, solved and placed, joint_knowledge, angle_knowledge)
    return solved


@njit(cache=True)
def _know(wrist: int, tips: Codes, placed: bool, joints: Codes, angles: Codes) -> None:
    """Fill the knowledge of (21,) joints and (21,) angles.

    A finger whose marker was located is inferred from it through the bones, the others keep their last angles: a
    guess, and so is everything when the palm is not `placed`. The palm's rotation is always a guess with one wrist
    marker, and says so itself (`palm_knowledge`).
    """
    joints[:], angles[:] = _GUESSED, _GUESSED
    if not placed:
        return
    if wrist <= _INFERRED:
        joints[0] = wrist
    for finger in range(5):
        if tips[finger] <= _INFERRED:
            joints[_JOINTS_OF[finger, 0]:_JOINTS_OF[finger, 1]] = _INFERRED
            angles[_ANGLES_OF[finger, 0]:_ANGLES_OF[finger, 1]] = _INFERRED
