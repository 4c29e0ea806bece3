"""MCAP for ROS 2, read back by mcap-ros2-support's reader: ROS's own types, at wall clock times."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rhot_app.__main__ import main
from rhot_app.export.export import export_log
from rhot_app.export.plan import ExportOptions
from rhot_app.export.states import HandStates
from rhot_app.hand.skeleton import ANGLES
from rhot_app.recording.raw_log import LogReader

reader = pytest.importorskip("mcap_ros2.reader", reason="the extra `export` is not installed")


@pytest.fixture(scope="module")
def found(log: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """The messages by topic."""
    out = tmp_path_factory.mktemp("ros2") / "take.mcap"
    export_log(log, out, format_name="ros2", options=ExportOptions(tracker="estimator"))
    messages: dict[str, list[Any]] = {}
    for message in reader.read_ros2_messages(str(out)):
        messages.setdefault(message.channel.topic, []).append(message)
    return messages


def stamp_ns(stamp: Any) -> int:
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def test_ros_reads_what_the_states_say(found: dict[str, list[Any]], log: Path,
                                       states_by: Callable[[str], HandStates]) -> None:
    states = states_by("estimator")
    about = LogReader(log).about
    since = datetime.fromisoformat(about["created"]) - datetime(1970, 1, 1, tzinfo=UTC)
    offset_ns = since // timedelta(microseconds=1) * 1000 - about["created_t_master_ns"]
    assert {topic: messages[0].schema.name for topic, messages in found.items()} == {
        "/hand/joint_states": "sensor_msgs/msg/JointState", "/hand/joints": "geometry_msgs/msg/PoseArray",
        "/tf": "tf2_msgs/msg/TFMessage", "/tf_static": "tf2_msgs/msg/TFMessage"}
    rows = np.flatnonzero(states.tracked)
    assert len(rows) == len(found["/hand/joint_states"]) == len(found["/hand/joints"]) > 50
    for row, angles, joints, frames in list(zip(rows, found["/hand/joint_states"], found["/hand/joints"], found["/tf"],
                                                strict=True))[::11]:
        t_ns = int(states.t_master_ns[row]) + offset_ns
        assert stamp_ns(angles.ros_msg.header.stamp) == t_ns == angles.log_time_ns
        assert tuple(angles.ros_msg.name) == ANGLES and list(angles.ros_msg.velocity) == []
        assert list(angles.ros_msg.position) == pytest.approx(states.angles[row])
        assert joints.ros_msg.header.frame_id == "rig"
        assert [[p.position.x, p.position.y, p.position.z] for p in joints.ros_msg.poses] == [
            pytest.approx(point) for point in states.joint_positions[row]]
        assert all(p.orientation.w == 1.0 for p in joints.ros_msg.poses)
        (palm,) = frames.ros_msg.transforms
        assert (palm.header.frame_id, palm.child_frame_id) == ("rig", "palm")
        turn, shift = palm.transform.rotation, palm.transform.translation
        assert turn.x**2 + turn.y**2 + turn.z**2 + turn.w**2 == pytest.approx(1.0)
        assert [shift.x, shift.y, shift.z] == pytest.approx(states.world_from_palm[row, :3, 3])
    (static,) = found["/tf_static"]
    assert [one.child_frame_id for one in static.ros_msg.transforms] == ["camera_left", "camera_right"]


def test_the_format_is_chosen_by_its_name_and_has_metres(log: Path, tmp_path: Path,
                                                         capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(log), "--format", "ros2", "--units", "mm", "--out", str(tmp_path / "a.mcap")]) == 2
    assert main(["export", str(log), "--format", "ros2", "--out", str(tmp_path / "a.bag")]) == 2
    assert ".mcap" in capsys.readouterr().err and not list(tmp_path.iterdir())
