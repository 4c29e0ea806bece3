"""One interface to every solver, and bounds on how much more one knuckle is bent than the next (RHOT 2.1.1).

The differences tie the fingers together. When fingers that were solved alone break them, one Levenberg-Marquardt over
all sixteen angles brings targets and differences to agree as far as they can. Around the result each finger alone is a
box again, because every difference is shared out: whatever the fingers do within their shares keeps it. There the
chosen method has the last word.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.linear import solve_in_box
from rhot_app.hand.model import inter_finger
from rhot_app.hand.solvers import inverse, newton
from rhot_app.hand.solvers.closed_form import solve_coupled
from rhot_app.hand.solvers.fabrik import plane_angles, solve_chain_arrays, thumb_angles
from rhot_app.hand.solvers.finger_chain import (
    EXHAUSTED,
    MISSING,
    REACHED,
    STALLED,
    UNREACHABLE,
    chain_points,
    distance,
    fabrik_within,
    miss,
    status_of,
    within_reach,
)
from rhot_app.hand.solvers.inverse import follow_jacobian
from rhot_app.hand.solvers.newton import STEP_MAX, solve_exactly
from rhot_app.hand.solvers.problem import Problem, Solution, assign, clamp, linearise, norm

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


# -- one interface to every solver -------------------------------------------------------------------------------------

class Method(IntEnum):
    """The solvers of RHOT chapter 2.2."""

    TRANSPOSE = inverse.TRANSPOSE
    """Jacobian transpose (eq. 2.13, 2.15)."""
    PSEUDO_INVERSE = inverse.PSEUDO_INVERSE
    """Pseudo-inverse of the Jacobian (eq. 2.16)."""
    SVD = inverse.SVD
    """Pseudo-inverse by singular values, the small ones left out (eq. 2.20)."""
    DAMPED = inverse.DAMPED
    """Damped least squares (eq. 2.23)."""
    NEWTON = newton.NEWTON
    """Newton with the exact Hessian (eq. 2.24), within limits."""
    LEVENBERG = newton.LEVENBERG
    """Levenberg-Marquardt, within limits."""
    CLOSED_FORM = 6
    """The planar finger with DIP = 2/3 PIP (eq. 2.4)."""
    FABRIK_FREE = 7
    """FABRIK without limits, as published (2.2.7)."""
    FABRIK = 8
    """FABRIK within limits; handed over to Levenberg-Marquardt where they stop it."""
    FABRIK_ALONE = 9
    """FABRIK within limits, which says what stopped it."""


_SVD, _LEVENBERG = int(Method.SVD), int(Method.LEVENBERG)
_CLOSED_FORM, _FABRIK_FREE, _FABRIK = int(Method.CLOSED_FORM), int(Method.FABRIK_FREE), int(Method.FABRIK)
_FABRIK_ALONE = int(Method.FABRIK_ALONE)

HANDED_OVER_ITERATIONS = 40
"""Of Levenberg-Marquardt, after FABRIK."""

EXACT = 1e-7
COARSE = 5e-5
"""Tolerances, m: of the solvers that converge fast, and of FABRIK, which needs ever more iterations."""


class Effort(NamedTuple):
    """When a method stops: at `tolerance`, m, or after `max_iterations`."""

    tolerance: float
    max_iterations: int


EFFORT = {method: Effort(EXACT, 40) for method in Method} | {
    Method.TRANSPOSE: Effort(EXACT, 200),
    Method.FABRIK: Effort(COARSE, 10),
    Method.FABRIK_FREE: Effort(COARSE, 100),
    Method.FABRIK_ALONE: Effort(COARSE, 100),
}


def solve(method: Method, problem: Problem, effort: Effort | None = None) -> Solution:
    """Solve the five fingers of `problem`; `effort` is the method's own from EFFORT unless told.

    Angles keep the problem's limits, but for FABRIK_FREE, which knows none. A target out of reach leaves the finger
    stretched towards it as far as limits allow; the statuses tell.
    """
    tolerance, max_iterations = effort or EFFORT[method]
    angles, joints = problem.start.copy(), np.empty((5, 4, 3))
    residuals, iterations = np.empty(5), np.empty(5, dtype=np.int64)
    statuses, handed_over = np.empty(5, dtype=np.uint8), np.empty(5, dtype=np.bool_)
    solve_arrays(int(method), angles, problem.lengths, problem.limits, problem.targets, tolerance, max_iterations,
                 residuals, iterations, statuses, handed_over, joints)
    return Solution(angles, residuals, iterations, statuses, handed_over, joints)


@njit(cache=True)
def solve_arrays(method: int, angles: Array, lengths: Array, limits: Array, targets: Array, tolerance: float,
                 max_iterations: int, residuals: Array, iterations: NDArray[np.int64], statuses: NDArray[np.uint8],
                 handed_over: NDArray[np.bool_], joints: Array) -> None:
    """`solve` on arrays: `angles` (21,) in place, and every field of `Solution` filled."""
    for finger in range(5):
        low = 0 if finger == 0 else 1 + 4 * finger
        high = 5 + 4 * finger
        own, bones, box, target = angles[low:high], lengths[finger], limits[low:high], targets[finger]
        residuals[finger], iterations[finger], statuses[finger] = np.nan, 0, MISSING
        handed_over[finger] = False
        if not math.isnan(target[0] + target[1] + target[2]):
            if method in (_FABRIK, _FABRIK_ALONE):
                residual, taken, status = solve_limited(own, bones, box, target, tolerance, max_iterations)
            elif method == _FABRIK_FREE:
                residual, taken, status = solve_free(own, bones, target, tolerance, max_iterations, joints[finger])
            elif method == _CLOSED_FORM:
                residual, taken, status = solve_coupled(own, bones, box, target, tolerance)
            elif method <= _SVD:
                residual, taken, status = follow_jacobian(method, own, bones, box, target, tolerance, max_iterations)
            else:
                residual, taken, status = solve_exactly(method, own, bones, box, target, tolerance, max_iterations)
            if method == _FABRIK and status != REACHED:
                handed_over[finger] = True
                residual, more, status = solve_exactly(_LEVENBERG, own, bones, box, target, tolerance,
                                                       HANDED_OVER_ITERATIONS)
                taken += more
            residuals[finger], iterations[finger], statuses[finger] = residual, taken, status
        if method != _FABRIK_FREE or statuses[finger] == MISSING:
            chain_points(own, bones, joints[finger], np.empty((3, high - low)))


# -- FABRIK for fingers ------------------------------------------------------------------------------------------------

@njit(cache=True)
def solve_free(angles: Array, lengths: Array, target: Array, tolerance: float, max_iterations: int,
               joints: Array) -> tuple[float, int, int]:
    """A free chain: fills `joints` (4, 3) and, with the nearest that a finger's joints can do, `angles`.

    Returns residual of the chain, m, iterations and status. The chain knows neither hinges nor limits: its angles
    may lie anywhere and put the end elsewhere.
    """
    chain_points(angles, lengths, joints, np.empty((3, angles.shape[0])))
    iterations, moving = solve_chain_arrays(joints, target, tolerance, max_iterations)
    bones = np.empty((3, 3))
    for k in range(3):
        for i in range(3):
            bones[k, i] = (joints[k + 1, i] - joints[k, i]) / max(lengths[k], 1e-300)
    assign(thumb_angles(bones) if angles.shape[0] == 5 else plane_angles(bones), angles)
    residual = distance(joints[3], target)
    if residual <= tolerance:
        return residual, iterations, REACHED
    if not within_reach(lengths, norm(target), tolerance):
        return residual, iterations, UNREACHABLE
    return residual, iterations, EXHAUSTED if moving else STALLED


@njit(cache=True)
def solve_limited(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[float, int, int]:
    """FABRIK within limits, in place on `angles`; returns residual, m, iterations, and what stopped it: LIMITED where
    limits did, STALLED where the target lies on the line of a straight finger."""
    clamp(angles, limits)
    iterations, stopped = 0, False
    if miss(angles, lengths, target) > tolerance:
        iterations, stopped = fabrik_within(angles, lengths, limits, target, tolerance, max_iterations)
    residual = miss(angles, lengths, target)
    return residual, iterations, status_of(angles, lengths, limits, norm(target), residual, tolerance, not stopped)
