"""What is told of how fingers bent before one camera."""

import numpy as np
import pytest
from painted_fingertips import COUNT, INDEX, WEARING, hand, looked_at, opened, placed, seen

from rhot_app.hand.skeleton import ANGLE_SLICES
from rhot_app.tracking.bends import ACROSS_M, OTHERWISE, tell_of_bends
from rhot_app.tracking.kalman.estimate import ANGLES, POSE, UNSEEN_S
from rhot_app.tracking.kalman.hiding import PLACED_BY
from rhot_app.tracking.kalman.sighted import line_of_sight

TIPS = np.arange(5)
COLUMNS = np.arange(ANGLES, POSE)[ANGLE_SLICES[INDEX]]


def before_one_camera(bent_rad):
    """A hand that the second camera no longer sees, whose index finger has bent so far since."""
    estimate = hand(0.4)
    estimate.placed_angles[:] = estimate.angles
    estimate.placed_angles[COLUMNS[-1] - ANGLES] -= bent_rad
    estimate.unseen[1] = UNSEEN_S
    return estimate


def told(estimate, tips=TIPS):
    points, jacobian, _ = placed(estimate)
    covariance = np.zeros((POSE + 1, POSE + 1))
    tell_of_bends(estimate, WEARING.cameras.pose, tips, points, jacobian, covariance)
    return covariance


@pytest.mark.parametrize("bent_rad", [0.2, -0.8])
def test_a_finger_that_bent_is_known_less_along_the_line_of_sight_and_no_other_is(bent_rad):
    estimate = before_one_camera(bent_rad)
    covariance, (points, jacobian, _) = told(estimate), placed(estimate)
    assert np.flatnonzero(covariance.any(axis=0)).tolist() == COLUMNS.tolist()
    assert np.linalg.eigvalsh(covariance).min() > -1e-12
    assert np.trace(covariance) < len(COLUMNS) * (OTHERWISE * bent_rad) ** 2
    tip = jacobian[INDEX] @ covariance[:POSE, :POSE] @ jacobian[INDEX].T
    sight = np.empty(3)
    line_of_sight(WEARING.cameras.pose[0], points[INDEX], sight)
    across = tip - np.outer(sight, sight) @ tip @ np.outer(sight, sight)
    along_m = np.sqrt(sight @ tip @ sight)
    assert 0.005 * abs(bent_rad) < along_m < 0.02 * abs(bent_rad)
    assert np.trace(tip) - along_m**2 <= 2.0 * ACROSS_M**2 and np.abs(np.diag(across)).max() < along_m**2


def test_it_is_known_the_less_the_farther_it_bent():
    sizes = [np.trace(told(before_one_camera(bent))) for bent in (0.0, 0.3, 0.6)]
    assert sizes[0] == 0.0 and sizes[2] == pytest.approx(4.0 * sizes[1], rel=0.05)


@pytest.mark.parametrize(("first", "second", "is_told"), [(COUNT, COUNT, False), (COUNT, PLACED_BY - 1, True),
                                                         (PLACED_BY, 0, True), (PLACED_BY - 1, 0, False)])
def test_only_a_hand_that_one_camera_sees_is_told_so(first, second, is_told):
    estimate = before_one_camera(0.5)
    for camera, count in enumerate((first, second)):
        estimate.unseen[camera, :count], estimate.unseen[camera, count:] = 0.0, UNSEEN_S
    assert told(estimate).any() == is_told


def test_a_finger_without_a_marker_on_its_tip_is_left_to_habit():
    assert not told(before_one_camera(0.5), np.where(TIPS == INDEX, -1, TIPS)).any()


def test_how_a_hand_is_bent_is_remembered_while_two_cameras_see_it():
    estimate = looked_at(0.4)
    assert np.array_equal(estimate.placed_angles, estimate.angles)
    for camera, others, remembers in ((0, COUNT, True), (0, PLACED_BY - 1, False)):
        estimate.angles[7] += 0.1
        estimate.unseen[1 - camera] = UNSEEN_S
        estimate.unseen[1 - camera, :others] = 0.0
        opened(seen(estimate, camera), estimate)
        assert np.array_equal(estimate.placed_angles, estimate.angles) == remembers
    estimate.unseen[:] = 0.0
    nothing = seen(estimate, 1)
    nothing.frame.seen[:] = False
    opened(nothing, estimate)
    assert not np.array_equal(estimate.placed_angles, estimate.angles)
