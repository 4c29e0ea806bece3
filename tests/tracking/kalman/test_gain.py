"""The update against the textbook's, in plain numpy."""

import numpy as np
import pytest

from rhot_app.tracking.kalman.gain import contract, empty_gain, expected_noise, misfit, solve
from rhot_app.tracking.kalman.rows import empty_rows

SIZE = 40
SIZES = (2, 2, 1, 2, 1, 2)  # rows of each observation


def case(seed=3):
    """Rows, covariance, and the block-diagonal noise of the rows."""
    rng = np.random.default_rng(seed)
    count = sum(SIZES)
    rows, noise = empty_rows(SIZE), np.zeros((count, count))
    rows.used[:] = count, len(SIZES)
    rows.first[:len(SIZES) + 1] = np.concatenate([[0], np.cumsum(SIZES)])
    rows.residual[:count] = rng.normal(size=count)
    rows.jacobian[:count] = rng.normal(size=(count, SIZE)) * (rng.random((count, SIZE)) < 0.4)
    for observation, size in enumerate(SIZES):
        own = slice(rows.first[observation], rows.first[observation] + size)
        root = rng.normal(size=(size, size)) + 2.0 * np.eye(size)
        noise[own, own] = root @ root.T
        rows.noise[own, 0] = noise[own, own].diagonal()
        rows.noise[own, 1] = noise[own, own][0, -1]
    root = rng.normal(size=(SIZE, SIZE))
    return rows, root @ root.T / SIZE, noise


def textbook(rows, covariance, noise, believed, widening, step):
    """Where the mean goes and the covariance it leaves."""
    owner = np.repeat(np.arange(len(SIZES)), SIZES)
    kept = believed[owner]
    jacobian = rows.jacobian[:len(owner)][kept]
    noise = (noise * widening[owner][:, None])[np.ix_(kept, kept)]
    innovation = rows.residual[:len(owner)][kept] + jacobian @ step
    total = jacobian @ covariance @ jacobian.T + noise
    gain = covariance @ jacobian.T @ np.linalg.inv(total)
    return gain @ innovation, covariance - gain @ total @ gain.T


@pytest.mark.parametrize("believed", [(1, 1, 1, 1, 1, 1), (1, 0, 1, 1, 0, 0), (0, 0, 0, 0, 1, 0)])
def test_update_is_the_textbooks(believed):
    rows, covariance, noise = case()
    believed = np.array(believed, dtype=bool)
    rng = np.random.default_rng(5)
    widening, step = 1.0 + rng.random(len(SIZES)), 0.1 * rng.normal(size=SIZE)
    mean, posterior = textbook(rows, covariance, noise, believed, widening, step)
    gain = empty_gain(32, SIZE)
    solve(rows, covariance, believed, widening, step, gain)
    contract(covariance, gain)
    assert gain.used[1] == sum(np.array(SIZES)[believed])
    np.testing.assert_allclose(step, mean, atol=1e-10)
    np.testing.assert_allclose(covariance, posterior, atol=1e-10)


def test_nothing_believed_changes_nothing():
    rows, covariance, _ = case()
    before, step, gain = covariance.copy(), np.zeros(SIZE), empty_gain(32, SIZE)
    solve(rows, covariance, np.zeros(len(SIZES), bool), np.ones(len(SIZES)), step, gain)
    contract(covariance, gain)
    assert gain.used[1] == 0 and not step.any()
    np.testing.assert_array_equal(covariance, before)


@pytest.mark.parametrize("believed", [(1, 1, 1, 1, 1, 1), (0, 1, 0, 0, 1, 0), (0, 0, 0, 0, 0, 0)])
def test_misfit_is_the_worst_believed_row_in_units_of_its_noise(believed):
    rows, _, _ = case()
    believed, widening = np.array(believed, dtype=bool), 1.0 + np.arange(len(SIZES))
    owner = np.repeat(np.arange(len(SIZES)), SIZES)
    squares = rows.residual[:len(owner)]**2 / (widening[owner] * rows.noise[:len(owner), 0])
    assert misfit(rows, believed, widening) == pytest.approx(squares[believed[owner]].max(initial=0.0))


def test_expected_noise_is_the_innovations_covariance():
    rows, covariance, noise = case()
    out = np.empty((len(SIZES), 3))
    expected_noise(rows, covariance, out)
    jacobian = rows.jacobian[:sum(SIZES)]
    total = jacobian @ covariance @ jacobian.T + noise
    for observation, size in enumerate(SIZES):
        row = rows.first[observation]
        expected = total[row:row + size, row:row + size]
        uu, uv, vv = out[observation]
        assert uu == pytest.approx(expected[0, 0])
        assert (uv, vv) == (pytest.approx((expected[0, 1], expected[1, 1])) if size == 2 else (0.0, 1.0))
