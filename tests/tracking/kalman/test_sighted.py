"""Who sees which marker, and what that leaves open."""

import numpy as np
import pytest
from known_hand import MARKERS, WEARING, moving_estimate, sighting

from rhot_app.tracking.kalman.estimate import ANGLES, FREE, PALM_HELD, POSE, TURN_HELD, UNSEEN_S
from rhot_app.tracking.kalman.rows import PALM_PART
from rhot_app.tracking.kalman.sighted import (
    FRESH_S,
    KEPT_S,
    count_seen,
    eyes_now,
    eyes_on,
    fingers_away,
    keep_shown,
    line_of_sight,
    note_sights,
    since_seen,
)

PART, POSES = WEARING.worn.part, WEARING.cameras.pose
LONG = 2.0 * FRESH_S
NOBODY = -1  # the camera of what no camera observed


def all_unseen(seconds=LONG):
    estimate = moving_estimate()
    estimate.unseen[:] = seconds
    return estimate


def test_what_is_believed_was_seen_and_what_is_not_believed_was_not():
    estimate = all_unseen()
    note_sights(estimate, PART, sighting((0, 2), (1, 4), (1, 5)), np.array([True, False, True]))
    expected = np.full((2, MARKERS), LONG)
    expected[0, 2] = expected[1, 5] = 0.0
    np.testing.assert_array_equal(estimate.unseen, expected)


def test_what_no_camera_observed_shows_the_markers_of_its_part():
    part, rows, estimate = np.array([0, 1, 1, 3, 4, PALM_PART]), sighting((NOBODY, 0)), all_unseen()
    rows.part[0] = 1
    note_sights(estimate, part, rows, np.array([True]))
    np.testing.assert_array_equal(estimate.unseen, np.where(part == 1, 0.0, LONG) * np.ones((2, 1)))


def test_what_is_seen_now_counts_whether_it_is_believed_or_not():
    estimate = all_unseen()
    estimate.unseen[1, 4] = 0.0
    now = sighting((0, 2), (NOBODY, 3), (0, 4))
    assert [eyes_now(estimate.unseen, m, now) for m in range(MARKERS)] == [
        (2, 1) if m == 4 else (1, 0) if m == 2 else (0, -1) for m in range(MARKERS)]
    assert eyes_on(estimate.unseen, 2) == (0, -1)


@pytest.mark.parametrize(("seen", "eyes"), [((LONG, LONG), (0, -1)), ((0.0, LONG), (1, 0)),
                                            ((LONG, 0.5 * FRESH_S), (1, 1)),
                                            ((0.0, 0.99 * FRESH_S), (2, 1)), ((0.0, FRESH_S), (1, 0))])
def test_a_camera_that_saw_a_marker_a_moment_ago_still_sees_it(seen, eyes):
    unseen = np.full((2, MARKERS), LONG)
    unseen[:, 3] = seen
    assert eyes_on(unseen, 3) == eyes


def test_a_finger_is_away_since_any_camera_saw_any_of_its_markers():
    part, estimate = np.array([0, 1, 1, 3, 4, PALM_PART]), all_unseen(1.0)
    estimate.unseen[1, 2], estimate.unseen[0, 4], estimate.unseen[:, 5] = 0.2, 0.3, 0.0
    away = np.empty(5)
    fingers_away(estimate, part, away)
    np.testing.assert_array_equal(away, [1.0, 0.2, UNSEEN_S, 1.0, 0.3])


def test_a_marker_is_unseen_since_the_last_camera_saw_it_and_a_camera_sees_what_it_just_saw():
    unseen = np.full((2, MARKERS), LONG)
    unseen[0, 3], unseen[1, 3], unseen[1, 4] = 0.3, 0.5 * FRESH_S, 0.0
    assert since_seen(unseen, 3) == 0.5 * FRESH_S and since_seen(unseen, 0) == LONG
    assert [count_seen(unseen, camera) for camera in range(2)] == [0, 2]


@pytest.mark.parametrize("camera", [0, 1])
def test_line_of_sight_leads_from_the_camera_to_the_point(camera):
    point, out = np.array([0.03, -0.2, 0.7]), np.empty(3)
    turned = POSES[camera].copy()
    turned[:, :3] = np.array([[0.0, -1.0, 0.0], [0.8, 0.0, -0.6], [0.6, 0.0, 0.8]]) @ turned[:, :3]
    line_of_sight(turned, point, out)
    ahead = point + turned[:, :3].T @ turned[:, 3]
    np.testing.assert_allclose(out, ahead / np.linalg.norm(ahead), atol=1e-12)


def test_what_is_shown_of_a_marker_is_what_its_cameras_see_of_it():
    """Markers 0 and 5 (on the palm) out of sight, 1 before one camera, the others before both."""
    rng, estimate = np.random.default_rng(1), all_unseen(0.0)
    estimate.unseen[:, [0, 5]] = LONG
    estimate.unseen[0, 1] = LONG
    points, before = np.array([0.0, 0.0, 3.0]) + rng.normal(size=(MARKERS, 3)), rng.normal(size=(MARKERS, 3, POSE))
    after, sight = before.copy(), np.empty(3)
    keep_shown(estimate, PART, WEARING.worn.palmar, POSES, points, after)
    line_of_sight(POSES[1], points[1], sight)
    np.testing.assert_array_equal(after[2:5], before[2:5])
    np.testing.assert_allclose(sight @ after[1], 0.0, atol=1e-12)
    np.testing.assert_allclose(after[1], before[1] - np.outer(sight, sight @ before[1]), atol=1e-12)
    assert not after[5].any() and not after[0, :, :ANGLES].any()
    np.testing.assert_array_equal(after[0, :, ANGLES:], before[0, :, ANGLES:])


@pytest.mark.parametrize(("how", "away", "kept"), [(TURN_HELD, LONG, True), (TURN_HELD, 0.99 * KEPT_S, True),
                                                   (TURN_HELD, KEPT_S, False), (FREE, LONG, False),
                                                   (PALM_HELD, LONG, False)])
def test_paint_that_was_covered_shows_for_a_while_how_a_held_palm_is_turned(how, away, kept):
    estimate, palmar = all_unseen(0.0), np.arange(MARKERS) == 5
    estimate.unseen[:, 5], estimate.held[0] = away, how
    after = np.ones((MARKERS, 3, POSE))
    keep_shown(estimate, PART, palmar, POSES, np.ones((MARKERS, 3)), after)
    assert after[5].all() == kept and after[5].any() == kept
