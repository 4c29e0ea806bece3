"""The silhouette of a round body against its outline, traced ray by ray."""

import numpy as np
import pytest

from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import ball, point_rays
from rhot_app.geometry.triangulate import Rays, triangulate

FOCAL = 530.0
CAMERAS = np.array([np.column_stack([np.eye(3), [-x, 0.0, 0.0]]) for x in (0.0, 0.075)])


def polygon_centroid(outline: np.ndarray) -> np.ndarray:
    x, y = outline.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    return np.array([((x + np.roll(x, -1)) * cross).sum(), ((y + np.roll(y, -1)) * cross).sum()]) / (3 * cross.sum())


def outline(centre: np.ndarray, root: np.ndarray, count: int = 20_000) -> np.ndarray:
    """Normalised coordinates of the points where lines of sight from the origin touch the ellipsoid centre + root u,
    |u| = 1: seen from the ellipsoid's own space it is the unit sphere."""
    eye = -np.linalg.solve(root, centre)
    distance = np.linalg.norm(eye)
    sight = eye / distance
    side = np.cross(sight, [0.3, 0.9, 0.1])
    side /= np.linalg.norm(side)
    up = np.cross(sight, side)
    turn = np.linspace(0.0, 2 * np.pi, count, endpoint=False)[:, None]
    touch = sight / distance + np.sqrt(1.0 - 1.0 / distance**2) * (np.cos(turn) * side + np.sin(turn) * up)
    points = centre + touch @ root.T
    return points[:, :2] / points[:, 2:]


def cylinder_edges(centre: np.ndarray, radius: float) -> float:
    """Middle, in x / z, of the two edges of a cylinder along y."""
    angle, half = np.arctan2(centre[0], centre[2]), np.arcsin(radius / np.hypot(centre[0], centre[2]))
    return 0.5 * (np.tan(angle + half) + np.tan(angle - half))


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.4), (0.15, -0.1, 0.4), (-0.3, 0.2, 0.6), (0.02, 0.05, 1.0)])
@pytest.mark.parametrize("radius", [0.008, 0.026])
def test_the_centre_of_a_sphere_is_found_behind_its_outline(centre, radius):
    world = np.array(centre)
    seen = np.array([polygon_centroid(outline(camera @ [*world, 1.0], radius * np.eye(3))) for camera in CAMERAS])
    position, covariance = np.empty(3), np.empty((3, 3))
    used, unit = np.ones(2, bool), np.tile(np.eye(2), (2, 1, 1))
    by_pixel = unit / FOCAL
    triangulate(Rays(seen, unit, by_pixel), CAMERAS, used, position, covariance)
    assert world[2] - position[2] == pytest.approx(radius**2 / world[2], rel=1e-3)
    corrected = np.empty((2, 2))
    point_rays(seen, CAMERAS, ball(radius), position, corrected)
    triangulate(Rays(corrected, unit, by_pixel), CAMERAS, used, position, covariance)
    assert np.abs(position - world).max() < 1e-6


def test_the_centre_of_a_flat_tilted_band_is_found_too():
    world = np.array([0.1, -0.08, 0.5])
    rotation, half_axes = exp_so3([0.4, 0.7, -0.3]), np.array([0.011, 0.031, 0.021])
    seen = np.array([polygon_centroid(outline(camera @ [*world, 1.0], rotation * half_axes)) for camera in CAMERAS])
    naive, position, covariance = np.empty(3), np.empty(3), np.empty((3, 3))
    used, unit = np.ones(2, bool), np.tile(np.eye(2), (2, 1, 1))
    by_pixel = unit / FOCAL
    triangulate(Rays(seen, unit, by_pixel), CAMERAS, used, naive, covariance)
    corrected = np.empty((2, 2))
    point_rays(seen, CAMERAS, (rotation * half_axes**2) @ rotation.T, naive, corrected)
    triangulate(Rays(corrected, unit, by_pixel), CAMERAS, used, position, covariance)
    assert np.linalg.norm(naive - world) > 5e-4
    assert np.linalg.norm(position - world) < 1e-6


def test_a_cylinder_does_the_same_across_its_axis():
    world, radius = np.array([0.12, 0.0, 0.5]), 0.026
    seen = np.array([[cylinder_edges(camera @ [*world, 1.0], radius), 0.0] for camera in CAMERAS])
    corrected = np.empty((2, 2))
    point_rays(seen, CAMERAS, ball(radius), world - [0.0, 0.0, radius**2 / world[2]], corrected)
    np.testing.assert_allclose(corrected[:, 0], [0.24, 0.09], atol=1e-12)


def test_a_position_inside_the_body_or_unknown_changes_nothing():
    rays = np.array([[0.1, 0.2], [0.0, 0.2]])
    out = np.empty((2, 2))
    for position in (np.array([0.0, 0.0, 0.01]), np.full(3, np.nan), np.array([0.0, 0.0, -1.0])):
        point_rays(rays, CAMERAS, ball(0.026), position, out)
        np.testing.assert_array_equal(out, rays)
