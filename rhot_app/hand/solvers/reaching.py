"""FABRIK for fingers: free chains as published, and chains within joint limits that say when these stop them."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.fabrik import solve_chain_arrays
from rhot_app.hand.finger_chain import chain_points, distance, fabrik_within, miss
from rhot_app.hand.ik_status import EXHAUSTED, REACHED, STALLED, UNREACHABLE, status_of, within_reach
from rhot_app.hand.joint_angles import plane_angles, thumb_angles
from rhot_app.hand.solvers.problem import assign, clamp, norm

Array = NDArray[np.float64]

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
