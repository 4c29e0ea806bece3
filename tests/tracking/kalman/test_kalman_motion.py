"""How the estimate is carried on: its covariance against finite differences and numerical integration."""

import numpy as np
import pytest
from known_hand import SIZE, WEARING, difference, empty, moved, moving_estimate, twin

from rhot_app.hand.skeleton import FLEXIONS
from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    BIAS,
    FIRST_FINGER,
    FREE,
    GROUP_OF,
    LINEAR,
    PALM_HELD,
    PLACED,
    POSE,
    SCALE,
    TURN,
    VELOCITY,
)
from rhot_app.tracking.kalman.motion import MOST, TURNING_S, WIDTH_S, liveliness, predict, speeds
from rhot_app.tracking.kalman.sighted import FRESH_S

DT = 0.0125
TOGETHER = WEARING.habits.together


def carried(estimate, dt=DT):
    other = twin(estimate)
    predict(other, dt, WEARING.worn.part, WEARING.habits, WEARING.bias_variance)
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
            if TOGETHER[i, j] == 0.0:
                assert np.abs(block).max() < 1e-7
            else:
                unit = block[2, 2] / shape[2, 2]
                np.testing.assert_allclose(block, unit * shape, rtol=0.02, atol=1e-7)
    scale = np.delete(added[SCALE], SCALE)
    assert np.abs(scale).max() < 1e-9


def lively(estimate):
    out = np.empty(7)
    liveliness(estimate, out)
    return out


def test_what_is_added_is_what_the_group_is_capable_of():
    """Nothing known before: what predicting leaves is the acceleration's own variance, in the habit's proportions."""
    estimate = moving_estimate()
    estimate.covariance[:] = 0.0
    estimate.velocity[:] = 0.0
    estimate.acceleration[:] = 0.0
    estimate.agitation[:] = np.arange(1.0, 8.0)
    after = carried(estimate)
    expected = lively(after)[GROUP_OF] * np.diag(TOGETHER)
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
    calm = lively(estimate)
    estimate.velocity[0] = 1.0
    brisk = lively(twin(estimate))
    assert brisk[LINEAR] > 100.0 * calm[LINEAR]
    np.testing.assert_array_equal(brisk[1:], calm[1:])
    estimate.velocity[:] = 1e4
    np.testing.assert_array_equal(lively(estimate), MOST)


def test_a_palm_that_hurries_to_and_fro_turns_as_hard_as_it_must():
    """A swing of 2.3 Hz has 2 m/s and 29 m/s^2, amplitude or rms. At a walking speed hands do not swing like that."""
    estimate, turn_hz = empty(), 2.3  # its covariance is zero: all of the speed counts
    for speed, share in ((0.1, (0.3, 0.6)), (2.0, (0.8, 1.2))):
        estimate.velocity[0] = speed
        found = np.sqrt(lively(estimate)[LINEAR]) / (2.0 * np.pi * turn_hz * speed)
        assert share[0] < found < share[1]


def test_biases_tend_to_what_their_markers_have():
    estimate = moving_estimate()
    estimate.covariance[BIAS:, BIAS:] = 0.0
    before = np.abs(estimate.bias).sum()
    for _ in range(300):
        predict(estimate, 0.1, WEARING.worn.part, WEARING.habits, WEARING.bias_variance)
    np.testing.assert_allclose(np.diag(estimate.covariance)[BIAS:], np.repeat(WEARING.bias_variance, 3), rtol=1e-3)
    assert np.abs(estimate.bias).sum() < 1e-3 * before


def test_no_time_changes_no_mean():
    estimate = moving_estimate()
    assert np.abs(difference(carried(estimate, 0.0), estimate)).max() < 1e-12


def still():
    """A hand at rest that both cameras see and of which all is known."""
    estimate = moving_estimate()
    for array in (estimate.covariance, estimate.velocity, estimate.acceleration, estimate.agitation, estimate.unseen):
        array[:] = 0.0
    return estimate


