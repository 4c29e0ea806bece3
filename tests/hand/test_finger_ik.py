"""Finger inverse kinematics: targets met, limits kept, neighbours near."""

from dataclasses import replace

import numpy as np
import pytest
from hand_samples import natural_angles, natural_motion, random_pose, random_world

from rhot_app.hand.kinematics import forward
from rhot_app.hand.limits import clamp_angle
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES, HandPose
from rhot_app.hand.solvers.fabrik import fabrik_within
from rhot_app.hand.solvers.finger_chain import Status, chain_points, to_finger
from rhot_app.hand.solvers.finger_ik import solve_fingers

HUNDREDTH_DEGREE = np.radians(0.01)


def test_reachable_targets_are_met_within_limits(model):
    rng = np.random.default_rng(1)
    low, high = model.limits.T
    residuals = []
    for _ in range(300):
        pose = random_pose(model, rng)
        targets = forward(model, pose).marker_centres
        solution = solve_fingers(model, neutral_pose(pose.world_from_palm), targets)
        residuals.append(solution.residuals)
        assert (solution.angles >= low - HUNDREDTH_DEGREE).all() and (solution.angles <= high + HUNDREDTH_DEGREE).all()
        effectors = forward(model, HandPose(pose.world_from_palm, solution.angles)).marker_centres
        np.testing.assert_allclose(np.linalg.norm(effectors - targets, axis=1), solution.residuals, atol=1e-9)
    met = np.array(residuals)
    assert (met <= 5e-5).mean() > 0.998
    assert met.max() < 1e-3


def test_fabrik_alone_comes_near_and_keeps_the_limits(right_hand):
    rng = np.random.default_rng(3)
    misses = []
    for _ in range(300):
        pose = random_pose(right_hand, rng, np.eye(4))
        targets = forward(right_hand, pose).marker_centres
        for finger, rows in enumerate(ANGLE_SLICES):
            local, joints = np.empty(3), np.empty((4, 3))
            to_finger(np.eye(4), 1.0, right_hand.base[finger], right_hand.base_rotation[finger], targets[finger], local)
            angles, limits = neutral_pose().angles[rows].copy(), right_hand.limits[rows]
            fabrik_within(angles, right_hand.chain[finger], limits, local, 1e-4, 20)
            assert (angles >= limits[:, 0]).all() and (angles <= limits[:, 1]).all()
            chain_points(angles, right_hand.chain[finger], joints, np.empty((3, len(angles))))
            misses.append(np.linalg.norm(joints[3] - local))
    assert np.median(misses) < 2e-4


def test_unreachable_target_stretches_the_finger_towards_it(right_hand):
    world = random_world(np.random.default_rng(4))
    straight = np.zeros(21)
    straight[6] = 0.5  # index finger straight, bent in its MCP joint only
    points = forward(right_hand, HandPose(world, straight))
    base, centre = points.joints[5], points.marker_centres[1]
    targets = np.full((5, 3), np.nan)
    targets[1] = base + 1.5 * (centre - base)
    solution = solve_fingers(right_hand, neutral_pose(world), targets)
    assert not solution.reached[1] and solution.statuses[1] == Status.UNREACHABLE
    assert solution.residuals[1] == pytest.approx(0.5 * np.linalg.norm(centre - base), rel=1e-3)
    np.testing.assert_allclose(solution.angles[5:9], straight[5:9], atol=0.03)


def test_target_behind_the_hand_says_not_reached_and_stays_legal(right_hand):
    targets = np.full((5, 3), np.nan)
    targets[2] = 0.06, 0.0, 0.06
    solution = solve_fingers(right_hand, neutral_pose(), targets)
    assert solution.statuses[2] == Status.LIMITED and np.isfinite(solution.angles).all()
    assert (solution.angles >= right_hand.limits[:, 0]).all()


