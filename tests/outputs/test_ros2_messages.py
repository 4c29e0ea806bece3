"""A state for ROS 2, read by an independent decoder; and the very bytes of the export."""

from __future__ import annotations

import io
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer
from streams import palm_before_cameras, state_of, unknown

from rhot_app.export.formats.ros2_file import TYPES
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLES
from rhot_app.outputs.joints import JointConverter
from rhot_app.outputs.ros2 import ros2_messages
from rhot_app.outputs.zenoh import KEY, ZenohSink
from rhot_app.project import OutputSettings, Rig

KINDS = {"hand/joint_states": "sensor_msgs/msg/JointState", "hand/joints": "geometry_msgs/msg/PoseArray",
         "tf": "tf2_msgs/msg/TFMessage"}


def decoded(topic: str, data: bytes) -> Any:
    schema = SimpleNamespace(id=1, name=KINDS[topic], encoding="ros2msg", data=TYPES[KINDS[topic]].encode())
    decode = DecoderFactory().decoder_for("cdr", schema)
    assert decode is not None
    return decode(data)


def written(topic: str, message: dict[str, Any]) -> bytes:
    """The bytes that the export's writer makes of a message."""
    file = io.BytesIO()
    writer = Writer(file)
    schema = writer.register_msgdef(KINDS[topic], TYPES[KINDS[topic]])
    writer.write_message(topic=topic, schema=schema, message=message, log_time=1, publish_time=1)
    writer.finish()
    (_, _, found), = make_reader(io.BytesIO(file.getvalue())).iter_messages()
    return bytes(found.data)


@pytest.fixture
def sample(rig: Rig):
    return JointConverter(rig).sample(state_of(rig, neutral_pose(palm_before_cameras())), "own")


def test_the_bytes_are_those_of_the_export_and_another_library_reads_them(sample) -> None:
    state, t_ns = sample.state, sample.t_unix_ns
    stamp = {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}
    header = {"stamp": stamp, "frame_id": "rig"}
    messages = dict(ros2_messages(sample))
    assert set(messages) == set(KINDS)
    joints = decoded("hand/joint_states", messages["hand/joint_states"])
    assert (joints.header.stamp.sec, joints.header.stamp.nanosec) == tuple(stamp.values())
    assert list(joints.name) == list(ANGLES)
    np.testing.assert_array_equal(joints.position, state.angles)
    poses = decoded("hand/joints", messages["hand/joints"]).poses
    np.testing.assert_array_equal([(one.position.x, one.position.y, one.position.z) for one in poses],
                                  state.joint_positions)
    (frame,) = decoded("tf", messages["tf"]).transforms
    assert frame.child_frame_id == "palm" and frame.header.frame_id == "rig"
    assert frame.transform.translation.z == state.world_from_palm[2, 3]
    assert messages["hand/joint_states"] == written("hand/joint_states", {
        "header": header, "name": list(ANGLES), "position": state.angles.tolist(), "velocity": [], "effort": []})
    assert messages["hand/joints"] == written("hand/joints", {"header": header, "poses": [
        {"position": dict(zip("xyz", point, strict=True)), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
        for point in state.joint_positions.tolist()]})


def test_a_hand_that_is_not_tracked_has_no_message(sample) -> None:
    assert list(ros2_messages(replace(sample, state=unknown(sample.state)))) == []


def test_zenoh_carries_them_beside_the_state(sample, monkeypatch: pytest.MonkeyPatch) -> None:
    zenoh = pytest.importorskip("zenoh", reason="the extra `zenoh` is not installed")
    put: list[tuple[str, bytes]] = []

    class Session:
        def declare_publisher(self, key: str, **_: object) -> Any:
            return SimpleNamespace(put=lambda data: put.append((key, data)))

        def close(self) -> None:
            pass

    monkeypatch.setattr(zenoh, "open", lambda config: Session())
    sink = ZenohSink(OutputSettings("zenoh"))
    sink.open()
    sink.write(sample)
    sink.write(sample)
    sink.close()
    assert [key for key, _ in put] == 2 * [KEY, *KINDS]
    assert dict(put)["tf"] == dict(ros2_messages(sample))["tf"]
