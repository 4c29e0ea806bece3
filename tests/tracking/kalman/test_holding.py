"""How the hand is held, by who sees what of it."""

import numpy as np
import pytest
from known_hand import WEARING, sighting

from rhot_app.hand.skeleton import ANGLE_SLICES, FLEXIONS
from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    BIAS,
    FREE,
    GOES_ON,
    PALM_HELD,
    PLACED,
    POSE,
    TURN_HELD,
    VELOCITY,
    empty_estimate,
)
from rhot_app.tracking.kalman.gain import MOST_HELD
from rhot_app.tracking.kalman.holding import (
    ARRIVE_S,
    HURRIES_M_S,
    HURRIES_RAD_S,
    STRANGE,
    TURNED_RAD_S,
    TURNS_RAD_S,
    hold,
    strangeness,
)
from rhot_app.tracking.kalman.rows import PALM_PART
from rhot_app.tracking.kalman.sighted import line_of_sight
from rhot_app.tracking.kalman.withholding import empty_held

STIFF, POSES = WEARING.habits.stiff, WEARING.cameras.pose
TIPS = (0, 1, 2, 3, 4)
WRIST, INDEX = 5, 1
HIDDEN = 1.0  # s


def hand_with(on_palm=1):
    """A hand at rest that both cameras see, with fingertips and `on_palm` markers; and its markers' parts."""
    estimate = empty_estimate(2, 5 + on_palm)
    estimate.world[:3, :3], estimate.world[:3, 3] = FACING, (0.03, 0.08, 0.6)
    estimate.covariance[:] = 1e-6 * np.eye(len(estimate.covariance))
    estimate.unseen[:], estimate.angles[:] = 0.0, WEARING.habits.mean
    return estimate, np.array([*TIPS, *[PALM_PART] * on_palm])


def held_of(estimate, part, *seen, palmar=()):
    """(K, N) the directions that are held, when `seen` (camera, marker) is what the update sees; fingers may cover
    the markers `palmar`."""
    held = empty_held(BIAS + 3 * len(part))
    held.used[0], held.directions[:7], held.sight[:] = 7, 3.0, 2.0  # of an earlier update
    hold(estimate, sighting(*seen, part=part), part, np.isin(np.arange(len(part)), palmar), POSES, WEARING.habits, held)
    count = held.used[0]
    assert count <= MOST_HELD and not held.directions[count:].any()
    placing = held.directions[:count, :3][held.directions[:count, :3].any(axis=1)]
    alone = np.count_nonzero(estimate.unseen.min(axis=1) < ARRIVE_S) < 2
    np.testing.assert_array_equal(held.sight, placing[0] if alone and len(placing) == 1 else np.zeros(3))
    return held.directions[:count]


def orders(*rows):
    """(3 K, N) the rows (27,) of a pose, of its velocity and of its acceleration, each in turn."""
    out = np.zeros((3 * len(rows), BIAS))
    for k, row in enumerate(rows):
        for order, base in enumerate((0, VELOCITY, ACCELERATION)):
            out[3 * k + order, base:base + POSE] = row
    return out


def numbers(*which):
    return orders(*np.eye(POSE)[list(which)])


TURNED = numbers(3, 4, 5)


def assert_holds(directions, expected):
    assert not directions[:, BIAS:].any()
    np.testing.assert_allclose(directions[:, :BIAS], expected, atol=1e-12)


@pytest.mark.parametrize(("on_palm", "how"), [(0, FREE), (1, TURN_HELD), (2, TURN_HELD), (3, FREE), (4, FREE)])
def test_a_hand_in_full_sight_is_held_by_the_markers_on_its_palm(on_palm, how):
    estimate, part = hand_with(on_palm)
    estimate.held[0] = PALM_HELD
    directions = held_of(estimate, part)
    assert estimate.held[0] == how
    assert_holds(directions, TURNED if how == TURN_HELD else np.zeros((0, BIAS)))


@pytest.mark.parametrize(("hidden_from", "how"), [((0,), TURN_HELD), ((0, 1), TURN_HELD), ((), FREE)])
def test_three_markers_on_a_palm_show_its_turn_only_while_two_cameras_see_them(hidden_from, how):
    estimate, part = hand_with(3)
    estimate.unseen[list(hidden_from), WRIST + 2] = HIDDEN
    estimate.unseen[0, INDEX] = HIDDEN
    directions = held_of(estimate, part)
    assert estimate.held[0] == how
    stiff = orders(*stiff_of(INDEX))
    assert_holds(directions, np.vstack([stiff, TURNED]) if how == TURN_HELD else stiff)


def test_without_markers_on_the_palm_nothing_is_held_whatever_is_hidden():
    estimate, part = hand_with(0)
    estimate.unseen[0, :3] = HIDDEN
    assert len(held_of(estimate, part)) == 0 and estimate.held[0] == FREE


