"""The cameras that were opened together and their rig: a first one, the one they had, and another's calibration."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from rhot_app.errors import SourceError
from rhot_app.project import CameraPose, Intrinsics, Rig, RigNode, load_rig, save_rig
from rhot_app.sources.cameras import camera_set
from rhot_app.sources.cameras.camera_set import (
    CameraSource,
    camera_set_of,
    cameras_folder,
    node_settings,
    prepare,
    with_ports,
)
from rhot_app.sources.local_nodes import NodePorts

TWO = [CameraSource(f"/films/{name}.mp4", f"{name}.mp4", 640, 480, 30.0, 4.0) for name in ("left", "right")]


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


@pytest.fixture
def networks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(camera_set, "installed_folder", lambda: tmp_path)


def calibrated(*names: str, size: tuple[int, int] = (640, 480)) -> Rig:
    """A rig whose every number could only come from its file."""
    lens = Intrinsics(*size, 500.0, 501.0, 310.0, 245.0, (0.1, 0.0, 0.0, 0.0, 0.0))
    return Rig("desk", tuple(RigNode(number + 3, name, lens, CameraPose(translation_m=(0.1 * number, 0.0, 0.0)),
                                     address="10.0.0.9", time_offset_s=0.004) for number, name in enumerate(names)))


def test_a_first_rig_knows_one_place_and_assumes_the_lenses(networks: None) -> None:
    prepared = prepare(TWO)
    rig = load_rig(prepared.rig_path)
    assert [node.name for node in rig.nodes] == ["left", "right"]
    assert rig.tracked_with == (True, False)
    assert all(node.intrinsics.nominal and node.intrinsics.fx == pytest.approx(554.3, abs=0.1) for node in rig.nodes)
    assert rig.tracker.landmarks and rig.calibration is None
    assert prepared.remarks == ()
    cameras = camera_set_of(prepared.rig_path)
    assert cameras is not None and [one.spec for one in cameras.cameras] == [one.spec for one in TWO]
    assert node_settings(cameras.cameras[1], rig.nodes[1], rig, None).detector == "landmarks"


def test_without_networks_markers_are_tracked_until_there_are_some(monkeypatch: pytest.MonkeyPatch,
                                                                   tmp_path: Path) -> None:
    monkeypatch.setattr(camera_set, "installed_folder", lambda: None)
    prepared = prepare(TWO)
    rig, cameras = load_rig(prepared.rig_path), camera_set_of(prepared.rig_path)
    assert rig.painted and rig.tracker.kind == "estimator"
    assert any("rhot landmarks install" in remark for remark in prepared.remarks)
    assert cameras is not None and node_settings(cameras.cameras[0], rig.nodes[0], rig, None).detector == "fast"
    monkeypatch.setattr(camera_set, "installed_folder", lambda: tmp_path)
    assert load_rig(prepare(TWO).rig_path).tracker.landmarks


def test_what_was_calibrated_is_there_when_the_cameras_are_opened_again(networks: None,
                                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    path = prepare(TWO).rig_path
    rig = load_rig(path)
    node = msgspec.structs.replace(rig.nodes[1], pose=CameraPose(translation_m=(0.2, 0.0, 0.0)), pose_known=True)
    save_rig(path, msgspec.structs.replace(rig, nodes=(rig.nodes[0], node)))
    monkeypatch.setattr(camera_set, "installed_folder", lambda: None)
    assert prepare(TWO).rig_path == path and load_rig(path).nodes[1] == node
    assert prepare([TWO[1], TWO[0]]).rig_path != path, "the order of the cameras is another set"


def test_another_hand_is_kept(networks: None) -> None:
    path = prepare(TWO, side="left").rig_path
    assert load_rig(path).hand.side == "left"
    assert load_rig(prepare(TWO).rig_path).hand.side == "left"


def test_the_calibration_of_a_rig_is_taken_over_by_name_or_order(networks: None) -> None:
    rig = load_rig(prepare(TWO, base=calibrated("right", "left", "third")).rig_path)
    assert [(node.name, node.node_id) for node in rig.nodes] == [("left", 4), ("right", 3)]
    rig = load_rig(prepare(TWO, base=calibrated("c0", "c1")).rig_path)
    assert [node.name for node in rig.nodes] == ["c0", "c1"] and all(rig.tracked_with)
    assert rig.nodes[1].pose.translation_m[0] == 0.1 and rig.nodes[1].time_offset_s == 0.004
    assert {node.address for node in rig.nodes} == {"127.0.0.1"} and not any(node.public_key for node in rig.nodes)


@pytest.mark.parametrize(("base", "words"), [
    (calibrated("c0", "c1", "c2"), "has 3 cameras"), (calibrated("c0", "c1", size=(1280, 720)), "1280 x 720 px")])
def test_a_rig_that_does_not_fit_is_refused_and_nothing_is_written(networks: None, base: Rig, words: str) -> None:
    with pytest.raises(SourceError, match=words):
        prepare(TWO, base=base)
    assert not cameras_folder().exists()


def test_only_a_rig_of_the_own_folder_starts_cameras(networks: None, tmp_path: Path) -> None:
    prepared = prepare(TWO)
    elsewhere = tmp_path / prepared.rig_path.name
    elsewhere.write_bytes(prepared.rig_path.read_bytes())
    elsewhere.with_suffix(".cameras").write_bytes(prepared.rig_path.with_suffix(".cameras").read_bytes())
    assert camera_set_of(elsewhere) is None and camera_set_of(prepared.rig_path) is not None


def test_an_assumed_lens_is_of_the_pictures_that_come(networks: None) -> None:
    rig = load_rig(prepare(TWO).rig_path)
    ports = [NodePorts(1, 2, 3, 4, "ab" * 32, (320, 240)), NodePorts(5, 6, 7, 8, "cd" * 32, (640, 480))]
    started = with_ports(rig, ports)
    assert (started.nodes[0].intrinsics.width, started.nodes[1].intrinsics.width) == (320, 640)
    assert started.nodes[0].intrinsics.nominal and started.nodes[1].control_port == 6
    known = with_ports(calibrated("c0", "c1"), ports)
    assert known.nodes[0].intrinsics.width == 640, "a calibrated lens is never bent to other pictures"
