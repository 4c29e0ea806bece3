"""Levenberg-Marquardt on curved, robust, singular and walled costs; and robust linear fits."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.estimation.least_squares import Dense, fit_linear, minimise
from rhot_app.estimation.residual import UNIT, Kernel, Rows, student


def valley(state: np.ndarray) -> list[Rows]:
    """Rosenbrock's banana, whose minimum is at (1, 1)."""
    x, y = state
    return [Rows(np.array([10.0 * (x**2 - y), x - 1.0]), np.array([[-20.0 * x, 10.0], [-1.0, 0.0]]), UNIT)]


def test_a_curved_valley_is_followed_to_its_end() -> None:
    found, taken = minimise(Dense(np.array([-1.2, 1.0]), valley, np.add, 2), steps=100, least_gain=1e-20)
    assert found.state == pytest.approx([1.0, 1.0], abs=1e-8)
    assert 5 < taken < 60


def test_the_cost_never_rises_and_the_steps_are_counted() -> None:
    costs = []
    for steps in range(12):
        found, taken = minimise(Dense(np.array([-1.2, 1.0]), valley, np.add, 2), steps, least_gain=0.0)
        costs.append(found.cost)
        assert taken == steps
    assert (np.diff(costs) <= 0.0).all() and costs[-1] < costs[0]


def circle(noise: float, kernel: Kernel, wild: int = 0) -> tuple[np.ndarray, Dense[np.ndarray]]:
    """A start at the centre and radius of 200 points on a circle about (2, -1) of radius 3, some of them far off."""
    rng = np.random.default_rng(1)
    angles = rng.uniform(0.0, 2.0 * np.pi, 200)
    points = np.array([2.0, -1.0]) + 3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points += rng.normal(0.0, noise, points.shape)
    points[:wild] += 4.0

    def rows(state: np.ndarray) -> list[Rows]:
        away = points - state[:2]
        distance = np.linalg.norm(away, axis=1)
        jacobian = np.column_stack([away / distance[:, None], np.ones(len(points))])
        return [Rows(distance - state[2], jacobian, np.full(len(points), noise**2), kernel)]
    return points, Dense(np.array([1.0, 0.0, 1.0]), rows, np.add, 3)


@pytest.mark.parametrize("kernel", [student(2.0), student(4.0)])
def test_outliers_hardly_move_a_robust_minimum(kernel: Kernel) -> None:
    clean, _ = minimise(circle(0.01, kernel)[1], 100, 1e-10)
    dirty, _ = minimise(circle(0.01, kernel, wild=20)[1], 100, 1e-10)
    assert clean.state == pytest.approx([2.0, -1.0, 3.0], abs=3e-3)
    assert dirty.state == pytest.approx(clean.state, abs=6e-3)


def test_the_covariance_is_that_of_the_noise() -> None:
    found, _ = minimise(circle(0.01, Kernel())[1], 100, 1e-10)
    covariance = found.covariance()
    assert covariance is not None
    assert np.sqrt(np.diag(covariance)) == pytest.approx(0.01 * np.sqrt([2.0 / 200, 2.0 / 200, 1.0 / 200]), rel=0.2)


def test_what_no_residual_shows_stays_and_has_no_covariance() -> None:
    def rows(state: np.ndarray) -> list[Rows]:
        return [Rows(np.array([4.0 - state[0] - state[1]]), np.array([[1.0, 1.0, 0.0]]), UNIT)]
    found, _ = minimise(Dense(np.array([0.0, 0.0, 7.0]), rows, np.add, 3), 20, 1e-12)
    assert found.state == pytest.approx([2.0, 2.0, 7.0], abs=1e-6), "the shortest way"
    assert found.covariance() is None


def test_impossible_states_are_avoided() -> None:
    """The first undamped step of sqrt(x) = 0.1 from x = 4 leads below zero."""
    def rows(state: np.ndarray) -> list[Rows] | None:
        if state[0] <= 0.0:
            return None
        return [Rows(0.1 - np.sqrt(state), 0.5 / np.sqrt(state)[:, None], UNIT)]
    found, _ = minimise(Dense(np.array([4.0]), rows, np.add, 1), 50, 1e-16)
    assert found.state == pytest.approx([0.01], rel=1e-4)


def test_a_line_through_points_of_which_a_fifth_is_wrong() -> None:
    rng = np.random.default_rng(2)
    x = rng.uniform(-1.0, 1.0, (300, 2))
    columns = np.stack([x, np.ones_like(x)], axis=2)
    target = columns @ [2.0, 0.5] + rng.normal(0.0, 0.01, x.shape)
    target[:60] += 3.0
    solution, weights = fit_linear(columns, target, student(4.0), rounds=20, rcond=1e-9)
    assert solution == pytest.approx([2.0, 0.5], abs=5e-3)
    assert weights[:60].max() < 0.01 < 0.5 < np.median(weights[60:])
