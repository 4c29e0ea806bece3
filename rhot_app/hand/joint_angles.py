"""Joint angles from joint positions: the inverse of the forward kinematics, in closed form."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, JOINT_SLICES

Array = NDArray[np.float64]


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
