"""Settings files: what is read, what is refused and how it is said, what a running node can change."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rhot_node.config import (
    NodeSettings,
    changed_settings,
    load_settings,
    needs_restart,
    save_settings,
)
from rhot_node.errors import SettingsError
from rhot_node.files import resource_path
from rhot_node.markers import load_markers


@pytest.fixture
def settings() -> NodeSettings:
    return NodeSettings(3, "left", load_markers(resource_path("markers", "rhot6.json")))


def test_a_file_survives_the_way(tmp_path: Path, settings: NodeSettings) -> None:
    path = tmp_path / "node.json"
    save_settings(path, settings)
    assert load_settings(path) == settings
    document = json.loads(path.read_text())
    assert (document["format"], document["version"], document["udp_port"]) == ("rhot-node", 1, 47800)


def test_defaults_are_enough(tmp_path: Path, settings: NodeSettings) -> None:
    path = tmp_path / "node.json"
    save_settings(path, settings)
    document = json.loads(path.read_text())
    wanted = {key: document[key] for key in ("format", "version", "node_id", "name", "markers")}
    path.write_text(json.dumps(wanted))
    assert load_settings(path) == settings


BROKEN: list[tuple[dict[str, Any], str]] = [
    ({"node_id": 0}, "node_id"), ({"udp_port": 70000}, "udp_port"), ({"detector": "magic"}, "detector"),
    ({"camera": {"width": 641}}, "camera.width"), ({"camera": {"fps": 0}}, "camera.fps"),
    ({"camera": {"zoom": 2}}, "zoom"), ({"prot": 1}, "prot"), ({"markers": {"markers": []}}, "markers"),
    ({"format": "rhot-rig"}, "rhot-node"), ({"version": 2}, "version 2"), ({"name": ""}, "name"),
    ({"control_port": 5000, "preview_port": 5000}, "5000"), ({"udp_port": 47799}, "47799"),
]


SAID: list[tuple[dict[str, Any], str]] = [
    ({"camera": {"exposure_ms": 4}}, 'camera: there is no field "exposure_ms"; did you mean "exposure_us"?'),
    ({"bind_adress": "x"}, 'there is no field "bind_adress"; did you mean "bind_address"?'),
    ({"prot": 1}, 'there is no field "prot"; is it misspelt, or in the wrong place?'),
    ({"markers": {}}, 'markers: the field "markers" is missing.'),
    ({"node_id": "a"}, "node_id: expected a whole number, not text."),
    ({"camera": {"gain": "a"}}, "camera.gain: expected a number or null, not text."),
    ({"node_id": 0}, "node_id: expected a whole number >= 1."),
    ({"detector": "magic"},
     """detector is 'magic'; it may be "fast", "reference", "keypoints:NAME" with the name of a model card, or """
     """"plug:NAME" with the name of a plug-in"""),
    ({"late_frames": "keep"},
     """late_frames: 'keep' is not one of the values that this field can have: "drop" or "send"."""),
]


@pytest.mark.parametrize(("changes", "sentence"), SAID)
def test_what_is_wrong_is_said_in_plain_words(tmp_path: Path, settings: NodeSettings, changes: dict[str, Any],
                                              sentence: str) -> None:
    path = tmp_path / "node.json"
    save_settings(path, settings)
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))
    with pytest.raises(SettingsError) as caught:
        load_settings(path)
    assert str(caught.value) == f"{path}: {sentence}"


@pytest.mark.parametrize(("changes", "named"), BROKEN)
def test_a_broken_file_is_named_with_its_field(tmp_path: Path, settings: NodeSettings, changes: dict[str, Any],
                                               named: str) -> None:
    path = tmp_path / "node.json"
    save_settings(path, settings)
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))
    with pytest.raises(SettingsError) as caught:
        load_settings(path)
    assert str(path) in str(caught.value) and named in str(caught.value)


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"\xff\xfe", b'{"format": "rhot-node"'])
def test_half_written_files_are_named(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "node.json"
    path.write_bytes(data)
    with pytest.raises(SettingsError, match=r"node\.json"):
        load_settings(path)


def test_changes_are_merged_field_by_field(settings: NodeSettings) -> None:
    changed = changed_settings(settings, {"camera": {"gain": 2.5}, "preview_hz": 2})
    assert changed.camera.gain == 2.5 and changed.camera.width == settings.camera.width
    assert changed.preview_hz == 2 and changed.markers == settings.markers
    assert needs_restart(settings, changed) == []


def test_changes_that_need_a_restart_are_told(settings: NodeSettings) -> None:
    changed = changed_settings(settings, {"udp_port": 1234, "clock": {"offset_s": 5}, "name": "right"})
    assert needs_restart(settings, changed) == ["udp_port", "clock"]


@pytest.mark.parametrize("changes", [{"camera": 3}, {"camera": {"fps": "fast"}}, {"wrong": 1}, {"node_id": None},
                                     {"version": 2}])
def test_wrong_changes_are_refused_as_a_whole(settings: NodeSettings, changes: dict[str, Any]) -> None:
    with pytest.raises(SettingsError, match="new settings"):
        changed_settings(settings, changes)


def test_the_simulated_clock_begins_to_drift_at_its_origin(settings: NodeSettings) -> None:
    clock = changed_settings(settings, {"clock": {"offset_s": -7200.5, "drift_ppm": 50}}).clock.clock(10**12)
    assert clock.from_host_ns(10**12) == 10**12 - 7_200_500_000_000
    assert clock.from_host_ns(2 * 10**12) - clock.from_host_ns(10**12) == 10**12 + 50_000_000
