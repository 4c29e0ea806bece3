"""One interface to the solvers of RHOT chapter 2.2 that meet each target exactly."""

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
from rhot_app.hand.solvers.finger_chain import MISSING, Solution, to_finger
from rhot_app.hand.solvers.inverse import follow_jacobian
from rhot_app.hand.solvers.newton import solve_exactly

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Problem:
    """Five fingers in their base frames (x along the first bone at zero angles, flexion about y, abduction about z).

    `lengths` (5, 3) m, the last bone only as far as the point to be placed, which lies `bends` (5,) rad beside the bone
    (`HandModel.chain_bend`); `limits` (21, 2) rad, low and high; `start` (21,) rad; `targets` (5, 3) m, NaN rows for
    fingers without one.
    """

    lengths: Array
    bends: Array
    limits: Array
    start: Array
    targets: Array


def make_problem(model: HandModel, start: HandPose, targets: Array) -> Problem:
    """The problem of bringing the marker centres of a hand in `start` to `targets` (5, 3) m, world."""
    local = np.empty((5, 3))
    for finger in range(5):
        to_finger(start.world_from_palm, model.mirror, model.base[finger], model.base_rotation[finger],
                  np.asarray(targets[finger], dtype=np.float64), local[finger])
    return Problem(model.chain, model.chain_bend, model.limits, np.array(start.angles, dtype=np.float64), local)


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


_SVD, _CLOSED_FORM = int(Method.SVD), int(Method.CLOSED_FORM)
_LAST = FINGER_ANGLES[:, 1] - 1  # of each finger's angles


class Effort(NamedTuple):
    """When a method stops: at `tolerance`, m, or after `max_iterations`."""

    tolerance: float
    max_iterations: int


EXACT = 1e-7
"""m: tolerance of all of them, a thousandth of what a marker is known to."""

EFFORT = {method: Effort(EXACT, 40) for method in Method} | {Method.TRANSPOSE: Effort(EXACT, 200)}


def solve(method: Method, problem: Problem, effort: Effort | None = None) -> Solution:
    """Solve the five fingers of `problem`; `effort` is the method's own from EFFORT unless told.

    Angles keep the problem's limits. A target out of reach leaves the finger stretched towards it as far as limits
    allow; the statuses tell.
    """
    angles, limits, residuals = problem.start.copy(), problem.limits.copy(), np.empty(5)
    angles[_LAST] += problem.bends
    limits[_LAST] += problem.bends[:, None]
    iterations, statuses = np.empty(5, dtype=np.int64), np.empty(5, dtype=np.uint8)
    solve_arrays(int(method), angles, problem.lengths, limits, problem.targets, effort or EFFORT[method],
                 residuals, iterations, statuses)
    angles[_LAST] -= problem.bends
    return Solution(angles, residuals, iterations, statuses)


@njit(cache=True)
def solve_arrays(method: int, angles: Array, lengths: Array, limits: Array, targets: Array, effort: Effort,
                 residuals: Array, iterations: NDArray[np.int64], statuses: NDArray[np.uint8]) -> None:
    """`solve` on arrays: `angles` (21,) in place, and every field of `Solution` filled."""
    tolerance, most = effort
    for finger in range(5):
        low, high = FINGER_ANGLES[finger]
        own, bones, box, target = angles[low:high], lengths[finger], limits[low:high], targets[finger]
        if math.isnan(target[0] + target[1] + target[2]):
            found = math.nan, 0, MISSING
        elif method == _CLOSED_FORM:
            found = solve_coupled(own, bones, box, target, tolerance)
        elif method <= _SVD:
            found = follow_jacobian(method, own, bones, box, target, tolerance, most)
        else:
            found = solve_exactly(method, own, bones, box, target, tolerance, most)
        residuals[finger], iterations[finger], statuses[finger] = found
