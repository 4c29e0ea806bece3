"""Levenberg-Marquardt for a chain of two-angle joints with limits of any shape: what limited FABRIK hands over to."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.linear import solve_in_box
from rhot_app.hand.solvers.finger_chain import distance
from rhot_app.hand.solvers.joint_shapes import HINGE, clamp_joint
from rhot_app.hand.solvers.problem import assign

Array = NDArray[np.float64]

STEPS = 60
STEP_MAX = 0.8
"""Largest change of an angle in one step, rad."""

ROUNDS = 10
"""Dampings tried for one step."""

RESTARTS = (0.4, 0.15, 0.7, 0.02, 0.95)
"""Parts of the flexions' ranges, from which to begin again."""


@njit(cache=True)
def lay_out(bone: int, joints: Array, base: Array, lengths: Array, angles: Array, frames: Array) -> None:
    """Fill the frame of `bone` and its far joint from its angles and its near joint."""
    parent = base if bone == 0 else frames[bone - 1]
    ca, sa = math.cos(angles[bone, 0]), math.sin(angles[bone, 0])
    cf, sf = math.cos(angles[bone, 1]), math.sin(angles[bone, 1])
    for i in range(3):
        out, y = ca * parent[i, 0] + sa * parent[i, 1], ca * parent[i, 1] - sa * parent[i, 0]
        frames[bone, i, 0], frames[bone, i, 1] = cf * out - sf * parent[i, 2], y
        frames[bone, i, 2] = sf * out + cf * parent[i, 2]
        joints[bone + 1, i] = joints[bone, i] + lengths[bone] * frames[bone, i, 0]


@njit(cache=True)
def finish_arrays(joints: Array, base: Array, target: Array, lengths: Array, shapes: NDArray[np.int64], bounds: Array,
                  angles: Array, frames: Array, tolerance: float) -> int:
    """Bring the end as near to `target` as the limits allow, in place on `joints` (n+1, 3), `angles` (n, 2) and
    `frames` (n, 3, 3); returns the steps taken.

    Stopped by limits or a local minimum it begins again, from every joint at the same part of its range.
    """
    bones = lengths.shape[0]
    taken = _descend(joints, base, target, lengths, shapes, bounds, angles, frames, tolerance)
    best, least = np.empty((bones, 2)), distance(joints[bones], target)
    for attempt in range(len(RESTARTS)):
        if least <= tolerance:
            break
        for k in range(bones):
            assign(angles[k], best[k])
            share = RESTARTS[attempt]
            angles[k, 0], angles[k, 1] = clamp_joint(
                shapes[k], bounds[k], 0.5 * (bounds[k, 0, 0] + bounds[k, 0, 1]),
                bounds[k, 1, 0] + share * (bounds[k, 1, 1] - bounds[k, 1, 0]))
            lay_out(k, joints, base, lengths, angles, frames)
        taken += _descend(joints, base, target, lengths, shapes, bounds, angles, frames, tolerance)
        missed = distance(joints[bones], target)
        if missed >= least:
            for k in range(bones):
                assign(best[k], angles[k])
                lay_out(k, joints, base, lengths, angles, frames)
        least = min(least, missed)
    return taken


@njit(cache=True)
def _descend(joints: Array, base: Array, target: Array, lengths: Array, shapes: NDArray[np.int64], bounds: Array,
             angles: Array, frames: Array, tolerance: float) -> int:
    """`finish_arrays` from one start. Steps keep the box around the limits; cones and parabolas take them back
    inside. Only steps that come nearer count."""
    bones = lengths.shape[0]
    size = 2 * bones
    jacobian, error = np.empty((3, size)), np.empty(3)
    matrix, right, step = np.empty((size, size)), np.empty(size), np.empty(size)
    low, high, before = np.empty(size), np.empty(size), np.empty((bones, 2))
    reach = 0.0
    for k in range(bones):
        reach += lengths[k]
    missed, damping, moving, taken = distance(joints[bones], target), 1e-3, True, 0
    while moving and missed > tolerance and taken < STEPS:
        taken += 1
        _jacobian(joints, base, angles, frames, shapes, jacobian)
        for i in range(3):
            error[i] = target[i] - joints[bones, i]
        for k in range(bones):
            assign(angles[k], before[k])
            for i in range(2):
                low[2 * k + i] = min(max(bounds[k, i, 0] - angles[k, i], -STEP_MAX), 0.0)
                high[2 * k + i] = max(min(bounds[k, i, 1] - angles[k, i], STEP_MAX), 0.0)
        moving = False
        for _ in range(ROUNDS):
            _damped_equations(jacobian, error, (damping * (missed / reach) ** 2 + 1e-9) * reach ** 2, matrix, right)
            solve_in_box(matrix, right, low, high, step)
            for k in range(bones):
                angles[k, 0], angles[k, 1] = clamp_joint(shapes[k], bounds[k], before[k, 0] + step[2 * k],
                                                         before[k, 1] + step[2 * k + 1])
                lay_out(k, joints, base, lengths, angles, frames)
            trial = distance(joints[bones], target)
            if trial < missed:
                moving = missed - trial > 1e-7 * missed
                missed, damping = trial, max(0.3 * damping, 1e-3)
                break
            damping = 8.0 * max(damping, 1e-2)
        else:
            for k in range(bones):
                assign(before[k], angles[k])
                lay_out(k, joints, base, lengths, angles, frames)
    return taken


@njit(cache=True)
def _jacobian(joints: Array, base: Array, angles: Array, frames: Array, shapes: NDArray[np.int64],
              jacobian: Array) -> None:
    """Fill `jacobian` (3, 2 n): change of the end per abduction, about the parent's z, and flexion, about the
    bone's y, of every joint."""
    end = joints.shape[0] - 1
    for k in range(end):
        parent = base if k == 0 else frames[k - 1]
        rx, ry, rz = joints[end, 0] - joints[k, 0], joints[end, 1] - joints[k, 1], joints[end, 2] - joints[k, 2]
        for i in range(2):
            ax, ay, az = parent[0, 2], parent[1, 2], parent[2, 2]
            if i == 1:
                ax, ay, az = frames[k, 0, 1], frames[k, 1, 1], frames[k, 2, 1]
            free = 0.0 if i == 0 and shapes[k] == HINGE else 1.0
            jacobian[0, 2 * k + i] = free * (ay * rz - az * ry)
            jacobian[1, 2 * k + i] = free * (az * rx - ax * rz)
            jacobian[2, 2 * k + i] = free * (ax * ry - ay * rx)


@njit(cache=True)
def _damped_equations(jacobian: Array, error: Array, damping: float, matrix: Array, right: Array) -> None:
    for i in range(right.shape[0]):
        right[i] = jacobian[0, i] * error[0] + jacobian[1, i] * error[1] + jacobian[2, i] * error[2]
        for j in range(right.shape[0]):
            matrix[i, j] = (jacobian[0, i] * jacobian[0, j] + jacobian[1, i] * jacobian[1, j]
                            + jacobian[2, i] * jacobian[2, j])
        matrix[i, i] += damping
