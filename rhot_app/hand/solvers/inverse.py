"""Solvers that follow the Jacobian step by step: its transpose, its pseudo-inverse, its SVD, damped least squares.

Each iteration asks for the step that cancels the error to first order. Joints that the step would take beyond their
limits stop there, and what they leave undone is asked of the others.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.linear import factorise, substitute
from rhot_app.hand.solvers.finger_chain import assign, clamp, linearise, norm, status_of

Array = NDArray[np.float64]

TRANSPOSE, PSEUDO_INVERSE, SVD, DAMPED = 0, 1, 2, 3

SMALLEST = 1e-12
"""Part of the trace of J J^T that keeps the pseudo-inverse's equations solvable where J loses rank."""

TRUNCATION = 0.005
"""Singular values below this part of the largest count as zero in the truncated SVD."""

DAMPING = 0.05
"""Square of the damping factor of damped least squares, in units of the error times the finger's length."""

STILL = 1e-9
"""A step shorter than this, rad, is none."""

PATIENCE = 12
"""Iterations without a smaller error after which a solver has stalled."""


@njit(cache=True)
def follow_jacobian(rule: int, angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                    max_iterations: int) -> tuple[float, int, int]:
    """One finger, in place on `angles` (4,) or (5,); returns residual, m, iterations and status.

    `rule`: TRANSPOSE, PSEUDO_INVERSE, SVD or DAMPED. The best angles on the way are the result: only the transpose
    and the damped step are sure to descend, and they only in steps that are short enough.
    """
    count = angles.shape[0]
    clamp(angles, limits)
    joints, jacobian, error = np.empty((4, 3)), np.empty((3, count)), np.empty(3)
    trial, step = np.empty(count), np.empty(count)
    assign(angles, trial)
    least, iterations, idle, moving = np.inf, 0, 0, True
    while True:
        residual = linearise(trial, lengths, target, joints, jacobian, error)
        idle = 0 if residual < 0.999 * least else idle + 1
        if residual < least:
            least = residual
            assign(trial, angles)
        if residual <= tolerance or iterations == max_iterations:
            break
        damping = DAMPING * residual * (lengths[0] + lengths[1] + lengths[2])
        _bounded_step(rule, damping, jacobian, error, trial, limits, step)
        largest = 0.0
        for k in range(count):
            trial[k] += step[k]
            largest = max(largest, abs(step[k]))
        clamp(trial, limits)
        iterations += 1
        if largest < STILL or idle >= PATIENCE:
            moving = False
            break
    return least, iterations, status_of(angles, lengths, limits, norm(target), least, tolerance, moving)


@njit(cache=True)
def _bounded_step(rule: int, damping: float, jacobian: Array, error: Array, angles: Array, limits: Array,
                  step: Array) -> None:
    """Fill `step` (n,): the rule's own, one joint after the other stopped at its limit and taken out of `jacobian`."""
    count = angles.shape[0]
    fixed, free = np.zeros(count), np.empty(count)
    stopped = np.zeros(count, dtype=np.bool_)
    for _ in range(count):
        _free_step(rule, damping, jacobian, error, free)
        worst, which = 0.0, -1
        for k in range(count):
            beyond = max(limits[k, 0] - angles[k] - free[k], angles[k] + free[k] - limits[k, 1])
            if not stopped[k] and beyond > worst:
                worst, which = beyond, k
        if which < 0:
            break
        stopped[which] = True
        fixed[which] = limits[which, 0 if free[which] < 0.0 else 1] - angles[which]
        for i in range(3):
            error[i] -= jacobian[i, which] * fixed[which]
            jacobian[i, which] = 0.0
    for k in range(count):
        step[k] = fixed[k] if stopped[k] else free[k]


@njit(cache=True)
def _free_step(rule: int, damping: float, jacobian: Array, error: Array, step: Array) -> None:
    """The step of a rule without limits."""
    if rule == TRANSPOSE:
        _transpose_step(jacobian, error, step)
    elif rule == SVD:
        svd_step(jacobian, error, TRUNCATION, step)
    else:
        damped_step(jacobian, error, damping if rule == DAMPED else 0.0, step)


