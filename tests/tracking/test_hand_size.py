"""The hand's size, learnt from shapes that were located: what counts, how well it is known, how it is followed."""

import numpy as np
import pytest
from modelled_hand import model_rig

from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.simulator.scene.motion import FACING
from rhot_app.tracking.locate import Located
from rhot_app.tracking.markers.hand_size import FOLLOW_S, GRID, HandSize
from rhot_app.tracking.markers.marker_model import LEAST_SIZE_SD, USUAL_SIZE_SD, compile_markers

WORN = compile_markers(model_rig())
MARKERS = len(WORN.roles)
NOISE_M = 5e-4
INDEX, LITTLE = 1, 4


def size_of_nobody():
    return HandSize(WORN.dh, WORN.limits, WORN.pose_prior, WORN.paint_variance)


def natural_poses(count, seed):
    """(count, 21) rad, drawn from the natural pose within the limits, about."""
    rng, poses = np.random.default_rng(seed), []
    root = np.linalg.cholesky(np.linalg.inv(WORN.pose_prior.information))
    while len(poses) < count:
        angles = WORN.pose_prior.mean + root @ rng.normal(size=21)
        bounded = np.clip(angles, *WORN.limits.T)
        if np.abs(angles - bounded).max() < np.radians(8.0):
            poses.append(bounded)
    return np.array(poses)


def world():
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = FACING, (0.03, 0.08, 0.6)
    return out


def located(angles, scale, rng):
    points, dh = np.empty((MARKERS, 3)), WORN.dh
    forward_arrays(dh, world(), angles, empty_frames(dh), points)
    points = world()[:3, 3] + scale * (points - world()[:3, 3]) + NOISE_M * rng.normal(size=points.shape)
    return Located(0, points, np.tile(NOISE_M**2 * np.eye(3), (MARKERS, 1, 1)), np.ones(MARKERS, bool))


def show(size, seen, angles):
    """Let `size` look at a shape and weigh all sizes for it."""
    size.look(seen, world(), angles)
    for _ in GRID:
        size.work()


def learnt(poses, scale, seed=0):
    size, rng = size_of_nobody(), np.random.default_rng(seed)
    for angles in poses:
        show(size, located(angles, scale, rng), angles)
    size.settle()
    return size


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.1])
@pytest.mark.parametrize("seed", [1, 2])
def test_eight_natural_poses_show_the_size_and_how_well(scale, seed):
    log_scale, variance = learnt(natural_poses(8, seed), scale, seed).known
    assert abs(log_scale - np.log(scale)) < 0.02
    assert LEAST_SIZE_SD < np.sqrt(variance) < 0.025


def test_a_single_shape_leaves_the_size_open_and_what_is_stated_is_true():
    off = []
    for seed in range(8):
        scale = float(np.exp(USUAL_SIZE_SD * np.random.default_rng(seed).normal()))
        log_scale, variance = learnt(natural_poses(1, seed), scale, seed).known
        assert 0.025 < np.sqrt(variance) < USUAL_SIZE_SD
        off.append((log_scale - np.log(scale)) / np.sqrt(variance))
    assert np.abs(off).max() < 2.5


def test_a_shape_seen_again_and_again_says_nothing_new():
    angles = natural_poses(1, 4)[0]
    once, often = learnt([angles], 1.1), learnt([angles] * 5, 1.1)
    assert often.known == once.known


def test_nothing_is_believed_of_fingers_in_exchange_of_markers_in_doubt_and_of_too_few():
    angles, rng = natural_poses(1, 5)[0], np.random.default_rng(5)
    seen = located(angles, 1.1, rng)
    swapped = seen.positions.copy()
    swapped[[INDEX, LITTLE]] = swapped[[LITTLE, INDEX]]
    few = seen.clear.copy()
    few[:2] = False
    for wrong in (seen._replace(positions=swapped), seen._replace(clear=few)):
        size = size_of_nobody()
        show(size, wrong, angles)
        assert size.known == (0.0, USUAL_SIZE_SD**2)
    astray = seen.positions.copy()
    astray[INDEX] += 0.05
    doubtful = np.arange(MARKERS) != INDEX
    one, other = size_of_nobody(), size_of_nobody()
    show(one, seen._replace(positions=astray, clear=doubtful), angles)
    show(other, seen._replace(clear=doubtful), angles)
    assert one.known == other.known != (0.0, USUAL_SIZE_SD**2)


def test_the_size_is_followed_slowly_and_what_it_lags_is_doubt():
    size, rng = size_of_nobody(), np.random.default_rng(6)
    size.follow(0)
    for angles in natural_poses(8, 6):
        show(size, located(angles, 1.1, rng), angles)
    times = np.arange(0.01, 5.0 * FOLLOW_S, 0.01)
    steps = np.array([(size.follow(round(1e9 * t)), size.follow(round(1e9 * (t - 0.006))))[1] for t in times])
    assert 0.0 < np.diff(steps[:, 0]).max() < 0.1 * 0.01 / FOLLOW_S
    assert steps[-1, 0] == pytest.approx(np.log(size.scale), abs=1e-3)
    assert steps[99, 0] == pytest.approx(np.log(size.scale) * -np.expm1(-1.0 / FOLLOW_S))
    assert (np.abs(steps[:, 0] - np.log(1.1)) < 2.0 * np.sqrt(steps[:, 1])).all()
    size.reset()
    assert size.known == (0.0, USUAL_SIZE_SD**2) and size.scale == 1.0
