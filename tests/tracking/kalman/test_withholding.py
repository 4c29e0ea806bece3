"""Updates that leave directions of the state alone, against plain numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot_app.tracking.kalman.estimate import BIAS
from rhot_app.tracking.kalman.gain import contract, empty_gain, solve
from rhot_app.tracking.kalman.rows import empty_rows
from rhot_app.tracking.kalman.withholding import bound_biases, empty_held, withhold

MARKERS = 2
SIZE = BIAS + 3 * MARKERS
ANY_BIAS = np.full(MARKERS, 1e9)
SEEDS, COUNTS = st.integers(0, 10_000), st.integers(0, 12)


def covariance_of(rng):
    root = rng.normal(size=(SIZE, SIZE))
    return root @ root.T / SIZE


def held_of(rng, count):
    """`count` directions that are neither orthogonal nor of unit length, each of a few numbers of the state."""
    held = empty_held(SIZE)
    held.used[0] = count
    for row in held.directions[:count]:
        row[rng.choice(SIZE, 5, replace=False)] = rng.normal(size=5)
    return held


def known(covariance, directions):
    """The covariance of the rest, given that the state along `directions` (K, N) is known."""
    cross = directions @ covariance
    return covariance - cross.T @ np.linalg.solve(cross @ directions.T, cross) if len(directions) else covariance


def update_of(rng, count=7):
    """Rows of one number each, and their noise."""
    rows = empty_rows(SIZE)
    rows.used[:] = count, count
    rows.first[:count + 1] = np.arange(count + 1)
    rows.residual[:count] = rng.normal(size=count)
    rows.jacobian[:count] = rng.normal(size=(count, SIZE)) * (rng.random((count, SIZE)) < 0.4)
    rows.noise[:count, 0] = 0.1 + rng.random(count)
    return rows


def updated(covariance, held, rows, bias_variance=ANY_BIAS):
    """The step, and the covariance after withholding and weighing."""
    after, gain, step = covariance.copy(), used_gain(rows.used[0]), np.zeros(SIZE)
    withhold(after, held, gain)
    np.testing.assert_array_equal(after, covariance)
    solve(rows, after, np.ones(rows.used[1], bool), np.ones(rows.used[1]), step, gain)
    contract(after, gain)
    if held.used[0] > 0:
        bound_biases(after, bias_variance)
    return step, after


def used_gain(count):
    """Room that an earlier update has left behind."""
    gain = empty_gain(count, SIZE)
    gain.used[:], gain.rows[:], gain.factor[:] = 3, 7.0, 5.0
    return gain


def rest_of(covariance, held):
    """The covariance less what is withheld."""
    gain = used_gain(0)
    withhold(covariance, held, gain)
    assert list(gain.used) == [held.used[0]] * 2
    withheld = gain.rows[:held.used[0]]
    return covariance - withheld.T @ withheld


@given(SEEDS, COUNTS)
def test_held_directions_count_as_known(seed, count):
    rng = np.random.default_rng(seed)
    covariance, held = covariance_of(rng), held_of(rng, count)
    after, directions = rest_of(covariance, held), held.directions[:count]
    np.testing.assert_allclose(directions @ after, 0.0, atol=1e-9)
    np.testing.assert_allclose(after, known(covariance, directions), atol=1e-9)
    assert np.linalg.eigvalsh(after).min() > -1e-9


def test_what_is_known_already_is_held_at_no_cost():
    """Twice the same direction, and one whose covariance is zero."""
    rng = np.random.default_rng(3)
    covariance, held = covariance_of(rng), held_of(rng, 2)
    covariance[7], covariance[:, 7] = 0.0, 0.0
    held.used[0], held.directions[2] = 4, held.directions[0]
    held.directions[3, 7] = 1.0
    np.testing.assert_allclose(rest_of(covariance, held), known(covariance, held.directions[:2]), atol=1e-9)


@given(SEEDS, COUNTS)
def test_the_update_is_josephs_with_the_gain_of_the_rest(seed, count):
    rng = np.random.default_rng(seed)
    covariance, held, rows = covariance_of(rng), held_of(rng, count), update_of(rng)
    used, rest = rows.used[0], known(covariance, held.directions[:count])
    noise, jacobian = np.diag(rows.noise[:used, 0]), rows.jacobian[:used]
    gain = rest @ jacobian.T @ np.linalg.inv(jacobian @ rest @ jacobian.T + noise)
    left = np.eye(SIZE) - gain @ jacobian
    step, after = updated(covariance, held, rows)
    np.testing.assert_allclose(step, gain @ rows.residual[:used], atol=1e-9)
    np.testing.assert_allclose(after, left @ covariance @ left.T + gain @ noise @ gain.T, atol=1e-9)


@given(SEEDS, COUNTS)
def test_the_step_leaves_held_directions_alone_and_nothing_is_learnt_of_them(seed, count):
    rng = np.random.default_rng(seed)
    covariance, held, rows = covariance_of(rng), held_of(rng, count), update_of(rng)
    directions = held.directions[:count].copy()
    step, after = updated(covariance, held, rows)
    assert np.abs(step).max() > 1e-3
    np.testing.assert_allclose(directions @ step, 0.0, atol=1e-9)
    np.testing.assert_allclose(directions @ after @ directions.T, directions @ covariance @ directions.T, atol=1e-9)


def test_a_markers_place_is_known_no_less_than_by_its_making():
    """However uncertain what is held is, the biases do not pay for it; correlations stay what they are."""
    rng = np.random.default_rng(4)
    covariance, rows = covariance_of(rng), update_of(rng)
    covariance[0, 0] += 1e3
    most = np.array([0.2, 1e9])

    def held():
        out = empty_held(SIZE)
        out.used[0], out.directions[0, 0] = 1, 1.0
        return out

    _, free = updated(covariance, held(), rows)
    _, capped = updated(covariance, held(), rows, most)
    own, others = slice(BIAS, BIAS + 3), np.r_[0:BIAS, BIAS + 3:SIZE]
    assert np.diag(free)[own].min() > most[0]
    np.testing.assert_allclose(np.diag(capped)[own], most[0])
    np.testing.assert_array_equal(capped[np.ix_(others, others)], free[np.ix_(others, others)])
    sd = [np.sqrt(np.diag(one)) for one in (free, capped)]
    np.testing.assert_allclose(capped / np.outer(sd[1], sd[1]), free / np.outer(sd[0], sd[0]), atol=1e-9)


@pytest.mark.parametrize("most", [1e-6, 1.0])
def test_biases_are_as_they_were_when_nothing_is_held(most):
    rng = np.random.default_rng(5)
    covariance, rows = covariance_of(rng), update_of(rng)
    _, free = updated(covariance, empty_held(SIZE), rows)
    _, after = updated(covariance, empty_held(SIZE), rows, np.full(MARKERS, most))
    np.testing.assert_array_equal(after, free)
