"""Forward kinematics against a plain numpy twin, the Jacobian against finite differences, the two sides as mirrors."""

import numpy as np
import pytest
from hand_samples import random_pose, rotation_about

from rhot_app.hand.dh import ROOT, DhRow, compile_table, rigid_rows
from rhot_app.hand.kinematics import chain_row, empty_frames, forward, forward_arrays, jacobian, point_jacobian
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import ANGLES, FINGERS, HandPose


def twin(model, pose):
    """Joints and markers from rotations about anatomical axes, without any DH table. Right hand only."""
    def rz(angle):
        return rotation_about([0, 0, angle])

    def ry(angle):
        return rotation_about([0, angle, 0])

    joints, markers = [np.zeros(3)], []
    for f, name in enumerate(FINGERS):
        q = pose.angles[:5] if f == 0 else pose.angles[1 + 4 * f:5 + 4 * f]
        r, p = model.base_rotation[f], model.base[f]
        turns = [rz(q[0]) @ ry(q[1]), rz(q[2]) @ ry(q[3]), ry(q[4])] if name == "thumb" else [
            rz(q[0]) @ ry(q[1]), ry(q[2]), ry(q[3])]
        joints.append(p)
        for bone, turn in zip(model.bones[f], turns, strict=True):
            r = r @ turn
            last, p = p, p + r @ [bone, 0, 0]
            joints.append(p)
        markers.append(last + r @ [model.marker[f], 0, 0])
    rotation, translation = pose.world_from_palm[:3, :3], pose.world_from_palm[:3, 3]
    return np.array(joints) @ rotation.T + translation, np.array(markers) @ rotation.T + translation


def test_joints_match_a_plain_numpy_hand(right_hand):
    rng = np.random.default_rng(1)
    for _ in range(20):
        pose = random_pose(right_hand, rng)
        points = forward(right_hand, pose)
        joints, markers = twin(right_hand, pose)
        np.testing.assert_allclose(points.joints, joints, atol=1e-12)
        np.testing.assert_allclose(points.marker_centres, markers, atol=1e-12)


def numeric_jacobian(look, pose):
    """(..., 27): how what `look` says of a pose follows each of its numbers, by differences."""
    def moved(column, by):
        world, angles = pose.world_from_palm.copy(), pose.angles.copy()
        if column < 3:
            world[column, 3] += by
        elif column < 6:
            world[:3, :3] = rotation_about(by * np.eye(3)[column - 3]) @ world[:3, :3]
        else:
            angles[column - 6] += by
        return look(HandPose(world, angles))

    step = 1e-6
    return np.stack([(moved(c, step) - moved(c, -step)) / (2 * step) for c in range(6 + len(ANGLES))], axis=-1)


def test_jacobian_matches_finite_differences(model):
    rng = np.random.default_rng(2)

    def points(pose):
        found = forward(model, pose)
        return np.vstack([found.joints, found.marker_centres])

    for _ in range(5):
        pose = random_pose(model, rng)
        np.testing.assert_allclose(jacobian(model, pose), numeric_jacobian(points, pose), atol=1e-8)


def test_directions_follow_the_pose_as_finite_differences_say(model):
    rng, dh = np.random.default_rng(3), model.dh
    count = len(dh.point_row)

    def frames_of(pose):
        frames = np.empty((len(dh.parent), 3, 4))
        forward_arrays(dh, pose.world_from_palm, pose.angles, frames, np.empty((count, 3)))
        return frames

    for _ in range(3):
        pose = random_pose(model, rng)
        frames = frames_of(pose)
        for point in range(count):
            row = dh.point_row[point]
            if row == ROOT:
                continue
            ends = np.zeros((2, 3, 6 + len(ANGLES)))
            for place, out in zip((frames[row, :, 3] + frames[row, :, 0], frames[row, :, 3]), ends, strict=True):
                point_jacobian(dh, pose.world_from_palm, frames, row, *place, out)
            numeric = numeric_jacobian(lambda other, row=row: frames_of(other)[row, :, 0], pose)
            np.testing.assert_allclose(ends[0] - ends[1], numeric, atol=1e-8)


def test_a_chain_row_is_a_gradient_times_the_jacobian(model):
    rng, dh = np.random.default_rng(4), model.dh
    pose, frames, points = random_pose(model, rng), empty_frames(model.dh), np.empty((len(model.dh.point_row), 3))
    forward_arrays(dh, pose.world_from_palm, pose.angles, frames, points)
    for point, slopes in enumerate(jacobian(model, pose)):
        gradient, out = rng.normal(size=3), np.zeros(6 + len(ANGLES))
        chain_row(dh, pose.world_from_palm, frames, dh.point_row[point], *points[point], gradient, out)
        np.testing.assert_allclose(out, gradient @ slopes, atol=1e-12)


def test_left_hand_is_the_mirror_image(right_hand, left_hand):
    pose = random_pose(right_hand, np.random.default_rng(3), world=np.eye(4))
    right, left = forward(right_hand, pose), forward(left_hand, pose)
    np.testing.assert_allclose(left.joints * [1, -1, 1], right.joints, atol=1e-12)
    np.testing.assert_allclose(left.marker_centres * [1, -1, 1], right.marker_centres, atol=1e-12)


def test_thumb_can_oppose_the_little_finger(right_hand):
    """Some pose within limits brings thumb pad and little finger pad together: the thumb's base is placed well."""
    rng = np.random.default_rng(5)
    low, high = right_hand.limits.T
    poses = (HandPose(np.eye(4), rng.uniform(low, high)) for _ in range(20000))
    gap = min(np.linalg.norm(np.subtract(*forward(right_hand, pose).marker_centres[[0, 4]])) for pose in poses)
    assert gap < 0.012


@pytest.mark.parametrize("rotation", [np.eye(3), rotation_about([0, 0, 0.7]), rotation_about([np.pi, 0, 0]),
                                      rotation_about([0.3, -1.2, 2.0])])
def test_rigid_rows_reach_any_frame(rotation):
    translation = np.array([0.03, -0.05, 0.07])
    rows, turn = rigid_rows(ROOT, 0, rotation, translation)
    table = compile_table([*rows, DhRow(1, theta=turn)], [])
    frames = empty_frames(table)
    forward_arrays(table, np.eye(4), np.zeros(0), frames, np.empty((0, 3)))
    np.testing.assert_allclose(frames[2], np.hstack([rotation, translation[:, None]]), atol=1e-12)


def test_table_with_a_row_before_its_parent_is_refused():
    with pytest.raises(ValueError, match="row 0 names parent 1"):
        compile_table([DhRow(1), DhRow(ROOT)], [])
    with pytest.raises(ValueError, match="does not exist"):
        compile_table([DhRow(ROOT)], [(1, (0.0, 0.0, 0.0))])


def test_both_shipped_hands_have_the_same_numbers(right_hand, left_hand):
    assert right_hand.anatomy.fingers == left_hand.anatomy.fingers
    assert build_model(left_hand.anatomy).mirror == -1.0
