"""What one instant's markers say of a hand's size: the evidence for a size, whatever the pose.

A larger hand holds its markers in the same places when it bends its fingers more. How plausible that is, its pose says:
by the natural pose, by the joints' limits, and by how much room there is for such poses. Fingers that are nearly
stretched hold their tips near the farthest place that they reach, where many poses differ little; that all of them
should end there by chance on a hand that is larger is not likely, and a smaller hand does not reach so far. So the
evidence integrates over the pose (Laplace's method, MacKay 2003, chapter 27), about the most plausible one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.least_squares import Stop, descend
from rhot_app.estimation.linear import factorise
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.limits import PERSON_LIMIT_SD_RAD
from rhot_app.hand.solvers.pose_descent import SIZE, WORLD, PoseProblem, linearise_pose, pose_state

Array = NDArray[np.float64]

STOP = Stop(20, 1e-5, 1e-6, 0.0)
"""Of the descent; a pose found for a neighbouring size needs three or four steps."""


class Posture(NamedTuple):
    """What holds of a hand in any pose. `dh`: its table with one point per marker; `limits` (21, 2) rad; `mean` (21,)
    rad and `information` (21, 21) 1/rad^2 of its angles without evidence."""

    dh: DhArrays
    limits: Array
    mean: Array
    information: Array


@njit(cache=True)
def implausibility(posture: Posture, places: Array, information: Array, log_scale: float, world: Array,
                   angles: Array) -> tuple[float, float]:
    """How implausible a hand exp(log_scale) times as large is: the negative logarithm of the evidence, but for a
    constant, and the part of it that is misfit and strain of the most plausible pose.

    `places` (M, 3) m, world, NaN for a marker that was not located; `information` (M, 3, 3) 1/m^2, the inverse of their
    covariances. The descent (Levenberg-Marquardt) starts from `world` (4, 4) and `angles` (21,) rad, which become the
    most plausible pose.
    """
    problem = pose_problem(posture, places, information, math.exp(log_scale))
    state = pose_state(world, angles)
    descend(problem, state, int(SIZE), STOP)
    world[:3], angles[:] = state[:WORLD].reshape(3, 4), state[WORLD:]
    matrix, room = np.empty((SIZE, SIZE)), 0.0
    cost = linearise_pose(problem, state, matrix, np.empty(SIZE), np.empty(SIZE), np.empty(SIZE))
    factorise(matrix)
    for i in range(SIZE):
        room += math.log(matrix[i, i])
    return cost + room, cost


@njit(cache=True)
def pose_problem(posture: Posture, places: Array, information: Array, scale: float) -> PoseProblem:
    """That of a hand `scale` times as large, its limits a person's. Arguments as in `implausibility`."""
    return PoseProblem(posture.dh, posture.limits, posture.mean, posture.information, places, information, scale,
                       PERSON_LIMIT_SD_RAD, np.zeros(WORLD + posture.mean.shape[0]), np.zeros(SIZE))
