"""The object's process and residuals: Jacobians against finite differences, round trips, and the fastest hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from object_scenes import hand_poses, wide_cameras

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.motion import (
    RATE,
    SIZE,
    START_SPEED,
    VELOCITY,
    CameraArrays,
    ObjectProcess,
    PointResidual,
    PoseResidual,
    state_of,
)

vectors = st.lists(st.floats(-2.0, 2.0), min_size=SIZE, max_size=SIZE).map(np.array)


def moving_state(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    state = state_of(rigid(exp_so3(rng.normal(size=3)), [0.03, -0.02, 0.6] + 0.02 * rng.normal(size=3)))
    state[VELOCITY] = rng.normal(size=6) * [1.0, 1.0, 1.0, 8.0, 8.0, 8.0]
    return state


def numeric(function, state: np.ndarray, step: float = 1e-6) -> np.ndarray:
    process = ObjectProcess()
    columns = [(function(process.retract(state, step * axis)) - function(process.retract(state, -step * axis)))
               / (2.0 * step) for axis in np.eye(len(state) - 6)]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("camera", [0, 1])
@pytest.mark.parametrize("seed", range(5))
def test_the_projections_jacobian_is_that_of_finite_differences(seed: int, camera: int) -> None:
    rng, cameras = np.random.default_rng(seed), CameraArrays.of(wide_cameras())
    points = 0.03 * rng.normal(size=(7, 3))
    residual = PointResidual(points, np.zeros((7, 2)), np.tile(np.eye(2), (7, 1, 1)), 0.02 * rng.normal(size=7),
                             cameras.poses[camera], cameras.intrinsics[camera])
    state = moving_state(seed)
    _, jacobian = residual.predict(state)
    expected = numeric(lambda moved: residual.predict(moved)[0], state)
    np.testing.assert_allclose(jacobian, expected, rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize(("camera", "reference"), [(0, 1), (1, 0), (0, 0)])
def test_the_projections_jacobian_has_the_turn_of_its_camera(camera: int, reference: int) -> None:
    rng, cameras = np.random.default_rng(4), CameraArrays.of(wide_cameras(), reference)
    residual = PointResidual(0.03 * rng.normal(size=(7, 3)), np.zeros((7, 2)), np.tile(np.eye(2), (7, 1, 1)),
                             0.02 * rng.normal(size=7), cameras.poses[camera], cameras.intrinsics[camera],
                             cameras.turn_at(camera))
    state = np.concatenate([moving_state(3), [0.02, -0.01, 0.03]])
    _, jacobian = residual.predict(state)
    np.testing.assert_allclose(jacobian, numeric(lambda moved: residual.predict(moved)[0], state), rtol=1e-6, atol=1e-3)
    assert np.any(jacobian[:, :, SIZE:]) == (camera != reference)


def test_a_projection_is_the_camera_models() -> None:
    models = wide_cameras()
    arrays, state = CameraArrays.of(models), moving_state(3)
    points, late = 0.05 * np.random.default_rng(1).normal(size=(5, 3)), np.full(5, 0.01)
    moved = ObjectProcess().predict(state, np.eye(SIZE), 0.01)[0]
    for camera, model in enumerate(models):
        residual = PointResidual(points, np.zeros((5, 2)), np.tile(np.eye(2), (5, 1, 1)), late, arrays.poses[camera],
                                 arrays.intrinsics[camera])
        pose = pose_matrix(moved)
        np.testing.assert_allclose(residual.predict(state)[0], model.project(points @ pose[:3, :3].T + pose[:3, 3]),
                                   atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_the_transition_is_that_of_finite_differences(seed: int) -> None:
    process, state, dt_s = ObjectProcess(), moving_state(seed), 0.03
    origin = process.predict(state, np.eye(SIZE), dt_s)[0]
    expected = numeric(lambda moved: process.difference(process.predict(moved, np.eye(SIZE), dt_s)[0], origin), state)
    np.testing.assert_allclose(process.transition(state, dt_s), expected, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_a_measured_poses_jacobian_is_that_of_finite_differences_at_its_place(seed: int) -> None:
    state = moving_state(seed)
    rows = PoseResidual(pose_matrix(state), np.eye(6)).linearise(state)
    expected = numeric(lambda moved: -PoseResidual(pose_matrix(state), np.eye(6)).linearise(moved).error, state)
    np.testing.assert_allclose(rows.jacobian, expected, atol=1e-8)


@given(vectors, st.integers(0, 50))
def test_retract_and_difference_are_inverse(step: np.ndarray, seed: int) -> None:
    process, state = ObjectProcess(), moving_state(seed)
    step[3:6] *= min(1.0, 3.0 / max(np.linalg.norm(step[3:6]), 1e-12))  # within half a turn
    moved = process.retract(state, step)
    np.testing.assert_allclose(process.difference(moved, state), step, atol=1e-7)
    np.testing.assert_allclose(pose_matrix(moved)[:3, :3] @ pose_matrix(moved)[:3, :3].T, np.eye(3), atol=1e-12)


def test_a_prediction_in_two_halves_is_that_in_one() -> None:
    process, state = ObjectProcess(), moving_state(4)
    covariance = np.diag(np.arange(1.0, 13.0)) * 1e-4
    once = process.predict(state, covariance, 0.02)
    halves = process.predict(*process.predict(state, covariance, 0.01), 0.01)
    np.testing.assert_allclose(halves[0], once[0], atol=1e-12)
    np.testing.assert_allclose(np.diag(halves[1]), np.diag(once[1]), rtol=0.25)  # the noise grows with the speed


def test_the_process_covers_the_fastest_hand() -> None:
    step_s = 1e-3
    poses = hand_poses("fast", np.arange(0.0, 0.9, step_s))
    velocity = np.diff(poses[:, :3, 3], axis=0) / step_s
    spin = np.array([log_so3(b @ a.T) for a, b in zip(poses[:-1, :3, :3], poses[1:, :3, :3], strict=True)]) / step_s
    for rates, start in zip((velocity, spin), START_SPEED, strict=True):  # m/s, rad/s
        fastest = np.linalg.norm(rates, axis=1).max()
        strongest = np.linalg.norm(np.diff(rates, axis=0) / step_s, axis=1).max()
        assert fastest < 2.5 * start
        assert strongest < 1.1 * RATE * fastest