@njit(cache=True)
def _transpose_step(jacobian: Array, error: Array, step: Array) -> None:
    """alpha J^T e (RHOT eq. 2.13), alpha = <e, J J^T e> / <J J^T e, J J^T e> (eq. 2.15)."""
    moved = np.zeros(3)
    for k in range(step.shape[0]):
        step[k] = 0.0
        for i in range(3):
            step[k] += jacobian[i, k] * error[i]
        for i in range(3):
            moved[i] += jacobian[i, k] * step[k]
    length = norm(moved)
    alpha = 0.0
    if length > 0.0:
        alpha = (error[0] * moved[0] + error[1] * moved[1] + error[2] * moved[2]) / length ** 2
    for k in range(step.shape[0]):
        step[k] *= alpha


@njit(cache=True)
def damped_step(jacobian: Array, error: Array, damping: float, step: Array) -> None:
    """J^T (J J^T + damping I)^-1 e, which equals (J^T J + damping I)^-1 J^T e (RHOT eq. 2.23) with a 3x3 matrix.

    Without damping it is the pseudo-inverse's step (eq. 2.16). Eq. 2.18 writes that with J^T J, which is singular for
    every finger: it has more joints than a position has coordinates.
    """
    count = step.shape[0]
    matrix, weights = np.zeros((3, 3)), np.empty(3)
    for i in range(3):
        for j in range(i + 1):
            for k in range(count):
                matrix[i, j] += jacobian[i, k] * jacobian[j, k]
    damping = max(damping, SMALLEST * (matrix[0, 0] + matrix[1, 1] + matrix[2, 2]) + 1e-30)
    for i in range(3):
        matrix[i, i] += damping
    factorise(matrix)
    substitute(matrix, error, weights)
    for k in range(count):
        step[k] = jacobian[0, k] * weights[0] + jacobian[1, k] * weights[1] + jacobian[2, k] * weights[2]


@njit(cache=True)
def svd_step(jacobian: Array, error: Array, truncation: float, step: Array) -> None:
    """V D^+ U^T e (RHOT eq. 2.20), singular values below `truncation` times the largest taken as zero.

    The rows of J are turned against each other until they are orthogonal (Hestenes 1958): U^T J = D V^T.
    """
    count = step.shape[0]
    rows, turned = np.empty((3, count)), np.empty(3)
    for i in range(3):
        turned[i] = error[i]
        for k in range(count):
            rows[i, k] = jacobian[i, k]
    for _ in range(8):
        rotated = False
        for p in range(2):
            for q in range(p + 1, 3):
                rotated |= _orthogonalise(rows, turned, p, q)
        if not rotated:
            break
    squares = np.zeros(3)
    for i in range(3):
        for k in range(count):
            squares[i] += rows[i, k] ** 2
    floor = truncation ** 2 * max(squares[0], squares[1], squares[2])
    for k in range(count):
        step[k] = 0.0
        for i in range(3):
            if squares[i] > floor:
                step[k] += rows[i, k] * turned[i] / squares[i]


@njit(cache=True)
def _orthogonalise(rows: Array, turned: Array, p: int, q: int) -> bool:
    """Turn the rows p and q of `rows` (3, n), and with them the places of `turned` (3,); whether that was needed."""
    aa, bb, ab = 0.0, 0.0, 0.0
    for k in range(rows.shape[1]):
        aa += rows[p, k] ** 2
        bb += rows[q, k] ** 2
        ab += rows[p, k] * rows[q, k]
    if abs(ab) <= 1e-14 * math.sqrt(aa * bb):
        return False
    zeta = (bb - aa) / (2.0 * ab)
    t = math.copysign(1.0, zeta) / (abs(zeta) + math.sqrt(1.0 + zeta ** 2))
    c = 1.0 / math.sqrt(1.0 + t ** 2)
    s = c * t
    for k in range(rows.shape[1]):
        rows[p, k], rows[q, k] = c * rows[p, k] - s * rows[q, k], s * rows[p, k] + c * rows[q, k]
    turned[p], turned[q] = c * turned[p] - s * turned[q], s * turned[p] + c * turned[q]
    return True
