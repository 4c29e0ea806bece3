"""The hand as a process: manifold, and prediction."""

from __future__ import annotations

import numpy as np
import pytest
from hand_states import BIAS_S, make_process, moving_state, natural_state, slopes, world_of
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rhot_app.tracking.hand_process import ACCELERATION, ANGLES, BIAS, MOTION, POSE, VELOCITY

seeds = st.integers(0, 2**32 - 1)


def random_step(rng, size, turn):
    """A step that turns the palm by `turn` rad."""
    step = rng.normal(size=size)
    step[3:6] *= turn / np.linalg.norm(step[3:6])
    return step


@given(seed=seeds, turn=st.floats(0.0, 3.1))
def test_difference_is_the_inverse_of_retract(seed, turn):
    process, rng = make_process(), np.random.default_rng(seed)
    state = moving_state(rng)
    step = random_step(rng, process.size, turn)
    np.testing.assert_allclose(process.difference(process.retract(state, step), state), step, atol=1e-8)


@given(seed=seeds)
def test_retract_is_the_inverse_of_difference(seed):
    process, rng = make_process(), np.random.default_rng(seed)
    origin, state = moving_state(rng), moving_state(rng)
    reached = process.retract(origin, process.difference(state, origin))
    np.testing.assert_allclose(reached, state, atol=1e-7)


def test_a_step_turns_the_palm_about_itself_in_world_axes():
    process, rng = make_process(), np.random.default_rng(1)
    state = natural_state(rng)
    step = np.zeros(process.size)
    step[:6] = 0.1, -0.2, 0.3, 0.4, -0.5, 0.6
    before, after = world_of(state), world_of(process.retract(state, step))
    np.testing.assert_allclose(after[:3, :3], Rotation.from_rotvec(step[3:6]).as_matrix() @ before[:3, :3], atol=1e-12)
    np.testing.assert_allclose(after[:3, 3], before[:3, 3] + step[:3], atol=1e-12)


@pytest.mark.parametrize("dt", [0.0125, 0.1])
def test_the_transition_of_a_hand_at_rest_is_the_slope_of_its_prediction(dt):
    process = make_process()
    state, covariance = natural_state(np.random.default_rng(2)), np.zeros((process.size, process.size))
    after = process.predict(state, covariance, dt)[0]
    expected = slopes(process, lambda moved: process.difference(process.predict(moved, covariance, dt)[0], after),
                      state)
    np.testing.assert_allclose(process.transition(state, dt), expected, atol=1e-4)


@pytest.mark.parametrize("dt", [0.0125, 0.05])
def test_the_transition_of_a_moving_hand_is_the_slope_of_its_prediction(dt):
    """At constant rates: how these follow the state is no part of it. An error of the angular velocity turns with half
    of the palm's turn, which the transition may take for all or none of it."""
    process = make_process(slowest=np.full(3, 6.0), fastest=6.0)
    state, covariance = moving_state(np.random.default_rng(3)), np.zeros((process.size, process.size))
    after = process.predict(state, covariance, dt)[0]
    turn = np.linalg.norm(process.difference(after, state)[3:6])
    assert turn > 0.01
    expected = slopes(process, lambda moved: process.difference(process.predict(moved, covariance, dt)[0], after),
                      state)
    got = process.transition(state, dt)
    for order in (1, 2):
        columns = slice(POSE * order + 3, POSE * order + 6)
        np.testing.assert_allclose(got[3:6, columns], expected[3:6, columns],
                                   atol=turn * np.abs(expected[3:6, columns]).max())
        got[3:6, columns] = expected[3:6, columns]
    np.testing.assert_allclose(got, expected, atol=1e-5)


def test_a_prediction_is_the_same_in_one_step_as_in_many():
    process = make_process(slowest=np.full(3, 6.0), fastest=6.0)
    state = moving_state(np.random.default_rng(4), 0.5)
    covariance = 1e-6 * np.eye(process.size)
    steps = state, covariance
    for _ in range(8):
        steps = process.predict(*steps, 0.01)
    once = process.predict(state, covariance, 0.08)
    moved = process.difference(once[0], state)[:POSE]
    np.testing.assert_allclose(process.difference(steps[0], once[0])[:POSE], 0.0, atol=0.05 * np.abs(moved).max())
    np.testing.assert_allclose(np.sqrt(np.diag(steps[1])), np.sqrt(np.diag(once[1])), rtol=0.05)


