"""Whole updates of the filter: what moves when the hand is held, and what the covariance is afterwards."""

from itertools import pairwise

import numpy as np
import pytest
from known_hand import SETTLED, SIZE, WEARING, blocks, empty, filter_of_hand, moving_estimate, settled
from places import places_of

from rhot_app.hand.skeleton import ANGLE_SLICES
from rhot_app.tracking.kalman import hand_filter
from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    FIRST_FINGER,
    LINEAR,
    PALM_HELD,
    PLACED,
    POSE,
    SCALE,
    TURN,
    TURN_HELD,
    Estimate,
    copy_estimate,
    take_size,
)
from rhot_app.tracking.kalman.motion import predict
from rhot_app.tracking.kalman.sighted import line_of_sight
from rhot_app.tracking.kalman.update import FASTEST_RAD_S

POSES, WRIST, MIDDLE = WEARING.cameras.pose, 5, 2
HIDDEN = 1.0  # s


def weighed(change):
    """The hand that two cameras saw for a second, after one more frame that `change(estimate, block)` has edited, and
    as it was expected at that instant."""
    hand, expected, (known, last), block = filter_of_hand(), empty(), settled(), blocks()[SETTLED]
    for estimate in (hand.estimate, expected):
        copy_estimate(known, estimate)
        estimate.unfaded[:] = 0.0
        estimate.velocity[:ANGLES], estimate.acceleration[:ANGLES], estimate.turning[0] = 0.0, 0.0, 0.0
        change(estimate, block)
    dt = 1e-9 * (block.t_ns - last.t_ns)
    outcome = hand.update(dt, [block])
    predict(expected, dt, WEARING.worn.part, WEARING.habits, WEARING.bias_variance)
    return hand.estimate, expected, outcome


def test_one_camera_moves_a_palm_across_its_line_of_sight_only():
    def hide(estimate, block):
        estimate.unseen[1 - block.observations.camera] = HIDDEN
        block.frame.pixels[WRIST, 0] += 0.3

    after, expected, outcome = weighed(hide)
    assert after.held[0] == PALM_HELD and outcome.verdict.believed.all()
    sight, moved = np.empty(3), after.world[:3, 3] - expected.world[:3, 3]
    line_of_sight(POSES[blocks()[SETTLED].observations.camera], expected.world[:3, 3], sight)
    assert np.linalg.norm(moved) > 3e-5
    assert abs(moved @ sight) < 1e-8
    np.testing.assert_allclose(after.world[:3, :3], expected.world[:3, :3], atol=1e-8)


def test_a_palm_out_of_sight_stays_while_its_fingers_go_where_one_camera_sees_them():
    def hide(estimate, block):
        estimate.unseen[:, WRIST] = estimate.unseen[1 - block.observations.camera] = HIDDEN
        block.frame.seen[WRIST] = False
        block.frame.pixels[:, 0] += 0.1

    after, expected, outcome = weighed(hide)
    assert after.held[0] == PALM_HELD and outcome.verdict.believed.all()
    np.testing.assert_allclose(after.world, expected.world, atol=1e-8)
    assert np.abs(after.angles - expected.angles).max() > 1e-3


def test_a_jump_of_a_palm_that_is_held_is_taken_for_one_of_its_fingers():
    def jump(hide):
        def change(estimate, block):
            estimate.agitation[:] = 0.0
            estimate.unseen[:, WRIST] = HIDDEN if hide else 0.0
            block.frame.seen[WRIST] = not hide
            block.frame.pixels[:, 1] -= 3.0
        return change

    held, free = weighed(jump(hide=True))[0], weighed(jump(hide=False))[0]
    assert held.held[0] == PLACED and not held.agitation[[LINEAR, TURN]].any()
    assert (held.agitation[FIRST_FINGER:] > free.agitation[FIRST_FINGER:]).all()
    assert free.agitation[LINEAR] > 0.1


