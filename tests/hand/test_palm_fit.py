"""The palm fit on hands whose pose is known: what it gets right, how sure it says it is, and what it refuses."""

import numpy as np
import pytest
from hand_samples import natural_angles, natural_motion, random_world, rotation_about
from scipy.spatial.transform import Rotation

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import HandPose
from rhot_app.hand.solvers.finger_ik import solve_fingers
from rhot_app.hand.solvers.palm_fit import fit_palm


def rotation_error_deg(found, true):
    return np.degrees(Rotation.from_matrix(found[:3, :3] @ true[:3, :3].T).magnitude())


def noisy_markers(model, pose, rng, noise):
    points = forward(model, pose)
    return points.joints[0] + rng.normal(0, noise, 3), points.marker_centres + rng.normal(0, noise, (5, 3))


def moving_hand(model, seed, frames=200, rate_hz=40):
    rng = np.random.default_rng(seed)
    angles = natural_motion(model, rng, frames, 30)
    world, poses = random_world(rng), []
    for k in range(frames):
        world = world.copy()
        world[:3, :3] = rotation_about(np.sin(k / rate_hz * np.array([2.0, 1.4, 0.9])) / rate_hz) @ world[:3, :3]
        world[:3, 3] += 0.2 / rate_hz * np.cos(k / rate_hz * np.array([3.0, 2.0, 1.0]))
        poses.append(HandPose(world, angles[k]))
    return poses


def test_cold_start_finds_natural_hands(model):
    rng = np.random.default_rng(1)
    errors, joint_errors, deviations = [], [], []
    for angles in natural_angles(model, rng, 40):
        pose = HandPose(random_world(rng), angles)
        wrist, tips = noisy_markers(model, pose, rng, 1e-3)
        fit = fit_palm(model, wrist, tips, None, 0.0)
        assert fit is not None and fit.converged
        errors.append(rotation_error_deg(fit.pose.world_from_palm, pose.world_from_palm))
        joint_errors.append(np.degrees(fit.pose.angles - angles))
        deviations.append(np.degrees(fit.rotation_std_rad))
        low, high = model.limits.T
        assert (fit.pose.angles >= low - 1e-9).all() and (fit.pose.angles <= high + 1e-9).all()
    rms = np.sqrt(np.mean(np.square(errors)))
    assert rms < 12.0 and np.max(errors) < 45.0
    assert np.sqrt(np.mean(np.square(joint_errors))) < 9.0
    assert 0.5 < rms / np.mean(deviations) < 2.0  # it knows how sure it is


def test_moving_hand_is_followed(right_hand):
    rng = np.random.default_rng(2)
    previous, errors, joint_errors = None, [], []
    for pose in moving_hand(right_hand, 3):
        wrist, tips = noisy_markers(right_hand, pose, rng, 1e-3)
        fit = fit_palm(right_hand, wrist, tips, previous, 0.025)
        previous = fit.pose
        errors.append(rotation_error_deg(previous.world_from_palm, pose.world_from_palm))
        joint_errors.append(np.degrees(previous.angles - pose.angles))
        assert np.linalg.norm(previous.world_from_palm[:3, 3] - wrist) < 4e-3
    assert np.sqrt(np.mean(np.square(errors))) < 10.0
    assert np.sqrt(np.mean(np.square(joint_errors))) < 9.0


def test_fingers_reach_their_markers_from_the_fitted_palm(right_hand):
    rng = np.random.default_rng(4)
    previous, residuals = None, []
    for pose in moving_hand(right_hand, 5, frames=100):
        wrist, tips = noisy_markers(right_hand, pose, rng, 1e-3)
        fit = fit_palm(right_hand, wrist, tips, previous, 0.025)
        previous = fit.pose
        residuals.append(solve_fingers(right_hand, fit.pose, tips).residuals)
    assert np.sqrt(np.mean(np.square(residuals))) < 1.5e-3


def test_relaxed_hand_without_noise_is_found_exactly(right_hand):
    """The natural pose itself costs nothing, so nothing pulls the fit away from it."""
    pose = HandPose(random_world(np.random.default_rng(6)), right_hand.pose_prior.mean)
    points = forward(right_hand, pose)
    fit = fit_palm(right_hand, points.joints[0], points.marker_centres, None, 0.0)
    assert fit is not None and fit.cost < 1e-3
    assert rotation_error_deg(fit.pose.world_from_palm, pose.world_from_palm) < 0.1
    np.testing.assert_allclose(fit.pose.angles, pose.angles, atol=2e-3)


def test_missing_tips_rest_on_the_previous_pose(right_hand):
    pose = neutral_pose(random_world(np.random.default_rng(7)))
    points = forward(right_hand, pose)
    tips = points.marker_centres.copy()
    tips[[1, 3, 4]] = np.nan
    fit = fit_palm(right_hand, points.joints[0], tips, pose, 0.025)
    everything = fit_palm(right_hand, points.joints[0], points.marker_centres, pose, 0.025)
    assert fit is not None and everything is not None
    assert rotation_error_deg(fit.pose.world_from_palm, pose.world_from_palm) < 2.0
    assert fit.rotation_std_rad > 1.2 * everything.rotation_std_rad


