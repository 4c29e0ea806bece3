"""What fades, and what it fades to."""

import numpy as np
import pytest
from known_hand import MARKERS, SIZE, WEARING, moved, moving_estimate
from places import places_of

from rhot_app.hand.skeleton import ANGLE_SLICES
from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    BIAS,
    FREE,
    GOES_ON,
    PALM_HELD,
    PLACED,
    POSE,
    ROTATION,
    TURN_HELD,
)
from rhot_app.tracking.kalman.forgetting import (
    FADING_S,
    SETTLED_RAD,
    WIDEST,
    forget,
)
from rhot_app.tracking.kalman.gain import empty_gain
from rhot_app.tracking.kalman.opening import SHARPNESS_M, STRIDE_RAD, empty_opening, open_directions, open_up

HABITS, BIAS_VARIANCE = WEARING.habits, WEARING.bias_variance
KEPT = np.r_[0:POSE, BIAS:SIZE]  # pose and biases among the estimate's numbers
GAIN, OPENING_ROOM = empty_gain(64, SIZE), empty_opening(MARKERS)
WRIST = WEARING.roles.index("wrist")
SEEN = np.zeros(5)
NATURAL = np.sqrt(np.diag(HABITS.usual)[ANGLES:])


def marker_jacobian(estimate):
    return places_of(WEARING.worn, estimate).jacobian


def left_open(jacobian):
    """(27 + 3 M, 27 + 3 M) what habit leaves open."""
    room = empty_opening(MARKERS)
    open_directions(jacobian, HABITS.usual, BIAS_VARIANCE, room)
    return room.left_open


def seen(estimate):
    """(3 M, 27 + 3 M) how pose and biases move the markers."""
    return np.hstack([marker_jacobian(estimate).reshape(3 * MARKERS, POSE), np.eye(3 * MARKERS)])


def prior():
    out = np.zeros((POSE + 3 * MARKERS,) * 2)
    out[:POSE, :POSE] = HABITS.usual
    out[POSE:, POSE:] = np.diag(np.repeat(BIAS_VARIANCE, 3))
    return out


def faded(estimate, seconds, dt=0.05):
    """The estimate after `seconds` of forgetting alone."""
    for _ in range(round(seconds / dt)):
        step = np.zeros(SIZE)
        forget(estimate, dt, HABITS, BIAS_VARIANCE, marker_jacobian(estimate), GAIN, OPENING_ROOM, step, SEEN)
        estimate = moved(estimate, step)
    return estimate


def confident():
    estimate = moving_estimate()
    estimate.covariance[:] = 1e-8 * np.eye(SIZE)
    return estimate


def test_open_directions_leave_every_marker_in_its_place():
    estimate = moving_estimate()
    left = left_open(marker_jacobian(estimate))
    np.testing.assert_allclose(left, left.T, atol=1e-10)
    values = np.linalg.eigvalsh(0.5 * (left + left.T))
    assert values.min() > -1e-9
    assert values[-8:].min() > 1e-3  # six markers leave much of 27 freedoms open
    strayed = seen(estimate) @ left @ seen(estimate).T
    assert np.sqrt(np.diag(strayed).max()) < 1.1 * SHARPNESS_M


@pytest.mark.parametrize("share", [0.03, 0.8])
def test_the_way_back_is_an_ornstein_uhlenbeck_step_in_the_open_directions(share):
    """What is worked out without any large matrix is what the textbook's matrices give."""
    estimate, jacobian, step = moving_estimate(), marker_jacobian(moving_estimate()), np.zeros(SIZE)
    estimate.angles[:] = HABITS.mean + 0.002 * np.random.default_rng(2).normal(size=POSE - ANGLES)
    before, away, knows = estimate.covariance.copy(), np.zeros(len(KEPT)), np.zeros((len(KEPT), len(KEPT)))
    away[ANGLES:POSE], away[POSE:] = estimate.angles - HABITS.mean, estimate.bias.ravel()
    knows[ANGLES:POSE, ANGLES:POSE] = HABITS.information
    knows[POSE:, POSE:] = np.diag(np.repeat(1.0 / BIAS_VARIANCE, 3))
    open_up(estimate, share, HABITS, BIAS_VARIANCE, jacobian, OPENING_ROOM, step)
    left = left_open(jacobian)
    back = np.eye(SIZE)
    back[np.ix_(KEPT, KEPT)] -= share * left @ knows
    expected = back @ before @ back.T
    expected[np.ix_(KEPT, KEPT)] += share * (2.0 - share) * left
    np.testing.assert_allclose(step[KEPT], -share * left @ knows @ away, atol=1e-9)
    assert np.abs(step[KEPT]).max() > 1e-5 and not np.delete(step, KEPT).any()
    np.testing.assert_allclose(estimate.covariance, expected, atol=1e-10)
    np.testing.assert_array_equal(estimate.left_open, left[:POSE, :POSE])


