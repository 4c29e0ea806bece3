"""What is forgotten of a finger that comes back into sight, and of a palm."""

import numpy as np
import pytest
from known_hand import SIZE, WEARING, filter_of_hand, moving_estimate, placed, settled, sighting, twin

from rhot_app.hand.skeleton import ANGLE_SLICES
from rhot_app.tracking.kalman.estimate import ACCELERATION, ANGLES, POSE, SCALE, VELOCITY, copy_estimate
from rhot_app.tracking.kalman.reappearing import (
    AWAY_S,
    ELSEWHERE_M,
    HASTE,
    SPEED,
    STRAYED_S,
    forget_finger,
    loosen,
    loosen_palm,
)
from rhot_app.tracking.kalman.surprise import appraise

PART, USUAL = WEARING.worn.part, WEARING.habits.usual
WRIST = WEARING.roles.index("wrist")


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
    loosen(estimate, part, rows, USUAL, np.empty(5, np.bool_))
    return estimate, before


def far_off(pixels):
    """Two fingertips that one camera sees so far from where they are expected."""
    rows = sighting((0, 1), (0, 2))
    rows.jacobian[:4, 0], rows.noise[:4, 0], rows.residual[:4] = 1.0, 0.05**2, pixels
    return rows


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


def test_what_a_finger_seemed_to_do_is_forgotten_too():
    estimate, before = moving_estimate(), moving_estimate()
    forget_finger(estimate, 2, USUAL)
    finger = own(2)
    for now, then in ((estimate.velocity, before.velocity), (estimate.acceleration, before.acceleration)):
        assert not now[finger].any()
        np.testing.assert_array_equal(np.delete(now, finger), np.delete(then, finger))


@pytest.mark.parametrize("px", [0.3, 400.0], ids=["off", "far off"])
def test_a_finger_that_is_back_is_believed_where_it_is_and_surprises_nobody(px):
    estimate, rows = moving_estimate(), far_off(px)
    estimate.unseen[:] = 0.0
    estimate.unseen[:, 2] = 1.0
    estimate.covariance[:] = 1e-8 * np.eye(SIZE)
    estimate.agitation[:] = 1.0
    back = np.empty(5, np.bool_)
    loosen(estimate, PART, rows, USUAL, back)
    np.testing.assert_array_equal(back, np.arange(5) == PART[2])
    believed, widening = np.empty(2, np.bool_), np.empty(2)
    appraise(rows, estimate, WEARING.habits.together, back, believed, widening)
    assert believed[1] and widening[1] == 1.0
    assert estimate.agitation[2 + PART[2]] == 1.0
    assert widening[0] > 1.0 and believed[0] == (px < 1.0)
    assert estimate.agitation[2 + PART[1]] > 1.0


PX_PER_M = 900.0


def off_by(metres):
    """The wrist is seen by the first camera so far across its line of sight from where it is expected."""
    rows = sighting((0, 1), (0, WRIST))
    rows.jacobian[2, 0] = rows.jacobian[3, 1] = PX_PER_M
    rows.residual[3] = metres * PX_PER_M
    rows.noise[:, 0] = 0.05**2
    return rows


def palm_back(metres, away_s):
    """What an estimate knows, and knew, whose wrist is seen again after `away_s`."""
    estimate = moving_estimate()
    estimate.covariance[:] = 1e-6 * np.eye(SIZE)
    estimate.unseen[:] = 0.0
    estimate.unseen[0, WRIST] = away_s
    before = estimate.covariance.copy()
    elsewhere = loosen_palm(estimate, WEARING.outfit, off_by(metres), USUAL)
    assert elsewhere == (metres > ELSEWHERE_M and away_s > AWAY_S)
    return estimate.covariance, before


def test_a_palm_that_is_back_elsewhere_may_be_anywhere_and_anyhow_with_its_fingertips_where_they_are():
    covariance, before = palm_back(0.04, 0.3)
    gained = covariance - before
    jacobian = placed(moving_estimate())[1]
    palm, angles = np.diag(gained)[:3], np.diag(gained)[3:6]
    assert np.sqrt(palm.sum()) > 0.025 and np.sqrt(angles.sum()) > 0.2
    for tip in range(5):
        strayed = jacobian[tip] @ gained[:POSE, :POSE] @ jacobian[tip].T
        assert np.sqrt(np.trace(strayed)) < 3.0 * np.sqrt(WEARING.bias_variance[tip])
    np.testing.assert_allclose(gained[VELOCITY:ACCELERATION, VELOCITY:ACCELERATION],
                               gained[:POSE, :POSE] / STRAYED_S**2)
    np.testing.assert_array_equal(gained[ACCELERATION:], 0.0)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_a_palm_that_is_back_near_by_has_the_fingers_that_it_had():
    covariance, before = palm_back(0.9 * ELSEWHERE_M, 0.3)
    assert covariance[0, 0] > 50.0 * before[0, 0]
    np.testing.assert_array_equal(covariance[3:, 3:], before[3:, 3:])


@pytest.mark.parametrize(("metres", "away_s"), [(0.0015, 0.3), (0.04, 0.9 * AWAY_S)], ids=["as expected", "not away"])
def test_a_palm_that_is_where_it_was_expected_or_was_never_away_is_not_doubted(metres, away_s):
    covariance, before = palm_back(metres, away_s)
    np.testing.assert_array_equal(covariance, before)


def test_a_palm_that_strayed_is_put_where_it_is_seen_and_not_set_going():
    """Taken for an acceleration, 4 cm would be several metres per second."""
    hand, (estimate, block) = filter_of_hand(), settled()
    copy_estimate(twin(estimate), hand.estimate)
    there = estimate.world[:3, 3].copy()
    hand.estimate.world[:2, 3] += 0.03, 0.025
    hand.estimate.covariance[:3] = 0.0
    hand.estimate.covariance[:, :3] = 0.0
    hand.estimate.covariance[np.arange(3), np.arange(3)] = 0.005**2
    hand.estimate.unseen[:, WRIST] = 0.4
    speed = hand.estimate.velocity[:3].copy()
    hand.update(0.0, [block])
    assert np.linalg.norm(hand.estimate.world[:2, 3] - there[:2]) < 0.01
    assert np.linalg.norm(hand.estimate.velocity[:3] - speed) < 0.3
    assert np.isfinite(hand.estimate.covariance[:SCALE]).all()
