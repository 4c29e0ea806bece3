"""Objects that another tracker follows: brought into the rig, recorded, replayed, and told with the hand."""

from __future__ import annotations

import socket
import time
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from patience import eventually

from rhot_app.diagnostics import Diagnostics
from rhot_app.errors import RecordingError, RigError, SourceError
from rhot_app.estimation.se3 import exp_so3, log_so3, quaternion_from_rotation
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.alignment.alignment_file import Alignment, RigidTransform, save_alignment
from rhot_app.objects.object_file import ObjectModel, SphereShape, cube, save_object
from rhot_app.objects.observations import MeasuredPose, decode_pose, encode_pose
from rhot_app.objects.pose import Validity
from rhot_app.objects.state import Validity as ObjectValidity
from rhot_app.project import ObjectPoses, Rig, RigObject, load_rig, save_rig
from rhot_app.recording.raw_log import Record, RecordKind
from rhot_app.sources.poses.followed import FollowedObjects, in_rig
from rhot_app.sources.poses.open_source import open_source
from rhot_app.sources.poses.source import ForeignPose
from rhot_app.sources.receiver import same_network
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.rig_objects import RigObjects
from rhot_node.files import resource_path

RIG_FROM_FOREIGN = rigid(exp_so3([0.3, -1.1, 0.4]), [0.2, -0.4, 1.5])
TRACKER_FROM_OBJECT = rigid(exp_so3([0.0, 0.5, 0.2]), [0.03, 0.05, -0.02])
FOREIGN = rigid(exp_so3([-0.7, 0.2, 2.0]), [1.0, 0.8, -0.3])
OFFSET_S = -0.037


def quaternion(transform: np.ndarray) -> tuple[float, float, float, float]:
    w, x, y, z = quaternion_from_rotation(transform[:3, :3])
    return float(w), float(x), float(y), float(z)


def alignment_of(transform: np.ndarray = RIG_FROM_FOREIGN, noise_m: float = 1e-9) -> Alignment:
    x, y, z = transform[:3, 3]
    covariance = tuple(tuple(row) for row in (1e-8 * np.eye(10)).tolist())
    return Alignment(RigidTransform(quaternion(transform), (float(x), float(y), float(z))), RigidTransform(), OFFSET_S,
                     covariance, noise_m)


def poses(alignment: Path | str, source: str = "openvr") -> ObjectPoses:
    x, y, z = TRACKER_FROM_OBJECT[:3, 3]
    return ObjectPoses(source, str(alignment), "T20", quaternion(TRACKER_FROM_OBJECT), (float(x), float(y), float(z)))


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    """A rig with a cup that a tracker follows, as read from its file."""
    save_object(tmp_path / "cup.json", ObjectModel("cup", shape=SphereShape(80.0)))
    save_alignment(tmp_path / "desk.alignment.json", alignment_of())
    plain = load_rig(resource_path("rigs", "two_pis.json"))
    entry = RigObject(str(tmp_path / "cup.json"), None, ObjectModel("cup", shape=SphereShape(80.0)),
                      poses(tmp_path / "desk.alignment.json"))
    save_rig(tmp_path / "desk.json", msgspec.structs.replace(plain, objects=(entry,)))
    return load_rig(tmp_path / "desk.json")


class FakeSource:
    """Gives the poses that a test puts in."""

    name, notice, ended, closed = "fake", "", False, False

    def __init__(self) -> None:
        self.waiting: list[ForeignPose] = []

    def poll(self) -> list[ForeignPose]:
        found, self.waiting = self.waiting, []
        return found

    def close(self) -> None:
        self.closed = True


def measured(t_ns: int, validity: Validity = Validity.TRACKED) -> ForeignPose:
    return ForeignPose(t_ns, FOREIGN, np.diag([1e-8] * 3 + [1e-7] * 3), validity)


