"""The small solvers against numpy and scipy."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from rhot_app.estimation.linear import factorise, solve_in_box, substitute


def _positive(rng, count):
    half = rng.normal(size=(count + 2, count))
    return half, half.T @ half


@pytest.mark.parametrize("count", [1, 4, 27])
def test_cholesky_solves(count):
    rng = np.random.default_rng(count)
    _, matrix = _positive(rng, count)
    right, out, factor = rng.normal(size=count), np.empty(count), matrix.copy()
    factorise(factor)
    substitute(factor, right, out)
    np.testing.assert_allclose(out, np.linalg.solve(matrix, right), rtol=1e-6)


@pytest.mark.parametrize("count", [2, 5, 12])
def test_box_constrained_minimum_matches_scipy(count):
    rng = np.random.default_rng(count)
    for _ in range(50):
        half, matrix = _positive(rng, count)
        goal = rng.normal(size=count + 2)
        low, high = -rng.uniform(0.0, 0.5, count), rng.uniform(0.05, 0.5, count)
        out = np.empty(count)
        solve_in_box(matrix, half.T @ goal, low, high, out)
        expected = lsq_linear(half, goal, (low, high), method="bvls", tol=1e-12).x
        np.testing.assert_allclose(out, expected, atol=1e-6)
