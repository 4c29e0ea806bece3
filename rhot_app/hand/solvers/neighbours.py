"""Fingers that bend one another: bounds on how much more one knuckle is bent than the next (RHOT 2.1.1).

The differences tie the fingers together. When fingers that were solved alone break them, one Levenberg-Marquardt over
all sixteen angles brings targets and differences to agree as far as they can. Around the result each finger alone is a
box again, because every difference is shared out: whatever the fingers do within their shares keeps it. There the
chosen method has the last word.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.linear import solve_in_box
from rhot_app.hand.solvers.methods import Effort, Method, solve
from rhot_app.hand.solvers.newton import STEP_MAX
from rhot_app.hand.solvers.problem import Problem, Solution, assign, linearise
from rhot_app.hand.variants import inter_finger

Array = NDArray[np.float64]


class Difference(NamedTuple):
    """`low` <= flexion of `first` less flexion of `second` <= `high`, rad; both index skeleton.ANGLES."""

    first: int
    second: int
    low: float
    high: float


def differences_of(rows: Array, bounds: Array) -> tuple[Difference, ...]:
    """The bounds of `variants.inter_finger`, rows @ angles <= bounds, each row one angle less another."""
    return tuple(Difference(int(np.argmax(row)), int(np.argmin(row)), -math.inf, float(bound))
                 for row, bound in zip(rows, bounds, strict=True))


NEIGHBOURS = differences_of(*inter_finger())
"""How far neighbouring knuckles follow each other, as all of this room has it."""

STEPS = 40
WEIGHT = 2.5e-3
"""What a difference that is broken by a radian counts, m^2, against the squared distances from the targets."""

FIRST, LAST = 5, 21
"""The angles of the four fingers."""


def solve_neighbours(method: Method, problem: Problem, effort: Effort | None = None,
                     differences: tuple[Difference, ...] = NEIGHBOURS) -> Solution:
    """`methods.solve` within `differences` as well as limits. A finger that these keep from its target is LIMITED.

    FABRIK_FREE knows neither. Raises ValueError when limits and differences contradict each other.
    """
    solution = solve(method, problem, effort)
    if method is Method.FABRIK_FREE or violation(solution.angles, differences) <= 0.0:
        return solution
    angles, limits = solution.angles.copy(), problem.limits.copy()
    table = np.array(differences, dtype=np.float64)
    agree(angles, problem.lengths, limits, problem.targets, table, STEPS)
    if not share_out(angles, limits, table):
        raise ValueError("joint limits and differences between fingers contradict each other")
    return solve(method, replace(problem, limits=limits, start=angles), effort)


def violation(angles: Array, differences: tuple[Difference, ...] = NEIGHBOURS) -> float:
    """By how much `angles` (21,) exceed the differences at most, rad; negative when they keep all."""
    return max(max(low - (angles[first] - angles[second]), angles[first] - angles[second] - high)
               for first, second, low, high in differences)


@njit(cache=True)
def agree(angles: Array, lengths: Array, limits: Array, targets: Array, differences: Array, steps: int) -> None:
    """Bring the four fingers, in place on `angles` (21,), near their targets with the `differences` (n, 4) kept."""
    size = LAST - FIRST
    matrix, right, step = np.empty((size, size)), np.empty(size), np.empty(size)
    low, high, trial = np.empty(size), np.empty(size), np.empty(angles.shape[0])
    assign(angles, trial)
    cost, damping = _model(trial, lengths, targets, differences, matrix, right), 1e-4
    for _ in range(steps):
        for k in range(size):
            low[k] = max(limits[FIRST + k, 0] - angles[FIRST + k], -STEP_MAX)
            high[k] = min(limits[FIRST + k, 1] - angles[FIRST + k], STEP_MAX)
            matrix[k, k] += damping * WEIGHT
        solve_in_box(matrix, right, low, high, step)
        for k in range(size):
            trial[FIRST + k] = angles[FIRST + k] + step[k]
        trial_cost = _model(trial, lengths, targets, differences, matrix, right)
        if trial_cost < cost:
            settled = cost - trial_cost < 1e-9 * cost
            cost, damping = trial_cost, max(0.1 * damping, 1e-9)
            assign(trial, angles)
            if settled or cost < 1e-18:
                break
        else:
            damping = 10.0 * damping
            if damping > 1e4:
                break
            _model(angles, lengths, targets, differences, matrix, right)


@njit(cache=True)
def _model(angles: Array, lengths: Array, targets: Array, differences: Array, matrix: Array, right: Array) -> float:
    """Fill the normal equations of the squared distances and broken differences at `angles`; returns their sum."""
    size, cost = LAST - FIRST, 0.0
    joints, jacobian, error = np.empty((4, 3)), np.empty((3, 4)), np.empty(3)
    for i in range(size):
        right[i] = 0.0
        for j in range(size):
            matrix[i, j] = 0.0
    for finger in range(1, 5):
        at = 4 * (finger - 1)
        if math.isnan(targets[finger, 0] + targets[finger, 1] + targets[finger, 2]):
            continue
        cost += linearise(angles[FIRST + at:FIRST + at + 4], lengths[finger], targets[finger], joints, jacobian,
                          error) ** 2
        for i in range(4):
            for k in range(3):
                right[at + i] += jacobian[k, i] * error[k]
                for j in range(4):
                    matrix[at + i, at + j] += jacobian[k, i] * jacobian[k, j]
    for pair in differences:
        first, second = int(pair[0]) - FIRST, int(pair[1]) - FIRST
        beyond = _beyond(angles, pair)
        if beyond != 0.0:
            cost += WEIGHT * beyond ** 2
            right[first] += WEIGHT * beyond
            right[second] -= WEIGHT * beyond
            matrix[first, first] += WEIGHT
            matrix[second, second] += WEIGHT
            matrix[first, second] -= WEIGHT
            matrix[second, first] -= WEIGHT
    return cost


@njit(cache=True)
def _beyond(angles: Array, pair: Array) -> float:
    """What the difference of a pair lacks, rad, positive below its low bound; zero within its bounds."""
    difference = angles[int(pair[0])] - angles[int(pair[1])]
    return max(pair[2] - difference, 0.0) + min(pair[3] - difference, 0.0)


@njit(cache=True)
def share_out(angles: Array, limits: Array, differences: Array) -> bool:
    """Bring `angles` (21,) within `limits` (21, 2) and `differences` (n, 4), and narrow `limits` to shares of what the
    differences leave, in place; False when there are no such angles."""
    for _ in range(200):
        worst = 0.0
        for k in range(angles.shape[0]):
            angles[k] = min(max(angles[k], limits[k, 0]), limits[k, 1])
        for pair in differences:
            first, second = int(pair[0]), int(pair[1])
            beyond = _beyond(angles, pair)
            worst = max(worst, abs(beyond))
            angles[first] += 0.5 * beyond
            angles[second] -= 0.5 * beyond
        if worst < 1e-10:
            break
    else:
        return False
    for pair in differences:
        first, second = int(pair[0]), int(pair[1])
        difference = angles[first] - angles[second]
        more, less = max(0.5 * (pair[3] - difference), 0.0), max(0.5 * (difference - pair[2]), 0.0)
        limits[first, 0] = max(limits[first, 0], angles[first] - less)
        limits[first, 1] = min(limits[first, 1], angles[first] + more)
        limits[second, 0] = max(limits[second, 0], angles[second] - more)
        limits[second, 1] = min(limits[second, 1], angles[second] + less)
    return True
