"""A jump is found where it was, none where there was none, and the covariance is that of least squares."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.estimation.change_point import ChangePoint, find_change

PARTS, SIZE = 12, 2
TIMES_S = 10.0 * np.arange(PARTS)
ODDS = np.full(PARTS + 1, np.log(1e-3))


def found(rng: np.random.Generator, step: np.ndarray, at: int, walk: float = 0.0) -> ChangePoint:
    """Twenty noisy observations of the state in each part; from part `at` on it is `step`."""
    matrices, vectors = np.empty((PARTS, SIZE, SIZE)), np.empty((PARTS, SIZE))
    for k in range(PARTS):
        jacobian = rng.normal(size=(20, SIZE))
        seen = jacobian @ (step if k >= at else np.zeros(SIZE)) + rng.normal(size=20)
        matrices[k], vectors[k] = jacobian.T @ jacobian, jacobian.T @ seen
    return find_change(np.full(SIZE, 1e-6), np.full(SIZE, 25.0), np.full(SIZE, walk), TIMES_S, matrices, vectors, ODDS)


@pytest.mark.parametrize("at", [0, 5, 11])
def test_a_jump_is_found_where_it_was(at: int) -> None:
    change = found(np.random.default_rng(at), np.array([2.0, -1.5]), at)
    assert change.part == at
    assert change.state == pytest.approx([2.0, -1.5], abs=4.0 * np.sqrt(change.covariance[0, 0]))
    assert change.before == pytest.approx([0.0, 0.0], abs=1e-2)
    assert np.diag(change.covariance) == pytest.approx(1.0 / (20.0 * (PARTS - at)), rel=0.8)


def test_no_jump_is_found_where_there_was_none() -> None:
    for seed in range(50):
        assert found(np.random.default_rng(seed), np.zeros(SIZE), PARTS).part == -1


def test_the_errors_are_as_large_as_stated() -> None:
    squares = []
    for seed in range(100):
        change = found(np.random.default_rng(seed), np.array([3.0, 3.0]), 4)
        away = change.state - 3.0
        squares.append(away @ np.linalg.solve(change.covariance, away))
    assert np.mean(squares) == pytest.approx(SIZE, abs=4.0 * np.sqrt(2.0 * SIZE / 100.0))


def test_what_is_not_observed_stays_as_uncertain_as_the_jump() -> None:
    matrices = np.zeros((PARTS, SIZE, SIZE))
    matrices[:, 0, 0] = 100.0
    vectors = np.zeros((PARTS, SIZE))
    vectors[:, 0] = 300.0
    change = find_change(np.full(SIZE, 1e-6), np.full(SIZE, 25.0), np.zeros(SIZE), TIMES_S, matrices, vectors, ODDS)
    assert change.part == 0 and change.covariance[1, 1] == pytest.approx(25.0, rel=1e-6)