def test_a_pose_is_brought_into_the_rig_with_its_time_and_covariance(tmp_path: Path) -> None:
    one = in_rig(measured(10**9), "cup", poses(tmp_path), alignment_of())
    assert one.t_ns == 10**9 - 37_000_000
    assert one.world_from_object == pytest.approx(RIG_FROM_FOREIGN @ FOREIGN @ TRACKER_FROM_OBJECT)
    rng, moved = np.random.default_rng(1), []
    errors = rng.normal(size=(4000, 6)) * np.sqrt([1e-8] * 3 + [1e-7] * 3)
    for error in errors:
        foreign = rigid(exp_so3(error[3:]) @ FOREIGN[:3, :3], FOREIGN[:3, 3] + error[:3])
        other = RIG_FROM_FOREIGN @ foreign @ TRACKER_FROM_OBJECT
        moved.append([*(other - one.world_from_object)[:3, 3],
                      *log_so3(other[:3, :3] @ one.world_from_object[:3, :3].T)])
    ratio = np.cov(np.transpose(moved)) / np.sqrt(np.outer(np.diag(one.covariance), np.diag(one.covariance)))
    assert ratio == pytest.approx(one.covariance / np.sqrt(np.outer(*[np.diag(one.covariance)] * 2)), abs=0.1)


def test_a_record_comes_back_and_damage_is_no_pose() -> None:
    pose = in_rig(measured(5), "Tasse ☕", poses("a"), alignment_of(noise_m=1e-3))
    back = decode_pose(encode_pose(pose))
    assert (back.name, back.t_ns) == (pose.name, pose.t_ns)
    assert back.world_from_object == pytest.approx(pose.world_from_object)
    assert back.covariance == pytest.approx(pose.covariance)
    data = encode_pose(pose)
    for wrong in (b"", data[:100], data[:8] + bytes(96) + data[104:], data[:-1] + b"\xff"):
        with pytest.raises(RecordingError, match="pose"):
            decode_pose(wrong)


def test_poses_are_delivered_recorded_and_replayed_alike(rig: Rig) -> None:
    source, delivered, records = FakeSource(), list[MeasuredPose](), list[Record]()

    class Tap:
        def put(self, kind: RecordKind, node_id: int, t_master_ns: int, data: bytes) -> None:
            records.append(Record(kind, node_id, t_master_ns, data))
    followed = FollowedObjects(rig, lambda name, tracker: source)
    followed.deliver, followed.tap = delivered.extend, Tap()  # type: ignore[assignment]
    source.waiting = [measured(10**9 + k * 8_000_000) for k in range(5)]
    source.waiting.insert(2, measured(1, Validity.LOST))
    followed.start()
    eventually(lambda: len(delivered) == 5)
    followed.close()
    followed.close()
    assert source.closed and [one.name for one in delivered] == ["cup"] * 5
    replayed = [LogValidator(rig).feed(record) for record in records]
    assert all(isinstance(one, MeasuredPose) for one in replayed)
    objects = [RigObjects(rig, Diagnostics()), RigObjects(rig, Diagnostics())]
    for tracked, given in zip(objects, (delivered, replayed), strict=True):
        for one in given:
            tracked.ingest(one)  # type: ignore[arg-type]
    states = [tracked.states(delivered[-1].t_ns)[0] for tracked in objects]
    assert states[0].validity is ObjectValidity.TRACKED
    assert states[0].world_from_object == pytest.approx(RIG_FROM_FOREIGN @ FOREIGN @ TRACKER_FROM_OBJECT, abs=1e-4)
    assert states[0].world_from_object == pytest.approx(states[1].world_from_object)


