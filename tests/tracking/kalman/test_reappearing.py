"""What is forgotten of a finger that comes back into sight."""

import numpy as np
import pytest
from known_hand import SIZE, WEARING, moving_estimate, sighting

from rhot_app.hand.skeleton import ANGLE_SLICES
from rhot_app.tracking.kalman.estimate import ACCELERATION, ANGLES, VELOCITY
from rhot_app.tracking.kalman.reappearing import AWAY_S, HASTE, SPEED, forget_finger, loosen

PART, USUAL = WEARING.worn.part, WEARING.habits.usual


def own(finger):
    """Which numbers of the pose are a finger's."""
    return ANGLES + np.arange(ANGLE_SLICES[finger].start, ANGLE_SLICES[finger].stop)


def assert_forgotten(covariance, before, *fingers):
    """All that is left of the fingers is habit; of the others all."""
    rows = np.concatenate([base + own(finger) for finger in fingers for base in (0, VELOCITY, ACCELERATION)])
    others = np.setdiff1d(np.arange(SIZE), rows)
    np.testing.assert_array_equal(covariance[np.ix_(others, others)], before[np.ix_(others, others)])
    np.testing.assert_array_equal(covariance[np.ix_(rows, others)], 0.0)
    np.testing.assert_array_equal(covariance[np.ix_(others, rows)], 0.0)
    expected = np.zeros((SIZE, SIZE))
    for finger in fingers:
        angles = own(finger)
        expected[np.ix_(angles, angles)] = USUAL[np.ix_(angles, angles)]
        expected[VELOCITY + angles, VELOCITY + angles] = SPEED**2
        expected[ACCELERATION + angles, ACCELERATION + angles] = HASTE**2
    np.testing.assert_array_equal(covariance[np.ix_(rows, rows)], expected[np.ix_(rows, rows)])


def loosened(away, rows, part=PART):
    """The estimate after `rows`, markers unseen since `away` (M,) s, and its covariance before."""
    estimate = moving_estimate()
    estimate.unseen[:] = away
    before = estimate.covariance.copy()
    loosen(estimate, part, rows, USUAL)
    return estimate, before


@pytest.mark.parametrize("finger", [0, 2])
def test_a_finger_that_was_away_and_is_back_is_forgotten(finger):
    away = np.where(finger == PART, 1.1 * AWAY_S, 0.01)
    estimate, before = loosened(away, sighting((0, 1), (0, finger), (0, 5)))
    assert_forgotten(estimate.covariance, before, finger)
    np.testing.assert_array_equal(estimate.angles, moving_estimate().angles)
    assert np.linalg.eigvalsh(estimate.covariance).min() > 0.0


def test_two_fingers_that_come_back_at_once_are_both_forgotten_and_do_not_go_together():
    estimate, before = loosened(np.where(PART < 2, 1.0, 0.0), sighting((0, 0), (0, 1), (0, 2)))
    assert_forgotten(estimate.covariance, before, *sorted({int(PART[0]), int(PART[1])}))


@pytest.mark.parametrize(("away", "seen"), [(0.9 * AWAY_S, (0, 2)), (1.0, (0, 1)), (1.0, (0, 5))],
                         ids=["not away", "still away", "palm back"])
def test_all_others_keep_what_is_known(away, seen):
    unseen = np.full(len(PART), away if away < AWAY_S else 0.0)
    unseen[[2, 5]] = away
    estimate, before = loosened(unseen, sighting(seen))
    np.testing.assert_array_equal(estimate.covariance, before)


def test_a_finger_of_which_one_marker_stayed_in_sight_was_not_away():
    part, away = np.array([0, 1, 2, 2, 4, -1]), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    estimate, before = loosened(away, sighting((0, 2), part=part), part)
    np.testing.assert_array_equal(estimate.covariance, before)


def test_forgetting_a_finger_asks_nobody():
    estimate = moving_estimate()
    before = estimate.covariance.copy()
    forget_finger(estimate, 4, USUAL)
    assert_forgotten(estimate.covariance, before, 4)
