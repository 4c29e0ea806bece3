"""The hand as a process: manifold, and prediction."""

import numpy as np
import pytest
from hand_states import BIAS_S, make_process, markers, moving_state, natural_state, points_of, slopes, world_of
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from rhot_app.hand.motion.hand_state import MOTION, POSE, STATE, TANGENT

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


def settled(process, seed):
    """A hand at rest in the most probable pose that its markers leave, well within its limits."""
    state, nothing = natural_state(np.random.default_rng(seed)), np.zeros((process.size, process.size))
    state[STATE.angles] = process.mean
    for _ in range(20):
        state = process.predict(state, nothing, 1e-9)[0]
    return state


@pytest.mark.parametrize("dt", [0.0125, 0.1])
def test_the_transition_of_a_hand_at_rest_is_the_slope_of_where_its_markers_go(dt):
    process = make_process()
    state, nothing = settled(process, 2), np.zeros((process.size, process.size))
    after = process.predict(state, nothing, dt)[0]
    expected = slopes(process, lambda moved: process.difference(process.predict(moved, nothing, dt)[0], after), state)
    got, seen = process.transition(state, dt), places_by_pose(after)
    for columns in (slice(0, POSE), TANGENT.velocity):
        np.testing.assert_allclose(seen @ got[:POSE, columns], seen @ expected[:POSE, columns],
                                   atol=2e-2 * np.abs(seen @ expected[:POSE, columns]).max())


def places_by_pose(state, step=1e-6):
    """(3 M, 27) slope of the markers' places, m, by the pose."""
    process = make_process()
    return slopes(process, lambda moved: points_of(markers().dh, moved).ravel(), state, step)[:, :POSE]


def open_directions(state):
    """(27, K) of the pose: what moves no marker."""
    _, values, directions = np.linalg.svd(places_by_pose(state))
    return directions[np.sum(values > 1e-9 * values[0]):].T


def test_a_hand_that_rests_keeps_its_markers_where_they_are():
    process = make_process()
    state = natural_state(np.random.default_rng(4))
    state[STATE.angles] = np.clip(state[STATE.angles], *markers().limits.T)
    after = process.predict(state, np.zeros((process.size, process.size)), 1e-9)[0]
    moved = points_of(markers().dh, after) - points_of(markers().dh, state)
    assert np.linalg.norm(process.difference(after, state)[TANGENT.angles]) > 0.05  # what they leave open is drawn anew
    assert np.linalg.norm(moved, axis=1).max() < 1e-3


def test_what_markers_leave_open_is_known_as_well_as_the_natural_pose_tells():
    process = make_process()
    state = settled(process, 5)
    covariance = process.predict(state, 1e-12 * np.eye(process.size), 1e-9)[1][TANGENT.pose, TANGENT.pose]
    free = open_directions(state)
    prior = np.linalg.inv(free[6:].T @ markers().pose_prior.information @ free[6:])
    np.testing.assert_allclose(free.T @ covariance @ free, prior, atol=0.05 * np.abs(prior).max())


def test_a_thumb_at_its_limits_is_bent_the_other_way_when_that_is_more_probable():
    """Its tip is where a thumb has it that is bent forwards; the estimate has bent it backwards."""
    process, nothing = make_process(), np.zeros((make_process().size, make_process().size))
    forwards = np.radians([-25.0, -7.0, -1.0, 34.0, 35.0])
    state = settled(process, 6)
    state[STATE.angles][:5] = forwards
    tip = points_of(markers().dh, state)[0]
    found = least_squares(lambda angles: 1e3 * (points_of(markers().dh, np.concatenate(
        [state[STATE.palm], angles, state[STATE.palm.stop + 5:]]))[0] - tip),
                          np.radians([-28.0, 20.0, -25.0, -15.0, -20.0])).x
    state[STATE.angles][:5] = found
    assert found[4] < 0.0
    after = process.predict(state, nothing, 1e-9)[0]
    assert after[STATE.angles][4] > np.radians(20.0)
    assert np.linalg.norm(points_of(markers().dh, after)[0] - tip) < 2e-3


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
    """However long the steps are."""
    process = make_process()
    *_, (state, covariance) = unobserved(process, 10.0, step_s, 1.0)
    np.testing.assert_allclose(state[STATE.angles], process.mean, atol=2e-2)
    np.testing.assert_allclose(state[STATE.velocity][6:], 0.0, atol=1e-2)
    sd = np.sqrt(np.diag(process.stationary[6:27, 6:27]))
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)[TANGENT.angles]) / sd, 1.0, atol=0.4)


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
    state[STATE.lasting] = 1e-3
    later, covariance = process.predict(state, np.zeros((process.size, process.size)), BIAS_S)
    np.testing.assert_allclose(later[STATE.lasting], 1e-3 / np.e, rtol=1e-6)
    np.testing.assert_allclose(np.diag(covariance)[MOTION:], 1e-6 * (1.0 - np.exp(-2.0)), rtol=1e-6)


def test_a_faster_hand_is_given_a_shorter_correlation_time():
    process, rest = make_process(), np.zeros(POSE)
    state = natural_state(np.random.default_rng(8))
    np.testing.assert_allclose(process.rates(state), [2.0, 4.0, 3.0])
    rest[:3] = 1.0
    state[STATE.velocity] = rest
    rates = process.rates(state)
    assert rates[0] > 3.0
    np.testing.assert_allclose(rates[1:], [4.0, 3.0])
    state[STATE.velocity] = 100.0
    np.testing.assert_allclose(process.rates(state), 25.0)
