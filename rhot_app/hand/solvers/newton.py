"""Newton's method on the squared distance to the target (RHOT 2.2.6), and Levenberg-Marquardt, within joint limits.

Both minimise a quadratic model of the distance within the box of the limits. Newton's model has the exact Hessian
(eq. 2.24), whose second derivatives a chain of joints gives for little; Levenberg-Marquardt leaves them out. Where
the distance does not fall as the model promised, the model is damped more.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.linear import solve_in_box
from rhot_app.hand.solvers.closed_form import solve_coupled
from rhot_app.hand.solvers.finger_chain import REACHED, UNREACHABLE, assign, clamp, linearise, norm, status_of
from rhot_app.hand.solvers.inverse import DAMPED, follow_jacobian

Array = NDArray[np.float64]

STEP_MAX = 0.8
"""Largest change of an angle in one step, rad."""

STILL = 1e-10
"""Steps shorter than this, rad, are none."""

FLOOR = 1e-9
"""Least damping, as a part of the mean diagonal of J^T J: a finger has more joints than its target has coordinates."""


@njit(cache=True)
def descend_finger(second_order: bool, angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                   max_iterations: int) -> tuple[float, int, int]:
    """One finger, in place on `angles` (4,) or (5,); returns residual, m, iterations, and status.

    Newton with the `second_order`, Levenberg-Marquardt without. It is not `estimation.least_squares.descend`: damping
    by the squared error is calmer at the stretched pose, and takes half the time (`python benchmarks/solvers.py`).
    """
    count = angles.shape[0]
    clamp(angles, limits)
    joints, jacobian, error = np.empty((4, 3)), np.empty((3, count)), np.empty(3)
    matrix, damped, right = np.empty((count, count)), np.empty((count, count)), np.empty(count)
    step, low, high, trial = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    residual = linearise(angles, lengths, target, joints, jacobian, error)
    reach = lengths[0] + lengths[1] + lengths[2]
    iterations, factor, moving = 0, 1.0, True
    while residual > tolerance and iterations < max_iterations and moving:
        scale = _normal_equations(second_order, angles, jacobian, error, matrix, right)
        for k in range(count):
            low[k] = max(limits[k, 0] - angles[k], -STEP_MAX)
            high[k] = min(limits[k, 1] - angles[k], STEP_MAX)
        moving = False
        for _ in range(12):
            # Damping that falls with the square of the error leaves the last steps undamped (Sugihara 2011).
            damping = factor * (residual / reach) ** 2 * scale + FLOOR * scale
            _add_damping(matrix, damping, scale if second_order else 0.0, damped)
            solve_in_box(damped, right, low, high, step)
            largest = 0.0
            for k in range(count):
                trial[k] = angles[k] + step[k]
                largest = max(largest, abs(step[k]))
            if largest < STILL:
                break
            missed = linearise(trial, lengths, target, joints, jacobian, error)
            if missed < residual:
                moving = largest > STILL and residual - missed > 1e-9 * residual
                factor = max(0.3 * factor, 1e-3)
                residual = missed
                assign(trial, angles)
                break
            factor = 6.0 * max(factor, 1e-2)
        iterations += 1
        clamp(angles, limits)
    return residual, iterations, status_of(angles, lengths, limits, norm(target), residual, tolerance, moving)


@njit(cache=True)
def _normal_equations(second_order: bool, angles: Array, jacobian: Array, error: Array, matrix: Array,
                      right: Array) -> float:
    """Fill the Hessian `matrix` (n, n) of half the squared distance and `right`, its downhill gradient; returns the
    mean diagonal of J^T J."""
    count = angles.shape[0]
    scale = 0.0
    for i in range(count):
        right[i] = jacobian[0, i] * error[0] + jacobian[1, i] * error[1] + jacobian[2, i] * error[2]
        for j in range(count):
            matrix[i, j] = (jacobian[0, i] * jacobian[0, j] + jacobian[1, i] * jacobian[1, j]
                            + jacobian[2, i] * jacobian[2, j])
        scale += matrix[i, i] / count
    if second_order:
        _add_curvature(angles, jacobian, error, matrix)
    return scale


@njit(cache=True)
def _add_curvature(angles: Array, jacobian: Array, error: Array, matrix: Array) -> None:
    """Subtract e . d2s / dtheta_i dtheta_j = e . (v_i x J_j), v_i the axis of the joint nearer to the root."""
    count = angles.shape[0]
    axes = np.empty((count, 3))
    chain_axes(angles, axes)
    for i in range(count):
        # e . (v x J) = J . (e x v)
        x = error[1] * axes[i, 2] - error[2] * axes[i, 1]
        y = error[2] * axes[i, 0] - error[0] * axes[i, 2]
        z = error[0] * axes[i, 1] - error[1] * axes[i, 0]
        for j in range(i, count):
            bend = x * jacobian[0, j] + y * jacobian[1, j] + z * jacobian[2, j]
            matrix[i, j] -= bend
            if j > i:
                matrix[j, i] -= bend


@njit(cache=True)
def chain_axes(angles: Array, axes: Array) -> None:
    """Fill `axes` (n, 3): the unit axis of every joint in the finger's base frame, as `finger_chain` turns it."""
    ca, sa, cf, sf = math.cos(angles[0]), math.sin(angles[0]), math.cos(angles[1]), math.sin(angles[1])
    axes[0, 0], axes[0, 1], axes[0, 2] = 0.0, 0.0, 1.0
    axes[1, 0], axes[1, 1], axes[1, 2] = -sa, ca, 0.0
    x, y, z = -sa, ca, 0.0
    if angles.shape[0] == 5:
        cb, sb = math.cos(angles[2]), math.sin(angles[2])
        axes[2, 0], axes[2, 1], axes[2, 2] = ca * sf, sa * sf, cf
        x, y, z = -cb * sa - sb * ca * cf, cb * ca - sb * sa * cf, sb * sf
    for k in range(angles.shape[0] - 2, angles.shape[0]):
        axes[k, 0], axes[k, 1], axes[k, 2] = x, y, z


