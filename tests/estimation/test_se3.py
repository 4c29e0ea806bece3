"""Rotations and poses against scipy, finite differences and each other."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rhot_app.estimation import se3

ANGLES = [0.0, 1e-12, 1e-6, 1e-4, 0.1, np.pi - 1e-7, np.pi]
AXIS = np.array([0.6, -0.48, 0.64])


@pytest.mark.parametrize("seed", range(20))
def test_quaternions_and_rotation_vectors_agree_with_scipy(seed):
    reference, origin = Rotation.random(2, random_state=seed)
    x, y, z, w = reference.as_quat()
    np.testing.assert_allclose(se3.rotation_from_quaternion([w, x, y, z]), reference.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(se3.exp_so3(reference.as_rotvec()), reference.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(se3.log_so3(reference.as_matrix()), reference.as_rotvec(), atol=1e-9)
    np.testing.assert_allclose(se3.rotation_vector(reference.as_matrix(), origin.as_matrix()),
                               (reference * origin.inv()).as_rotvec(), atol=1e-9)
    back = se3.rotation_from_quaternion(se3.quaternion_from_rotation(reference.as_matrix()))
    np.testing.assert_allclose(back, reference.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_and_log_meet_at_small_and_straight_angles(angle):
    rotation = se3.exp_so3(angle * AXIS)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(se3.exp_so3(se3.log_so3(rotation)), rotation, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.99e-4, 1.01e-4, 0.1, 2.0, np.pi])
def test_the_left_jacobian_is_that_of_the_exponential(angle):
    vector = angle * AXIS
    slope = np.column_stack([se3.rotation_vector(se3.exp_so3(vector + 1e-6 * axis), se3.exp_so3(vector - 1e-6 * axis))
                             for axis in np.eye(3)]) / 2e-6
    np.testing.assert_allclose(se3.left_jacobian(vector), slope, atol=1e-8)


def test_cross_products_by_matrices():
    a, b = np.random.default_rng(3).normal(size=(2, 4, 3))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", se3.skew(a), b), np.cross(a, b))
    np.testing.assert_allclose(se3.skew(a[0]) @ b[0], np.cross(a[0], b[0]))


@pytest.mark.parametrize("turn", [0.3, np.pi - 1e-9])
def test_the_difference_of_states_undoes_a_step(turn):
    state = np.random.default_rng(4).normal(size=15)
    state[:12] = np.column_stack([se3.exp_so3(2.0 * AXIS), state[:3]]).ravel()
    step = np.concatenate([[0.1, -0.2, 0.3], turn * AXIS, [1.0, -2.0, 3.0]])
    np.testing.assert_allclose(se3.difference(se3.retract(state, step), state), step, atol=1e-8)


def test_many_quaternions_of_which_one_is_unknown():
    rotations = np.array([np.eye(3), np.diag([-1.0, -1.0, 1.0]), np.full((3, 3), np.nan), np.eye(3)])
    rotations[3, 0, 1] = np.nan
    found = se3.quaternion_from_rotation(rotations)
    np.testing.assert_allclose(np.abs(found[:2]), [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]], atol=1e-12)
    assert np.isnan(found[2:]).all()


def test_a_zero_quaternion_is_refused():
    with pytest.raises(ValueError, match="length zero"):
        se3.rotation_from_quaternion([[1, 0, 0, 0], [0, 0, 0, 0]])
