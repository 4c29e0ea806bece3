"""The iterated extended Kalman update: innovations, their covariance, and the step that weighs them.

Rehg's Gauss-Newton on all residuals at once (1995, 2.5), with what is known from before as one more residual. Arrays:
H (K, N) rows' Jacobians, P (N, N) covariance, R the rows' noise, block-diagonal by observation.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.linear import factorise
from rhot_app.tracking.kalman.rows import Rows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@njit(cache=True)
def spread(rows: Rows, covariance: Array, out: Array) -> None:
    """Fill `out` (K, N) with H P. Zeros of the Jacobian cost nothing."""
    size = covariance.shape[0]
    for k in range(rows.used[0]):
        target = out[k]
        target[:] = 0.0
        for j in range(size):
            factor = rows.jacobian[k, j]
            if factor != 0.0:
                source = covariance[j]
                for i in range(size):
                    target[i] += factor * source[i]


@njit(cache=True)
def expected_noise(rows: Rows, spread_rows: Array, observation: int) -> tuple[float, float, float]:
    """Innovation covariance of one observation: (uu, uv, vv); for a single row vv = 1 and uv = 0."""
    row = rows.first[observation]
    uu = rows.noise[row, 0] + _dot(spread_rows[row], rows.jacobian[row])
    if rows.first[observation + 1] - row < 2:
        return uu, 0.0, 1.0
    vv = rows.noise[row + 1, 0] + _dot(spread_rows[row + 1], rows.jacobian[row + 1])
    uv = rows.noise[row, 1] + _dot(spread_rows[row], rows.jacobian[row + 1])
    return uu, uv, vv


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(a.shape[0]):
        if b[i] != 0.0:
            total += a[i] * b[i]
    return total


@njit(cache=True)
def solve(rows: Rows, covariance: Array, believed: Mask, widening: Array, step: Array, gains: Array) -> int:
    """One Gauss-Newton step of the believed observations.

    `step` (N,): where the rows were linearised, as a displacement of the prior mean; becomes where the mean should
    be. `widening` (L,): factor on each observation's noise. Fills the first rows of `gains` (K, N) with the factor G
    of the posterior covariance P - G^T G, and returns how many.
    """
    size, capacity = covariance.shape[0], rows.used[0]
    chosen = np.empty(capacity, np.int64)
    owner = np.empty(capacity, np.int64)
    count = 0
    for observation in range(rows.used[1]):
        if believed[observation]:
            for row in range(rows.first[observation], rows.first[observation + 1]):
                chosen[count], owner[count] = row, observation
                count += 1
    if count == 0:
        return 0
    total, right = np.empty((count, count)), np.empty(count)
    for k in range(count):
        jacobian, target = rows.jacobian[chosen[k]], gains[k]
        target[:] = 0.0
        right[k] = rows.residual[chosen[k]]
        for j in range(size):
            factor = jacobian[j]
            if factor != 0.0:
                right[k] += factor * step[j]
                source = covariance[j]
                for i in range(size):
                    target[i] += factor * source[i]
    for k in range(count):
        for other in range(k + 1):
            value = _dot(gains[k], rows.jacobian[chosen[other]])
            if owner[k] == owner[other]:
                value += widening[owner[k]] * rows.noise[chosen[k], 0 if k == other else 1]
            total[k, other] = value
    factorise(total)
    for k in range(count):  # gains becomes L^-1 H P, right L^-1 times the innovation
        for other in range(k):
            factor = total[k, other]
            right[k] -= factor * right[other]
            for i in range(size):
                gains[k, i] -= factor * gains[other, i]
        inverse = 1.0 / total[k, k]
        right[k] *= inverse
        for i in range(size):
            gains[k, i] *= inverse
    step[:] = 0.0
    for k in range(count):
        for i in range(size):
            step[i] += right[k] * gains[k, i]
    return count


@njit(cache=True)
def contract(covariance: Array, gains: Array, count: int) -> None:
    """The posterior covariance P - G^T G in place of P; `gains` and `count` as `solve` leaves them."""
    size = covariance.shape[0]
    for k in range(count):
        row = gains[k]
        for i in range(size):
            factor, target = row[i], covariance[i]
            for j in range(size):
                target[j] -= factor * row[j]