@njit(cache=True)
def _add_damping(matrix: Array, damping: float, scale: float, damped: Array) -> None:
    """Fill `damped` with `matrix`, its diagonal raised by `damping`; by more, until it is positive definite, when
    `scale`, the size of its elements, is not zero."""
    for _ in range(20):
        for i in range(matrix.shape[0]):
            assign(matrix[i], damped[i])
            damped[i, i] += damping
        if scale == 0.0 or _positive(damped, 1e-10 * scale):
            break
        damping = 4.0 * max(damping, 1e-4 * scale)


@njit(cache=True)
def _positive(matrix: Array, least: float) -> bool:
    """Whether every pivot of the symmetric `matrix` (n, n) is at least `least`."""
    size = matrix.shape[0]
    work = np.empty((size, size))
    for i in range(size):
        assign(matrix[i], work[i])
    for i in range(size):
        if work[i, i] < least:
            return False
        for j in range(i + 1, size):
            share = work[j, i] / work[i, i]
            for k in range(i + 1, size):
                work[j, k] -= share * work[i, k]
    return True


# -- restarts at limits and local minima -------------------------------------------------------------------------------

NEWTON, LEVENBERG = 4, 5
"""With inverse.DAMPED the descents to choose from."""

RESTARTS = (0.5, 0.0, 1.0)
"""Parts of the joints' ranges from which to begin again, after the closed form."""


@njit(cache=True)
def solve_exactly(rule: int, angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[float, int, int]:
    """One finger, in place on `angles` (4,) or (5,); returns residual, m, iterations in all, and status.

    `rule`: DAMPED, NEWTON or LEVENBERG. What stops short of a target within the finger's length begins again: from
    the closed form of the coupled finger, the middle of the range, and both its ends. The nearest end of
    all is the result.
    """
    trial = np.empty(angles.shape[0])
    assign(angles, trial)
    iterations, residual, status = 0, np.inf, REACHED
    for attempt in range(2 + len(RESTARTS)):
        if attempt == 1:
            assign(angles, trial)
            solve_coupled(trial, lengths, limits, target, tolerance)
        elif attempt > 1:
            for k in range(angles.shape[0]):
                trial[k] = limits[k, 0] + RESTARTS[attempt - 2] * (limits[k, 1] - limits[k, 0])
        if rule == DAMPED:
            missed, taken, ended = follow_jacobian(DAMPED, trial, lengths, limits, target, tolerance, max_iterations)
        else:
            missed, taken, ended = descend_finger(rule == NEWTON, trial, lengths, limits, target, tolerance,
                                                  max_iterations)
        iterations += taken
        if missed < residual:
            residual, status = missed, ended
            assign(trial, angles)
        if status in (REACHED, UNREACHABLE):
            break
    return residual, iterations, status
