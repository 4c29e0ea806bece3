"""Sums of weighted rows: what the covariance's algebra consists of, done so that the processor's vector units can."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@njit(cache=True, fastmath={"contract"})
def add_rows(target: Array, weights: Array, rows: Array, chosen: Indices) -> None:
    """Add to `target` (N,) the rows chosen (K,) of `rows` (R, N), times their `weights` (K,). Four rows at once: the
    target is read and written once for them."""
    size, count, k = target.shape[0], chosen.shape[0], 0
    while k + 4 <= count:
        a, b, c, d = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
        row_a, row_b, row_c, row_d = rows[chosen[k]], rows[chosen[k + 1]], rows[chosen[k + 2]], rows[chosen[k + 3]]
        for j in range(size):
            target[j] += a * row_a[j] + b * row_b[j] + c * row_c[j] + d * row_d[j]
        k += 4
    while k < count:
        a, row_a = weights[k], rows[chosen[k]]
        for j in range(size):
            target[j] += a * row_a[j]
        k += 1


@njit(cache=True, fastmath={"contract", "reassoc"})
def dot(a: Array, b: Array) -> float:
    """The product of two vectors, summed up in any order."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@njit(cache=True, fastmath={"contract"})
def add_products(matrix: Array, left: Array, right: Array) -> None:
    """Add to a symmetric `matrix` (N, N) left^T right, of two (K, N) whose product is symmetric; leaves it symmetric to
    the last bit.

    From the eight columns on in which the diagonal lies, and by slices: a loop that does not begin at zero is compiled
    with a test for negative indices, and so number by number. Two rows of the matrix at once: what is read of `right`
    serves both.
    """
    size, count = matrix.shape[0], left.shape[0]
    for i in range(0, size, 2):
        first, last = i - i % 8, min(i + 1, size - 1)
        for k in range(0, count - 3, 4):
            upper, lower = matrix[i, first:], matrix[last, first:]
            row_a, row_b = right[k, first:], right[k + 1, first:]
            row_c, row_d = right[k + 2, first:], right[k + 3, first:]
            a, b, c, d = left[k, i], left[k + 1, i], left[k + 2, i], left[k + 3, i]
            e, f, g, h = left[k, last], left[k + 1, last], left[k + 2, last], left[k + 3, last]
            for j in range(size - first):
                w, x, y, z = row_a[j], row_b[j], row_c[j], row_d[j]
                upper[j] += a * w + b * x + c * y + d * z
                if last > i:
                    lower[j] += e * w + f * x + g * y + h * z
        for k in range(count - count % 4, count):
            for row in range(i, last + 1):
                weight, target, source = left[k, row], matrix[row, first:], right[k, first:]
                for j in range(size - first):
                    target[j] += weight * source[j]
    mirror(matrix)


@njit(cache=True)
def add_squares(matrix: Array, rows: Array, sign: float) -> None:
    """Add to a symmetric `matrix` (N, N) sign G^T G, G being the `rows` (K, N); leaves it symmetric to the last bit."""
    add_products(matrix, sign * rows, rows)


@njit(cache=True)
def mirror(matrix: Array) -> None:
    """Copy what is above the diagonal of a square matrix below it."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            matrix[i, j] = matrix[j, i]
