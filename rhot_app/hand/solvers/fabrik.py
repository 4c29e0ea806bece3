"""FABRIK (Aristidou and Lasenby 2011) of one finger within its joint limits; arrays as in `finger_chain`."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.limits import clamp_angle
from rhot_app.hand.solvers.finger_chain import assign, chain_points, distance, fold_abduction

Array = NDArray[np.float64]

GAIN = 0.02
"""An iteration of FABRIK that brings the end nearer by less than this part of its distance makes no progress."""

PATIENCE = 10
"""Iterations in a row without progress, after which FABRIK is stopped."""

PLANE_MARGIN = 0.02
"""A target nearer to the abduction axis than this part of the finger's length does not show the finger's plane."""


@njit(cache=True)
def fabrik_within(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[int, bool]:
    """FABRIK in place on `angles`; returns the iterations done and whether it was stopped.

    The backward pass is free; the forward pass reads each bone's angles in its parent's frame and clamps them. Stopped
    means that limits, or a target on the line of a straight finger, let PATIENCE iterations in a row gain nothing.
    """
    joints, jacobian = np.empty((4, 3)), np.empty((3, angles.shape[0]))
    chain_points(angles, lengths, joints, jacobian)
    if distance(joints[0], target) >= lengths[0] + lengths[1] + lengths[2]:
        for k in range(1, 4):
            assign(target, joints[k])
        _read(angles, joints, lengths, limits)
        return 0, False
    missed, idle = distance(joints[3], target), 0
    for iteration in range(1, max_iterations + 1):
        assign(target, joints[3])
        for k in range(2, 0, -1):
            length = distance(joints[k + 1], joints[k])
            if length > 0.0:
                for i in range(3):
                    joints[k, i] = joints[k + 1, i] + lengths[k] / length * (joints[k, i] - joints[k + 1, i])
        _read(angles, joints, lengths, limits)
        chain_points(angles, lengths, joints, jacobian)
        before, missed = missed, distance(joints[3], target)
        idle = idle + 1 if missed > (1.0 - GAIN) * before else 0
        if missed <= tolerance or idle == PATIENCE:
            return iteration, idle == PATIENCE
    return max_iterations, False


@njit(cache=True)
def _read(angles: Array, joints: Array, lengths: Array, limits: Array) -> None:
    """Clamped angles that point the bones, one after the other from the root, at `joints`. A thumb's metacarpal has a
    plane of its own."""
    local = joints[1:].copy()
    if angles.shape[0] == 4:
        _read_plane(angles, local, lengths, limits)
        return
    _read_plane(angles[:2], local[:1], lengths[:1], limits[:2])
    ca, sa, cf, sf = math.cos(angles[0]), math.sin(angles[0]), math.cos(angles[1]), math.sin(angles[1])
    for k in range(1, 3):  # seen from the MCP joint in the metacarpal's frame
        along, across, up = ca * local[k, 0] + sa * local[k, 1], ca * local[k, 1] - sa * local[k, 0], local[k, 2]
        local[k, 0], local[k, 1], local[k, 2] = cf * along - sf * up - lengths[0], across, sf * along + cf * up
    _read_plane(angles[2:], local[1:], lengths[1:], limits[2:])


@njit(cache=True)
def _read_plane(angles: Array, joints: Array, lengths: Array, limits: Array) -> None:
    """Abduction and flexions (n + 1,) of n bones in one plane through z, whose ends are to be near `joints` (n, 3)."""
    count, reach = lengths.shape[0], 0.0
    for k in range(count):
        reach += lengths[k]
    abduction = fold_abduction(joints[count - 1, 0], joints[count - 1, 1], PLANE_MARGIN * reach, angles[0])
    angles[0] = clamp_angle(abduction, limits[0, 0], limits[0, 1])
    c, s, heading, u, w = math.cos(angles[0]), math.sin(angles[0]), 0.0, 0.0, 0.0
    for k in range(count):  # u outward, w palmar
        turn = math.atan2(-joints[k, 2] - w, c * joints[k, 0] + s * joints[k, 1] - u) - heading
        angles[k + 1] = clamp_angle(turn, limits[k + 1, 0], limits[k + 1, 1])
        heading += angles[k + 1]
        u, w = u + lengths[k] * math.cos(heading), w + lengths[k] * math.sin(heading)
