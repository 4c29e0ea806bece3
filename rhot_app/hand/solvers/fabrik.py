"""FABRIK for a chain without limits (Aristidou and Lasenby 2011), and joint angles from joint positions.

FABRIK within limits is `finger_chain.fabrik_within`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.solvers.finger_chain import assign, distance

Array = NDArray[np.float64]

STILL = 1e-12
"""An iteration that moves every joint by less than this part of the chain's length moves nothing."""


@njit(cache=True)
def solve_chain(joints: Array, target: Array, tolerance: float, max_iterations: int) -> tuple[int, bool]:
    """Move the last of `joints` (n + 1, 3), root first, to `target` (3,), in place; the bones keep their lengths.

    Returns the iterations done and whether the last one moved anything. A target farther than the chain is long
    stretches the chain towards it, without iterating. Otherwise each iteration is a backward pass, from the last joint
    set on the target, and a forward pass, from the root; then the `tolerance` is checked. A straight chain whose target
    lies on its own line cannot bend.
    """
    bones = joints.shape[0] - 1
    if distance(joints[bones], target) <= tolerance:
        return 0, False
    lengths = np.empty(bones)
    directions = np.empty((bones, 3))  # the last one known of each bone, for when its two joints coincide
    total = 0.0
    for k in range(bones):
        lengths[k] = distance(joints[k], joints[k + 1])
        total += lengths[k]
        for i in range(3):
            directions[k, i] = (joints[k + 1, i] - joints[k, i]) / lengths[k] if lengths[k] > 0.0 else i == 0
    if distance(joints[0], target) > total:
        for k in range(bones):
            _place(joints[k], target, lengths[k], directions[k], 1.0, joints[k + 1])
        return 0, False
    root, before, moving = joints[0].copy(), joints.copy(), True
    for iteration in range(1, max_iterations + 1):
        assign(target, joints[bones])
        for k in range(bones - 1, -1, -1):
            _place(joints[k + 1], joints[k], lengths[k], directions[k], -1.0, joints[k])
        assign(root, joints[0])
        for k in range(bones):
            _place(joints[k], joints[k + 1], lengths[k], directions[k], 1.0, joints[k + 1])
        moving = False
        for k in range(1, bones + 1):
            moving |= distance(joints[k], before[k]) > STILL * total
            assign(joints[k], before[k])
        if distance(joints[bones], target) <= tolerance:
            return iteration, moving
    return max_iterations, moving


@njit(cache=True)
def _place(fixed: Array, towards: Array, length: float, direction: Array, sign: float, out: Array) -> None:
    """Put `out` at `length` from `fixed` on the line to `towards` (eq. 2.28); keep `direction`, times `sign`."""
    apart = distance(fixed, towards)
    if apart > 1e-15 * length:
        for i in range(3):
            direction[i] = sign * (towards[i] - fixed[i]) / apart
    for i in range(3):
        out[i] = fixed[i] + sign * length * direction[i]


# -- joint angles from joint positions ---------------------------------------------------------------------------------

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
