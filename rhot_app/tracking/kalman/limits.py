"""Joint limits as constraints on the estimate: what lies beyond is brought back along what the markers leave open."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.estimate import ANGLES, MOST_NUMBERS, VELOCITY

Array = NDArray[np.float64]

FASTEST_RAD_S = 12.0
"""No finger bends faster for long. Without a bound cameras that take turns can drive one another on: a wrong speed is
wrong distance, which is a wrong speed at the next frame, and a thumb in plain view thrashes for a second."""

_ROUNDS = 4


@lean
def project(angles: Array, velocity: Array, covariance: Array, gains: Array, limits: Array, step: Array) -> None:
    """Change `step` (N,) so that `angles` (21,) + step keep their `limits` (21, 2), and before that their speeds,
    `velocity` (27,) + step, `FASTEST_RAD_S`.

    The most plausible state with the offending number on its limit (Simon and Chia 2002), one after the other, of the
    angles the farthest first; plausible by `covariance` less what an update takes from it, the squares of `gains`
    (K, N). The covariance stays: to know that a joint is within its limits would make it smaller, so it is on the safe
    side. A joint at its limit does not move on beyond it: its speed is stopped likewise.
    """
    for i in range(angles.shape[0]):
        row = VELOCITY + ANGLES + i
        speed = velocity[ANGLES + i] + step[row]
        if abs(speed) > FASTEST_RAD_S:
            _pull(covariance, gains, row, math.copysign(FASTEST_RAD_S, speed) - velocity[ANGLES + i], step)
    for _ in range(_ROUNDS * angles.shape[0]):
        worst, which, target = 1e-9, -1, 0.0
        for i in range(angles.shape[0]):
            value = angles[i] + step[ANGLES + i]
            bound = min(max(value, limits[i, 0]), limits[i, 1])
            if abs(value - bound) > worst:
                worst, which, target = abs(value - bound), i, bound
        if which < 0:
            return
        speed = velocity[ANGLES + which] + step[VELOCITY + ANGLES + which]
        if speed * (target - 0.5 * (limits[which, 0] + limits[which, 1])) > 0.0:
            _pull(covariance, gains, VELOCITY + ANGLES + which, -velocity[ANGLES + which], step)
        _pull(covariance, gains, ANGLES + which, target - angles[which], step)
    for i in range(angles.shape[0]):
        step[ANGLES + i] = min(max(angles[i] + step[ANGLES + i], limits[i, 0]), limits[i, 1]) - angles[i]


@lean
def _pull(covariance: Array, gains: Array, row: int, target: float, step: Array) -> None:
    """Make one number of the step `target`, and the others what is then most plausible."""
    column = room((MOST_NUMBERS,))[:covariance.shape[0]]
    for i in range(column.shape[0]):
        column[i] = covariance[row, i]
    for k in range(gains.shape[0]):
        factor = gains[k, row]
        for i in range(column.shape[0]):
            column[i] -= factor * gains[k, i]
    pull = (target - step[row]) / max(column[row], 1e-12)
    for i in range(step.shape[0]):
        step[i] += column[i] * pull
    step[row] = target