def test_fingers_bend_together():
    """What predicting adds is correlated between fingers as habit has it, however lively each of them is."""
    assert np.linalg.eigvalsh(TOGETHER).min() > -1e-9
    np.testing.assert_allclose(TOGETHER, TOGETHER.T, atol=1e-12)
    estimate = still()
    estimate.agitation[:] = (1.0, 1.0, 5.0, 20.0, 300.0, 40.0, 7.0)
    added = carried(estimate).covariance[ACCELERATION:SCALE, ACCELERATION:SCALE]
    sd, habit = np.sqrt(np.diag(added)), np.sqrt(np.diag(TOGETHER))
    np.testing.assert_allclose(added / np.outer(sd, sd), TOGETHER / np.outer(habit, habit), atol=1e-9)
    assert not added[:ANGLES, ANGLES:].any()
    pips = [ANGLES + flexions[1] for flexions in FLEXIONS]
    correlations = (added / np.outer(sd, sd))[np.ix_(pips, pips)]
    fingers = correlations[1:, 1:][np.triu_indices(4, 1)]
    assert fingers.min() > 0.5 and correlations[0, 1:].min() > 0.2 and correlations[0, 1:].max() < fingers.min()


def test_a_finger_out_of_sight_is_as_lively_as_its_neighbours():
    estimate = still()
    lively = np.array([40.0, 90.0, 160.0])
    estimate.agitation[FIRST_FINGER + np.array([1, 3, 4])] = lively
    estimate.unseen[:, [0, 2]] = 2.0 * FRESH_S
    estimate.unseen[0, 1] = 2.0 * FRESH_S  # one camera is enough
    faded, neighbours = carried(twin(estimate)).agitation[FIRST_FINGER + 1] / 40.0, np.mean(np.sqrt(lively)) ** 2
    after = carried(estimate).agitation[FIRST_FINGER:]
    np.testing.assert_allclose(after, faded * np.array([neighbours, 40.0, neighbours, 90.0, 160.0]), rtol=1e-9)
    estimate.agitation[FIRST_FINGER + 2] = 1000.0
    assert carried(estimate).agitation[FIRST_FINGER + 2] == pytest.approx(1000.0 * faded)


def test_fingers_that_none_sees_fall_asleep():
    estimate = still()
    estimate.agitation[FIRST_FINGER + 1] = 100.0
    estimate.unseen[:, :5] = 2.0 * FRESH_S
    after = carried(estimate).agitation
    assert 0.0 < after[FIRST_FINGER + 1] < 100.0
    assert not np.delete(after, FIRST_FINGER + 1).any()


def test_time_passes_for_what_was_seen():
    estimate = still()
    estimate.unseen[1, 2] = 0.3
    np.testing.assert_allclose(carried(estimate).unseen, estimate.unseen + DT)


def test_a_palm_that_turned_is_taken_to_turn_for_a_while():
    estimate = still()
    estimate.velocity[4] = 2.0
    turns = carried(estimate)
    moving = np.empty(7)
    speeds(turns, moving)
    assert 1.5 < moving[TURN] <= turns.turning[0] <= 2.0
    turns.velocity[:], turns.acceleration[:] = 0.0, 0.0
    assert carried(turns, 0.2).turning[0] == pytest.approx(turns.turning[0] * np.exp(-0.2 / TURNING_S))


@pytest.mark.parametrize("how", [FREE, PLACED, PALM_HELD])
def test_a_palm_that_is_held_does_not_wake_by_moving(how):
    estimate = still()
    estimate.velocity[[0, 4, ANGLES + 6]] = 0.1, 1.0, 2.0
    estimate.held[0] = how
    awake = carried(estimate).agitation > 0.0
    assert awake[FIRST_FINGER + 1] and awake[LINEAR] == awake[TURN] == (how != PALM_HELD)


def test_how_wide_paint_is_is_forgotten_only_while_two_cameras_see_it():
    """One camera tells by it how far away the hand is, for as long as it is alone."""
    estimate = moving_estimate()
    estimate.width[:], estimate.unseen[:] = 0.02, 0.0
    estimate.unseen[1, :3] = 2.0 * FRESH_S
    after = carried(estimate)
    assert after.width[:3] == pytest.approx(0.02, rel=1e-12)
    assert after.width[3:] == pytest.approx(0.02 * np.exp(-DT / WIDTH_S), rel=1e-12)
