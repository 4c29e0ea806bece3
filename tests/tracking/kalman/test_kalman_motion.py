"""How the estimate is carried on: its covariance against finite differences and numerical integration."""

import numpy as np
import pytest
from known_hand import SIZE, WEARING, difference, moved, moving_estimate, twin

from rhot_app.tracking.kalman.estimate import ACCELERATION, BIAS, GROUP_OF, LINEAR, POSE, SCALE, VELOCITY
from rhot_app.tracking.kalman.motion import MOST, liveliness, predict

DT = 0.0125


def carried(estimate, dt=DT):
    other = twin(estimate)
    predict(other, dt, WEARING.cameras, WEARING.habits, WEARING.bias_variance)
    return other


def transition(estimate):
    """(N, N) by finite differences: a step of the mean before, as a step of the mean after."""
    after, out = carried(estimate), np.empty((SIZE, SIZE))
    for k in range(SIZE):
        step = np.zeros(SIZE)
        step[k] = 1e-5
        out[:, k] = difference(carried(moved(estimate, step)), after) / 1e-5
    return out


def white_jerk(dt, steps=2000):
    """(3, 3) covariance of place, speed and acceleration by white jerk of unit density, integrated step by step."""
    h = dt / steps
    onward = np.array([[1.0, h, 0.5 * h * h], [0.0, 1.0, h], [0.0, 0.0, 1.0]])
    out = np.zeros((3, 3))
    for _ in range(steps):
        out = onward @ out @ onward.T
        out[2, 2] += h
    return out


def test_covariance_is_carried_as_the_mean_is():
    estimate = moving_estimate()
    carry = transition(estimate)
    added = carried(estimate).covariance - carry @ estimate.covariance @ carry.T
    added[BIAS:, BIAS:] -= np.diag(np.diag(added[BIAS:, BIAS:]))
    places = [[VELOCITY * order + i for order in range(3)] for i in range(POSE)]
    shape = white_jerk(DT)
    for i in range(POSE):
        for j in range(POSE):
            block = added[np.ix_(places[i], places[j])]
            if GROUP_OF[i] != GROUP_OF[j] or WEARING.habits.together[i, j] == 0.0:
                assert np.abs(block).max() < 1e-7
            else:
                unit = block[2, 2] / shape[2, 2]
                np.testing.assert_allclose(block, unit * shape, rtol=0.02, atol=1e-7)
    scale = np.delete(added[SCALE], SCALE)
    assert np.abs(scale).max() < 1e-9


def test_what_is_added_is_what_the_group_is_capable_of():
    """Nothing known before: what predicting leaves is the acceleration's own variance, in the habit's proportions."""
    estimate = moving_estimate()
    estimate.covariance[:] = 0.0
    estimate.velocity[:] = 0.0
    estimate.acceleration[:] = 0.0
    estimate.agitation[:] = np.arange(1.0, 8.0)
    after = carried(estimate)
    expected = liveliness(after)[GROUP_OF] * np.diag(WEARING.habits.together)
    got = np.diag(after.covariance)[ACCELERATION:SCALE]
    assert got.min() > 0.0
    np.testing.assert_allclose(got / expected, (got / expected)[0], rtol=1e-9)


def test_mean_moves_with_its_velocity():
    estimate = moving_estimate()
    estimate.acceleration[:] = 0.0
    estimate.velocity[:] = 0.0
    estimate.velocity[0], estimate.velocity[5], estimate.velocity[10] = 0.4, 1.5, 2.0
    step = difference(carried(estimate, 1e-3), estimate)
    assert step[:POSE] == pytest.approx(1e-3 * estimate.velocity, rel=0.01, abs=1e-12)


def test_still_hands_are_calm_and_fast_ones_no_livelier_than_hands_are():
    estimate = moving_estimate()
    estimate.velocity[:] = 0.0
    calm = liveliness(estimate)
    estimate.velocity[0] = 1.0
    brisk = liveliness(twin(estimate))
    assert brisk[LINEAR] > 100.0 * calm[LINEAR]
    np.testing.assert_array_equal(brisk[1:], calm[1:])
    estimate.velocity[:] = 1e4
    np.testing.assert_array_equal(liveliness(estimate), MOST)


def test_biases_tend_to_what_their_markers_have():
    estimate = moving_estimate()
    estimate.covariance[BIAS:, BIAS:] = 0.0
    before = np.abs(estimate.bias).sum()
    for _ in range(300):
        predict(estimate, 0.1, WEARING.cameras, WEARING.habits, WEARING.bias_variance)
    np.testing.assert_allclose(np.diag(estimate.covariance)[BIAS:], np.repeat(WEARING.bias_variance, 3), rtol=1e-3)
    assert np.abs(estimate.bias).sum() < 1e-3 * before


def test_no_time_changes_no_mean():
    estimate = moving_estimate()
    assert np.abs(difference(carried(estimate, 0.0), estimate)).max() < 1e-12


def test_one_eye_believes_that_the_palm_keeps_its_distance():
    """Camera 1 looks along z: what moves along it comes to rest sooner than what moves across."""
    def after(unseeing, speed=0.1):
        estimate = moving_estimate()
        estimate.velocity[:] = 0.0
        estimate.velocity[[0, 2]] = speed
        estimate.acceleration[:] = 0.0
        estimate.unseeing[:] = unseeing
        return carried(estimate, 0.05).velocity

    both, one, none = after((0.0, 0.0)), after((0.0, np.inf)), after((np.inf, np.inf))
    np.testing.assert_array_equal(both, none)
    assert one[0] == pytest.approx(both[0]) and one[2] < 0.8 * both[2]
    np.testing.assert_array_equal(after((0.0, 0.0), 0.3), after((0.0, np.inf), 0.3))  # what moves goes on
