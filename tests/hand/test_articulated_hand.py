"""A hand written out as an articulated object is the same hand: points, angles, limits, couplings, sides."""

import numpy as np
import pytest
from hand_samples import random_pose

from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.hand.articulated import articulated_hand, load_articulated, save_articulated
from rhot_app.hand.articulated_model import build_articulated, forward_state, state_jacobian
from rhot_app.hand.kinematics import forward, jacobian
from rhot_app.hand.model import make_variant
from rhot_app.hand.skeleton import ANGLES


def state_of(pose):
    world = pose.world_from_palm
    return np.concatenate([quaternion_from_rotation(world[:3, :3]), world[:3, 3], pose.angles])


def test_points_and_jacobian_are_the_hands(model, tmp_path):
    path = tmp_path / "hand.json"
    save_articulated(path, articulated_hand(model.anatomy))
    articulated = build_articulated(load_articulated(path))
    for seed in range(3):
        pose = random_pose(model, np.random.default_rng(seed))
        points, expected = forward_state(articulated, state_of(pose)).points, forward(model, pose)
        np.testing.assert_allclose(points[:21], expected.joints, atol=1e-11)
        np.testing.assert_allclose(points[21:], expected.marker_centres, atol=1e-11)
        per_number, per_twist = state_jacobian(articulated, state_of(pose)), jacobian(model, pose)
        np.testing.assert_allclose(per_number[:, :, 4:7], per_twist[:, :, :3], atol=1e-12)
        np.testing.assert_allclose(per_number[:, :, 7:], per_twist[:, :, 6:], atol=1e-11)


def test_it_has_the_hands_bodies_angles_and_couplings(right_hand):
    model = build_articulated(articulated_hand(right_hand.anatomy))
    assert len(model.bodies) == 16
    assert len(model.rest) == 28
    assert model.angle_names == ANGLES
    np.testing.assert_allclose(model.limits, right_hand.limits, atol=1e-12)
    np.testing.assert_allclose(model.coupled.basis, make_variant("coupled").basis, atol=1e-12)
    assert model.document.length_mm == pytest.approx(179.31)
