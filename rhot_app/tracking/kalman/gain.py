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
from rhot_app.tracking.kalman.combine import add_rows, add_squares, dot
from rhot_app.tracking.kalman.rows import Rows

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


@njit(cache=True)
def expected_noise(rows: Rows, covariance: Array, out: Array) -> None:
    """Fill `out` (L, 3): innovation covariance of each observation, (uu, uv, vv); for a single row vv = 1, uv = 0."""
    size = covariance.shape[0]
    chosen, weights, product = np.empty(size, np.int64), np.empty(size), np.empty(size)
    for observation in range(rows.used[1]):
        row, last = rows.first[observation], rows.first[observation + 1] - 1
        count = _pick(rows.jacobian[row], chosen, weights)
        product[:] = 0.0
        add_rows(product, weights[:count], covariance, chosen[:count], 0)
        out[observation, 0] = rows.noise[row, 0] + _at(product, chosen, weights, count)
        out[observation, 1], out[observation, 2] = 0.0, 1.0
        if last > row:
            count = _pick(rows.jacobian[last], chosen, weights)
            out[observation, 1] = rows.noise[last, 1] + _at(product, chosen, weights, count)
            product[:] = 0.0
            add_rows(product, weights[:count], covariance, chosen[:count], 0)
            out[observation, 2] = rows.noise[last, 0] + _at(product, chosen, weights, count)


@njit(cache=True)
def _pick(row: Array, chosen: Indices, weights: Array) -> int:
    """Note which numbers of `row` (N,) are not zero, and them; returns how many. A marker's row has some 40 of 100."""
    count = 0
    for j in range(row.shape[0]):
        if row[j] != 0.0:
            chosen[count], weights[count] = j, row[j]
            count += 1
    return count


@njit(cache=True)
def _at(vector: Array, chosen: Indices, weights: Array, count: int) -> float:
    """The product of `vector` (N,) with a row that was picked."""
    total = 0.0
    for k in range(count):
        total += weights[k] * vector[chosen[k]]
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
    noise, right = np.empty((rows.used[0], 2)), np.empty(rows.used[0])
    count = _gather(rows, believed, widening, step, noise, right, gain)
    project_rows(gain, count, covariance, noise)
    whiten(gain, count, right)
    step[:] = 0.0
    add_rows(step, right[:count], gain.rows, np.arange(count), 0)


@njit(cache=True)
def project_rows(gain: Gain, count: int, covariance: Array, noise: Array) -> None:
    """Fill the first `count` of `gain.rows` with H P and of `gain.factor` with the Cholesky factor of H P H^T + R."""
    size = covariance.shape[0]
    chosen, weights = np.empty(size, np.int64), np.empty(size)
    for k in range(count):
        picked = _pick(gain.jacobian[k], chosen, weights)
        gain.rows[k] = 0.0
        add_rows(gain.rows[k], weights[:picked], covariance, chosen[:picked], 0)
        for other in range(k + 1):
            gain.factor[k, other] = _at(gain.rows[other], chosen, weights, picked)
        gain.factor[k, k] += noise[k, 0]
        if k > 0:
            gain.factor[k, k - 1] += noise[k, 1]
    factorise(gain.factor[:count, :count])


@njit(cache=True)
def whiten(gain: Gain, count: int, right: Array) -> None:
    """H P becomes L^-1 H P, the innovation `right` (K,) L^-1 times itself."""
    order = np.arange(count)
    for k in range(count):
        for other in range(k):
            right[k] -= gain.factor[k, other] * right[other]
        add_rows(gain.rows[k], -gain.factor[k, :k], gain.rows, order[:k], 0)
        right[k] /= gain.factor[k, k]
        gain.rows[k] /= gain.factor[k, k]


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
                right[count] = rows.residual[row] + dot(step, rows.jacobian[row])
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
    add_squares(covariance, gain.rows, gain.used[0], -1.0)
