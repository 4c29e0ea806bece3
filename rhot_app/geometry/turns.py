"""Cameras that are turned otherwise than their calibration says.

C cameras have C - 1 turns against one of them, the reference: rotation vectors about each camera's own axes, rad.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.se3 import exponential
from rhot_app.geometry.camera import camera_coordinates

Array = NDArray[np.float64]

HELD_SD_RAD = 2e-5
"""rad, 0.01 px of a lens of 530 px: the least standard deviation of any turn, and that of one about the normal of
the plane of both cameras and what they see. That moves things along the lines of sight and contradicts nothing: their
own lengths alone would decide it, and they are not known better."""

TURN_S = 3600.0
"""s: correlation time of a turn. Chosen: a bracket follows the temperature of a room within an hour."""


@njit(cache=True)
def turn_of(camera: int, reference: int) -> int:
    """Which of the turns is this camera's; the reference has none."""
    return camera - 1 if camera > reference else camera


@njit(cache=True)
def turned_pose(pose: Array, turn: Array) -> tuple[Array, Array]:
    """camera_from_world (3, 4) of a camera at `pose` (3, 4) with a turn (3,), and the turn's left Jacobian (3, 3)."""
    rotation, left = np.empty((3, 3)), np.empty((3, 3))
    exponential(turn[0], turn[1], turn[2], rotation, left)
    return np.dot(rotation, pose), left


@njit(cache=True)
def fill_by_turn(point: Array, pose: Array, left: Array, slope: Array, out: Array) -> None:
    """Fill `out` (3,) px/rad: of one pixel coordinate by the turn that `turned_pose` has given `pose` and `left`.
    `slope` (3,) px/m: of the coordinate by the place `point` (3,) m. A turn d moves the camera's coordinates p by
    d x p, and so a pixel with the slope s by d . (p x s)."""
    px, py, pz = camera_coordinates(pose, point[0], point[1], point[2])
    sx = pose[0, 0] * slope[0] + pose[0, 1] * slope[1] + pose[0, 2] * slope[2]
    sy = pose[1, 0] * slope[0] + pose[1, 1] * slope[1] + pose[1, 2] * slope[2]
    sz = pose[2, 0] * slope[0] + pose[2, 1] * slope[1] + pose[2, 2] * slope[2]
    x, y, z = py * sz - pz * sy, pz * sx - px * sz, px * sy - py * sx
    for k in range(3):
        out[k] = x * left[0, k] + y * left[1, k] + z * left[2, k]


@njit(cache=True)
def turn_covariances(place: Array, poses: Array, reference: int, sd: Array) -> Array:
    """(C - 1, 3, 3) rad^2: of the turns by their standard deviations `sd` (C,) rad, where the cameras at `poses`
    (C, 3, 4) see something at `place` (3,) m."""
    cameras, first, centre = len(poses), poses[reference], np.empty(3)
    out, across = np.zeros((cameras - 1, 3, 3)), np.empty(3)
    for i in range(3):
        centre[i] = -(first[0, i] * first[0, 3] + first[1, i] * first[1, 3] + first[2, i] * first[2, 3])
    for camera in range(cameras):
        if camera == reference:
            continue
        own = out[turn_of(camera, reference)]
        ax, ay, az = camera_coordinates(poses[camera], centre[0], centre[1], centre[2])
        bx, by, bz = camera_coordinates(poses[camera], place[0], place[1], place[2])
        across[0], across[1], across[2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        across /= max(math.sqrt(np.dot(across, across)), 1e-12)
        for i in range(3):
            own[i, i] = sd[camera]**2
            for j in range(3):
                own[i, j] += (HELD_SD_RAD**2 - sd[camera]**2) * across[i] * across[j]
    return out


def turns_covariance(place: Array, poses: Array, reference: int, sd: Array) -> Array:
    """(3 (C - 1), 3 (C - 1)) rad^2: the same of all turns together."""
    each = turn_covariances(place, poses, reference, sd)
    out = np.zeros((3 * len(each), 3 * len(each)))
    for k, one in enumerate(each):
        out[3 * k:3 * k + 3, 3 * k:3 * k + 3] = one
    return out
