"""FABRIK (Aristidou and Lasenby 2011) of one finger within its joint limits; arrays as in `finger_chain`."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.limits import clamp_angle, wrap
from rhot_app.hand.solvers.finger_chain import assign, chain_points, distance, fold_abduction

Array = NDArray[np.float64]

GAIN = 0.02
"""An iteration of FABRIK that brings the end nearer by less than this part of its distance makes no progress."""

PATIENCE = 10
"""Iterations in a row without progress, after which FABRIK is stopped."""

PLANE_MARGIN = 0.02
"""A target nearer to the abduction axis than this part of the finger's length does not show the finger's plane."""


@njit(cache=True)
def fabrik_finger(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[int, bool]:
    """FABRIK in the finger's plane, in place on `angles`; returns the iterations done and whether it was stopped.

    The abduction axis lies in the plane, so the target alone chooses it. In the plane (u outward, w palmar) a bone
    is its direction F from u; a hinge limits the difference of neighbours' directions in both passes. Stopped means
    that limits, or a target on the line of a straight finger, let PATIENCE iterations in a row gain nothing.
    """
    reach = lengths[0] + lengths[1] + lengths[2]
    angles[0] = clamp_angle(fold_abduction(target[0], target[1], PLANE_MARGIN * reach, angles[0]),
                            limits[0, 0], limits[0, 1])
    goal_u = math.cos(angles[0]) * target[0] + math.sin(angles[0]) * target[1]
    goal_w = -target[2]
    if math.sqrt(target[0] ** 2 + target[1] ** 2 + target[2] ** 2) >= reach:
        angles[1] = clamp_angle(math.atan2(goal_w, goal_u), limits[1, 0], limits[1, 1])
        for k in range(2, 4):
            angles[k] = clamp_angle(0.0, limits[k, 0], limits[k, 1])
        return 0, False
    u, w = np.zeros(4), np.zeros(4)
    _lay_out(angles, lengths, u, w)
    missed, idle = math.hypot(u[3] - goal_u, w[3] - goal_w), 0
    if missed <= tolerance:
        return 0, False
    for iteration in range(1, max_iterations + 1):
        u[3], w[3] = goal_u, goal_w
        heading = math.atan2(w[3] - w[2], u[3] - u[2])
        for k in range(2, 0, -1):
            u[k] = u[k + 1] - lengths[k] * math.cos(heading)
            w[k] = w[k + 1] - lengths[k] * math.sin(heading)
            bend = wrap(heading - math.atan2(w[k] - w[k - 1], u[k] - u[k - 1]))
            heading -= clamp_angle(bend, limits[k + 1, 0], limits[k + 1, 1])
        # The first bone keeps its far end: that is what the forward pass reads from it.
        heading = 0.0
        for k in range(3):
            turn = math.atan2(w[k + 1] - w[k], u[k + 1] - u[k]) - heading
            angles[k + 1] = clamp_angle(turn, limits[k + 1, 0], limits[k + 1, 1])
            heading += angles[k + 1]
            u[k + 1] = u[k] + lengths[k] * math.cos(heading)
            w[k + 1] = w[k] + lengths[k] * math.sin(heading)
        before, missed = missed, math.hypot(u[3] - goal_u, w[3] - goal_w)
        idle = idle + 1 if missed > (1.0 - GAIN) * before else 0
        if missed <= tolerance or idle == PATIENCE:
            return iteration, idle == PATIENCE
    return max_iterations, False


@njit(cache=True)
def _lay_out(angles: Array, lengths: Array, u: Array, w: Array) -> None:
    """The finger's joints in its plane."""
    heading = 0.0
    for k in range(3):
        heading += angles[k + 1]
        u[k + 1] = u[k] + lengths[k] * math.cos(heading)
        w[k + 1] = w[k] + lengths[k] * math.sin(heading)


@njit(cache=True)
def fabrik_within(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[int, bool]:
    """`fabrik_finger` or `fabrik_thumb`, by the number of angles."""
    if angles.shape[0] == 5:
        return fabrik_thumb(angles, lengths, limits, target, tolerance, max_iterations)
    return fabrik_finger(angles, lengths, limits, target, tolerance, max_iterations)


@njit(cache=True)
def fabrik_thumb(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                 max_iterations: int) -> tuple[int, bool]:
    """FABRIK of the thumb, in place on `angles`; returns the iterations done and whether it was stopped.

    The backward pass is free; the forward pass reads each bone's angles in its parent's frame and clamps them. The
    two bones behind the MCP joint share a plane, which the target chooses as it does for a finger.
    """
    joints, jacobian = np.empty((4, 3)), np.empty((3, 5))
    chain_points(angles, lengths, joints, jacobian)
    if distance(joints[0], target) >= lengths[0] + lengths[1] + lengths[2]:
        for k in range(1, 4):
            assign(target, joints[k])
        _read_thumb(angles, joints, lengths, limits)
        return 0, False
    missed, idle = distance(joints[3], target), 0
    for iteration in range(1, max_iterations + 1):
        assign(target, joints[3])
        for k in range(2, 0, -1):
            length = distance(joints[k + 1], joints[k])
            if length > 0.0:
                for i in range(3):
                    joints[k, i] = joints[k + 1, i] + lengths[k] / length * (joints[k, i] - joints[k + 1, i])
        _read_thumb(angles, joints, lengths, limits)
        chain_points(angles, lengths, joints, jacobian)
        before, missed = missed, distance(joints[3], target)
        idle = idle + 1 if missed > (1.0 - GAIN) * before else 0
        if missed <= tolerance or idle == PATIENCE:
            return iteration, idle == PATIENCE
    return max_iterations, False


@njit(cache=True)
def _read_thumb(angles: Array, joints: Array, lengths: Array, limits: Array) -> None:
    """Clamped angles that point the thumb's bones, one after the other from the root, at `joints`."""
    abduction = fold_abduction(joints[1, 0], joints[1, 1], 1e-9, angles[0])
    angles[0] = clamp_angle(abduction, limits[0, 0], limits[0, 1])
    ca, sa = math.cos(angles[0]), math.sin(angles[0])
    flexion = math.atan2(-joints[1, 2], ca * joints[1, 0] + sa * joints[1, 1])
    angles[1] = clamp_angle(flexion, limits[1, 0], limits[1, 1])
    cf, sf = math.cos(angles[1]), math.sin(angles[1])
    local = np.empty((2, 3))  # the two joints behind the MCP joint, seen from it in the metacarpal's frame
    for k in range(2):
        along = ca * joints[k + 2, 0] + sa * joints[k + 2, 1]
        local[k, 0] = cf * along - sf * joints[k + 2, 2] - lengths[0]
        local[k, 1] = ca * joints[k + 2, 1] - sa * joints[k + 2, 0]
        local[k, 2] = sf * along + cf * joints[k + 2, 2]
    margin = PLANE_MARGIN * (lengths[1] + lengths[2])
    angles[2] = clamp_angle(fold_abduction(local[1, 0], local[1, 1], margin, angles[2]), limits[2, 0], limits[2, 1])
    c, s = math.cos(angles[2]), math.sin(angles[2])
    angles[3] = clamp_angle(math.atan2(-local[0, 2], c * local[0, 0] + s * local[0, 1]), limits[3, 0], limits[3, 1])
    u = c * local[1, 0] + s * local[1, 1] - lengths[1] * math.cos(angles[3])
    w = -local[1, 2] - lengths[1] * math.sin(angles[3])
    angles[4] = clamp_angle(math.atan2(w, u) - angles[3], limits[4, 0], limits[4, 1])
