"""Sums of weighted rows: what the covariance's algebra consists of, done so that the processor's vector units can."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, lean_fused, lean_summed

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@lean_fused
def add_rows(target: Array, weights: Array, rows: Array, sign: float) -> None:
    """Add to `target` (N,) all `rows` (K, N), times `sign` and their `weights` (K,). Four rows at once: the target is
    read and written once for them."""
    size, count, k = target.shape[0], weights.shape[0], 0
    while k + 4 <= count:
        a, b, c, d = sign * weights[k], sign * weights[k + 1], sign * weights[k + 2], sign * weights[k + 3]
        row_a, row_b, row_c, row_d = rows[k], rows[k + 1], rows[k + 2], rows[k + 3]
        for j in range(size):
            target[j] += a * row_a[j] + b * row_b[j] + c * row_c[j] + d * row_d[j]
        k += 4
    while k < count:
        a, row_a = sign * weights[k], rows[k]
        for j in range(size):
            target[j] += a * row_a[j]
        k += 1


@lean_fused
def add_chosen(target: Array, weights: Array, rows: Array, chosen: Indices) -> None:
    """The same with the rows chosen (K,) of `rows` (R, N)."""
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


@lean_summed
def dot(a: Array, b: Array) -> float:
    """The product of two vectors, summed up in any order."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@lean
def scale(target: Array, factor: float) -> None:
    """Multiply `target` (N,) by a factor."""
    for i in range(target.shape[0]):
        target[i] *= factor


@lean
def fill(target: Array, source: Array) -> None:
    """Copy `source` (N,) into `target` (N,)."""
    for i in range(target.shape[0]):
        target[i] = source[i]


@lean_fused
def add_squares(matrix: Array, rows: Array, sign: float) -> None:
    """Add to a symmetric `matrix` (N, N) sign G^T G, G being the `rows` (K, N); leaves it symmetric to the last bit.

    From the eight columns on in which the diagonal lies, and by slices: a loop that does not begin at zero is compiled
    with a test for negative indices, and so number by number. Two rows of the matrix at once: what is read of `rows`
    serves both.
    """
    size, count = matrix.shape[0], rows.shape[0]
    for i in range(0, size, 2):
        first, last = i - i % 8, min(i + 1, size - 1)
        upper, lower = matrix[i, first:], matrix[last, first:]
        for k in range(0, count - 3, 4):
            row_a, row_b = rows[k, first:], rows[k + 1, first:]
            row_c, row_d = rows[k + 2, first:], rows[k + 3, first:]
            a, b, c, d = sign * rows[k, i], sign * rows[k + 1, i], sign * rows[k + 2, i], sign * rows[k + 3, i]
            e, f = sign * rows[k, last], sign * rows[k + 1, last]
            g, h = sign * rows[k + 2, last], sign * rows[k + 3, last]
            for j in range(size - first):
                w, x, y, z = row_a[j], row_b[j], row_c[j], row_d[j]
                upper[j] += a * w + b * x + c * y + d * z
                if last > i:
                    lower[j] += e * w + f * x + g * y + h * z
        for k in range(count - count % 4, count):
            row_a, a, e = rows[k, first:], sign * rows[k, i], sign * rows[k, last]
            for j in range(size - first):
                upper[j] += a * row_a[j]
                if last > i:
                    lower[j] += e * row_a[j]
    mirror(matrix)


@lean_fused
def add_both(matrix: Array, one: Array, other: Array) -> None:
    """Add to a symmetric `matrix` (N, N) A^T B + B^T A, of `one` and `other` (K, N); leaves it symmetric to the last
    bit. Row by row as `add_squares` does."""
    size, count = matrix.shape[0], one.shape[0]
    for i in range(0, size, 2):
        first, last = i - i % 8, min(i + 1, size - 1)
        upper, lower = matrix[i, first:], matrix[last, first:]
        for k in range(0, count - 1, 2):
            row_a, row_b, row_c, row_d = one[k, first:], other[k, first:], one[k + 1, first:], other[k + 1, first:]
            a, b, c, d = other[k, i], one[k, i], other[k + 1, i], one[k + 1, i]
            e, f, g, h = other[k, last], one[k, last], other[k + 1, last], one[k + 1, last]
            for j in range(size - first):
                w, x, y, z = row_a[j], row_b[j], row_c[j], row_d[j]
                upper[j] += a * w + b * x + c * y + d * z
                if last > i:
                    lower[j] += e * w + f * x + g * y + h * z
        for k in range(count - count % 2, count):
            row_a, row_b = one[k, first:], other[k, first:]
            a, b, e, f = other[k, i], one[k, i], other[k, last], one[k, last]
            for j in range(size - first):
                upper[j] += a * row_a[j] + b * row_b[j]
                if last > i:
                    lower[j] += e * row_a[j] + f * row_b[j]
    mirror(matrix)


@lean
def mirror(matrix: Array) -> None:
    """Copy what is above the diagonal of a square matrix below it."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            matrix[i, j] = matrix[j, i]
