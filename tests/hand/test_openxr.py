"""The 26 OpenXR joints: order and names, positions that are ours, axes as the standard defines them, both hands."""

from itertools import pairwise

import numpy as np
from hand_samples import random_pose
from scipy.spatial.transform import Rotation

from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import FINGERS, JOINTS, HandPose
from rhot_app.outputs.openxr import OPENXR_JOINTS, OUR_JOINTS, openxr_hand, openxr_map

CHAINS = {finger: [k for k, name in enumerate(OPENXR_JOINTS) if name.startswith(finger)] for finger in FINGERS}


def posed(model, pose):
    hand = openxr_hand(model, openxr_map(model), pose)
    return hand.positions, Rotation.from_quat(hand.orientations[:, [1, 2, 3, 0]]).as_matrix(), hand.radii


def test_order_is_the_standards():
    assert len(OPENXR_JOINTS) == len(OUR_JOINTS) == 26
    numbers = {"palm": 0, "wrist": 1, "thumb_metacarpal": 2, "thumb_tip": 5, "index_metacarpal": 6, "index_proximal": 7,
               "middle_intermediate": 13, "ring_distal": 19, "little_tip": 25}
    assert {name: OPENXR_JOINTS.index(name) for name in numbers} == numbers
    assert {name for name in OUR_JOINTS if name} == set(JOINTS)


def test_our_joints_are_where_the_kinematics_puts_them(model):
    for seed in range(3):
        pose = random_pose(model, np.random.default_rng(seed))
        positions, _, _ = posed(model, pose)
        ours = positions[[OUR_JOINTS.index(name) for name in JOINTS]]
        np.testing.assert_allclose(ours, forward(model, pose).joints, atol=1e-12)


def test_minus_z_points_along_each_bone(model):
    positions, turns, _ = posed(model, random_pose(model, np.random.default_rng(4)))
    for chain in CHAINS.values():
        for joint, following in pairwise(chain):
            bone = positions[following] - positions[joint]
            np.testing.assert_allclose(-turns[joint][:, 2], bone / np.linalg.norm(bone), atol=1e-9)
        np.testing.assert_allclose(turns[chain[-1]], turns[chain[-2]], atol=1e-12)  # a tip turns with its bone
    middle = OPENXR_JOINTS.index("middle_metacarpal")
    to_middle = positions[middle] - positions[1]
    np.testing.assert_allclose(-turns[1][:, 2], to_middle / np.linalg.norm(to_middle), atol=1e-9)
    np.testing.assert_allclose(positions[0], 0.5 * (positions[middle] + positions[middle + 1]), atol=1e-12)
    np.testing.assert_allclose(turns[0][:, 2], turns[middle][:, 2], atol=1e-12)


def test_y_is_dorsal_and_x_right_of_a_palm_that_faces_down(model):
    _, turns, _ = posed(model, HandPose(np.eye(4), np.zeros(21)))  # palm frame: x distal, z dorsal
    np.testing.assert_allclose(np.linalg.det(turns), 1.0, atol=1e-12)
    flat = [k for k, name in enumerate(OPENXR_JOINTS) if not name.startswith("thumb")]
    assert np.all(turns[flat][:, 2, 1] > 0.95)
    assert np.all(turns[flat][:, 1, 0] < -0.9), "+x lies to the right as one looks along the fingers, on both hands"


def test_fingers_bend_about_x_and_to_the_palm(model):
    angles = np.zeros(21)
    angles[[6, 7, 8]] = 0.4, 0.5, 0.3  # the index finger's flexions
    _, turns, _ = posed(model, HandPose(np.eye(4), angles))
    _, straight, _ = posed(model, HandPose(np.eye(4), np.zeros(21)))
    for joint, bent in zip(CHAINS["index"][1:4], np.cumsum([0.4, 0.5, 0.3]), strict=True):
        turn = Rotation.from_matrix(straight[joint].T @ turns[joint]).as_rotvec()
        np.testing.assert_allclose(turn, [-bent, 0, 0], atol=1e-9)


def test_a_left_hand_is_the_mirror_image(right_hand, left_hand):
    pose = random_pose(right_hand, np.random.default_rng(5), world=np.eye(4))
    right, right_turns, right_radii = posed(right_hand, pose)
    left, left_turns, left_radii = posed(left_hand, pose)
    np.testing.assert_allclose(left * [1, -1, 1], right, atol=1e-12)
    mirrored = np.diag([1, -1, 1]) @ left_turns @ np.diag([-1, 1, 1])
    np.testing.assert_allclose(mirrored, right_turns, atol=1e-9)
    np.testing.assert_array_equal(left_radii, right_radii)


def test_metacarpals_are_as_long_as_x_rays_have_them(right_hand):
    positions, _, radii = posed(right_hand, HandPose(np.eye(4), np.zeros(21)))
    lengths = [1e3 * np.linalg.norm(positions[CHAINS[f][1]] - positions[CHAINS[f][0]]) for f in FINGERS[1:]]
    np.testing.assert_allclose(lengths, [68.12, 64.60, 58.00, 53.69], atol=0.1)
    assert np.all((radii > 0.006) & (radii < 0.025))