def test_a_palm_out_of_sight_goes_along_with_fingertips_that_two_cameras_see():
    def hide(estimate, block):
        estimate.unseen[:, WRIST] = HIDDEN
        block.frame.seen[WRIST] = False
        block.frame.pixels[:, 0] += 0.3

    after, expected, outcome = weighed(hide)
    assert after.held[0] == PLACED and outcome.verdict.believed.all()
    assert np.linalg.norm(after.world[:3, 3] - expected.world[:3, 3]) > 5e-5
    np.testing.assert_allclose(after.world[:3, :3], expected.world[:3, :3], atol=1e-8)


def test_a_distance_that_one_camera_sees_is_not_let_go_whatever_is_seen():
    """The hand is taken to be 8 cm too far away, and not known to be there. One camera cannot tell."""
    sight, where = np.empty(3), {}

    def push(estimate, block):
        eye = block.observations.camera
        estimate.unseen[1 - eye] = HIDDEN
        line_of_sight(POSES[eye], estimate.world[:3, 3], sight)
        where["true"] = estimate.world[:3, 3].copy()
        estimate.world[:3, 3] += 0.08 * sight
        estimate.covariance[:3, :3] += 0.08**2 * np.outer(sight, sight)

    after, expected, _ = weighed(push)
    assert after.held[0] == PALM_HELD
    assert abs((after.world[:3, 3] - where["true"]) @ sight - 0.08) < 1e-6
    np.testing.assert_allclose(after.world[:3, :3], expected.world[:3, :3], atol=1e-8)


def test_a_finger_that_cannot_bend_as_it_is_held_to_is_let_go(monkeypatch):
    """One camera sees the middle finger where it would not be with all its joints bent alike; both see the wrist."""
    def stray(estimate, block):
        estimate.unseen[1 - block.observations.camera, MIDDLE] = HIDDEN
        rows = slice(ANGLES + ANGLE_SLICES[MIDDLE].start, ANGLES + ANGLE_SLICES[MIDDLE].stop)
        estimate.covariance[rows] = estimate.covariance[:, rows] = 0.0
        estimate.covariance[rows, rows] = 0.3**2 * np.eye(4)
        block.frame.pixels[MIDDLE] += (-16.0, 40.0)

    def bend():
        """How far the finger bends in each of its joints, rad."""
        after, expected, outcome = weighed(stray)
        assert after.held[0] == TURN_HELD and outcome.verdict.believed.all()
        return (after.angles - expected.angles)[ANGLE_SLICES[MIDDLE]][1:]

    knuckle, joint, last = bend()
    assert knuckle > 1.5 * joint and last < 0.2 * knuckle
    monkeypatch.setattr(hand_filter, "MISFIT", np.inf)
    knuckle, joint, last = bend()
    assert joint > 1.2 * knuckle and last > 0.8 * knuckle


@pytest.mark.parametrize(("off_px", "most_rad", "taken"), [(0.0, 1.0, True), (0.0, 1e-7, False), (8.0, 1.0, False)])
def test_a_gentle_update_is_not_concluded_when_it_turns_the_hand_or_shows_what_is_unlikely(off_px, most_rad, taken):
    (known, last), block = settled(), blocks()[SETTLED]
    block.frame.pixels[MIDDLE, 0] += off_px
    gentle, plain = filter_of_hand(), filter_of_hand()
    for hand in (gentle, plain):
        copy_estimate(known, hand.estimate)
    dt = 1e-9 * (block.t_ns - last.t_ns)
    outcome = gentle.update_gently(dt, [block], most_rad)
    assert (outcome is not None) == taken
    if outcome is not None:
        expected = plain.update(dt, [block])
        np.testing.assert_array_equal(outcome.verdict.widening, expected.verdict.widening)
        np.testing.assert_array_equal(gentle.estimate.memory, plain.estimate.memory)


