"""The descent of the palm fit: palm twist and joint angles together, by Levenberg-Marquardt, on arrays in place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import TWIST, forward_arrays, jacobian_arrays, move, rotation_vector
from rhot_app.hand.linear import factorise, solve_in_box, substitute
from rhot_app.hand.skeleton import ANGLES, JOINTS

Array = NDArray[np.float64]

WRIST_SD = 1.0e-3
TIP_SD = 1.5e-3
"""Standard deviations of the markers' positions, m: measurement, and what the model's bones get wrong."""

ROTATION_DRIFT = 0.6
ANGLE_DRIFT = 0.8
TRANSLATION_DRIFT = 0.15
"""Random walks of palm rotation and joint angles, rad/sqrt(s), and of the palm's place, m/sqrt(s): standard
deviations of the change since the previous pose. A walk weighs the past alike at every frame rate."""

STEP_MAX = 0.6
"""Largest change of a rotation or angle in one step, rad."""

SIZE = TWIST + len(ANGLES)
FIRST_MARKER = len(JOINTS)


@njit(cache=True)
def descend_arrays(dh: DhArrays, limits: Array, mean: Array, information: Array, wrist: Array, tips: Array,
                   previous_world: Array, previous_angles: Array, dt: float, steps: int, world: Array,
                   angles: Array) -> bool:
    """Levenberg-Marquardt from `world` (4, 4) and `angles` (21,), in place; dt is inf without a previous pose.

    Returns whether the last step was small. Unknowns: palm twist in world axes (see kinematics.TWIST), then the
    angles.
    """
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((dh.point_row.shape[0], 3))
    jacobian = np.empty((points.shape[0], 3, SIZE))
    matrix, damped, right = np.empty((SIZE, SIZE)), np.empty((SIZE, SIZE)), np.empty(SIZE)
    low, high, step = np.empty(SIZE), np.empty(SIZE), np.empty(SIZE)
    trial_world, trial_angles = world.copy(), angles.copy()
    forward_arrays(dh, world, angles, frames, points)
    cost = _cost(points, world, angles, mean, information, wrist, tips, previous_world, previous_angles, dt)
    damping, converged = 1e-4, False
    for _ in range(steps):
        jacobian_arrays(dh, world, frames, points, jacobian)
        _normal_equations(points, jacobian, world, angles, mean, information, wrist, tips, previous_world,
                          previous_angles, dt, matrix, right)
        for i in range(SIZE):
            low[i], high[i] = -STEP_MAX, STEP_MAX
            if i >= TWIST:
                low[i] = max(low[i], min(limits[i - TWIST, 0] - angles[i - TWIST], 0.0))
                high[i] = min(high[i], max(limits[i - TWIST, 1] - angles[i - TWIST], 0.0))
        accepted = False
        for _ in range(6):
            damped[:] = matrix
            for i in range(SIZE):
                damped[i, i] *= 1.0 + damping
            solve_in_box(damped, right, low, high, step)
            move(world, angles, step, trial_world, trial_angles)
            forward_arrays(dh, trial_world, trial_angles, frames, points)
            trial_cost = _cost(points, trial_world, trial_angles, mean, information, wrist, tips, previous_world,
                               previous_angles, dt)
            if trial_cost <= cost:
                accepted = True
                break
            damping = max(10.0 * damping, 1e-3)
        if not accepted:
            converged = True
            break
        gain, cost = cost - trial_cost, trial_cost
        world[:], angles[:] = trial_world, trial_angles
        damping = max(0.1 * damping, 1e-9)
        if np.abs(step).max() < 1e-4 or gain < 1e-5 * (1.0 + cost):
            converged = True
            break
    return converged


@njit(cache=True)
def judge_arrays(dh: DhArrays, world: Array, angles: Array, mean: Array, information: Array, wrist: Array,
           tips: Array) -> tuple[float, float]:
    """Cost and rotation's standard deviation without the previous pose, whose error is not independent."""
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((dh.point_row.shape[0], 3))
    jacobian = np.empty((points.shape[0], 3, SIZE))
    matrix, right = np.empty((SIZE, SIZE)), np.empty(SIZE)
    forward_arrays(dh, world, angles, frames, points)
    cost = _cost(points, world, angles, mean, information, wrist, tips, world, angles, np.inf)
    jacobian_arrays(dh, world, frames, points, jacobian)
    _normal_equations(points, jacobian, world, angles, mean, information, wrist, tips, world, angles, np.inf, matrix,
                      right)
    for i in range(3):  # without wrist the tips may not fix the place: keep the matrix invertible
        matrix[i, i] += 1.0
        matrix[i + 3, i + 3] += 1.0 / math.pi ** 2
    factorise(matrix)
    variance = 0.0
    for axis in range(3, TWIST):
        right[:] = 0.0
        right[axis] = 1.0
        substitute(matrix, right, right)
        variance += right[axis]
    return cost, math.sqrt(variance)


