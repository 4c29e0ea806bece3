"""Quaternions, rotation vectors and rigid transforms against scipy and against each other."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rhot_app.geometry import transforms as tf


@pytest.mark.parametrize("seed", range(20))
def test_quaternions_and_rotation_vectors_agree_with_scipy(seed):
    reference = Rotation.random(random_state=seed)
    x, y, z, w = reference.as_quat()
    np.testing.assert_allclose(tf.rotation_from_quaternion([w, x, y, z]), reference.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(tf.exp_so3(reference.as_rotvec()), reference.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(tf.log_so3(reference.as_matrix()), reference.as_rotvec(), atol=1e-9)
    back = tf.rotation_from_quaternion(tf.quaternion_from_rotation(reference.as_matrix()))
    np.testing.assert_allclose(back, reference.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 1e-4, 0.1, np.pi - 1e-7, np.pi])
def test_exp_and_log_meet_at_small_and_straight_angles(angle):
    vector = angle * np.array([0.6, -0.48, 0.64])
    rotation = tf.exp_so3(vector)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(tf.exp_so3(tf.log_so3(rotation)), rotation, atol=1e-9)


def test_inverse_and_apply_chain():
    a_from_b = tf.rigid(tf.exp_so3([0.3, -0.2, 0.9]), [0.1, 0.2, -0.3])
    points = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_allclose(tf.apply(tf.inverse(a_from_b), tf.apply(a_from_b, points)), points, atol=1e-14)


def test_a_zero_quaternion_is_refused():
    with pytest.raises(ValueError, match="length zero"):
        tf.rotation_from_quaternion([0, 0, 0, 0])