def test_a_hand_begun_anew_remembers_nothing_of_the_lost_one():
    fresh, used = filter_of_hand(), filter_of_hand()
    copy_estimate(settled()[0], used.estimate)
    used.estimate.turning[:], used.estimate.held[:], used.estimate.unfaded[:] = 300.0, PALM_HELD, 0.03
    for hand in (fresh, used):
        hand.start(settled()[0].world, settled()[0].angles)
    for field, one, other in zip(Estimate._fields, fresh.estimate, used.estimate, strict=True):
        np.testing.assert_array_equal(one, other, err_msg=field)


def test_a_palm_that_spins_faster_than_a_forearm_can_is_lost():
    hand = filter_of_hand()
    hand.start(settled()[0].world, settled()[0].angles)
    assert not hand.astray
    hand.estimate.velocity[4] = -1.1 * FASTEST_RAD_S
    assert hand.astray


def test_rounding_does_not_add_up():
    """What makes the covariance unsymmetric is not kept: as knowledge fades it would grow without end."""
    hand, (known, last) = filter_of_hand(), settled()
    copy_estimate(known, hand.estimate)
    covariance, sd = hand.estimate.covariance, np.sqrt(np.diag(known.covariance))
    crooked = 1e-9 * np.random.default_rng(3).normal(size=(SIZE, SIZE)) * np.outer(sd, sd)
    covariance += crooked - crooked.T

    def skew():
        away = (covariance - covariance.T)[:ANGLES, :ANGLES]
        return np.abs(away / np.outer(sd, sd)[:ANGLES, :ANGLES]).max()

    before = skew()
    for earlier, block in pairwise([last, *blocks()[SETTLED:]]):
        hand.update(1e-9 * (block.t_ns - earlier.t_ns), [block])
    assert before > 1e-10 and skew() < 1e-3 * before


def tracked_with(size):
    """A hand that two cameras saw for a second, by a filter that was told its size, (log_scale, variance)."""
    hand, frames, truth = filter_of_hand(), blocks()[:SETTLED], moving_estimate()
    hand.resize(*size)
    hand.start(truth.world, truth.angles)
    for before, block in pairwise([frames[0], *frames]):
        hand.update(1e-9 * (block.t_ns - before.t_ns), [block])
    return hand.estimate


def test_the_filter_learns_no_size_and_what_is_not_known_of_it_is_doubt_about_the_pose():
    sure, unsure = tracked_with((0.05, 0.0)), tracked_with((0.05, 0.01))
    assert unsure.log_scale[0] == 0.05 and unsure.covariance[SCALE, SCALE] == 0.01
    np.testing.assert_allclose(unsure.covariance, unsure.covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(unsure.covariance).min() > -1e-9
    angles = [np.sqrt(one.covariance[ANGLES:POSE, ANGLES:POSE].diagonal().mean()) for one in (sure, unsure)]
    assert angles[1] > 1.5 * angles[0]
    tips = []
    for estimate in (sure, unsure):  # where a tip is, cameras show, whatever the size
        points, jacobian, _ = places_of(WEARING.worn, estimate)
        slope = np.zeros((3, SIZE))
        slope[:, :POSE], slope[:, SCALE] = jacobian[MIDDLE], points[MIDDLE] - estimate.world[:3, 3]
        tips.append(np.sqrt(np.trace(slope @ estimate.covariance @ slope.T)))
    assert max(tips) < 2e-3 < 0.01 < 0.1 * np.linalg.norm(slope[:, SCALE])


def test_a_size_that_is_better_known_takes_its_doubt_along():
    estimate = moving_estimate()
    before = estimate.covariance.copy()
    for variance in (0.5, 0.1, 3.0):
        size = np.array([0.07, variance * before[SCALE, SCALE]])
        take_size(estimate, size)
        assert estimate.log_scale[0] == 0.07 and estimate.covariance[SCALE, SCALE] == size[1]
        assert np.linalg.eigvalsh(estimate.covariance).min() > 0.0
    np.testing.assert_allclose(estimate.covariance[SCALE, :POSE], np.sqrt(0.1) * before[SCALE, :POSE])
