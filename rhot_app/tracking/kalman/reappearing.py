"""A finger that comes back into sight after a while: what seemed to be known of it meanwhile does not count."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    FINGERS,
    FIRST_FINGER,
    GROUP_OF,
    POSE,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.rows import Rows
from rhot_app.tracking.kalman.sighted import fingers_away

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

AWAY_S = 0.08
"""A finger unseen for this long may be anywhere."""

SPEED, HASTE = 3.0, 30.0
"""Standard deviations of its angles' velocities, rad/s, and accelerations, rad/s^2."""


@njit(cache=True)
def loosen(estimate: Estimate, part: Indices, rows: Rows, usual: Array) -> None:
    """Forget all of a finger that is seen again but what habit, `usual` (27, 27) as in `Habits`, says of its angles.

    How it was taken to go with the rest of the hand is forgotten too, so that the finger alone goes where it is seen.
    `part` (M,) as in `Worn`.
    """
    away = fingers_away(estimate, part)
    for finger in range(FINGERS):
        back = False
        for observation in range(rows.used[1]):
            back |= rows.part[observation] == finger
        if not back or away[finger] < AWAY_S:
            continue
        forget_finger(estimate, finger, usual)


@njit(cache=True)
def forget_finger(estimate: Estimate, finger: int, usual: Array) -> None:
    """Leave of what is known of a finger's angles only `usual` (27, 27), and of their velocities nothing."""
    covariance = estimate.covariance
    for i in range(ANGLES, POSE):
        if GROUP_OF[i] == FIRST_FINGER + finger:
            for base in (0, VELOCITY, ACCELERATION):
                covariance[base + i] = 0.0
                covariance[:, base + i] = 0.0
    for i in range(ANGLES, POSE):
        if GROUP_OF[i] == FIRST_FINGER + finger:
            for j in range(ANGLES, POSE):
                if GROUP_OF[j] == FIRST_FINGER + finger:
                    covariance[i, j] = usual[i, j]
            covariance[VELOCITY + i, VELOCITY + i] = SPEED * SPEED
            covariance[ACCELERATION + i, ACCELERATION + i] = HASTE * HASTE
