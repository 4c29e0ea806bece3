"""The iterated extended Kalman update: innovations, their covariance, and the step that weighs them.

Rehg's Gauss-Newton on all residuals at once (1995, 2.5), with what is known from before as one more residual. Arrays:
H (K, N) rows' Jacobians, P (N, N) covariance, R the rows' noise, block-diagonal by observation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.linear import factorise
from rhot_app.tracking.kalman.rows import Rows

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
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


class Gain(NamedTuple):
    """How an update weighed its rows. `used` (1,): believed rows, the first ones of the others. `rows` (K, N): the
    factor G of the posterior covariance P - G^T G, which is L^-1 H P; `jacobian` (K, N): H; `factor` (K, K): L, the
    Cholesky factor of the innovations' covariance."""

    used: Indices
    rows: Array
    jacobian: Array
    factor: Array


def empty_gain(rows: int, size: int) -> Gain:
    """Room for `rows` rows of a state with `size` numbers."""
    return Gain(np.zeros(1, np.int64), np.zeros((rows, size)), np.zeros((rows, size)), np.zeros((rows, rows)))


@njit(cache=True)
def solve(rows: Rows, covariance: Array, believed: Mask, widening: Array, step: Array, gain: Gain) -> None:
    """One Gauss-Newton step of the believed observations; fills `gain`.

    `step` (N,): where the rows were linearised, as a displacement of the prior mean; becomes where the mean should
    be. `widening` (L,): factor on each observation's noise.
    """
    size = covariance.shape[0]
    noise, right = np.empty((rows.used[0], 2)), np.empty(rows.used[0])
    count = _gather(rows, believed, widening, step, noise, right, gain)
    for k in range(count):
        gain.rows[k] = 0.0
        for j in range(size):
            slope = gain.jacobian[k, j]
            if slope != 0.0:
                for i in range(size):
                    gain.rows[k, i] += slope * covariance[j, i]
        for other in range(k + 1):
            gain.factor[k, other] = _dot(gain.rows[k], gain.jacobian[other])
        gain.factor[k, k] += noise[k, 0]
        if k > 0:
            gain.factor[k, k - 1] += noise[k, 1]
    factorise(gain.factor[:count, :count])
    for k in range(count):  # H P becomes L^-1 H P, the innovation L^-1 times itself
        for other in range(k):
            right[k] -= gain.factor[k, other] * right[other]
            for i in range(size):
                gain.rows[k, i] -= gain.factor[k, other] * gain.rows[other, i]
        right[k] /= gain.factor[k, k]
        for i in range(size):
            gain.rows[k, i] /= gain.factor[k, k]
    step[:] = 0.0
    for k in range(count):
        for i in range(size):
            step[i] += right[k] * gain.rows[k, i]


@njit(cache=True)
def _gather(rows: Rows, believed: Mask, widening: Array, step: Array, noise: Array, right: Array, gain: Gain) -> int:
    """Fill the believed rows' Jacobians, `noise` (K, 2) of each and with the row before, and innovations from the prior
    mean, `right` (K,); returns how many."""
    count = 0
    for observation in range(rows.used[1]):
        if believed[observation]:
            first = rows.first[observation]
            for row in range(first, rows.first[observation + 1]):
                gain.jacobian[count] = rows.jacobian[row]
                noise[count, 0] = widening[observation] * rows.noise[row, 0]
                noise[count, 1] = widening[observation] * rows.noise[row, 1] if row > first else 0.0
                right[count] = rows.residual[row] + _dot(step, rows.jacobian[row])
                count += 1
    gain.used[0] = count
    return count


@njit(cache=True)
def misfit(rows: Rows, believed: Mask, widening: Array) -> float:
    """The largest squared residual of a believed row, in units of its variance."""
    worst = 0.0
    for observation in range(rows.used[1]):
        if believed[observation]:
            for row in range(rows.first[observation], rows.first[observation + 1]):
                worst = max(worst, rows.residual[row] ** 2 / (widening[observation] * rows.noise[row, 0]))
    return worst


@njit(cache=True)
def contract(covariance: Array, gain: Gain) -> None:
    """The posterior covariance P - G^T G in place of P."""
    size = covariance.shape[0]
    for k in range(gain.used[0]):
        row = gain.rows[k]
        for i in range(size):
            factor, target = row[i], covariance[i]
            for j in range(size):
                target[j] -= factor * row[j]
