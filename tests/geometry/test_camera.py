"""The camera model against OpenCV."""

import cv2
import numpy as np
import pytest

from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import exp_so3, quaternion_from_rotation
from rhot_app.project import CameraPose, Intrinsics

LENSES = {
    "none": (0.0, 0.0, 0.0, 0.0, 0.0),
    "twin": (-0.05, 0.0, 0.0, 0.0, 0.0),
    "barrel": (-0.28, 0.09, 0.001, -0.0007, -0.01),
    "pincushion": (0.2, -0.1, -0.002, 0.001, 0.05),
}


def camera(lens: str = "twin") -> CameraModel:
    rotation = exp_so3([0.05, -0.3, 0.1])
    return CameraModel.from_rig(Intrinsics(640, 480, 531.0, 529.0, 317.3, 243.1, LENSES[lens]),
                                CameraPose(tuple(quaternion_from_rotation(rotation)), (0.07, -0.01, 0.02)))


def pixel_grid() -> np.ndarray:
    return np.stack(np.meshgrid(np.linspace(-0.5, 639.5, 33), np.linspace(-0.5, 479.5, 25)), -1).reshape(-1, 2)


@pytest.mark.parametrize("lens", LENSES)
def test_projection_agrees_with_opencv(lens):
    model = camera(lens)
    points = np.random.default_rng(2).uniform([-0.3, -0.2, 0.4], [0.3, 0.2, 1.2], (200, 3))
    rotation, translation = model.camera_from_world[:3, :3], model.camera_from_world[:3, 3]
    expected, _ = cv2.projectPoints(points, cv2.Rodrigues(rotation)[0], translation, model.matrix,
                                    np.array(LENSES[lens]))
    np.testing.assert_allclose(model.project(points), expected[:, 0], atol=1e-9)


@pytest.mark.parametrize("lens", LENSES)
def test_undistorted_points_project_back_onto_their_pixels_up_to_the_corners(lens):
    model = camera(lens)
    pixels = pixel_grid()
    normalised = model.undistort(pixels)
    distorted, _ = cv2.projectPoints(np.column_stack([normalised, np.ones(len(normalised))]), np.zeros(3),
                                     np.zeros(3), model.matrix, np.array(LENSES[lens]))
    assert np.abs(distorted[:, 0] - pixels).max() < 1e-6


def test_undistortion_agrees_with_a_converged_opencv():
    model = camera("twin")
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    expected = cv2.undistortPointsIter(pixel_grid()[:, None], model.matrix, np.array(LENSES["twin"]), np.eye(3),
                                       np.eye(3), criteria)
    np.testing.assert_allclose(model.undistort(pixel_grid()), expected[:, 0], atol=1e-9)


def test_the_undistortion_jacobian_is_the_derivative():
    from rhot_app.geometry.camera import undistort_point

    intrinsics = camera("barrel").intrinsics
    u, v, h = 37.0, 455.0, 1e-4
    analytic = np.array(undistort_point(u, v, intrinsics)[2:]).reshape(2, 2)
    columns = [(np.array(undistort_point(u + du, v + dv, intrinsics)[:2])
                - undistort_point(u - du, v - dv, intrinsics)[:2]) / (2 * h) for du, dv in ((h, 0), (0, h))]
    np.testing.assert_allclose(analytic, np.column_stack(columns), rtol=1e-6, atol=1e-9)


def test_pixels_no_ray_can_reach_are_nan():
    model = camera("barrel")
    strong = CameraModel(640, 480, np.array([200.0, 200.0, 320.0, 240.0, -0.4, 0.0, 0.0, 0.0, 0.0]),
                         model.world_from_camera, model.camera_from_world)
    assert np.isnan(strong.undistort(np.array([[-0.5, -0.5]]))).all()  # radius 2 at a turning point of 0.61
    assert np.isfinite(strong.undistort(np.array([[300.0, 200.0]]))).all()
    assert np.isnan(model.undistort(np.array([[np.nan, 3.0]]))).all()


def test_points_behind_the_camera_are_nan():
    model = camera()
    behind = model.centre - 0.5 * model.world_from_camera[:3, 2]
    assert np.isnan(model.project(behind)).all()