def test_open_directions_are_what_habit_leaves_when_markers_are_seen():
    estimate = moving_estimate()
    view, before = seen(estimate), prior()
    total = view @ before @ view.T + SHARPNESS_M**2 * np.eye(3 * MARKERS)
    expected = before - before @ view.T @ np.linalg.solve(total, view @ before)
    left = left_open(marker_jacobian(estimate))
    np.testing.assert_allclose(left, expected, atol=1e-8)


def test_what_nothing_shows_returns_to_the_natural_pose_and_its_spread():
    estimate = confident()
    estimate.covariance[BIAS:, BIAS:] = prior()[POSE:, POSE:]
    estimate.angles[:] += 0.2
    end = faded(estimate, 40.0)
    np.testing.assert_allclose(np.sqrt(np.diag(end.covariance)[ANGLES:POSE]), NATURAL, rtol=0.1)
    np.testing.assert_allclose(end.angles, HABITS.mean, atol=0.05 * NATURAL.max())
    assert np.sqrt(np.diag(end.covariance)[:ANGLES]).max() <= 1.001 * WIDEST
    assert np.linalg.eigvalsh(end.covariance[:POSE, :POSE]).min() > -1e-9


def test_habit_is_where_forgetting_comes_to_rest():
    estimate = moving_estimate()
    estimate.angles[:], estimate.bias[:], estimate.covariance[:] = HABITS.mean, 0.0, 0.0
    estimate.covariance[np.ix_(KEPT, KEPT)] = prior()
    end = faded(estimate, 1.0)
    np.testing.assert_allclose(end.angles, HABITS.mean, atol=1e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(end.covariance)[ANGLES:POSE]), NATURAL, rtol=0.02)


def test_a_tenth_of_a_second_takes_what_no_marker_shows_and_moves_no_marker():
    estimate = confident()
    end = faded(estimate, 0.1)
    view = seen(end)
    strayed = view @ end.covariance[np.ix_(KEPT, KEPT)] @ view.T
    assert np.sqrt(np.diag(strayed).max()) < 4e-4
    assert np.sqrt(np.diag(end.covariance)[ANGLES:POSE].max()) > 0.05


@pytest.mark.parametrize("dt", [0.008, 0.02])
def test_forgetting_adds_up_over_short_frames(dt):
    together, apart = faded(confident(), 0.4, 0.04), faded(confident(), 0.4, dt)
    a, b = (np.sqrt(np.diag(end.covariance)[ANGLES:POSE]) for end in (together, apart))
    np.testing.assert_allclose(a, b, rtol=0.05)


def opened(estimate, how=FREE):
    """The step that forgetting takes at once, of a hand that is held so and whose markers show nothing but the palm's
    place."""
    estimate.held[0], step, jacobian = how, np.zeros(SIZE), np.zeros((MARKERS, 3, POSE))
    jacobian[:, :, :ROTATION] = np.eye(3)
    forget(estimate, FADING_S, HABITS, BIAS_VARIANCE, jacobian, GAIN, OPENING_ROOM, step, SEEN)
    return step


def bent(rad):
    estimate = confident()
    estimate.angles[:] = HABITS.mean + rad
    return estimate


def test_the_way_back_to_habit_is_gone_in_small_strides():
    small, large = opened(bent(0.02)), opened(bent(1.0))
    assert np.abs(small[ROTATION:POSE]).max() == pytest.approx(0.02 * (1.0 - np.exp(-0.8)), rel=0.05)
    assert np.abs(large[ROTATION:POSE]).max() == pytest.approx(STRIDE_RAD, rel=0.05)


def test_a_short_stride_gives_up_as_much_less_of_what_is_known():
    """The covariance goes with the mean: a part of the way is a part of the knowledge."""
    estimate = bent(1.0)
    share = STRIDE_RAD  # of the way of 1 rad
    opened(estimate)
    gained = np.diag(estimate.covariance)[ANGLES:POSE] / NATURAL**2
    np.testing.assert_allclose(gained, share * (2.0 - share), rtol=0.05)


def test_a_short_stride_keeps_the_spread_of_habit():
    estimate = bent(1.0)
    estimate.covariance[np.ix_(KEPT, KEPT)] = prior()
    opened(estimate)
    np.testing.assert_allclose(np.diag(estimate.covariance)[ANGLES:POSE], NATURAL**2, rtol=0.05)


def test_the_rest_of_a_hand_that_is_held_is_forgotten_more_slowly_or_not_at_all():
    steps, doubts = [], []
    for how in (FREE, TURN_HELD, PLACED, GOES_ON):
        estimate = bent(0.05)
        steps.append(np.abs(opened(estimate, how)[ANGLES:POSE]).max())
        doubts.append(np.sqrt(np.diag(estimate.covariance)[ANGLES:POSE].max()))
    assert steps[0] == pytest.approx(steps[1]) and doubts[0] == pytest.approx(doubts[1])
    assert 0.0 < steps[2] < 0.2 * steps[0] and 1e-3 < doubts[2] < 0.5 * doubts[0]
    assert steps[3] == 0.0 and doubts[3] == pytest.approx(1e-4, rel=0.05)