def test_no_tip_moves_the_previous_pose_with_the_wrist(right_hand):
    pose = neutral_pose(random_world(np.random.default_rng(8)))
    wrist = pose.world_from_palm[:3, 3] + [0.0, 0.01, 0.0]
    fit = fit_palm(right_hand, wrist, np.full((5, 3), np.nan), pose, 0.025)
    np.testing.assert_allclose(fit.pose.world_from_palm[:3, 3], wrist, atol=1e-4)
    assert rotation_error_deg(fit.pose.world_from_palm, pose.world_from_palm) < 0.1
    assert fit.rotation_std_rad > 1.0


def test_hidden_wrist_is_carried_by_four_tips(right_hand):
    rng = np.random.default_rng(9)
    poses = moving_hand(right_hand, 10, frames=60)
    previous = poses[0]
    for pose in poses[1:20]:
        _, tips = noisy_markers(right_hand, pose, rng, 5e-4)
        tips[3] = np.nan
        fit = fit_palm(right_hand, np.full(3, np.nan), tips, previous, 0.025)
        previous = fit.pose
    assert np.linalg.norm(previous.world_from_palm[:3, 3] - pose.world_from_palm[:3, 3]) < 0.03


@pytest.mark.parametrize("tips_seen", [1, 2, 3])
def test_few_tips_carry_the_previous_pose_along(right_hand, tips_seen):
    pose = neutral_pose(random_world(np.random.default_rng(14)))
    step = np.array([0.004, 0.002, -0.003])
    tips = forward(right_hand, pose).marker_centres + step
    tips[tips_seen:] = np.nan
    fit = fit_palm(right_hand, np.full(3, np.nan), tips, pose, 0.025)
    found = forward(right_hand, fit.pose).marker_centres[:tips_seen]
    assert np.abs(found - tips[:tips_seen]).max() < 1e-3
    moved = fit.pose.world_from_palm[:3, 3] - pose.world_from_palm[:3, 3]
    assert moved @ step > 0.2 * step @ step
    assert fit.rotation_std_rad > 0.5


def test_cold_start_from_tips_alone_is_a_guess_that_says_so(model):
    rng = np.random.default_rng(15)
    errors, deviations = [], []
    for angles in natural_angles(model, rng, 30):
        pose = HandPose(random_world(rng), angles)
        _, tips = noisy_markers(model, pose, rng, 1e-3)
        fit = fit_palm(model, np.full(3, np.nan), tips, None, 0.0)
        assert np.linalg.norm(forward(model, fit.pose).marker_centres - tips, axis=1).max() < 3e-3
        errors.append(rotation_error_deg(fit.pose.world_from_palm, pose.world_from_palm))
        deviations.append(np.degrees(fit.rotation_std_rad))
    assert np.median(errors) < 20.0
    assert np.median(errors) < 2.0 * np.mean(deviations)


@pytest.mark.parametrize(("wrist_seen", "tips_seen", "known"), [
    (False, 3, False), (True, 0, False), (False, 0, True),
])
def test_too_little_to_say_anything(right_hand, wrist_seen, tips_seen, known):
    pose = neutral_pose()
    points = forward(right_hand, pose)
    tips = points.marker_centres.copy()
    tips[tips_seen:] = np.nan
    wrist = points.joints[0] if wrist_seen else np.full(3, np.nan)
    assert fit_palm(right_hand, wrist, tips, pose if known else None, 0.025) is None


@pytest.mark.parametrize("tips_seen", [1, 2, 3])
def test_cold_start_from_few_tips_is_unsure_but_sound(right_hand, tips_seen):
    pose = neutral_pose(random_world(np.random.default_rng(11)))
    points = forward(right_hand, pose)
    tips = points.marker_centres.copy()
    tips[tips_seen:] = np.nan
    fit = fit_palm(right_hand, points.joints[0], tips, None, 0.0)
    assert fit is not None and np.isfinite(fit.pose.world_from_palm).all() and np.isfinite(fit.pose.angles).all()
    np.testing.assert_allclose(fit.pose.world_from_palm[:3, :3] @ fit.pose.world_from_palm[:3, :3].T, np.eye(3),
                               atol=1e-9)
    assert fit.rotation_std_rad > np.radians(9.0)


def test_stretched_time_frees_the_fit_from_the_past(right_hand):
    rng = np.random.default_rng(12)
    pose = neutral_pose(random_world(rng))
    points = forward(right_hand, pose)
    past = HandPose(pose.world_from_palm.copy(), pose.angles)
    past.world_from_palm[:3, :3] = pose.world_from_palm[:3, :3] @ rotation_about([0.3, 0.0, 0.0])
    soon = fit_palm(right_hand, points.joints[0], points.marker_centres, past, 0.005)
    late = fit_palm(right_hand, points.joints[0], points.marker_centres, past, 10.0)
    assert soon is not None and late is not None
    assert rotation_error_deg(late.pose.world_from_palm, pose.world_from_palm) < rotation_error_deg(
        soon.pose.world_from_palm, pose.world_from_palm)
