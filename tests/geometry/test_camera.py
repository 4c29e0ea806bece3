"""The camera model against OpenCV."""

import cv2
import numpy as np
import pytest

from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation
from rhot_app.geometry.camera import (
    CameraModel,
    intrinsics_row,
    lens_parameters,
    linearise_lenses,
    pixels_per_metre,
    pixels_per_metre_facing,
    project_with_slope,
    rig_intrinsics,
    undistort_point,
    undistort_with_slope,
)
from rhot_app.project import CameraPose, Intrinsics

LENSES = {
    "none": (0.0, 0.0, 0.0, 0.0, 0.0),
    "twin": (-0.05, 0.0, 0.0, 0.0, 0.0),
    "barrel": (-0.28, 0.09, 0.001, -0.0007, -0.01),
    "pincushion": (0.2, -0.1, -0.002, 0.001, 0.05),
    "wide": (1.28, 0.396, 0.0005, -0.0003, 0.017, 1.615, 0.734, 0.0816),
}


def camera(lens: str = "twin") -> CameraModel:
    rotation = exp_so3([0.05, -0.3, 0.1])
    fx, fy = (306.0, 305.0) if lens == "wide" else (531.0, 529.0)
    return CameraModel.from_rig(Intrinsics(640, 480, fx, fy, 317.3, 243.1, LENSES[lens]),
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


@pytest.mark.parametrize("lens", ["barrel", "wide"])
def test_the_undistortion_jacobian_is_the_derivative(lens):
    intrinsics = camera(lens).intrinsics
    u, v, h = 37.0, 455.0, 1e-4
    analytic = np.array(undistort_point(u, v, intrinsics)[2:]).reshape(2, 2)
    columns = [(np.array(undistort_point(u + du, v + dv, intrinsics)[:2])
                - undistort_point(u - du, v - dv, intrinsics)[:2]) / (2 * h) for du, dv in ((h, 0), (0, h))]
    np.testing.assert_allclose(analytic, np.column_stack(columns), rtol=1e-6, atol=1e-9)


def test_pixels_no_ray_can_reach_are_nan():
    model = camera("barrel")
    strong = CameraModel(640, 480, intrinsics_row([200.0, 200.0, 320.0, 240.0, -0.4]),
                         model.world_from_camera, model.camera_from_world)
    assert np.isnan(strong.undistort(np.array([[-0.5, -0.5]]))).all()  # radius 2 at a turning point of 0.61
    assert np.isfinite(strong.undistort(np.array([[300.0, 200.0]]))).all()
    assert np.isnan(model.undistort(np.array([[np.nan, 3.0]]))).all()


def test_points_behind_the_camera_are_nan():
    model = camera()
    behind = model.centre - 0.5 * model.world_from_camera[:3, 2]
    assert np.isnan(model.project(behind)).all()


TURNING = {
    "turns over": [200.0, 200.0, 320.0, 240.0, -0.4],
    "turns over by itself": [305.0, 305.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.0],
    "has a pole": [305.0, 305.0, 319.5, 239.5, 0.2, 0.0, 0.0, 0.0, 0.0, -0.3, 0.0, 0.0],
}


@pytest.mark.parametrize("lens", TURNING.values(), ids=TURNING)
def test_no_ray_beyond_the_end_of_a_lens_has_a_pixel(lens):
    """There the formula gives pixels of other rays, often in the middle of the image."""
    model = CameraModel(640, 480, intrinsics_row(lens), np.eye(4), np.eye(4))
    radius = np.geomspace(0.01, 100.0, 400)
    pixels = model.project(np.column_stack([radius, 0 * radius, 1 + 0 * radius]))
    seen = np.isfinite(pixels[:, 0])
    assert seen[0] and not seen[-1] and np.all(np.diff(seen.astype(int)) <= 0)  # from the axis to one radius
    assert np.all(np.diff(pixels[seen, 0]) > 0.0)
    back = model.undistort(pixels[seen])
    np.testing.assert_allclose(back[:-1, 0], radius[seen][:-1], rtol=1e-6)


def test_a_lens_without_an_end_sees_nearly_up_to_its_plane():
    pixels = camera("none").project(np.array([[0.0, 0.0, 1.0], [25.0, 0.0, 1.0], [35.0, 0.0, 1.0]]) @ (
        camera("none").world_from_camera[:3, :3].T) + camera("none").centre)
    assert np.isfinite(pixels[:2]).all() and np.isnan(pixels[2]).all()


@pytest.mark.parametrize("lens", LENSES)
def test_slopes_are_derivatives(lens):
    model, h = camera(lens), 1e-6
    points = model.centre + np.random.default_rng(4).uniform([-0.3, -0.2, 0.4], [0.3, 0.2, 1.2], (20, 3))
    pixels, slopes = project_with_slope(points, model.camera_from_world, model.intrinsics)
    np.testing.assert_allclose(pixels, model.project(points))
    for axis in range(3):
        step = h * np.eye(3)[axis]
        np.testing.assert_allclose(slopes[:, :, axis], (model.project(points + step) - model.project(points - step))
                                   / (2.0 * h), rtol=1e-5, atol=1e-3)
    rays, by_pixel = undistort_with_slope(pixels, model.intrinsics)
    np.testing.assert_allclose(rays, model.undistort(pixels))
    np.testing.assert_allclose(by_pixel[0] @ slopes[0], _of_ray(model, points[0]), atol=1e-9)
    assert model.pixels_per_metre(points)[3] == pytest.approx(pixels_per_metre(slopes[3]))


def _of_ray(model, point):
    """(2, 3) change per m of a point's normalised coordinates."""
    x, y, z = model.camera_from_world[:3, :3] @ point + model.camera_from_world[:3, 3]
    return np.array([[1.0, 0.0, -x / z], [0.0, 1.0, -y / z]]) / z @ model.camera_from_world[:3, :3]


def test_a_ball_covers_as_many_pixels_as_its_size_says():
    model = camera("wide")
    place = model.world_from_camera[:3, :3] @ np.array([0.35, 0.2, 0.4]) + model.centre
    line = (place - model.centre) / np.linalg.norm(place - model.centre)
    a = np.cross(line, [0.0, 1.0, 0.0])
    a /= np.linalg.norm(a)
    angles, radius = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)[:, None], 1e-3
    u, v = model.project(place + radius * (np.cos(angles) * a + np.sin(angles) * np.cross(line, a))).T
    area = 0.5 * abs(np.sum(u * np.roll(v, -1) - v * np.roll(u, -1)))
    assert model.pixels_per_metre(place)[0] == pytest.approx(np.sqrt(area / np.pi) / radius, rel=5e-3)


