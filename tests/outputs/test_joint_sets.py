"""What other programs get of a state: the joints that they name, in their order and their axes."""

from __future__ import annotations

import time
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from streams import palm_before_cameras, state_of, unknown

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose
from rhot_app.outputs.joints import MEDIAPIPE_JOINTS, JointConverter, json_message
from rhot_app.outputs.openxr import OPENXR_JOINTS
from rhot_app.outputs.vmc import bone_poses, bones_of
from rhot_app.project import Rig
from rhot_node.files import resource_path


def joint(sample, name: str) -> np.ndarray:
    return sample.hands[0].positions[sample.joints.index(name)]


def axes_of(sample, name: str) -> np.ndarray:
    """(3, 3): x, y and z of a joint as columns."""
    return Rotation.from_quat(sample.hands[0].orientations[sample.joints.index(name)]).as_matrix()


def test_own_joints_are_the_states(rig: Rig) -> None:
    state = state_of(rig, neutral_pose(palm_before_cameras()))
    sample = JointConverter(rig).sample(state, "own")
    assert sample.joints == JOINTS
    np.testing.assert_array_equal(sample.hands[0].positions, state.joint_positions)
    assert sample.hands[0].orientations is None and sample.hands[0].radii is None
    assert 0.0 <= sample.age_s < 5.0
    palm = Rotation.from_quat(sample.hands[0].palm_orientation).as_matrix()
    np.testing.assert_allclose(palm, palm_before_cameras()[:3, :3], atol=1e-12)


def test_mediapipes_numbers_are_its_own(rig: Rig) -> None:
    numbers = {"WRIST": 0, "THUMB_CMC": 1, "THUMB_TIP": 4, "INDEX_FINGER_MCP": 5, "MIDDLE_FINGER_PIP": 10,
               "RING_FINGER_DIP": 15, "PINKY_MCP": 17, "PINKY_TIP": 20}
    assert {name: MEDIAPIPE_JOINTS.index(name) for name in numbers} == numbers and len(MEDIAPIPE_JOINTS) == 21
    sample = JointConverter(rig).sample(state_of(rig, neutral_pose()), "mediapipe")
    own = JointConverter(rig).sample(state_of(rig, neutral_pose()), "own")
    np.testing.assert_array_equal(joint(sample, "PINKY_TIP"), joint(own, "little_tip"))
    np.testing.assert_array_equal(joint(sample, "THUMB_IP"), joint(own, "thumb_ip"))


def test_openxr_has_its_own_axes(rig: Rig) -> None:
    """A flat right hand before the camera, fingers up, its back away from the viewer: in OpenXR's room fingers point to
    +y, the hand is in front (-z), the back of the hand is away (-z), the thumb is at the viewer's right (+x)."""
    pose = HandPose(palm_before_cameras(), np.zeros(len(ANGLES)))
    state = state_of(rig, pose)
    sample = JointConverter(rig).sample(state, "openxr")
    assert sample.joints == OPENXR_JOINTS and len(sample.joints) == 26
    np.testing.assert_allclose(joint(sample, "wrist"), (0.04, -0.06, -0.6), atol=1e-12)
    own = state.joint_positions[JOINTS.index("index_tip")]
    np.testing.assert_allclose(joint(sample, "index_tip"), (1, -1, -1) * own, atol=1e-9)
    assert joint(sample, "middle_tip")[1] > joint(sample, "middle_proximal")[1] > joint(sample, "wrist")[1]
    assert joint(sample, "thumb_tip")[0] > joint(sample, "index_tip")[0]
    middle = axes_of(sample, "middle_proximal")
    np.testing.assert_allclose(-middle[:, 2], (0, 1, 0), atol=0.1)  # -z runs to the fingertip
    np.testing.assert_allclose(middle[:, 1], (0, 0, -1), atol=0.1)  # +y out of the back
    radii = sample.hands[0].radii
    assert radii is not None and 0.004 < radii.min() < radii.max() < 0.03
    palm = Rotation.from_quat(sample.hands[0].palm_orientation).as_matrix()
    np.testing.assert_allclose(palm[:, 0], (0, 1, 0), atol=1e-9)
    np.testing.assert_allclose(palm[:, 2], (0, 0, -1), atol=1e-9)


def test_a_table_frame_is_turned_upright(rig: Rig) -> None:
    """z of a table points up, and so does y of OpenXR."""
    table = msgspec.structs.replace(rig, up="z")
    palm = np.eye(4)
    palm[:3, 3] = (0.1, 0.2, 0.3)
    sample = JointConverter(table).sample(state_of(table, HandPose(palm, np.zeros(21))), "openxr")
    np.testing.assert_allclose(joint(sample, "wrist"), (0.1, 0.3, -0.2), atol=1e-12)
    np.testing.assert_allclose(axes_of(sample, "middle_proximal")[:, 1], (0, 1, 0), atol=0.1)  # the back is up