@pytest.mark.parametrize("eye", [0, 1])
def test_a_palm_that_one_camera_sees_keeps_its_distance_and_its_turn(eye):
    estimate, part = hand_with()
    estimate.unseen[1 - eye] = HIDDEN
    sight = np.empty(3)
    line_of_sight(POSES[eye], estimate.world[:3, 3], sight)
    directions = held_of(estimate, part)
    assert estimate.held[0] == PALM_HELD
    assert_holds(directions, np.vstack([orders(np.r_[sight, np.zeros(POSE - 3)]), TURNED]))


@pytest.mark.parametrize("hidden_from", [(0, 1), (0,), (1,)])
def test_a_palm_is_placed_by_a_fingertip_that_two_cameras_see(hidden_from):
    estimate, part = hand_with()
    estimate.unseen[list(hidden_from), WRIST] = HIDDEN
    estimate.unseen[0, [0, 2, 3, 4]] = HIDDEN
    directions = held_of(estimate, part)
    assert estimate.held[0] == PLACED
    assert_holds(directions, TURNED)


def test_a_palm_out_of_sight_whose_fingertips_one_camera_sees_is_held_whole():
    estimate, part = hand_with()
    estimate.unseen[:, WRIST] = estimate.unseen[0] = HIDDEN
    directions = held_of(estimate, part)
    assert estimate.held[0] == PALM_HELD
    assert_holds(directions, np.vstack([numbers(0, 1, 2), TURNED]))


def test_what_this_update_sees_counts():
    """The wrist was hidden from both cameras; now one sees it again, and it was seen by the other."""
    estimate, part = hand_with()
    estimate.unseen[:, WRIST] = HIDDEN
    held_of(estimate, part, (0, WRIST))
    assert estimate.held[0] == PLACED
    estimate.unseen[1, WRIST] = 0.01
    held_of(estimate, part, (0, WRIST))
    assert estimate.held[0] == TURN_HELD


def faster(estimate, part, palm_m_s=0.0, palm_rad_s=0.0):
    estimate.velocity[:] = 0.0
    estimate.velocity[1], estimate.velocity[4] = palm_m_s, palm_rad_s
    return held_of(estimate, part)


@pytest.mark.parametrize("hidden_from", [(0, 1), (0,)])
@pytest.mark.parametrize(("speed", "how"), [((0.9 * HURRIES_M_S, 0.9 * HURRIES_RAD_S), PLACED),
                                            ((1.2 * HURRIES_M_S, 0.0), FREE),
                                            ((0.0, 1.2 * HURRIES_RAD_S), FREE)])
def test_a_palm_out_of_sight_that_hurries_is_not_held_but_its_half_seen_fingers_are_stiff(hidden_from, speed, how):
    estimate, part = hand_with()
    estimate.unseen[list(hidden_from), WRIST] = estimate.unseen[0, INDEX] = HIDDEN
    directions = faster(estimate, part, *speed)
    assert estimate.held[0] == how
    assert_holds(directions, orders(*stiff_of(INDEX)) if how == FREE else TURNED)


@pytest.mark.parametrize("hidden_from", [(0, 1), (0,)])
def test_a_palm_out_of_sight_that_turned_just_now_is_not_held(hidden_from):
    estimate, part = hand_with()
    estimate.unseen[list(hidden_from), WRIST] = HIDDEN
    for turning, how in ((0.9, PLACED), (1.1, FREE)):
        estimate.held[0], estimate.turning[0] = FREE, turning * TURNED_RAD_S
        held_of(estimate, part)
        assert estimate.held[0] == how


def test_a_palm_that_goes_on_before_one_camera_keeps_its_distance_and_turns():
    estimate, part = hand_with()
    estimate.unseen[0] = HIDDEN
    sight = np.empty(3)
    line_of_sight(POSES[1], estimate.world[:3, 3], sight)
    for _ in range(2):  # it does not pass for one that only seems to hurry since it was held
        directions = faster(estimate, part, palm_rad_s=1.2 * HURRIES_RAD_S)
        assert estimate.held[0] == GOES_ON
        assert_holds(directions, np.vstack([orders(*STIFF), orders(np.r_[sight, np.zeros(POSE - 3)])]))


def bent_strangely(estimate):
    """All fingers to one side, as a palm looks that turned: nobody's hand."""
    estimate.angles[[5, 9, 13, 17]] += 0.5


@pytest.mark.parametrize("hidden", [(), ((0, WRIST),), ((0, WRIST), (1, WRIST)), ((0, INDEX),)])
def test_nothing_is_held_of_a_hand_that_would_have_to_be_bent_strangely(hidden):
    estimate, part = hand_with()
    for camera, marker in hidden:
        estimate.unseen[camera, marker] = HIDDEN
    assert strangeness(estimate.angles, WEARING.habits) < 0.1 * STRANGE
    assert len(held_of(estimate, part)) > 0 and estimate.held[0] != FREE
    bent_strangely(estimate)
    assert strangeness(estimate.angles, WEARING.habits) > STRANGE
    assert len(held_of(estimate, part)) == 0 and estimate.held[0] == FREE


