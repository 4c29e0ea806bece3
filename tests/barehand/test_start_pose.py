"""The pose that a hand is to take: where it is, in files, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import cast

import msgspec
import numpy as np
import pytest
from bare_scenes import DISTANCE_M, near, poses, rig_of
from pictures import look_at, two_cameras
from shipped_rig import LEFT_HAND

from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.errors import RigError
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import forward
from rhot_app.project import CameraCalibration, PalmPlane, Rig, TrackerSettings, load_rig, save_rig
from rhot_app.tracking.contours.tracker import ContourEstimator
from rhot_app.tracking.scene import Scene, make_tracker


def joints_shown(rig: Rig) -> tuple[list[CameraModel], np.ndarray, np.ndarray]:
    """The cameras, the joints (21, 3) m and the pose of the hand that the rig shows."""
    tracker = BareHandTracker(rig)
    return tracker.cameras, forward(tracker.model, tracker.start_pose).joints, tracker.start_pose.world_from_palm


def parallel() -> list[CameraModel]:
    return [look_at(np.array([x, 0.0, 0.0]), np.array([x, 0.0, 1.0])) for x in (-0.06, 0.06)]


@pytest.mark.parametrize("cameras", [two_cameras(distance=DISTANCE_M), two_cameras(distance=0.9)[:1], parallel(),
                                     [look_at(np.array([0.0, 0.0, z]), np.array([0.0, 0.0, 0.6])) for z in (0, 1.2)]],
                         ids=["converging", "one", "parallel", "face to face"])
@pytest.mark.parametrize("hand", ["right", "left"])
def test_every_camera_sees_the_whole_hand(cameras: list[CameraModel], hand: str) -> None:
    rig = rig_of(cameras) if hand == "right" else rig_of(cameras, LEFT_HAND)
    models, joints, world = joints_shown(rig)
    for camera in models:
        pixels = camera.project(joints)
        assert (pixels > 0.0).all() and (pixels < [camera.width, camera.height]).all()
    assert models[0].world_from_camera[:3, 2] @ world[:3, 2] > 0.9, "the first one sees its palm"


def test_parallel_cameras_show_it_where_they_were_calibrated_for() -> None:
    rig = msgspec.structs.replace(rig_of(parallel()), calibration=CameraCalibration("board", distance_m=0.8))
    assert joints_shown(rig)[1][:, 2].mean() == pytest.approx(0.8, abs=0.05)


def test_a_palm_on_a_plane_is_shown_on_it() -> None:
    rig = rig_of(two_cameras(distance=DISTANCE_M))
    plane = PalmPlane((0.0, -1.0, -1.0), -0.38)
    rig = msgspec.structs.replace(rig, tracker=TrackerSettings("estimator", observe="contours", palm_plane=plane))
    world = joints_shown(rig)[2]
    normal = np.array([0.0, -1.0, -1.0]) / np.sqrt(2.0)
    assert world[:3, 2] == pytest.approx(normal) and normal @ world[:3, 3] == pytest.approx(-0.38)
    assert np.linalg.det(world[:3, :3]) == pytest.approx(1.0) and world[1, 0] < 0.0, "its fingers point away, upwards"


def hands_of(rig: Rig) -> Sequence[ContourEstimator]:
    """The trackers of a rig's two bare hands."""
    scene = make_tracker(rig)
    assert isinstance(scene, Scene)
    return cast(Sequence[ContourEstimator], scene.hands)


def test_two_hands_are_shown_apart() -> None:
    rig = msgspec.structs.replace(rig_of(two_cameras(distance=DISTANCE_M)), other_hand=LEFT_HAND,
                                  tracker=TrackerSettings("estimator", observe="contours"))
    right, left = (hand.hand.start_pose.world_from_palm[:3, 3] for hand in hands_of(rig))
    assert left[0] - right[0] > 0.15


def test_the_rigs_poses_are_those_of_its_hands_and_come_back_from_its_file(tmp_path: Path) -> None:
    given = [near(pose, k) for k, pose in enumerate(poses("spread", (0.0, 0.4)))]
    rig = msgspec.structs.replace(rig_of(two_cameras(distance=DISTANCE_M), shown=given), other_hand=LEFT_HAND)
    rig = msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, kind="estimator",
                                                                       observe="contours"))
    save_rig(tmp_path / "rig.json", rig)
    for hand, pose in zip(hands_of(load_rig(tmp_path / "rig.json")), given, strict=True):
        np.testing.assert_allclose(hand.hand.start_pose.world_from_palm, pose.world_from_palm, atol=1e-9)
        np.testing.assert_allclose(hand.hand.start_pose.angles, pose.angles, atol=1e-9)


@pytest.mark.parametrize(("field", "value", "says"), [
    ("rotation_wxyz", [1.0, 1.0, 0.0, 0.0], "unit quaternion"), ("angles_deg", {"index_pip": 3.0}, "to start with"),
    ("translation_m", [0.0, 0.0], "translation_m"), ("angles_deg", {"index_pip_flexion": 1e9}, "angles_deg")])
def test_a_pose_that_is_none_is_refused(tmp_path: Path, field: str, value: object, says: str) -> None:
    save_rig(tmp_path / "rig.json", rig_of(two_cameras(distance=DISTANCE_M), shown=[poses("grasp", (0.0,))[0]]))
    document = msgspec.json.decode((tmp_path / "rig.json").read_bytes())
    document["tracker"]["start_poses"][0][field] = value
    (tmp_path / "rig.json").write_bytes(msgspec.json.encode(document))
    with pytest.raises(RigError, match=says):
        load_rig(tmp_path / "rig.json")