def test_predicting_by_nothing_changes_nothing_and_leaves_its_arguments():
    process = make_process()
    state, covariance = moving_state(np.random.default_rng(5)), np.eye(process.size)
    kept = state.copy(), covariance.copy()
    same = process.predict(state, covariance, 0.0)
    np.testing.assert_allclose(same[0], state, atol=1e-12)
    np.testing.assert_allclose(same[1], covariance, atol=1e-12)
    process.predict(state, covariance, 0.5)
    np.testing.assert_array_equal(state, kept[0])
    np.testing.assert_array_equal(covariance, kept[1])


def unobserved(process, seconds, step_s, speed=0.0):
    """(state, covariance) each second without observations, from a hundredth of the start's standard deviations."""
    rng = np.random.default_rng(6)
    state, covariance = process.start(world_of(natural_state(rng)), process.mean, (0.03, 0.5))
    if speed:
        state = moving_state(rng, speed)
    covariance = 1e-4 * covariance
    for k in range(round(seconds / step_s)):
        state, covariance = process.predict(state, covariance, step_s)
        if (k + 1) % round(max(1.0 / step_s, 1.0)) == 0:
            yield state, covariance


@pytest.mark.parametrize(("step_s", "speed"), [(1.0 / 80.0, 0.0), (1.0 / 80.0, 1.0), (10.0, 1.0)])
def test_without_observations_the_covariance_stays_symmetric_and_positive(step_s, speed):
    process = make_process()
    for state, covariance in unobserved(process, 10.0, step_s, speed):
        np.testing.assert_allclose(covariance, covariance.T, atol=1e-9 * np.abs(covariance).max())
        sd = np.sqrt(np.diag(covariance))
        assert np.all(sd > 0.0)
        assert np.linalg.eigvalsh(covariance / np.outer(sd, sd)).min() > -1e-9
        rotation = world_of(state)[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)


@pytest.mark.parametrize("step_s", [1.0 / 200.0, 1.0 / 40.0, 10.0])
def test_without_observations_the_angles_return_to_the_natural_pose(step_s):
    """However long the steps are: mean, standard deviations and correlations."""
    process = make_process()
    *_, (state, covariance) = unobserved(process, 10.0, step_s, 1.0)
    np.testing.assert_allclose(state[ANGLES:VELOCITY], process.mean, atol=1e-3)
    np.testing.assert_allclose(state[VELOCITY + 6:ACCELERATION], 0.0, atol=1e-3)
    sd = np.sqrt(np.diag(process.stationary[6:27, 6:27]))
    np.testing.assert_allclose(covariance[6:POSE, 6:POSE] / np.outer(sd, sd),
                               process.stationary[6:27, 6:27] / np.outer(sd, sd), atol=0.05)


def test_without_observations_the_palm_may_be_anywhere_and_the_paint_bias_returns_to_its_prior():
    process = make_process()
    seconds = list(unobserved(process, 10.0, 1.0 / 40.0))
    places = [covariance[0, 0] for _, covariance in seconds]
    assert np.all(np.diff(places) > 0.0)
    assert np.sqrt(places[-1]) > 0.5
    bias = seconds[-1][1][MOTION:, MOTION:]
    np.testing.assert_allclose(bias, 1e-6 * np.eye(len(bias)), atol=1e-8)


def test_the_paint_bias_decays_with_its_correlation_time():
    process = make_process()
    state = natural_state(np.random.default_rng(7))
    state[BIAS:] = 1e-3
    later, covariance = process.predict(state, np.zeros((process.size, process.size)), BIAS_S)
    np.testing.assert_allclose(later[BIAS:], 1e-3 / np.e, rtol=1e-6)
    np.testing.assert_allclose(np.diag(covariance)[MOTION:], 1e-6 * (1.0 - np.exp(-2.0)), rtol=1e-6)


def test_a_faster_hand_is_given_a_shorter_correlation_time():
    process, rest = make_process(), np.zeros(POSE)
    state = natural_state(np.random.default_rng(8))
    np.testing.assert_allclose(process.rates(state), [2.0, 4.0, 3.0])
    rest[:3] = 1.0
    state[VELOCITY:ACCELERATION] = rest
    rates = process.rates(state)
    assert rates[0] > 3.0
    np.testing.assert_allclose(rates[1:], [4.0, 3.0])
    state[VELOCITY:ACCELERATION] = 100.0
    np.testing.assert_allclose(process.rates(state), 25.0)
