"""FABRIK for a chain without limits (Aristidou and Lasenby 2011), and joint angles from joint positions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, JOINT_SLICES
from rhot_app.hand.solvers.finger_chain import Status, within_reach

Array = NDArray[np.float64]

STILL = 1e-12
"""An iteration that moves every joint by less than this part of the chain's length moves nothing."""


@dataclass(frozen=True, slots=True)
class ChainSolution:
    """`joints` (n+1, 3) in the unit of the input; `residual`: distance of the last joint from the target; `status`:
    how it ended, STALLED when its last iteration moved nothing."""

    joints: Array
    iterations: int
    residual: float
    reached: bool
    status: Status


def solve_chain(joints: ArrayLike, target: ArrayLike, *, tolerance: float = 1e-4,
                max_iterations: int = 100) -> ChainSolution:
    """Move the last joint of a chain to `target`, keeping its first joint and its bone lengths.

    `joints` (n+1, 3) is the start pose, root first, n >= 1 bones; `target` (3,) and `tolerance` in the same unit
    (the default means 0.1 mm when that is the metre). A chain already within tolerance is returned as it is. A
    target farther than the chain is long stretches the chain straight towards it, without iterating. Otherwise each
    iteration is a backward pass, from the last joint set on the target, and a forward pass, from the root; then the
    tolerance is checked. A straight chain whose target lies on its own line cannot bend: its status is STALLED.

    Raises ValueError for wrong shapes, numbers that are not finite, a negative tolerance or no iterations.
    """
    start = np.ascontiguousarray(joints, dtype=np.float64)
    goal = np.ascontiguousarray(target, dtype=np.float64)
    if start.ndim != 2 or start.shape[1] != 3 or start.shape[0] < 2:
        raise ValueError(f"joints must have shape (n+1, 3) with at least one bone, not {start.shape}")
    if goal.shape != (3,):
        raise ValueError(f"target must have shape (3,), not {goal.shape}")
    if not (np.isfinite(start).all() and np.isfinite(goal).all()):
        raise ValueError("joints and target must be finite numbers")
    if not tolerance >= 0:
        raise ValueError(f"tolerance must be zero or positive, not {tolerance}")
    if max_iterations < 1:
        raise ValueError(f"max_iterations must be at least 1, not {max_iterations}")
    solved = start.copy()
    iterations, moving = solve_chain_arrays(solved, goal, float(tolerance), int(max_iterations))
    residual = float(np.linalg.norm(solved[-1] - goal))
    lengths = np.linalg.norm(np.diff(start, axis=0), axis=1)
    return ChainSolution(solved, iterations, residual, residual <= tolerance,
                         chain_status(lengths, float(np.linalg.norm(goal - start[0])), residual, tolerance, moving))


@njit(cache=True)
def solve_chain_arrays(joints: Array, target: Array, tolerance: float, max_iterations: int) -> tuple[int, bool]:
    """`solve_chain` in place, without its checks; returns the iterations done and whether the last one moved it."""
    bones = joints.shape[0] - 1
    if _distance(joints[bones], target) <= tolerance:
        return 0, False
    lengths = np.empty(bones)
    directions = np.empty((bones, 3))  # the last one known of each bone, for when its two joints coincide
    total = 0.0
    for k in range(bones):
        lengths[k] = _distance(joints[k], joints[k + 1])
        total += lengths[k]
        for i in range(3):
            directions[k, i] = (joints[k + 1, i] - joints[k, i]) / lengths[k] if lengths[k] > 0.0 else i == 0
    if _distance(joints[0], target) > total:
        for k in range(bones):
            _place(joints[k], target, lengths[k], directions[k], 1.0, joints[k + 1])
        return 0, False
    root, before, moving = joints[0].copy(), joints.copy(), True
    for iteration in range(1, max_iterations + 1):
        _copy(target, joints[bones])
        for k in range(bones - 1, -1, -1):
            _place(joints[k + 1], joints[k], lengths[k], directions[k], -1.0, joints[k])
        _copy(root, joints[0])
        for k in range(bones):
            _place(joints[k], joints[k + 1], lengths[k], directions[k], 1.0, joints[k + 1])
        moving = False
        for k in range(1, bones + 1):
            moving |= _distance(joints[k], before[k]) > STILL * total
            _copy(joints[k], before[k])
        if _distance(joints[bones], target) <= tolerance:
            return iteration, moving
    return max_iterations, moving