@pytest.mark.parametrize("lens", LENSES)
def test_derivatives_by_the_lens_are_derivatives(lens):
    parameters = camera(lens).intrinsics[:12]
    rays = np.random.default_rng(5).uniform(-0.6, 0.6, (10, 2))
    pixels, by_ray, by_lens = linearise_lenses(rays, np.tile(parameters, (10, 1)))
    for place in range(12):
        h = 1e-6 * np.eye(12)[place]
        moved = [linearise_lenses(rays, np.tile(parameters + sign * h, (10, 1)))[0] for sign in (1, -1)]
        np.testing.assert_allclose(by_lens[:, :, place], (moved[0] - moved[1]) / 2e-6, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(pixels[0], cv2.projectPoints(np.append(rays[0], 1.0)[None], np.zeros(3), np.zeros(3),
                                                            camera(lens).matrix, parameters[4:])[0].ravel())
    step = np.array([1e-6, 0.0])
    ahead, behind = (linearise_lenses(rays + each, np.tile(parameters, (10, 1)))[0] for each in (step, -step))
    np.testing.assert_allclose(by_ray[:, :, 0], (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("lens", LENSES)
def test_a_rigs_lens_comes_back_as_it_was(lens):
    given = Intrinsics(640, 480, 306.0, 305.0, 317.3, 243.1, LENSES[lens])
    assert rig_intrinsics((640, 480), lens_parameters(given)) == given


def test_the_field_of_view_of_a_wide_lens_is_that_of_its_rays():
    across, down = camera("wide").field_of_view
    assert np.degrees(across) == pytest.approx(120.0, abs=1.0)  # equidistant, f 306 px: 640 / 306 rad
    assert np.degrees(down) == pytest.approx(90.0, abs=1.0)
    assert camera("none").field_of_view[0] == pytest.approx(2.0 * np.arctan(320.0 / 531.0), abs=1e-3)


@pytest.mark.parametrize("lens", LENSES)
def test_what_faces_the_camera_is_as_large_as_a_square_across_its_axis(lens):
    model, side = camera(lens), 1e-4
    for local in ([0.0, 0.0, 0.6], [0.2, -0.1, 0.6]):
        corners = np.array(local) + side * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        place = corners @ model.world_from_camera[:3, :3].T + model.centre
        pixels = model.project(place)
        area = abs(np.linalg.det(pixels[1:] - pixels[0]))
        _, slopes = project_with_slope(place[:1], model.camera_from_world, model.intrinsics)
        facing = pixels_per_metre_facing(slopes[0], model.camera_from_world)
        assert facing == pytest.approx(np.sqrt(area) / side, rel=1e-3)
        if lens == "none":
            assert facing == pytest.approx(np.sqrt(531.0 * 529.0) / 0.6)
