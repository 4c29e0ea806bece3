"""Hands from one number: the published parts of hand length, proportions that stay, and the lengths of people."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shipped_rig import LEFT_HAND

from rhot_app.hand.anthropometry import hand_length, scaled_by_hand_length, scaled_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import BONES, FINGERS, JOINTS, HandPose
from rhot_app.hand.tables import TABLES

TABLE = Path(__file__).parents[2] / "../shared/data/anthropometry/hand_segments.json"


def test_parts_are_the_published_table():
    if not TABLE.exists():
        pytest.skip(f"{TABLE} is not here")
    published = json.loads(TABLE.read_text())["buchholz_1992_fraction_of_hand_length"]
    for finger, bones in zip(FINGERS, BONES, strict=True):
        np.testing.assert_allclose(TABLES.bones[finger], [published[finger][bone] for bone in bones], atol=5e-5)


@settings(deadline=None, max_examples=50)
@given(st.floats(0.10, 0.26))
def test_a_hand_of_a_length_has_it_and_the_tables_bones(length):
    hand = scaled_by_hand_length(LEFT_HAND, length)
    joints = forward(build_model(hand), HandPose(np.eye(4), np.zeros(21))).joints
    assert np.linalg.norm(joints[JOINTS.index("middle_tip")]) == pytest.approx(length, abs=1e-6)
    assert hand_length(hand) == pytest.approx(length, abs=1e-6)
    for finger, parts in TABLES.bones.items():
        np.testing.assert_allclose(hand.fingers[finger].bones_mm, 1e3 * length * np.array(parts), atol=1e-5)
        assert hand.fingers[finger].limits_deg == LEFT_HAND.fingers[finger].limits_deg
        share = LEFT_HAND.fingers[finger].marker_mm / LEFT_HAND.fingers[finger].bones_mm[2]
        assert hand.fingers[finger].marker_mm == pytest.approx(share * hand.fingers[finger].bones_mm[2], abs=1e-5)
    assert hand.side == "left"


@settings(deadline=None, max_examples=50)
@given(st.floats(0.3, 2.0), st.lists(st.floats(-0.5, 1.5), min_size=21, max_size=21))
def test_scaling_a_hand_scales_every_pose(factor, angles):
    pose = HandPose(np.eye(4), np.array(angles))
    small, big = forward(build_model(LEFT_HAND), pose), forward(build_model(scaled_hand(LEFT_HAND, factor)), pose)
    np.testing.assert_allclose(big.joints, factor * small.joints, atol=1e-8)
    np.testing.assert_allclose(big.marker_centres, factor * small.marker_centres, atol=1e-8)


@pytest.mark.parametrize("length", [0.0, 0.09, 0.3, 190.0, float("nan")])
def test_lengths_of_no_hand_are_refused(length):
    with pytest.raises(ValueError, match="100 to 260 mm"):
        scaled_by_hand_length(LEFT_HAND, length)


def test_a_scale_is_positive():
    with pytest.raises(ValueError, match="positive"):
        scaled_hand(LEFT_HAND, -1.0)
