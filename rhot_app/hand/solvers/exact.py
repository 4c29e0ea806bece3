"""Descents that begin again where limits or a local minimum stop them: the solvers that meet what can be met."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.ik_status import REACHED, UNREACHABLE
from rhot_app.hand.solvers.closed_form import solve_coupled
from rhot_app.hand.solvers.inverse import DAMPED, follow_jacobian
from rhot_app.hand.solvers.newton import descend
from rhot_app.hand.solvers.problem import assign

Array = NDArray[np.float64]

NEWTON, LEVENBERG = 4, 5
"""With inverse.DAMPED the descents to choose from."""

RESTARTS = (0.5, 0.5, 0.25, 0.05, 0.95)
"""Parts of the joints' ranges from which to begin again; the first gives way to the closed form."""


@njit(cache=True)
def solve_exactly(rule: int, angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[float, int, int]:
    """One finger, in place on `angles` (4,) or (5,); returns residual, m, iterations in all, and status.

    `rule`: DAMPED, NEWTON or LEVENBERG. What stops short of a target within the finger's length begins again: from
    the closed form of the coupled finger, the middle of the range, and near both its ends. The nearest end of
    all is the result.
    """
    trial = np.empty(angles.shape[0])
    assign(angles, trial)
    iterations, residual, status = 0, np.inf, REACHED
    for attempt in range(1 + len(RESTARTS)):
        if attempt > 0:
            for k in range(angles.shape[0]):
                trial[k] = limits[k, 0] + RESTARTS[attempt - 1] * (limits[k, 1] - limits[k, 0])
        if attempt == 1:
            assign(angles, trial)
            solve_coupled(trial, lengths, limits, target, tolerance)
        if rule == DAMPED:
            missed, taken, ended = follow_jacobian(DAMPED, trial, lengths, limits, target, tolerance, max_iterations)
        else:
            missed, taken, ended = descend(rule == NEWTON, trial, lengths, limits, target, tolerance, max_iterations)
        iterations += taken
        if missed < residual:
            residual, status = missed, ended
            assign(trial, angles)
        if status in (REACHED, UNREACHABLE):
            break
    return residual, iterations, status
