"""What comes back into sight after a while: what seemed to be known of it meanwhile does not count."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    FINGERS,
    FIRST_FINGER,
    GROUP_OF,
    MOST_MARKERS,
    POSE,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.gain import expected_noise
from rhot_app.tracking.kalman.markers import Outfit, place_markers
from rhot_app.tracking.kalman.opening import open_directions
from rhot_app.tracking.kalman.rows import PALM_PART, ROWS_MAX, Rows
from rhot_app.tracking.kalman.sighted import fingers_away, keep_shown

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

AWAY_S = 0.08
"""What was unseen for this long may be anywhere."""

UNLIKELY = 4.0
"""Squared normalised innovation (2 degrees of freedom) of a palm that is not where it was carried on to."""

ELSEWHERE_M = 0.01
"""A palm that is so far from where it was expected is turned otherwise, too, and has other fingers: all that is known
is where the other markers are that were in sight."""

STRAYED_S = 0.3
"""It has come there in about this time."""

SPEED, HASTE = 3.0, 30.0
"""Standard deviations of its angles' velocities, rad/s, and accelerations, rad/s^2."""


@lean
def loosen(estimate: Estimate, part: Indices, rows: Rows, usual: Array, forgotten: Mask) -> None:
    """Forget all of a finger that is seen again but what habit, `usual` (27, 27) as in `Habits`, says of its angles.

    How it was taken to go with the rest of the hand is forgotten too, so that the finger alone goes where it is seen.
    `part` (M,) as in `Worn`. Fills `forgotten` (5,): which fingers were.
    """
    away = room((FINGERS,))
    fingers_away(estimate, part, away)
    for finger in range(FINGERS):
        back, forgotten[finger] = False, False
        for observation in range(rows.used[1]):
            back |= rows.part[observation] == finger
        if not back or away[finger] < AWAY_S:
            continue
        forget_finger(estimate, finger, usual)
        forgotten[finger] = True


@lean
def forget_finger(estimate: Estimate, finger: int, usual: Array) -> None:
    """Leave of what is known of a finger's angles only `usual` (27, 27), and of their velocities nothing, not even what
    they seemed to be: a finger seen twice within a moment may seem to move at any speed."""
    covariance = estimate.covariance
    for i in range(ANGLES, POSE):
        if GROUP_OF[i] == FIRST_FINGER + finger:
            covariance[i] = 0.0
            covariance[:, i] = 0.0
    for i in range(ANGLES, POSE):
        if GROUP_OF[i] == FIRST_FINGER + finger:
            for j in range(ANGLES, POSE):
                if GROUP_OF[j] == FIRST_FINGER + finger:
                    covariance[i, j] = usual[i, j]
    forget_course(estimate, finger)


@lean
def forget_course(estimate: Estimate, finger: int) -> None:
    """Leave of what is known of how a finger's angles change nothing, not even what they seemed to do."""
    covariance = estimate.covariance
    for i in range(ANGLES, POSE):
        if GROUP_OF[i] == FIRST_FINGER + finger:
            estimate.velocity[i], estimate.acceleration[i] = 0.0, 0.0
            for base in (VELOCITY, ACCELERATION):
                covariance[base + i] = 0.0
                covariance[:, base + i] = 0.0
            covariance[VELOCITY + i, VELOCITY + i] = SPEED * SPEED
            covariance[ACCELERATION + i, ACCELERATION + i] = HASTE * HASTE


@lean
def loosen_palm(estimate: Estimate, outfit: Outfit, rows: Rows, usual: Array) -> bool:
    """Let a palm be where it is seen again, if it is not likely to be where it was carried on to. True if it is so far
    off that nothing must be held of it.

    It is the place that is wrong: were it not doubted, what is seen would be taken for an acceleration, and a palm that
    has strayed by centimetres for one that moves at metres per second. Fingertips that were seen meanwhile stay where
    they are. `usual` as in `loosen`.
    """
    noise, strayed, known, back = room((ROWS_MAX, 3)), 0.0, False, room((MOST_MARKERS,))
    back[:] = 0.0
    for observation in range(rows.used[1]):
        camera, marker = rows.source[observation, 0], rows.source[observation, 2]
        if rows.part[observation] != PALM_PART or camera < 0 or estimate.unseen[camera, marker] < AWAY_S:
            continue
        if not known:
            expected_noise(rows, estimate.covariance, noise)
            known = True
        row = rows.first[observation]
        uu, uv, vv = noise[observation, 0], noise[observation, 1], noise[observation, 2]
        u, v = rows.residual[row], rows.residual[row + 1]
        if (vv * u * u - 2.0 * uv * u * v + uu * v * v) / (uu * vv - uv * uv) > UNLIKELY:
            slope = 0.0
            for k in range(3):
                slope += 0.5 * (rows.jacobian[row, k] ** 2 + rows.jacobian[row + 1, k] ** 2)
            strayed = max(strayed, (u * u + v * v) / slope)
            back[marker] = 1.0
    if strayed <= ELSEWHERE_M * ELSEWHERE_M:
        for k in range(3):
            estimate.covariance[k, k] += strayed
        return False
    worn, places = outfit.worn, outfit.places
    place_markers(worn.dh, estimate, places)
    keep_shown(estimate, worn.part, worn.palmar, outfit.cameras.pose, places.points, places.jacobian)
    for m in range(worn.part.shape[0]):
        if back[m] > 0.0:
            places.jacobian[m] = 0.0
    open_directions(places.jacobian, usual, estimate.bias_variance, outfit.opening)
    for i in range(POSE):
        for j in range(POSE):
            left_open = outfit.opening.left_open[i, j]
            estimate.covariance[i, j] += left_open
            estimate.covariance[VELOCITY + i, VELOCITY + j] += left_open / (STRAYED_S * STRAYED_S)
    return True
