"""Two uncalibrated cameras: distance by the thesis's formulas, honest about what they are worth."""

import math

import msgspec
import numpy as np
import pytest
from synthetic_rig import EPOCH_NS, WIDE, Viewing, hand_trajectory, make_rig, observe, run

from rhot_app.calibration.depth.fit import depth_from_disparity, depth_from_power_law
from rhot_app.project import CameraPose, DepthSettings
from rhot_app.state import Condition, Knowledge
from rhot_app.tracking.rig_arrays import disparity_law, locate_by_disparity
from rhot_app.tracking.scene import make_tracker

THEORY = DepthSettings(mode="disparity", baseline_m=0.075, view_angle_deg=62.2)
LAW = DepthSettings(mode="disparity", baseline_m=0.075, view_angle_deg=62.2, k=45.4332, z=-1.035423)
SIGMA_PX = 0.1


def rig_with(depth: DepthSettings):
    return msgspec.structs.replace(make_rig(), depth=depth)


def locate(depth: DepthSettings, pixels: np.ndarray, used: np.ndarray | None = None):
    markers = pixels.shape[1]
    used = np.ones((2, markers), np.bool_) if used is None else used
    covariances = np.tile(SIGMA_PX**2 * np.eye(2), (2, markers, 1, 1))
    positions, spread, errors = np.empty((markers, 3)), np.empty((markers, 3, 3)), np.empty(markers)
    locate_by_disparity(pixels, covariances, used, disparity_law(rig_with(depth)), positions, spread, errors)
    return positions, spread, used


def test_distance_is_the_thesis_formulas_and_the_rest_the_pinholes() -> None:
    pixels = np.array([[[400.0, 300.0], [319.5, 239.5], [500.0, 100.0]],
                       [[340.0, 310.0], [250.0, 239.5], [460.0, 90.0]]])
    disparity = pixels[0, :, 0] - pixels[1, :, 0]
    for depth, expected in ((THEORY, depth_from_disparity(disparity, 0.075, 640, math.radians(62.2))),
                            (LAW, depth_from_power_law(disparity, 45.4332, -1.035423))):
        positions, _, _ = locate(depth, pixels)
        np.testing.assert_allclose(positions[:, 2], expected)
        focal = 320.0 / math.tan(math.radians(31.1))
        middle = pixels.mean(axis=0) - (319.5, 239.5)
        np.testing.assert_allclose(positions[:, :2] - (0.0375, 0.0), middle * positions[:, 2:] / focal)


def test_swapped_cameras_and_missing_sights() -> None:
    pixels = np.array([[[400.0, 300.0]] * 4, [[340.0, 300.0]] * 4])
    pixels[1, 2] = np.nan
    pixels[1, 3, 0] = 399.5
    there, _, used = locate(THEORY, pixels, np.array([[True, True, True, True], [True, False, True, True]]))
    back, _, _ = locate(THEORY, pixels[::-1])
    np.testing.assert_allclose(there[0], back[0])
    assert np.isnan(there[1:]).all()
    np.testing.assert_array_equal(used, [[True, False, False, False]] * 2)


def test_the_covariance_is_pixel_noise_and_model_error() -> None:
    rng = np.random.default_rng(2)
    pixels = np.array([[[420.0, 300.0]], [[340.0, 310.0]]])
    noisy = pixels + rng.normal(0.0, SIGMA_PX, (2, 4000, 2))
    positions, _, _ = locate(LAW, noisy)
    mean, spread, _ = locate(LAW, pixels)
    ray = (mean[0] - (0.0375, 0.0, 0.0)) / mean[0, 2]
    model = (0.02 * mean[0, 2]) ** 2 * np.outer(ray, ray)
    np.testing.assert_allclose(spread[0] - model, np.cov(positions.T), atol=0.08 * np.cov(positions.T).max())


@pytest.mark.parametrize("depth", [THEORY, DepthSettings(mode="disparity", k=39.785, z=-1.0)])
def test_a_hand_is_tracked_with_cameras_nobody_calibrated(depth: DepthSettings) -> None:
    """Lens and poses of the rig are wrong; the second camera hangs 8 px too low, which no triangulation would take."""
    rig = rig_with(depth)
    grasp = hand_trajectory(rig, "grasp", 2.0)
    frames = observe(rig, WIDE, grasp, 2.0, Viewing(noise_px=0.05))
    for frame in frames:
        if frame.camera == 1:
            frame.pixels[:, 1] += 8.0
    wrong = tuple(msgspec.structs.replace(node, pose=CameraPose(), intrinsics=msgspec.structs.replace(
        node.intrinsics, fx=900.0, cx=200.0)) for node in rig.nodes)
    states = run(make_tracker(msgspec.structs.replace(rig, nodes=wrong)), frames)[10:]
    assert all(state.condition is Condition.TRACKING for state in states)
    truth = grasp(np.array([1e-9 * (state.t_master_ns - EPOCH_NS) for state in states]))
    found = np.array([state.marker_positions for state in states])
    sd = np.sqrt([np.diagonal(state.marker_covariances, axis1=1, axis2=2) for state in states])
    error = np.abs(found - truth)
    assert (error[..., 2] < 0.02).all() and (error[..., 2] < 3.0 * sd[..., 2]).mean() > 0.99
    assert (sd[..., 2] > 0.019 * truth[..., 2]).all()
    assert all((state.marker_knowledge == Knowledge.MEASURED).all() for state in states)
    assert all(np.isnan(state.epipolar_error_px).all() for state in states)
