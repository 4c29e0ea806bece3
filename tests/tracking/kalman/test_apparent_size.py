"""A hand before one camera: how far away it is, by how large its fingertips look."""

import numpy as np
import pytest
from painted_fingertips import COUNT, DISTANCE_M, INDEX, WEARING, WRIST, looked_at, seen
from places import places_of

from rhot_app.tracking.kalman.apparent_size import EACH, NEEDED, weigh_sizes
from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    BIAS,
    FREE,
    GOES_ON,
    PALM_HELD,
    PLACED,
    POSE,
    TURN_HELD,
    UNSEEN_S,
    copy_estimate,
    displace,
    empty_estimate,
)
from rhot_app.tracking.kalman.hiding import PLACED_BY
from rhot_app.tracking.kalman.sighted import line_of_sight
from rhot_app.tracking.kalman.sizes import measure_sizes
from rhot_node.wire.messages import MarkerFlag

OFF_M = 0.02
SIZE = BIAS + 3 * COUNT


def copied(estimate):
    other = empty_estimate(2, COUNT)
    copy_estimate(estimate, other)
    return other


def alone(bent=0.0):
    """A hand that the second camera no longer sees: its distance is known to 3 cm."""
    estimate = looked_at(bent)
    estimate.unseen[1], estimate.held[0] = UNSEEN_S, PALM_HELD
    sight = sight_of(estimate)
    estimate.covariance[:3, :3] = 1e-3**2 * np.eye(3) + 0.03**2 * np.outer(sight, sight)
    estimate.covariance[ANGLES:POSE, ANGLES:POSE] = np.radians(1.0) ** 2 * np.eye(POSE - ANGLES)
    return estimate


def sight_of(estimate, camera=0):
    sight = np.empty(3)
    line_of_sight(WEARING.cameras.pose[camera], estimate.world[:3, 3], sight)
    return sight


def moved(estimate, by_m):
    other, step = copied(estimate), np.zeros(SIZE)
    step[:3] = by_m
    displace(estimate, step, other)
    return other


def weigh(block, estimate, times=1):
    for _ in range(times):
        block.frame.label[:] = np.arange(COUNT)
        places = places_of(WEARING.worn, estimate)
        measure_sizes(WEARING.worn, WEARING.cameras, block.frame, estimate, places)
        weigh_sizes(WEARING.worn, WEARING.cameras, block.frame, estimate, places)


@pytest.mark.parametrize("off_m", [-OFF_M, OFF_M])
@pytest.mark.parametrize("bent", [0.0, 0.9])
def test_a_hand_that_looks_too_large_is_nearer(off_m, bent):
    true = alone(bent)
    sight = sight_of(true)
    estimate = moved(true, off_m * sight)
    weigh(seen(true, 0), estimate, 10)
    left = estimate.world[:3, 3] - true.world[:3, 3]
    assert abs(left @ sight) < 0.15 * OFF_M
    assert np.linalg.norm(left - left @ sight * sight) < 0.05 * OFF_M
    assert np.degrees(np.abs(estimate.angles - true.angles).max()) < 1.0


def test_fingers_that_would_look_another_size_are_bent_with_it():
    """Nearer, they are bent more, to be where they are seen."""
    true = alone(0.5)
    with_distance = np.zeros(SIZE)
    with_distance[:3], with_distance[ANGLES + 5:POSE] = sight_of(true), -5.0
    true.covariance[:] = 1e-6 * np.eye(SIZE) + 0.03**2 * np.outer(with_distance, with_distance)
    estimate = copied(true)
    displace(true, OFF_M * with_distance, estimate)
    weigh(seen(true, 0), estimate, 10)
    left = difference_of(estimate, true)
    assert abs(left[:3] @ sight_of(true)) < 0.15 * OFF_M
    assert np.abs(left[ANGLES + 5:POSE]).max() < 0.15 * 5.0 * OFF_M


def difference_of(a, b):
    step = np.zeros(POSE)
    step[:3], step[ANGLES:] = a.world[:3, 3] - b.world[:3, 3], a.angles - b.angles
    return step


def test_a_fingertip_that_is_hidden_in_part_does_not_push_the_hand_away():
    true = alone()
    for hidden in ({INDEX: 0.7}, {INDEX: 0.7, 3: 0.8}):
        pushed = []
        for shares in (hidden, dict.fromkeys(range(5), 0.85)):
            estimate = copied(true)
            weigh(seen(true, 0, shares), estimate, 10)
            pushed.append((estimate.world[:3, 3] - true.world[:3, 3]) @ sight_of(true))
        assert abs(pushed[0]) < 0.12 * pushed[1]
        assert pushed[1] == pytest.approx((0.85**-0.5 - 1.0) * DISTANCE_M, rel=0.15)  # if all are, it is farther away


def test_what_has_been_learnt_of_sizes_is_not_learnt_again():
    """A size is wrong in all frames alike."""
    estimate = alone()
    sight, known_m = sight_of(estimate), []
    for _ in range(6):
        weigh(seen(estimate, 0), estimate, 20)
        known_m.append(np.sqrt(sight @ estimate.covariance[:3, :3] @ sight))
    assert known_m[0] < 0.01 and (np.diff(known_m) < 0.0).all()
    assert known_m[-1] > 0.5 * known_m[0] > 0.2 * EACH * DISTANCE_M
    assert np.allclose(estimate.covariance, estimate.covariance.T, atol=1e-15)
    assert np.linalg.eigvalsh(estimate.covariance).min() > -1e-12


def test_what_surprises_is_followed_and_gently():
    true = alone()
    true.covariance[:3, :3] = 1e-3**2 * np.eye(3)
    sight = sight_of(true)
    estimate = moved(true, 0.1 * sight)
    before = estimate.world[:3, 3].copy()
    weigh(seen(true, 0), estimate)
    assert 0.0 < (before - estimate.world[:3, 3]) @ sight < 0.02


def unmoved(block, estimate):
    before = copied(estimate)
    weigh(block, estimate)
    return np.array_equal(before.memory, estimate.memory)


def test_a_hand_that_another_camera_places_is_left_alone():
    true = alone()
    for others in range(COUNT + 1):
        estimate = moved(true, OFF_M * sight_of(true))
        estimate.unseen[1, :others] = 0.0
        assert unmoved(seen(true, 0), estimate) == (others >= PLACED_BY)


def test_only_a_hand_whose_distance_is_held_is_brought():
    true = alone()
    for held in (FREE, TURN_HELD, PLACED, PALM_HELD, GOES_ON):
        estimate = moved(true, OFF_M * sight_of(true))
        estimate.held[0] = held
        assert unmoved(seen(true, 0), estimate) == (held in (FREE, TURN_HELD, PLACED))


def test_too_few_fingertips_of_known_size_say_nothing():
    true = alone()
    for known in range(6):
        estimate = moved(true, OFF_M * sight_of(true))
        estimate.width[known:] = 0.0
        assert unmoved(seen(true, 0), estimate) == (known < NEEDED)
    estimate = moved(true, OFF_M * sight_of(true))
    assert unmoved(seen(true, 0, dict.fromkeys(range(3), 0.9), MarkerFlag.PARTIAL), estimate)
    assert estimate.width[WRIST] == 0.0
