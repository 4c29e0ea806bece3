"""Angles recovered from joint positions are the angles that posed them."""

import numpy as np
import pytest
from hand_samples import rotation_about
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import HandPose
from rhot_app.hand.solvers.fabrik import angles_from_joints
from rhot_node.files import resource_path

MODELS = {side: build_model(load_hand(resource_path("hands", f"{side}.json"))) for side in ("right", "left")}


@settings(max_examples=200, deadline=None)
@given(side=st.sampled_from(["right", "left"]),
       fractions=st.lists(st.floats(0.0, 1.0), min_size=21, max_size=21),
       turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3), place=st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_round_trip_through_the_joints(side, fractions, turn, place):
    model = MODELS[side]
    low, high = model.limits.T
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = rotation_about(turn), place
    pose = HandPose(world, low + fractions * (high - low))
    joints = forward(model, pose).joints
    found = angles_from_joints(model, world, joints)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(forward(model, HandPose(world, found)).joints, joints, atol=1e-8)
    # A chain that nowhere leaves its abduction axis does not show the abduction; elsewhere the angles are unique.
    thumb_shown = np.cos(pose.angles[3]) ** 2 + np.cos(pose.angles[3] + pose.angles[4]) ** 2 > 1e-3
    np.testing.assert_allclose(found[5:], pose.angles[5:], atol=1e-7)
    if thumb_shown:
        np.testing.assert_allclose(found[:5], pose.angles[:5], atol=1e-7)


def test_undetermined_abduction_is_zero_not_nan():
    angles = np.zeros(21)
    angles[6] = np.pi / 2  # the index finger points along its abduction axis
    joints = forward(MODELS["right"], HandPose(np.eye(4), angles)).joints
    np.testing.assert_allclose(angles_from_joints(MODELS["right"], np.eye(4), joints), angles, atol=1e-6)


@pytest.mark.parametrize("noise", [1e-4, 1e-3])
def test_noisy_joints_give_nearby_angles(noise):
    rng = np.random.default_rng(7)
    low, high = MODELS["right"].limits.T
    pose = HandPose(np.eye(4), 0.7 * low + 0.3 * high)
    joints = forward(MODELS["right"], pose).joints + rng.normal(0, noise, (21, 3))
    assert np.abs(angles_from_joints(MODELS["right"], np.eye(4), joints) - pose.angles).max() < 400 * noise
