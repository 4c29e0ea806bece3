"""Tracking articulated objects by layered templates: fingers that cross, a box that opens, what is not free."""

import numpy as np
import pytest
from objects import box_on_hinge, object_of
from painted_object import meshes_of, picture
from pictures import look_at, wall

from rhot_app.articulated.bodies import ANGLES
from rhot_app.articulated.tracker import ConstantVelocity, LayeredTracker, free_of, rest_of
from rhot_app.errors import TrackingError

PACE_HZ = 0.75


def filmed(model, angles_at, cameras, frames, rate_hz, root=None, seed=0, texture=0.15):
    """Images of every camera and of the empty scene; the object stands still but for its angles, degrees."""
    meshes, walls = meshes_of(model, seed, texture), [wall(camera, seed + k, False) for k, camera in enumerate(cameras)]
    pose = rest_of(model)[0] if root is None else root
    images = [{c: picture(model, meshes, pose, np.radians(angles_at(k / rate_hz)), camera, walls[c], 100 * seed + k)
               for c, camera in enumerate(cameras)} for k in range(frames)]
    return images, [np.clip(one, 0.0, 255.0).astype(np.uint8) for one in walls]


def crossing(t_s):
    """Two fingers that curl by turns, 15 Hz images: one passes before the other."""
    part = 0.5 - 0.5 * np.cos(np.pi * t_s)
    return np.array([10.0 + 80.0 * part, 10.0 + 90.0 * part, 90.0 - 80.0 * part, 100.0 - 90.0 * part])


def test_fingers_that_cross_are_told_apart_by_layers():
    model, bodies, _ = object_of("two_fingers")
    camera = look_at(np.array([0.10, -0.28, 0.27]), np.array([0.04, 0.0, 0.0]), focal=700.0)
    images, empty = filmed(model, crossing, [camera], 16, 15.0)
    tracker = LayeredTracker(bodies, model.limits, ConstantVelocity(free_of(model), pace_hz=PACE_HZ), [camera],
                             backgrounds=empty)
    tracker.start(*tracker.process.start(rest_of(model)[0], np.radians(crossing(0.0))), images[0], 0)
    errors, orders = [], set()
    for k in range(1, 16):
        state = tracker.see(images[k], round(1e9 * k / 15.0)).state
        errors.append(np.degrees(state[ANGLES:ANGLES + 4]) - crossing(k / 15.0))
        orders.add(tuple(tracker.views[0].visibility.order))
        np.testing.assert_array_equal(state[:ANGLES], rest_of(model)[0][:3].ravel())  # the file keeps the root
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 2.0
    assert len(orders) > 1


def test_a_box_is_followed_as_it_moves_and_opens():
    model, bodies, _ = box_on_hinge()
    cameras = [look_at(np.array([x, -0.28, 0.30]), np.zeros(3), focal=500.0, width=400, height=300)
               for x in (-0.12, 0.12)]
    meshes, walls = meshes_of(model, 4, 0.2), [wall(camera, k, False) for k, camera in enumerate(cameras)]

    def truth(k):
        root = np.eye(4)
        root[:3, 3] = [0.002 * k, -0.0015 * k, 0.001 * k]
        return root, np.radians([-40.0 - 2.0 * k]) * -1.0

    def images(k):
        return {c: picture(model, meshes, *truth(k), camera, walls[c], k) for c, camera in enumerate(cameras)}

    tracker = LayeredTracker(bodies, model.limits, ConstantVelocity(free_of(model)), cameras, outline=False)
    tracker.start(*tracker.process.start(*truth(0)), images(0), 0)
    for k in range(1, 9):
        state = tracker.see(images(k), round(1e9 * k / 60.0)).state
    root, angles = truth(8)
    assert np.linalg.norm(state[[3, 7, 11]] - root[:3, 3]) < 5e-4
    assert abs(np.degrees(state[ANGLES] - angles[0])) < 0.5


def test_before_a_start_it_says_what_to_do():
    model, bodies, _ = object_of("planar_arm")
    camera = look_at(np.array([0.0, 0.0, -0.4]), np.zeros(3), width=64, height=48)
    tracker = LayeredTracker(bodies, model.limits, ConstantVelocity(free_of(model)), [camera])
    with pytest.raises(TrackingError, match="start"):
        tracker.see({0: np.zeros((48, 64, 3), np.uint8)}, 0)


def test_without_anything_to_see_it_predicts():
    """Empty pictures at the start: no template is taken, the reasons are kept, the estimate stays finite."""
    model, bodies, names = object_of("planar_arm")
    camera = look_at(np.array([0.05, 0.01, -0.4]), np.array([0.05, 0.0, 0.0]), width=160, height=120, focal=150.0)
    tracker = LayeredTracker(bodies, model.limits, ConstantVelocity(free_of(model)), [camera])
    empty = {0: np.full((120, 160, 3), 80, np.uint8)}
    tracker.start(*tracker.process.start(*rest_of(model)), empty, 0)
    for k in range(1, 4):
        knot = tracker.see(empty, k * 10**8)
    assert np.isfinite(knot.state).all() and np.isfinite(knot.covariance).all()
    assert set(tracker.templates.refused) == set(range(len(names)))


def test_a_process_predicts_and_differs_on_its_manifold():
    process = ConstantVelocity(np.ones(8, bool))
    rng = np.random.default_rng(2)
    root = np.eye(4)
    state, covariance = process.start(root, np.array([0.2, -0.1]), (0.01, 0.1, 0.1))
    step = 0.3 * rng.normal(size=16)
    np.testing.assert_allclose(process.difference(process.retract(state, step), state), step, atol=1e-12)
    later, wider = process.predict(process.retract(state, step), covariance, 0.1)
    moved = process.difference(later, process.retract(state, step))
    np.testing.assert_allclose(moved[6:8], 0.1 * step[14:], atol=1e-12)
    assert np.all(np.linalg.eigvalsh(wider) > 0.0)