def test_a_larger_hand_has_larger_bones(rig: Rig) -> None:
    state = state_of(rig, neutral_pose())
    converter = JointConverter(rig)
    plain = converter.sample(state, "openxr")
    large = converter.sample(replace(state, hand_scale=1.1), "openxr")
    np.testing.assert_allclose(joint(large, "index_tip") - joint(large, "wrist"),
                               1.1 * (joint(plain, "index_tip") - joint(plain, "wrist")), atol=1e-12)
    np.testing.assert_allclose(large.hands[0].radii, 1.1 * plain.hands[0].radii)


@pytest.mark.parametrize("joint_set", ["own", "openxr", "mediapipe"])
def test_what_is_unknown_stays_unknown(rig: Rig, joint_set: str) -> None:
    sample = JointConverter(rig).sample(unknown(state_of(rig, neutral_pose())), joint_set)
    hand = sample.hands[0]
    assert hand.condition == "LOST" and np.isnan(hand.positions).all() and np.isnan(hand.palm_orientation).all()
    assert (hand.knowledge == 3).all()


def test_a_replayed_state_has_no_age(rig: Rig) -> None:
    state = replace(state_of(rig, neutral_pose()), t_master_ns=5)
    sample = JointConverter(rig).sample(state, "own")
    assert np.isnan(sample.age_s) and sample.t_unix_ns is None


def test_a_live_state_has_a_wall_clock_time(rig: Rig) -> None:
    before, state = time.time_ns(), replace(state_of(rig, neutral_pose()), t_master_ns=time.monotonic_ns())
    sample = JointConverter(rig).sample(state, "own")
    assert sample.t_unix_ns is not None
    assert before - 10_000_000 <= sample.t_unix_ns <= time.time_ns()
    assert msgspec.json.decode(json_message(sample))["t_unix_ns"] == sample.t_unix_ns


def test_two_hands_have_two_names(two_hands: Rig) -> None:
    state = state_of(two_hands, neutral_pose())
    sample = JointConverter(two_hands).sample(replace(state, other=state), "own")
    assert [hand.name for hand in sample.hands] == ["right", "left"]
    twice = msgspec.structs.replace(two_hands, other_hand=two_hands.hand)
    sample = JointConverter(twice).sample(replace(state, other=state), "own")
    assert [(hand.name, hand.side) for hand in sample.hands] == [("right", "right"), ("other_right", "right")]


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_hand_in_the_t_pose_turns_no_bone(rig: Rig, side: str) -> None:
    """An avatar that looks along Unity's +z holds its arms along x, palms down: fingers turn by their own few degrees,
    the fist closes downwards."""
    hand = load_hand(resource_path("hands", f"{side}.json"))
    rig = msgspec.structs.replace(rig, hand=hand, up="-y")
    along = 1.0 if side == "right" else -1.0
    palm = np.eye(4)  # in the rig frame: x right, y down, z away. Fingers along x, back of the hand up
    palm[:3, 0], palm[:3, 2] = (along, 0.0, 0.0), (0.0, -1.0, 0.0)
    palm[:3, 1] = np.cross(palm[:3, 2], palm[:3, 0])
    flat = JointConverter(rig).sample(state_of(rig, HandPose(palm, np.zeros(21))), "openxr").hands[0]
    bones = bones_of(side)
    offsets, turns = bone_poses(flat, bones)
    assert bones.names[0] == f"{side.capitalize()}Hand" and len(bones.names) == 16
    for name, turn in zip(bones.names, turns, strict=True):
        degrees = np.degrees(Rotation.from_quat(turn).magnitude())
        assert degrees < (70.0 if "ThumbProximal" in name else 25.0), (name, degrees)
    middle = bones.names.index(f"{side.capitalize()}MiddleIntermediate")
    np.testing.assert_allclose(offsets[middle] * (along, 1, 1), (np.linalg.norm(offsets[middle]), 0, 0), atol=0.004)
    angles = np.where([name.endswith("pip_flexion") for name in ANGLES], 1.0, 0.0)
    bent = JointConverter(rig).sample(state_of(rig, HandPose(palm, angles)), "openxr").hands[0]
    _, bent_turns = bone_poses(bent, bones)
    to_tip = Rotation.from_quat(bent_turns[middle]).apply((along, 0.0, 0.0))
    np.testing.assert_allclose(to_tip, (along * np.cos(1.0), -np.sin(1.0), 0.0), atol=0.1)