def test_free_joints_follow_the_dip_coupling(right_hand):
    angles = neutral_pose().angles.copy()
    for finger in range(1, 5):
        angles[6 + 4 * (finger - 1):9 + 4 * (finger - 1)] = np.radians([30.0, 45.0, 30.0])
    targets = forward(right_hand, HandPose(np.eye(4), angles)).marker_centres
    found = solve_fingers(right_hand, HandPose(np.eye(4), np.clip(angles + 0.3, *right_hand.limits.T)), targets).angles
    for finger in range(1, 5):
        pip, dip = found[7 + 4 * (finger - 1):9 + 4 * (finger - 1)]
        assert abs(np.degrees(dip - 2 / 3 * pip)) < 3.0


def test_nearby_targets_give_nearby_angles(right_hand):
    world = random_world(np.random.default_rng(5))
    motion = natural_motion(right_hand, np.random.default_rng(6), 600)
    previous = motion[0]
    jumps = []
    for angles in motion:
        targets = forward(right_hand, HandPose(world, angles)).marker_centres
        found = solve_fingers(right_hand, HandPose(world, previous), targets).angles
        jumps.append(np.degrees(np.abs(found - previous)).max())
        previous = found
    assert np.percentile(jumps[1:], 99) < 10 * np.degrees(np.abs(np.diff(motion, axis=0)).max())


def test_noise_known_as_such_moves_the_joints_less(right_hand):
    """A nearly stretched hand: half a millimetre of noise must not make its joints flutter."""
    rng = np.random.default_rng(10)
    pose = HandPose(np.eye(4), np.full(21, np.radians(4.0)))
    centres = forward(right_hand, pose).marker_centres
    exact, calm, misses = [], [], []
    for _ in range(100):
        targets = centres + rng.normal(0, 5e-4, (5, 3))
        exact.append(solve_fingers(right_hand, pose, targets).angles)
        solution = solve_fingers(right_hand, pose, targets, target_sd=1e-3)
        calm.append(solution.angles)
        misses.append(forward(right_hand, HandPose(np.eye(4), solution.angles)).marker_centres - centres)
        low, high = right_hand.limits.T
        assert (solution.angles >= low).all() and (solution.angles <= high).all()
    assert np.std(calm, axis=0).mean() < 0.5 * np.std(exact, axis=0).mean()
    assert np.sqrt(np.mean(np.square(misses))) < 5e-4  # not farther from the truth than the targets were


def test_far_start_still_comes_near_when_noise_is_known(right_hand):
    rng = np.random.default_rng(11)
    for angles in natural_angles(right_hand, rng, 30):
        targets = forward(right_hand, HandPose(np.eye(4), angles)).marker_centres
        residuals = solve_fingers(right_hand, neutral_pose(), targets, target_sd=3e-4).residuals
        assert np.median(residuals) < 3e-4 and residuals.max() < 6e-3


def test_missing_targets_keep_their_angles(right_hand):
    start = neutral_pose()
    targets = forward(right_hand, start).marker_centres.copy()
    targets[3] = np.nan
    solution = solve_fingers(right_hand, start, targets)
    np.testing.assert_array_equal(solution.angles[13:17], start.angles[13:17])
    assert np.isnan(solution.residuals[3]) and solution.statuses[3] == Status.MISSING
    assert not solution.reached[3] and solution.reached[[0, 1, 2, 4]].all()


def test_narrower_limits_are_kept(right_hand):
    limits = right_hand.limits.copy()
    limits[7] = np.radians([0.0, 20.0])
    narrow = replace(right_hand, limits=limits)
    targets = forward(right_hand, HandPose(np.eye(4), random_pose(right_hand, np.random.default_rng(8)).angles))
    solution = solve_fingers(narrow, neutral_pose(), targets.marker_centres)
    assert solution.angles[7] <= limits[7, 1]


def test_clamping_takes_the_nearer_end_around_the_circle():
    assert clamp_angle(np.radians(-170), 0.0, np.radians(90)) == pytest.approx(np.radians(90))
    assert clamp_angle(np.radians(-20), 0.0, np.radians(90)) == 0.0
    assert clamp_angle(np.radians(400), 0.0, np.radians(90)) == pytest.approx(np.radians(40))
