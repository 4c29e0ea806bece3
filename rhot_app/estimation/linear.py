"""Small dense linear algebra for the solvers: no calls into LAPACK, whose overhead is larger than the work."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def factorise(matrix: Array) -> None:
    """Cholesky factor of a positive definite (n, n) matrix, in place in its lower triangle."""
    for i in range(matrix.shape[0]):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = math.sqrt(max(total, 1e-300)) if i == j else total / matrix[j, j]


@njit(cache=True)
def substitute(factor: Array, right: Array, out: Array) -> None:
    """Solve factor factor^T out = right; `factor` as `factorise` leaves it, `out` (n,) may be `right`."""
    count = right.shape[0]
    for i in range(count):
        total = right[i]
        for k in range(i):
            total -= factor[i, k] * out[k]
        out[i] = total / factor[i, i]
    for i in range(count - 1, -1, -1):
        total = out[i]
        for k in range(i + 1, count):
            total -= factor[k, i] * out[k]
        out[i] = total / factor[i, i]


@njit(cache=True)
def solve_in_box(matrix: Array, right: Array, low: Array, high: Array, out: Array) -> None:
    """Minimise x^T matrix x / 2 - right^T x within low <= x <= high, into `out` (n,).

    Active set: the variable that leaves its range farthest is fixed on its bound, one at a time; a fixed one that
    the gradient pulls back inside is freed again. It stops, within the range, after 4 n rounds at the latest.
    """
    count = right.shape[0]
    side = np.zeros(count, dtype=np.int8)  # -1 or 1: fixed on the low or high bound
    work, rest = np.empty((count, count)), np.empty(count)
    for _ in range(4 * count):
        for i in range(count):
            rest[i] = right[i]
            for j in range(i + 1):
                work[i, j] = matrix[i, j]
        for i in range(count):
            if side[i] != 0:
                bound = low[i] if side[i] < 0 else high[i]
                for j in range(count):
                    rest[j] -= matrix[j, i] * bound
                    if j < i:
                        work[i, j] = 0.0
                    elif j > i:
                        work[j, i] = 0.0
                work[i, i] = 1.0
        for i in range(count):
            if side[i] != 0:
                rest[i] = low[i] if side[i] < 0 else high[i]
        factorise(work)
        substitute(work, rest, out)
        worst, which = 0.0, -1
        for i in range(count):
            beyond = max(low[i] - out[i], out[i] - high[i])
            if side[i] == 0 and beyond > worst:
                worst, which = beyond, i
        if which >= 0:
            side[which] = -1 if out[which] < low[which] else 1
            continue
        for i in range(count):
            if side[i] != 0:
                slope = right[i]
                for j in range(count):
                    slope -= matrix[i, j] * out[j]
                if -side[i] * slope > worst:
                    worst, which = -side[i] * slope, i
        if which < 0:
            break
        side[which] = 0
    for i in range(count):
        out[i] = min(max(out[i], low[i]), high[i])
