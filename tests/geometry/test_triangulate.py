"""Triangulation: exact points, honest covariance, and degenerate views that are named instead of computed."""

import numpy as np
import pytest

from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.triangulate import Outcome, cast, empty_rays, triangulate
from rhot_app.project import CameraPose, Intrinsics

LENS = Intrinsics(640, 480, 530.0, 530.0, 319.5, 239.5, (-0.05, 0.0, 0.0, 0.0, 0.0))


def stereo(count: int = 2) -> list[CameraModel]:
    turns = ([0.0, 0.0, 0.0], [0.0, -0.06, 0.01], [0.4, 0.0, 0.0])
    places = ((0.0, 0.0, 0.0), (0.075, 0.001, 0.0), (0.03, 0.3, 0.05))
    return [CameraModel.from_rig(LENS, CameraPose(tuple(quaternion_from_rotation(exp_so3(turn))), place))
            for turn, place in zip(turns[:count], places, strict=False)]


def nominal() -> list[CameraModel]:
    return [CameraModel.from_rig(LENS, CameraPose(translation_m=(x, 0.0, 0.0))) for x in (0.0, 0.075)]


def solve(cameras, pixels, covariance_px, used=None):
    rays, used = empty_rays(len(cameras)), np.ones(len(cameras), bool) if used is None else used
    cast(pixels, covariance_px, np.array([model.intrinsics for model in cameras]), used, rays)
    position, covariance = np.empty(3), np.empty((3, 3))
    rms, outcome = triangulate(rays, np.array([m.camera_from_world[:3] for m in cameras]), used, position, covariance)
    return position, covariance, rms, Outcome(outcome)


def pixels_of(cameras, point):
    return np.array([model.project(point)[0] for model in cameras])


@pytest.mark.parametrize("count", [2, 3])
def test_exact_pixels_give_the_exact_point(count):
    cameras = stereo(count)
    for point in np.random.default_rng(3).uniform([-0.2, -0.15, 0.35], [0.25, 0.15, 1.2], (50, 3)):
        position, _, rms, outcome = solve(cameras, pixels_of(cameras, point), np.tile(np.eye(2), (count, 1, 1)))
        assert outcome is Outcome.OK
        assert np.abs(position - point).max() < 1e-10
        assert rms < 1e-6


def test_the_covariance_is_the_scatter_of_noisy_points():
    cameras = stereo(3)
    point = np.array([0.05, -0.04, 0.6])
    covariance_px = np.array([[[0.04, 0.01], [0.01, 0.02]], [[0.01, 0.0], [0.0, 0.03]], [[0.09, -0.02], [-0.02, 0.04]]])
    rng = np.random.default_rng(4)
    true = pixels_of(cameras, point)
    noise = np.stack([rng.multivariate_normal(np.zeros(2), c, 4000) for c in covariance_px], axis=1)
    results = np.array([solve(cameras, true + n, covariance_px)[0] for n in noise])
    stated = solve(cameras, true, covariance_px)[1]
    root = np.linalg.cholesky(np.linalg.inv(stated))
    whitened = root.T @ np.cov(results.T) @ root
    assert np.linalg.norm(results.mean(axis=0) - point) < 5e-5
    assert np.abs(np.linalg.eigvalsh(whitened) - 1.0).max() < 0.1  # 4000 samples: 3 sigma of a variance is 7 %


def test_a_noisier_camera_counts_less():
    cameras = stereo(3)
    point = np.array([0.05, -0.04, 0.6])
    pixels = pixels_of(cameras, point)
    pixels[2] += [8.0, -6.0]
    trusted = np.tile(np.eye(2) * 0.01, (3, 1, 1))
    trusted[2] *= 1e6
    assert np.linalg.norm(solve(cameras, pixels, trusted)[0] - point) < 1e-4


def test_depth_noise_at_the_nominal_rig_is_nine_millimetres_per_pixel():
    cameras = nominal()
    covariance = solve(cameras, pixels_of(cameras, np.array([0.0375, 0.0, 0.6])), np.tile(np.eye(2), (2, 1, 1)))[1]
    assert np.sqrt(covariance[2, 2] / 2) == pytest.approx(9.05e-3, rel=0.02)


def test_degenerate_views_are_named_and_nan():
    cameras = nominal()
    unit = np.tile(np.eye(2), (2, 1, 1))
    cases = {
        Outcome.PARALLEL: np.array([[300.0, 200.0], [300.0, 200.0]]),
        Outcome.BEHIND: np.array([[300.0, 200.0], [360.0, 200.0]]),
        Outcome.TOO_FEW: np.array([[300.0, 200.0], [np.nan, np.nan]]),
    }
    for expected, pixels in cases.items():
        position, covariance, rms, outcome = solve(cameras, pixels, unit)
        assert outcome is expected
        assert np.isnan(position).all() and np.isnan(covariance).all() and np.isnan(rms)
    position, _, _, outcome = solve(cameras, np.array([[300.0, 200.0], [240.0, 200.0]]), unit, np.array([True, False]))
    assert outcome is Outcome.TOO_FEW and np.isnan(position).all()


def test_a_covariance_that_is_none_drops_its_camera():
    cameras = stereo(3)
    point = np.array([0.05, -0.04, 0.6])
    covariances = np.tile(np.eye(2), (3, 1, 1))
    covariances[1] = np.nan
    position, _, _, outcome = solve(cameras, pixels_of(cameras, point), covariances)
    assert outcome is Outcome.OK and np.abs(position - point).max() < 1e-9
    covariances[2] = [[1.0, 2.0], [2.0, 1.0]]
    assert solve(cameras, pixels_of(cameras, point), covariances)[3] is Outcome.TOO_FEW


def test_the_reprojection_error_is_half_the_epipolar_distance():
    cameras = nominal()
    pixels = pixels_of(cameras, np.array([0.03, 0.02, 0.6]))
    pixels[1, 1] += 3.0
    assert solve(cameras, pixels, np.tile(np.eye(2), (2, 1, 1)))[2] == pytest.approx(1.5, abs=0.02)
