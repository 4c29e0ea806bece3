"""MCAP, read back by the format's own reader and by Foxglove's message definitions."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.json_format import ParseDict
from mcap.reader import make_reader

from rhot_app.export.export import export_log
from rhot_app.export.plan import ExportOptions
from rhot_app.export.states import HandStates
from rhot_app.hand.skeleton import JOINTS
from rhot_app.recording.raw_log import LogReader, encode_header, encode_record

Message = tuple[int, dict[str, Any]]


def messages(path: Path) -> tuple[dict[str, list[Message]], dict[str, str]]:
    """The messages of each topic with their times, and each topic's schema."""
    found: dict[str, list[Message]] = {}
    schemas: dict[str, str] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None and schema.encoding == "jsonschema" and channel.message_encoding == "json"
            schemas[channel.topic] = schema.name
            found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    return found, schemas


def as_protobuf(value: Any) -> Any:
    """Foxglove's JSON with times as protobuf's JSON has them."""
    if isinstance(value, list):
        return [as_protobuf(one) for one in value]
    if not isinstance(value, dict):
        return value
    if set(value) == {"sec", "nsec"}:
        return f"{value['sec']}.{value['nsec']:09d}s"
    return {key: as_protobuf(one) for key, one in value.items() if key != "timestamp"}


@pytest.fixture(scope="module")
def exported(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("mcap") / "a.mcap"
    return export_log(log, out, options=ExportOptions(tracker="estimator")).path


def wall_ns(log: Path, t_master_ns: int) -> int:
    """ns since 1970, by what the log says of its beginning."""
    about = LogReader(log).about
    since = datetime.fromisoformat(about["created"]) - datetime(1970, 1, 1, tzinfo=UTC)
    return since // timedelta(microseconds=1) * 1000 + int(t_master_ns) - about["created_t_master_ns"]


def test_every_state_is_a_message_at_its_wall_clock_time(exported: Path, log: Path,
                                                         states_by: Callable[[str], HandStates]) -> None:
    states = states_by("estimator")
    found, schemas = messages(exported)
    assert schemas["/hand/state"] == "rhot.HandState"
    sent = found["/hand/state"]
    assert [time for time, _ in sent] == [wall_ns(log, t_ns) for t_ns in states.t_master_ns]
    assert [message["t_master_ns"] for _, message in sent] == list(states.t_master_ns)
    assert {message["transforms"][0]["timestamp"]["sec"] for _, message in found["/tf_static"]} == {
        sent[0][0] // 1_000_000_000}
    assert [message["condition"] for _, message in sent] == list(states.conditions)
    for name in ("joint_positions", "joint_covariances", "angles", "marker_positions", "world_from_palm"):
        values = np.array([message[name] for _, message in sent], dtype=float)  # null is NaN
        assert values == pytest.approx(getattr(states, name), nan_ok=True)


def test_without_a_date_the_masters_clock_remains_and_is_said(log: Path, states_by: Callable[[str], HandStates],
                                                              tmp_path: Path) -> None:
    reader = LogReader(log)
    (tmp_path / "old.rhotlog").write_bytes(encode_header(reader.rig, {}) + b"".join(map(encode_record, reader)))
    done = export_log(tmp_path / "old.rhotlog", tmp_path / "a.mcap", options=ExportOptions(tracker="classic"))
    assert any("when it was begun" in note for note in done.notes)
    assert messages(done.path)[0]["/hand/state"][0][0] == states_by("classic").t_master_ns[0]


def test_foxglove_knows_scene_and_frames(exported: Path, log: Path, states_by: Callable[[str], HandStates]) -> None:
    states = states_by("estimator")
    found, schemas = messages(exported)
    assert (schemas["/hand/scene"], schemas["/tf"]) == ("foxglove.SceneUpdate", "foxglove.FrameTransforms")
    shown = {time: ParseDict(as_protobuf(message), SceneUpdate()) for time, message in found["/hand/scene"]}
    frames = {time: ParseDict(as_protobuf(message), FrameTransforms()) for time, message in found["/tf"]}
    for number in np.flatnonzero(states.tracked)[::17]:
        scene = shown[wall_ns(log, states.t_master_ns[number])]
        (hand,) = scene.entities
        assert hand.frame_id == "rig" and len(hand.lines[0].points) == 40
        tip = hand.spheres[JOINTS.index("index_tip")].pose.position
        assert [tip.x, tip.y, tip.z] == pytest.approx(states.joint_positions[number, JOINTS.index("index_tip")])
        (palm,) = frames[wall_ns(log, states.t_master_ns[number])].transforms
        assert (palm.parent_frame_id, palm.child_frame_id) == ("rig", "palm")
        assert palm.translation.x == pytest.approx(states.world_from_palm[number, 0, 3])
    lost = np.flatnonzero(~states.tracked)[0]
    assert [one.id for one in shown[wall_ns(log, states.t_master_ns[lost])].deletions] == ["hand"]
    cameras = ParseDict(as_protobuf(found["/tf_static"][0][1]), FrameTransforms()).transforms
    assert [camera.child_frame_id for camera in cameras] == ["camera_left", "camera_right"]
