"""A hand that one camera alone sees: what it cannot show is held, lest it be made up.

One camera does not see distance. A finger that bends, a palm that turns and one that withdraws look alike to it, and a
filter that linearises anew with every frame soon believes to tell them apart. So a palm that stands nearly still is
believed to keep its distance and its bearing, and the fingers to do what is seen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import ACCELERATION, SCALE, VELOCITY, Estimate

Array = NDArray[np.float64]

FRESH_S = 0.07
"""A camera that saw a marker this recently still sees the hand: it may take turns with another."""

MOVES_M_S, TURNS_RAD_S = 0.15, 1.5
"""A palm that moves or turns faster goes on as it did."""

REST_S, SHARE = 0.1, 0.02
"""How soon the palm comes to rest along the line of sight of a single camera, and how much of its acceleration stays.
"""


class Cameras(NamedTuple):
    """C cameras: `pose` (C, 3, 4) camera_from_world m and `intrinsics` (C, 9) as in `CameraModel`."""

    pose: Array
    intrinsics: Array


@njit(cache=True)
def single_eye(estimate: Estimate) -> int:
    """The only camera that sees the hand just now, if the palm stands nearly still; -1 otherwise."""
    speed, turning = 0.0, 0.0
    for i in range(3):
        speed += estimate.velocity[i] ** 2
        turning += estimate.velocity[3 + i] ** 2
    if speed > MOVES_M_S * MOVES_M_S or turning > TURNS_RAD_S * TURNS_RAD_S:
        return -1
    eye = -1
    for camera in range(estimate.unseeing.shape[0]):
        if estimate.unseeing[camera] < FRESH_S:
            if eye >= 0:
                return -1
            eye = camera
    return eye


@njit(cache=True)
def squint(estimate: Estimate, pose: Array, dt: float, together: Array) -> None:
    """With one eye, believe that the palm keeps its distance and its bearing while the fingers move.

    Along the line of sight, and about all axes, the palm comes to rest soon and is hardly accelerated (`together`,
    (27, 27), is changed): a finger that bends and a palm that turns or withdraws look alike to one camera, and the
    first is far more usual. `pose` (3, 4) camera_from_world.
    """
    rest = 1.0 - math.exp(-dt / REST_S)
    for base in (VELOCITY, ACCELERATION):
        motion = estimate.velocity if base == VELOCITY else estimate.acceleration
        along = pose[2, 0] * motion[0] + pose[2, 1] * motion[1] + pose[2, 2] * motion[2]
        for i in range(3):
            motion[i] -= rest * along * pose[2, i]
            motion[3 + i] *= 1.0 - rest
    for i in range(3):
        for j in range(3):
            together[i, j] -= (1.0 - SHARE) * pose[2, i] * pose[2, j]
        together[3 + i, 3 + i] = SHARE


@njit(cache=True)
def hold_back(covariance: Array, gains: Array, count: int, pose: Array, step: Array) -> None:
    """Learn nothing from one camera about the palm's distance and bearing.

    With the gain K' = (I - A) K the posterior is P - G^T G + A G^T G A^T; A projects on these directions. `gains` and
    `count` as `gain.solve` leaves them; `covariance` is P - G^T G. Changes `covariance` and `step` (N,).
    """
    held = np.zeros(step.shape[0])
    for k in range(count + 1):
        source = gains[k] if k < count else step
        for base in (0, VELOCITY, ACCELERATION):
            along = pose[2, 0] * source[base] + pose[2, 1] * source[base + 1] + pose[2, 2] * source[base + 2]
            for i in range(3):
                held[base + i] = along * pose[2, i]
                held[base + 3 + i] = source[base + 3 + i]
        if k < count:
            for a in range(SCALE):
                if held[a] != 0.0:
                    for b in range(SCALE):
                        covariance[a, b] += held[a] * held[b]
    for i in range(step.shape[0]):
        step[i] -= held[i]