@njit(cache=True)
def _cost(points: Array, world: Array, angles: Array, mean: Array, information: Array, wrist: Array, tips: Array,
          previous_world: Array, previous_angles: Array, dt: float) -> float:
    total = 0.0
    for marker in range(6):
        point = points[0] if marker == 5 else points[FIRST_MARKER + marker]
        measured = wrist if marker == 5 else tips[marker]
        deviation = WRIST_SD if marker == 5 else TIP_SD
        if not math.isnan(measured[0] + measured[1] + measured[2]):
            for i in range(3):
                total += ((point[i] - measured[i]) / deviation) ** 2
    for i in range(angles.shape[0]):
        for j in range(angles.shape[0]):
            total += (angles[i] - mean[i]) * information[i, j] * (angles[j] - mean[j])
    if dt < np.inf:
        turn = rotation_vector(world, previous_world)
        for i in range(3):
            total += (turn[i] / (ROTATION_DRIFT * math.sqrt(dt))) ** 2
            total += ((world[i, 3] - previous_world[i, 3]) / (TRANSLATION_DRIFT * math.sqrt(dt))) ** 2
        for i in range(angles.shape[0]):
            total += ((angles[i] - previous_angles[i]) / (ANGLE_DRIFT * math.sqrt(dt))) ** 2
    return 0.5 * total


@njit(cache=True)
def _normal_equations(points: Array, jacobian: Array, world: Array, angles: Array, mean: Array, information: Array,
                      wrist: Array, tips: Array, previous_world: Array, previous_angles: Array, dt: float,
                      matrix: Array, right: Array) -> None:
    """Fill the Gauss-Newton `matrix` (27, 27) and `right` (27,), the negative gradient of `_cost`."""
    count = angles.shape[0]
    matrix[:], right[:] = 0.0, 0.0
    for i in range(count):
        for j in range(count):
            matrix[TWIST + i, TWIST + j] = information[i, j]
            right[TWIST + i] += information[i, j] * (mean[j] - angles[j])
    for marker in range(6):
        row = 0 if marker == 5 else FIRST_MARKER + marker
        measured = wrist if marker == 5 else tips[marker]
        weight = 1.0 / (WRIST_SD if marker == 5 else TIP_SD) ** 2
        if math.isnan(measured[0] + measured[1] + measured[2]):
            continue
        first, last = 0, 0  # this finger's columns; all others but the twist's are zero
        if marker < 5:
            first, last = (TWIST if marker == 0 else TWIST + 1 + 4 * marker), TWIST + 5 + 4 * marker
        for i in range(3):
            _add_residual(jacobian[row, i], measured[i] - points[row, i], weight, first, last, matrix, right)
    if dt < np.inf:
        turn = rotation_vector(world, previous_world)
        for i in range(3):
            _pull(i, previous_world[i, 3] - world[i, 3], TRANSLATION_DRIFT * math.sqrt(dt), matrix, right)
            _pull(3 + i, -turn[i], ROTATION_DRIFT * math.sqrt(dt), matrix, right)
        for i in range(count):
            _pull(TWIST + i, previous_angles[i] - angles[i], ANGLE_DRIFT * math.sqrt(dt), matrix, right)


@njit(cache=True)
def _add_residual(slope: Array, residual: float, weight: float, first: int, last: int, matrix: Array,
                  right: Array) -> None:
    """Add one residual whose Jacobian row is zero but for the twist and the columns first..last."""
    for i in range(TWIST):
        right[i] += weight * slope[i] * residual
        for j in range(TWIST):
            matrix[i, j] += weight * slope[i] * slope[j]
    for i in range(first, last):
        right[i] += weight * slope[i] * residual
        for j in range(TWIST):
            cross = weight * slope[i] * slope[j]
            matrix[i, j] += cross
            matrix[j, i] += cross
        for j in range(first, last):
            matrix[i, j] += weight * slope[i] * slope[j]


@njit(cache=True)
def _pull(column: int, residual: float, deviation: float, matrix: Array, right: Array) -> None:
    matrix[column, column] += 1.0 / deviation ** 2
    right[column] += residual / deviation ** 2
