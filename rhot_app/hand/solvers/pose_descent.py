"""The most probable pose of a hand by the places of points on it: misfit, strain of the joints, and what came before.

    cost(x) = sum_m (y_m - s p_m(x))^T W_m (y_m - s p_m(x)) / 2 + strain(q) + (x - x0)^T D (x - x0) / 2

A state x has 33 numbers: world_from_palm (3, 4) row by row, then the angles q. Its tangent space has 27: palm
translation and rotation, both along the world's axes, then the angles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.least_squares import implements
from rhot_app.estimation.se3 import difference
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import TWIST, forward_arrays, point_jacobian
from rhot_app.hand.motion.hand_state import POSE, STATE

Array = NDArray[np.float64]

WORLD, SIZE = STATE.angles.start, POSE
"""Numbers of a state before its angles, and of its tangent space."""

STEP_MAX = 0.6
"""Largest change of a rotation or angle in one step, rad: beyond it the linearisation says nothing."""


class PoseProblem(NamedTuple):
    """What is known of a hand in one pose.

    `dh`: its table with P points; `limits` (21, 2) rad; `mean` (21,) rad and `information` (21, 21) 1/rad^2 of its
    angles without evidence. `places` (P, 3) m, world, NaN for a point that is not located; `weights` (P, 3, 3) 1/m^2,
    the inverse of their covariances. `scale`: of the hand's size. `limit_sd` rad: how far angles go beyond their
    limits; 0: not at all. `previous` (33,): another state, and `drift` (27,): the information that it holds.
    """

    dh: DhArrays
    limits: Array
    mean: Array
    information: Array
    places: Array
    weights: Array
    scale: float
    limit_sd: float
    previous: Array
    drift: Array


@njit(cache=True)
def pose_state(world: Array, angles: Array) -> Array:
    """(33,) the state of a pose, `world` (4, 4) and `angles` (21,)."""
    state = np.empty(WORLD + angles.shape[0])
    state[:WORLD], state[WORLD:] = world[:3].copy().reshape(WORLD), angles
    return state


@njit(cache=True)
def linearise_pose(problem: PoseProblem, state: Array, matrix: Array, right: Array, low: Array, high: Array) -> float:
    """The cost at `state` (33,); fills its normal equations `matrix` (27, 27) and `right` (27,), the negative gradient,
    and the bounds `low` and `high` (27,) of a step."""
    dh, world, angles = problem.dh, state[:WORLD].reshape(3, 4), state[WORLD:]
    count = dh.point_row.shape[0]
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3))
    jacobian, weighed = np.zeros((3, SIZE)), np.empty(3)
    forward_arrays(dh, world, angles, frames, points)
    matrix[:], right[:] = 0.0, 0.0
    cost = _strain(problem, angles, matrix, right, low, high)
    off, used = np.empty(3), np.empty(SIZE, np.int64)
    for m in range(count):
        if math.isnan(problem.places[m, 0]):
            continue
        weight = problem.weights[m]
        jacobian[:] = 0.0
        point_jacobian(dh, world, frames, dh.point_row[m], points[m, 0], points[m, 1], points[m, 2], jacobian)
        for i in range(3):
            off[i] = problem.places[m, i] - world[i, 3] - problem.scale * (points[m, i] - world[i, 3])
            for j in range(3, SIZE):
                jacobian[i, j] *= problem.scale
        columns = _columns(jacobian, used)
        for a in range(columns):
            column = used[a]
            for i in range(3):
                weighed[i] = (jacobian[0, column] * weight[0, i] + jacobian[1, column] * weight[1, i]
                              + jacobian[2, column] * weight[2, i])
            right[column] += weighed[0] * off[0] + weighed[1] * off[1] + weighed[2] * off[2]
            for b in range(columns):
                other = used[b]
                matrix[column, other] += (weighed[0] * jacobian[0, other] + weighed[1] * jacobian[1, other]
                                          + weighed[2] * jacobian[2, other])
        for i in range(3):
            for k in range(3):
                cost += 0.5 * off[i] * weight[i, k] * off[k]
    if problem.drift[0] > 0.0:
        moved = difference(state, problem.previous)
        for i in range(SIZE):
            matrix[i, i] += problem.drift[i]
            right[i] -= problem.drift[i] * moved[i]
            cost += 0.5 * problem.drift[i] * moved[i] ** 2
    return cost


@njit(cache=True)
def _columns(jacobian: Array, used: NDArray[np.int64]) -> int:
    """Note the columns of a point's `jacobian` (3, 27) that are not zero; returns how many: ten of 27 for a tip."""
    count = 0
    for j in range(SIZE):
        if jacobian[0, j] != 0.0 or jacobian[1, j] != 0.0 or jacobian[2, j] != 0.0:
            used[count] = j
            count += 1
    return count


@njit(cache=True)
def _strain(problem: PoseProblem, angles: Array, matrix: Array, right: Array, low: Array, high: Array) -> float:
    """Add how far `angles` (21,) are from the natural pose and beyond their limits; fill the bounds of a step.

    A limit with a standard deviation sets in softly, over that: the cost shall not jump where a joint meets its limit.
    """
    cost = 0.0
    low[:], high[:] = -STEP_MAX, STEP_MAX
    for i in range(angles.shape[0]):
        pull, row = 0.0, TWIST + i
        for j in range(angles.shape[0]):
            pull += problem.information[i, j] * (problem.mean[j] - angles[j])
            matrix[row, TWIST + j] = problem.information[i, j]
        cost += 0.5 * pull * (problem.mean[i] - angles[i])
        right[row] = pull
        if problem.limit_sd == 0.0:
            low[row] = max(low[row], min(problem.limits[i, 0] - angles[i], 0.0))
            high[row] = min(high[row], max(problem.limits[i, 1] - angles[i], 0.0))
            continue
        for side in range(2):
            sign = 2.0 * side - 1.0
            beyond = sign * (angles[i] - problem.limits[i, side]) / problem.limit_sd
            root = math.sqrt(beyond * beyond + 1.0)
            soft, slope = 0.5 * (beyond + root), 0.5 * (1.0 + beyond / root) / problem.limit_sd
            cost += 0.5 * soft * soft
            right[row] -= sign * slope * soft
            matrix[row, row] += slope * slope
    return cost


implements(PoseProblem, linearise_pose)
