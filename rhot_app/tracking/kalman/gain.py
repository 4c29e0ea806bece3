"""The iterated extended Kalman update: innovations, their covariance, and the step that weighs them.

Rehg's Gauss-Newton on all residuals at once (1995, 2.5), with what is known from before as one more residual. Arrays:
H (K, N) rows' Jacobians, P (N, N) covariance, R the rows' noise, block-diagonal by observation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.linear import factorise
from rhot_app.lean import lean, room, slots
from rhot_app.tracking.kalman.combine import add_both, add_chosen, add_rows, add_squares, dot, fill, scale
from rhot_app.tracking.kalman.estimate import MOST_NUMBERS
from rhot_app.tracking.kalman.rows import ROWS_MAX, Rows

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

MOST_HELD = 64
"""Directions held at most (`withholding.py`): all fingers stiff, the palm held whole and the hand's size make 52."""


@lean
def expected_noise(rows: Rows, covariance: Array, out: Array) -> None:
    """Fill `out` (L, 3): innovation covariance of each observation, (uu, uv, vv); for a single row vv = 1, uv = 0."""
    chosen, weights = slots((MOST_NUMBERS,)), room((MOST_NUMBERS,))
    product = room((MOST_NUMBERS,))[:covariance.shape[0]]
    for observation in range(rows.used[1]):
        row, last = rows.first[observation], rows.first[observation + 1] - 1
        count = pick(rows.jacobian[row], chosen, weights)
        product[:] = 0.0
        add_chosen(product, weights, covariance, chosen[:count])
        out[observation, 0] = rows.noise[row, 0] + _at(product, chosen, weights, count)
        out[observation, 1], out[observation, 2] = 0.0, 1.0
        if last > row:
            count = pick(rows.jacobian[last], chosen, weights)
            out[observation, 1] = rows.noise[last, 1] + _at(product, chosen, weights, count)
            product[:] = 0.0
            add_chosen(product, weights, covariance, chosen[:count])
            out[observation, 2] = rows.noise[last, 0] + _at(product, chosen, weights, count)


@lean
def pick(row: Array, chosen: Indices, weights: Array) -> int:
    """Note which numbers of `row` (N,) are not zero, and them; returns how many. A marker's row has some 40 of 100."""
    count = 0
    for j in range(row.shape[0]):
        if row[j] != 0.0:
            chosen[count], weights[count] = j, row[j]
            count += 1
    return count


@lean
def _at(vector: Array, chosen: Indices, weights: Array, count: int) -> float:
    """The product of `vector` (N,) with a row that was picked."""
    total = 0.0
    for k in range(count):
        total += weights[k] * vector[chosen[k]]
    return total


class Gain(NamedTuple):
    """How an update weighed its rows.

    `used` (2,): how many directions are held (`withholding.py`), and these and the K believed rows together, T. `rows`
    (T, N): what the update takes from the covariance P, which less their squares is what would be left were the held
    directions known: first D, what is not known of these; then G = L^-1 H (P - D^T D), what is learnt. `jacobian`
    (K, N): H. `factor` (T, T): in its last K rows H D^T, and then L, the Cholesky factor of H (P - D^T D) H^T + R.
    `shares` (K, 64) and `into` (K, N): room for what is not known of the held directions and goes on into the others.
    """

    used: Indices
    rows: Array
    jacobian: Array
    factor: Array
    shares: Array
    into: Array


def empty_gain(rows: int, size: int) -> Gain:
    """Room for `rows` rows besides all directions that may be held, of a state with `size` numbers."""
    most = rows + MOST_HELD
    return Gain(np.zeros(2, np.int64), np.zeros((most, size)), np.zeros((rows, size)), np.zeros((most, most)),
                np.zeros((rows, MOST_HELD)), np.zeros((rows, size)))


@lean
def solve(rows: Rows, covariance: Array, believed: Mask, widening: Array, step: Array, gain: Gain) -> None:
    """One Gauss-Newton step of the believed observations; fills `gain`, all but what is held.

    `step` (N,): where the rows were linearised, as a displacement of the prior mean; becomes where the mean should
    be. `widening` (L,): factor on each observation's noise.
    """
    noise, right = room((ROWS_MAX, 2)), room((ROWS_MAX,))
    _gather(rows, believed, widening, step, noise, right, gain)
    project_rows(gain, covariance, noise)
    step[:] = 0.0
    add_step(gain, right, step)


