"""One interface to every solver of RHOT chapter 2.2."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import FINGER_ANGLES, HandPose
from rhot_app.hand.solvers import inverse, newton
from rhot_app.hand.solvers.closed_form import solve_coupled
from rhot_app.hand.solvers.fabrik import plane_angles, solve_chain, thumb_angles
from rhot_app.hand.solvers.finger_chain import (
    EXHAUSTED,
    MISSING,
    REACHED,
    STALLED,
    UNREACHABLE,
    assign,
    chain_points,
    clamp,
    distance,
    fabrik_within,
    miss,
    norm,
    status_of,
    to_finger,
    within_reach,
)
from rhot_app.hand.solvers.inverse import follow_jacobian
from rhot_app.hand.solvers.newton import solve_exactly

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Problem:
    """Five fingers in their base frames (x along the first bone at zero angles, flexion about y, abduction about z).

    `lengths` (5, 3) m, the last bone only as far as the point to be placed; `limits` (21, 2) rad, low and high;
    `start` (21,) rad; `targets` (5, 3) m, NaN rows for fingers without one.
    """

    lengths: Array
    limits: Array
    start: Array
    targets: Array


@dataclass(frozen=True, slots=True)
class Solution:
    """`angles` (21,) rad, `residuals` (5,) m (NaN without a target), `iterations` (5,), `statuses` (5,) of Status,
    `handed_over` (5,) bool: limits stopped FABRIK, and Levenberg-Marquardt went on.

    `joints` (5, 4, 3) m in the base frames, root to the placed point: where the angles put them, but of a solver
    without angles (free FABRIK) its own, which the angles only approximate.
    """

    angles: Array
    residuals: Array
    iterations: NDArray[np.int64]
    statuses: NDArray[np.uint8]
    handed_over: NDArray[np.bool_]
    joints: Array


def make_problem(model: HandModel, start: HandPose, targets: Array) -> Problem:
    """The problem of bringing the marker centres of a hand in `start` to `targets` (5, 3) m, world."""
    local = np.empty((5, 3))
    for finger in range(5):
        to_finger(start.world_from_palm, model.mirror, model.base[finger], model.base_rotation[finger],
                  np.asarray(targets[finger], dtype=np.float64), local[finger])
    return Problem(model.chain, model.limits, np.array(start.angles, dtype=np.float64), local)


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
        low, high = FINGER_ANGLES[finger]
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
    iterations, moving = solve_chain(joints, target, tolerance, max_iterations)
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