def test_the_distance_of_a_hand_that_one_camera_sees_is_held_however_it_is_bent():
    estimate, part = hand_with()
    bent_strangely(estimate)
    estimate.unseen[0] = HIDDEN
    held_of(estimate, part)
    assert estimate.held[0] == PALM_HELD


def test_a_palm_that_seems_to_hurry_only_since_it_was_held_is_still_held():
    """Its speed is what fingertips made of it."""
    estimate, part = hand_with()
    estimate.unseen[:, WRIST] = HIDDEN
    for before in (PLACED, PALM_HELD):
        estimate.held[0] = before
        faster(estimate, part, 2.0 * HURRIES_M_S)
        assert estimate.held[0] == PLACED
    estimate.held[0] = TURN_HELD
    faster(estimate, part, 2.0 * HURRIES_M_S)
    faster(estimate, part, 2.0 * HURRIES_M_S)
    assert estimate.held[0] == FREE


def test_a_speed_that_may_be_noise_is_none():
    estimate, part = hand_with()
    estimate.unseen[:, WRIST] = HIDDEN
    estimate.covariance[VELOCITY + 1, VELOCITY + 1] = HURRIES_M_S**2
    faster(estimate, part, 1.9 * HURRIES_M_S)
    assert estimate.held[0] == PLACED
    estimate.held[0] = TURN_HELD
    faster(estimate, part, 2.3 * HURRIES_M_S)
    assert estimate.held[0] == FREE


def test_the_turn_of_a_hand_that_moves_in_sight_is_not_held():
    estimate, part = hand_with()
    assert len(faster(estimate, part, 1.2 * HURRIES_M_S)) == 0 and estimate.held[0] == FREE
    estimate.velocity[:], estimate.turning[0] = 0.0, 1.1 * TURNS_RAD_S
    assert len(held_of(estimate, part)) == 0 and estimate.held[0] == FREE
    estimate.unseen[0, 2] = HIDDEN  # the other camera still sees it, but not where it is along its line of sight
    held_of(estimate, part)
    assert estimate.held[0] == TURN_HELD
    estimate.turning[0] = 1.1 * TURNED_RAD_S
    assert_holds(held_of(estimate, part), orders(*stiff_of(2)))
    assert estimate.held[0] == FREE


def test_covered_paint_does_not_keep_a_turning_palm_from_being_known_by_its_fingertips():
    estimate, part = hand_with(3)
    estimate.turning[0], estimate.unseen[:, 6] = 1.1 * TURNS_RAD_S, HIDDEN
    held_of(estimate, part, palmar=(6, 7))
    assert estimate.held[0] == FREE
    held_of(estimate, part)
    assert estimate.held[0] == TURN_HELD
    estimate.turning[0] = 0.0
    held_of(estimate, part, palmar=(6, 7))
    assert estimate.held[0] == TURN_HELD


def stiff_of(finger):
    columns = slice(ANGLES + ANGLE_SLICES[finger].start, ANGLES + ANGLE_SLICES[finger].stop)
    return STIFF[np.abs(STIFF[:, columns]).max(axis=1) > 0.0]


@pytest.mark.parametrize("on_palm", [1, 3])
@pytest.mark.parametrize("finger", [0, INDEX, 4])
def test_a_finger_that_one_camera_sees_is_stiff(on_palm, finger):
    estimate, part = hand_with(on_palm)
    estimate.unseen[0, finger] = HIDDEN
    directions = held_of(estimate, part)
    expected = orders(*stiff_of(finger))
    assert_holds(directions, expected if on_palm == 3 else np.vstack([expected, TURNED]))
    assert estimate.held[0] == (FREE if on_palm == 3 else TURN_HELD)


def test_all_fingers_before_one_camera_find_room():
    estimate, part = hand_with()
    estimate.unseen[0, :5] = HIDDEN
    assert_holds(held_of(estimate, part), np.vstack([orders(*STIFF), TURNED]))


def test_a_finger_that_none_sees_is_not_stiff():
    estimate, part = hand_with()
    estimate.unseen[:, INDEX] = HIDDEN
    assert_holds(held_of(estimate, part), TURNED)


def test_a_stiff_finger_may_stretch_aside_and_bend_all_its_joints_at_once():
    natural = np.sqrt(np.diag(np.linalg.inv(WEARING.model.natural.information)))
    for finger, columns in enumerate(ANGLE_SLICES):
        rows, bend, aside = stiff_of(finger), np.zeros(POSE), np.zeros(POSE)
        bend[ANGLES + np.array(FLEXIONS[finger])] = natural[list(FLEXIONS[finger])]
        aside[ANGLES + columns.start] = 1.0
        np.testing.assert_allclose(rows @ rows.T, np.eye(columns.stop - columns.start - 2), atol=1e-12)
        np.testing.assert_allclose(rows @ np.array([bend, aside]).T, 0.0, atol=1e-6)
    assert len(STIFF) == sum(len(stiff_of(finger)) for finger in TIPS)