@lean
def project_rows(gain: Gain, covariance: Array, noise: Array) -> None:
    """Fill the rows after the held ones, by their `gain.jacobian` and `noise` (K, 2), all but the whitening."""
    held, total = gain.used[0], gain.used[1]
    chosen, weights = slots((MOST_NUMBERS,)), room((MOST_NUMBERS,))
    for row in range(held, total):
        target, factor, k = gain.rows[row], gain.factor[row], row - held
        picked = pick(gain.jacobian[k], chosen, weights)
        target[:] = 0.0
        add_chosen(target, weights, covariance, chosen[:picked])
        for other in range(held):
            factor[other] = _at(gain.rows[other], chosen, weights, picked)
        add_rows(target, factor[:held], gain.rows, -1.0)
        for other in range(held, row + 1):
            factor[other] = _at(gain.rows[other], chosen, weights, picked)
        factor[row] += noise[k, 0]
        if k > 0:
            factor[row - 1] += noise[k, 1]
    factorise(gain.factor[held:total, held:total])


@lean
def add_step(gain: Gain, right: Array, step: Array) -> None:
    """Whiten the projected rows, H P becomes L^-1 H P; add to `step` (N,) what they make of the innovations `right`
    (K,), which become L^-1 times themselves."""
    held, total = gain.used[0], gain.used[1]
    for row in range(held, total):
        target, factor = gain.rows[row], gain.factor[row]
        for other in range(held, row):
            right[row - held] -= factor[other] * right[other - held]
        add_rows(target, factor[held:row], gain.rows[held:row], -1.0)
        right[row - held] /= factor[row]
        scale(target, 1.0 / factor[row])
    add_rows(step, right[:total - held], gain.rows[held:total], 1.0)


@lean
def _gather(rows: Rows, believed: Mask, widening: Array, step: Array, noise: Array, right: Array, gain: Gain) -> None:
    """Count the believed rows, fill their Jacobians, `noise` (K, 2) of each and with the row before, and innovations
    from the prior mean, `right` (K,)."""
    count = 0
    for observation in range(rows.used[1]):
        if believed[observation]:
            first = rows.first[observation]
            for row in range(first, rows.first[observation + 1]):
                fill(gain.jacobian[count], rows.jacobian[row])
                noise[count, 0] = widening[observation] * rows.noise[row, 0]
                noise[count, 1] = widening[observation] * rows.noise[row, 1] if row > first else 0.0
                right[count] = rows.residual[row] + dot(step, rows.jacobian[row])
                count += 1
    gain.used[1] = gain.used[0] + count


@lean
def misfit(rows: Rows, believed: Mask, widening: Array) -> float:
    """The largest squared residual of a believed row, in units of its variance."""
    worst = 0.0
    for observation in range(rows.used[1]):
        if believed[observation]:
            for row in range(rows.first[observation], rows.first[observation + 1]):
                worst = max(worst, rows.residual[row] ** 2 / (widening[observation] * rows.noise[row, 0]))
    return worst


@lean
def contract(covariance: Array, gain: Gain) -> None:
    """The posterior covariance in place of P.

    Of the held directions nothing is learnt, and what is not known of them goes on into the others by the gain that
    leaves them alone: Joseph's form, which is true of any gain, also of one that is not the best. With
    S = -L^-1 H D^T it is P - G^T G - D^T D + (D + S^T G)^T (D + S^T G), which is P + G^T Y + Y^T G with
    Y = S D + (S S^T - 1) G / 2.
    """
    held, total = gain.used[0], gain.used[1]
    learnt, count = gain.rows[held:total], total - held
    if held == 0:
        add_squares(covariance, learnt, -1.0)
        return
    square = room((ROWS_MAX,))
    for k in range(count):
        factor, share = gain.factor[held + k], gain.shares[k, :held]
        for other in range(held):
            share[other] = -factor[other]
        for other in range(k):
            for j in range(held):
                share[j] -= factor[held + other] * gain.shares[other, j]
        scale(share, 1.0 / factor[held + k])
    for k in range(count):
        into = gain.into[k]
        for other in range(count):
            square[other] = 0.5 * dot(gain.shares[k, :held], gain.shares[other, :held])
        square[k] -= 0.5
        into[:] = 0.0
        add_rows(into, gain.shares[k, :held], gain.rows, 1.0)
        add_rows(into, square[:count], learnt, 1.0)
    add_both(covariance, learnt, gain.into[:count])
