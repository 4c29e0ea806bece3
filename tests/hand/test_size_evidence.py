"""What one instant's markers say of a hand's size, against plain numpy and against hands whose size is known."""

import numpy as np
import pytest
from hand_samples import random_world
from scipy.spatial.transform import Rotation

from rhot_app.hand.kinematics import TWIST, forward, move
from rhot_app.hand.limits import PERSON_LIMIT_SD_RAD
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose
from rhot_app.hand.solvers.pose_descent import linearise_pose, pose_state
from rhot_app.tracking.markers.hand_size import Posture, implausibility, pose_problem

SIZE = TWIST + len(ANGLES)
ROWS = [0, *range(len(JOINTS), len(JOINTS) + 5)]  # wrist and fingertips of the model's own points
SD_M = 7e-4
INFORMATION = np.tile(np.eye(3) / SD_M**2, (len(ROWS), 1, 1))


def posture_of(model):
    dh = model.dh._replace(point_row=model.dh.point_row[ROWS], point_offset=model.dh.point_offset[ROWS])
    return Posture(dh, model.limits, model.pose_prior.mean, model.pose_prior.information)


def markers_of(model, pose, scale):
    points = forward(model, pose)
    found = np.vstack([points.joints[0], points.marker_centres])
    return pose.world_from_palm[:3, 3] + scale * (found - pose.world_from_palm[:3, 3])


def stretched(world):
    angles = np.radians([0.0, 5.0, 0.0, 5.0, 5.0, *[0.0, 5.0, 8.0, 5.0] * 4])
    return HandPose(world, angles)


def curve(model, pose, true_log_scale, grid):
    """(G,) how implausible the sizes are for a hand in `pose` that is exp(true_log_scale) times as large."""
    places, values = markers_of(model, pose, np.exp(true_log_scale)), np.empty(len(grid))
    for order in (np.flatnonzero(grid >= true_log_scale), np.flatnonzero(grid < true_log_scale)[::-1]):
        world, angles = pose.world_from_palm.copy(), pose.angles.copy()
        for k in order:
            values[k] = implausibility(posture_of(model), places, INFORMATION, grid[k], world, angles)[0]
    return values


def linearised(problem, world, angles):
    matrix, right = np.empty((SIZE, SIZE)), np.empty(SIZE)
    cost = linearise_pose(problem, pose_state(world, angles), matrix, right, np.empty(SIZE), np.empty(SIZE))
    return cost, matrix, right


def plain_cost(model, places, information, scale, pose):
    off = np.nan_to_num(places - markers_of(model, pose, scale))
    away = pose.angles - model.pose_prior.mean
    beyond = np.stack([model.limits[:, 0] - pose.angles, pose.angles - model.limits[:, 1]]) / PERSON_LIMIT_SD_RAD
    soft = 0.5 * (beyond + np.hypot(beyond, 1.0))
    return 0.5 * (np.einsum("mi,mij,mj->", off, information, off) + away @ model.pose_prior.information @ away
                  + (soft**2).sum())


def test_cost_and_gradient_are_those_of_plain_numpy(model):
    rng = np.random.default_rng(3)
    posture, world = posture_of(model), random_world(rng)
    angles = neutral_pose().angles + 0.6 * rng.normal(size=len(ANGLES))  # some beyond their limits
    places = markers_of(model, HandPose(world, angles), 1.1) + 5e-3 * rng.normal(size=(6, 3))
    places[2] = np.nan
    root = rng.normal(size=(6, 3, 3))
    information = 1e6 * (root @ root.transpose(0, 2, 1) + np.eye(3))
    cost, matrix, right = linearised(pose_problem(posture, places, information, 1.07), world, angles)
    assert cost == pytest.approx(plain_cost(model, places, information, 1.07, HandPose(world, angles)))
    slope, trial = np.empty(SIZE), (np.empty((4, 4)), np.empty(len(ANGLES)))
    for i in range(SIZE):
        sides = []
        for step in (1e-6 * np.eye(SIZE)[i], -1e-6 * np.eye(SIZE)[i]):
            move(world, angles, step, *trial)
            sides.append(plain_cost(model, places, information, 1.07, HandPose(trial[0].copy(), trial[1].copy())))
        slope[i] = (sides[0] - sides[1]) / 2e-6
    np.testing.assert_allclose(right, -slope, rtol=1e-5, atol=1e-4 * np.abs(slope).max())
    assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_evidence_is_that_of_the_most_plausible_pose_and_of_the_room_about_it(right_hand):
    rng = np.random.default_rng(5)
    true = stretched(random_world(rng))
    world = true.world_from_palm.copy()
    world[:3, :3] = Rotation.from_rotvec([0.1, -0.1, 0.1]).as_matrix() @ world[:3, :3]
    angles, places = neutral_pose().angles, markers_of(right_hand, true, 1.0)
    value, misfit = implausibility(posture_of(right_hand), places, INFORMATION, 0.05, world, angles)
    problem = pose_problem(posture_of(right_hand), places, INFORMATION, np.exp(0.05))
    cost, matrix, right = linearised(problem, world, angles)
    assert misfit == pytest.approx(cost)
    assert value == pytest.approx(cost + 0.5 * np.linalg.slogdet(matrix)[1])
    assert right @ np.linalg.solve(matrix, right) < 1e-2  # nothing is left to gain
    assert np.linalg.norm(markers_of(right_hand, HandPose(world, angles), np.exp(0.05)) - places) < 5e-3


@pytest.mark.parametrize("true", [-0.1, 0.0, 0.1])
def test_a_stretched_hand_is_not_smaller_and_hardly_larger(right_hand, true):
    grid = true + 0.0125 * np.arange(-8, 9)
    values = curve(right_hand, stretched(random_world(np.random.default_rng(7))), true, grid)
    assert abs(grid[np.argmin(values)] - true) <= 0.0126
    by_size = dict(zip(np.round(grid - true, 4), values - values.min(), strict=True))
    assert by_size[-0.05] > 10.0  # its markers cannot be reached
    assert 1.0 < by_size[0.05] < by_size[0.1] < 10.0  # all fingers would have to end there by chance


def test_a_bent_hand_says_less_than_a_stretched_one(right_hand):
    grid, world = 0.0125 * np.arange(-8, 9), random_world(np.random.default_rng(9))
    bent = HandPose(world, np.clip(right_hand.pose_prior.mean + np.radians(10.0), *right_hand.limits.T))
    spreads = []
    for pose in (bent, stretched(world)):
        values = curve(right_hand, pose, 0.0, grid)
        spreads.append(np.sqrt(np.average(grid**2, weights=np.exp(values.min() - values))))
    assert spreads[0] > 1.2 * spreads[1]