def test_a_palm_that_no_camera_sees_returns_to_habit_sooner_and_later_when_one_sees_all():
    steps = []
    for wrist, fingers in ((1, 2), (0, 2), (1, 1)):  # cameras that see them
        estimate, step = bent(0.05), np.zeros(SIZE)
        estimate.held[0] = PALM_HELD
        jacobian = marker_jacobian(estimate)
        if wrist == 0:
            jacobian[WRIST] = 0.0
        if fingers == 1:
            jacobian[:, 2] = 0.0  # along the line of sight
        forget(estimate, FADING_S, HABITS, BIAS_VARIANCE, jacobian, GAIN, OPENING_ROOM, step, SEEN)
        steps.append(np.abs(step[ANGLES:POSE]).max())
    assert steps[1] > 1.5 * steps[0] and 0.3 * steps[0] > steps[2] > 0.0


def test_a_finger_out_of_sight_soon_bends_as_its_neighbours_do():
    """The ring finger was stretched when it was seen last; the others are bent, and known to be."""
    ring, gone = ANGLE_SLICES[3], []
    for away_s in (0.0, 1.0):
        estimate, away = bent(0.5), SEEN.copy()
        estimate.angles[ring], away[3] = 0.0, away_s
        estimate.covariance[ANGLES + 13:ANGLES + 17, ANGLES + 13:ANGLES + 17] = 0.3**2 * np.eye(4)
        for _ in range(10):
            step = np.zeros(SIZE)
            forget(estimate, FADING_S, HABITS, BIAS_VARIANCE, np.zeros((MARKERS, 3, POSE)), GAIN, OPENING_ROOM, step,
                   away)
            estimate = moved(estimate, step)
        gone.append(estimate.angles[ring][1:3].mean() / estimate.angles[ANGLE_SLICES[2]][1:3].mean())
    assert 0.0 < 2.5 * gone[0] < gone[1] < 1.0


@pytest.mark.parametrize(("how", "doubt_rad", "turns"), [(TURN_HELD, 0.5 * SETTLED_RAD, True),
                                                         (FREE, 0.5 * SETTLED_RAD, False),
                                                         (TURN_HELD, 0.98 * SETTLED_RAD, True),
                                                         (TURN_HELD, 1.02 * SETTLED_RAD, False)])
def test_a_palm_that_habit_turns_is_taken_to_turn_once_it_has_been_found(how, doubt_rad, turns):
    estimate, step = moving_estimate(), np.zeros(SIZE)
    estimate.held[0], estimate.turning[0] = how, 0.0
    estimate.covariance[:] = 1e-8 * np.eye(SIZE)
    estimate.covariance[3, 3] = doubt_rad**2
    jacobian = marker_jacobian(estimate)
    forget(estimate, FADING_S, HABITS, BIAS_VARIANCE, jacobian, GAIN, OPENING_ROOM, step, SEEN)
    assert (estimate.turning[0] > 0.01) == turns


@pytest.mark.parametrize(("how", "knuckles", "told"), [(FREE, 0, True), (FREE, 2, False), (TURN_HELD, 0, True),
                                                       (PLACED, 0, False), (GOES_ON, 0, False)])
def test_what_is_open_of_a_palm_that_only_fingers_show_to_turn_is_told(how, knuckles, told):
    estimate, step = moving_estimate(), np.zeros(SIZE)
    estimate.held[0], estimate.left_open[:] = how, 7.0
    jacobian = marker_jacobian(estimate)
    jacobian[:knuckles] = jacobian[WRIST]  # so many more markers on the palm
    forget(estimate, FADING_S, HABITS, BIAS_VARIANCE, jacobian, GAIN, OPENING_ROOM, step, SEEN)
    if told:
        np.testing.assert_array_equal(estimate.left_open,
                                      left_open(jacobian)[:POSE, :POSE])
    else:
        assert not estimate.left_open.any()


def test_a_hand_of_which_hardly_anything_is_seen_is_not_opened():
    estimate, step = bent(0.5), np.zeros(SIZE)
    jacobian = np.zeros((MARKERS, 3, POSE))
    jacobian[:2, :, :ROTATION] = np.eye(3)
    before = estimate.covariance[:ROTATION, :ROTATION].copy()
    forget(estimate, FADING_S, HABITS, BIAS_VARIANCE, jacobian, GAIN, OPENING_ROOM, step, SEEN)
    np.testing.assert_allclose(estimate.covariance[:ROTATION, :ROTATION], before, rtol=0.1)