def test_a_source_that_fails_is_told_and_opened_again(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_app.sources.poses.followed.AGAIN_S", 0.02)
    tries, source = [], FakeSource()

    def opened(name: str, tracker: str) -> FakeSource:
        tries.append((name, tracker))
        if len(tries) < 3:
            raise SourceError("SteamVR is not running. Start it.")
        return source
    followed = FollowedObjects(rig, opened)
    followed.start()
    eventually(lambda: followed.notices() == ["cup: SteamVR is not running. Start it."])
    eventually(lambda: len(tries) == 3 and not followed.notices())
    source.ended = True
    eventually(lambda: len(tries) > 3)
    followed.close()
    assert tries[0] == ("openvr", "T20")


class FailingSource(FakeSource):
    """Raises whatever it likes, once."""

    def __init__(self, raised: BaseException) -> None:
        super().__init__()
        self.raised: BaseException | None = raised

    def poll(self) -> list[ForeignPose]:
        raised, self.raised = self.raised, None
        if raised is not None:
            raise raised
        return [measured(10**9)]


@pytest.mark.parametrize("raised", [ValueError("a strange line"), SystemExit(0), UnicodeError("label too long")])
def test_a_source_that_fails_is_named_and_opened_again(rig: Rig, raised: BaseException,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_app.sources.poses.followed.AGAIN_S", 0.1)
    source, delivered = FailingSource(raised), list[MeasuredPose]()
    followed = FollowedObjects(rig, lambda name, tracker: source)
    followed.deliver = delivered.extend  # type: ignore[assignment]
    followed.start()
    eventually(lambda: any(type(raised).__name__ in one and "cup" in one for one in followed.notices()))
    eventually(lambda: delivered and not followed.notices())
    followed.close()


def test_a_name_that_no_host_can_have_is_a_sentence() -> None:
    with pytest.raises(SourceError, match="nobody answers"):
        open_source(f"tcp:{'a' * 70}:5000", "")
    with pytest.raises(SourceError, match="cannot be listened on"):
        open_source(f"udp:{'a' * 70}:5000", "")


def test_lines_by_udp_reach_the_tracker(rig: Rig) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    entry = rig.objects[0]
    assert entry.poses is not None
    entry = msgspec.structs.replace(entry, poses=msgspec.structs.replace(entry.poses, source=f"udp:{port}"))
    followed, delivered = FollowedObjects(msgspec.structs.replace(rig, objects=(entry,))), list[MeasuredPose]()
    followed.deliver = delivered.extend  # type: ignore[assignment]
    followed.start()
    words = " ".join(f"{value:.9f}" for value in (*FOREIGN[:3, 3], *quaternion(FOREIGN)))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        def sent() -> bool:
            sender.sendto(f"{time.monotonic():.6f} T20 {words}\n".encode(), ("127.0.0.1", port))
            return len(delivered) > 3
        eventually(sent)
    followed.close()
    assert delivered[-1].world_from_object == pytest.approx(RIG_FROM_FOREIGN @ FOREIGN @ TRACKER_FROM_OBJECT, abs=1e-6)


def test_the_alignment_lies_beside_the_rig_and_another_source_opens_anew(rig: Rig, tmp_path: Path) -> None:
    assert '"alignment":"desk.alignment.json"' in (tmp_path / "desk.json").read_text().replace(" ", "")
    entry = rig.objects[0]
    assert entry.poses is not None and entry.poses.alignment == str((tmp_path / "desk.alignment.json").resolve())
    other = msgspec.structs.replace(entry, poses=msgspec.structs.replace(entry.poses, tracker="T21"))
    assert not same_network(rig, msgspec.structs.replace(rig, objects=(other,)))


def test_a_missing_alignment_is_a_sentence(rig: Rig, tmp_path: Path) -> None:
    (tmp_path / "desk.alignment.json").unlink()
    followed = FollowedObjects(rig)
    followed.start()
    eventually(lambda: any("desk.alignment.json" in one for one in followed.notices()))
    followed.close()


@pytest.mark.parametrize("source", ["run:rm -rf x", "/some/file.csv", "tcp:", "openvr2"])
def test_a_rig_file_starts_no_program_and_follows_no_file(tmp_path: Path, rig: Rig, source: str) -> None:
    document = (tmp_path / "desk.json").read_text().replace('"openvr"', f'"{source}"')
    (tmp_path / "other.json").write_text(document)
    with pytest.raises(RigError, match="source"):
        load_rig(tmp_path / "other.json")


def test_an_object_that_nothing_shows_is_refused(rig: Rig) -> None:
    bare = msgspec.structs.replace(rig.objects[0], poses=None)
    with pytest.raises(ValueError, match="neither fiducials nor markers"):
        msgspec.structs.replace(rig, objects=(bare,))
    tagged = replace_model(bare)
    assert msgspec.structs.replace(rig, objects=(tagged,)).models[0].fiducials


def replace_model(entry: RigObject) -> RigObject:
    return msgspec.structs.replace(entry, model=cube("cup", 60.0, 40.0, "DICT_APRILTAG_36h11"))


def test_a_pose_of_an_unknown_object_changes_nothing(rig: Rig) -> None:
    objects = RigObjects(rig, Diagnostics())
    one = in_rig(measured(10**9), "spoon", poses("a"), alignment_of())
    objects.ingest(replace(one))
    assert objects.states(10**9)[0].validity is ObjectValidity.SEARCHING
