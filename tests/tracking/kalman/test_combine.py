"""Sums of rows against plain numpy."""

import numpy as np
import pytest

from rhot_app.tracking.kalman.combine import add_both, add_chosen, add_rows, add_squares, dot, mirror

RNG = np.random.default_rng(4)


@pytest.mark.parametrize("count", [0, 1, 3, 4, 9])
def test_rows_are_added_with_their_weights(count):
    rows, weights, chosen = RNG.normal(size=(12, 23)), RNG.normal(size=count), RNG.permutation(12)[:count]
    target = RNG.normal(size=23)
    expected = target + weights @ rows[chosen]
    add_chosen(target, weights, rows, chosen)
    np.testing.assert_allclose(target, expected, atol=1e-14)
    expected -= weights @ rows[:count]
    add_rows(target, weights, rows, -1.0)
    np.testing.assert_allclose(target, expected, atol=1e-14)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_squares_are_added_and_what_was_nearly_symmetric_is_symmetric(sign):
    rows, matrix = RNG.normal(size=(7, 23)), np.eye(23)
    matrix[3, 11] += 1e-15
    expected = matrix + sign * rows[:5].T @ rows[:5]
    add_squares(matrix, rows[:5], sign)
    np.testing.assert_allclose(matrix, expected, atol=1e-13)
    np.testing.assert_array_equal(matrix, matrix.T)


@pytest.mark.parametrize("size", [1, 2, 7, 16, 23])
@pytest.mark.parametrize("count", [0, 1, 4, 6])
def test_a_symmetric_product_is_added(size, count):
    one, other = RNG.normal(size=(2, count, size))
    matrix = np.diag(RNG.random(size))
    expected = matrix + one.T @ other + other.T @ one
    add_both(matrix, one, other)
    np.testing.assert_allclose(matrix, expected, atol=1e-13)
    np.testing.assert_array_equal(matrix, matrix.T)


def test_the_lower_half_becomes_the_upper_ones_mirror_image():
    matrix = RNG.normal(size=(9, 9))
    upper = np.triu(matrix)
    mirror(matrix)
    np.testing.assert_array_equal(matrix, upper + upper.T - np.diag(np.diag(upper)))


def test_dot_is_the_product():
    a, b = RNG.normal(size=(2, 101))
    assert dot(a, b) == pytest.approx(a @ b, abs=1e-12)