def chain_status(lengths: Array, away: float, residual: float, tolerance: float, moving: bool) -> Status:
    """The status of a free chain whose target was this far `away` from its root."""
    if residual <= tolerance:
        return Status.REACHED
    if not within_reach(lengths, away, tolerance):
        return Status.UNREACHABLE
    return Status.EXHAUSTED if moving else Status.STALLED


@njit(cache=True)
def _place(fixed: Array, towards: Array, length: float, direction: Array, sign: float, out: Array) -> None:
    """Put `out` at `length` from `fixed` on the line to `towards` (eq. 2.28); keep `direction`, times `sign`."""
    distance = _distance(fixed, towards)
    if distance > 1e-15 * length:
        for i in range(3):
            direction[i] = sign * (towards[i] - fixed[i]) / distance
    for i in range(3):
        out[i] = fixed[i] + sign * length * direction[i]


@njit(cache=True)
def _distance(a: Array, b: Array) -> float:
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@njit(cache=True)
def _copy(point: Array, out: Array) -> None:
    for i in range(3):
        out[i] = point[i]


# -- joint angles from joint positions ---------------------------------------------------------------------------------

def angles_from_joints(model: HandModel, world_from_palm: Array, joints: Array) -> Array:
    """The 21 angles, rad, of a hand whose palm and joints (21, 3) m are known.

    Positions that no pose of the model has (a solver without limits leaves such) give the angles of the nearest
    finger plane. Where the positions do not determine an abduction (all bones along its axis), it is zero.
    """
    palm = (joints - world_from_palm[:3, 3]) @ world_from_palm[:3, :3] * [1.0, model.mirror, 1.0]
    angles = np.empty(len(ANGLES))
    for finger, rows in enumerate(JOINT_SLICES):
        bones = np.diff(palm[rows], axis=0) @ model.base_rotation[finger]
        bones /= np.maximum(np.linalg.norm(bones, axis=1, keepdims=True), 1e-12)
        if finger == 0:
            angles[0:5] = thumb_angles(bones)
        else:
            angles[1 + 4 * finger:5 + 4 * finger] = plane_angles(bones)
    return angles


@njit(cache=True)
def plane_angles(bones: Array) -> Array:
    """Abduction, then one flexion per bone, of a planar chain of unit bones (n, 3) in its base frame.

    In that frame a bone bent by F in all lies along (cos a cos F, sin a cos F, -sin F): seen along z all bones lie
    on one line through the abduction a, which is their principal axis.
    """
    count = bones.shape[0]
    angles = np.empty(count + 1)
    xx, yy, xy = 0.0, 0.0, 0.0
    for k in range(count):
        xx += bones[k, 0] ** 2
        yy += bones[k, 1] ** 2
        xy += bones[k, 0] * bones[k, 1]
    abduction = 0.5 * math.atan2(2.0 * xy, xx - yy) if xx + yy > 1e-18 else 0.0
    c, s = math.cos(abduction), math.sin(abduction)
    angles[0] = abduction
    bent = 0.0
    for k in range(count):
        total = math.atan2(-bones[k, 2], c * bones[k, 0] + s * bones[k, 1])
        turn = total - bent
        angles[k + 1] = turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))
        bent = total
    return angles


@njit(cache=True)
def thumb_angles(bones: Array) -> Array:
    """The thumb's five angles from its unit bones (3, 3) in its base frame: CMC abduction and flexion, then MCP, IP."""
    angles = np.empty(5)
    angles[:2] = plane_angles(bones[:1])
    ca, sa, cf, sf = math.cos(angles[0]), math.sin(angles[0]), math.cos(angles[1]), math.sin(angles[1])
    turned = np.empty((2, 3))  # the last two bones in the metacarpal's frame
    for k in range(2):
        along = ca * bones[k + 1, 0] + sa * bones[k + 1, 1]
        turned[k, 0] = cf * along - sf * bones[k + 1, 2]
        turned[k, 1] = ca * bones[k + 1, 1] - sa * bones[k + 1, 0]
        turned[k, 2] = sf * along + cf * bones[k + 1, 2]
    angles[2:] = plane_angles(turned)
    return angles
