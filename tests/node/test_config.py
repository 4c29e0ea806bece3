"""Settings files: what is read, what is refused and how it is said, what a running node can change."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from node_fakes import node_settings

from rhot_node.config import (
    changed_settings,
    load_settings,
    needs_restart,
    save_settings,
)
from rhot_node.errors import SettingsError

SETTINGS = node_settings()


def test_a_file_survives_the_way(tmp_path: Path) -> None:
    path = tmp_path / "node.json"
    save_settings(path, SETTINGS)
    assert load_settings(path) == SETTINGS
    document = json.loads(path.read_text())
    assert (document["format"], document["version"], document["udp_port"]) == ("rhot-node", 1, 47800)


def test_defaults_are_enough(tmp_path: Path) -> None:
    path = tmp_path / "node.json"
    save_settings(path, SETTINGS)
    document = json.loads(path.read_text())
    wanted = {key: document[key] for key in ("format", "version", "node_id", "name", "markers")}
    path.write_text(json.dumps(wanted))
    assert load_settings(path) == SETTINGS


SAID: list[tuple[dict[str, Any], str]] = [
    ({"camera": {"exposure_ms": 4}}, 'camera: there is no field "exposure_ms"; did you mean "exposure_us"?'),
    ({"bind_adress": "x"}, 'there is no field "bind_adress"; did you mean "bind_address"?'),
    ({"prot": 1}, 'there is no field "prot"; is it misspelt, or in the wrong place?'),
    ({"markers": {}}, 'markers: the field "markers" is missing.'),
    ({"node_id": "a"}, "node_id: expected a whole number, not text."),
    ({"camera": {"gain": "a"}}, "camera.gain: expected a number or null, not text."),
    ({"node_id": 0}, "node_id: expected a whole number >= 1."),
    ({"detector": "magic"},
     """detector is 'magic'; it may be "fast", "reference", "landmarks", "landmarks:lite", """
     """"keypoints:NAME" with the name of a model card, or "plug:NAME" with the name of a plug-in"""),
    ({"late_frames": "keep"},
     """late_frames: 'keep' is not one of the values that this field can have: "drop" or "send"."""),
    ({"udp_port": 70000}, "udp_port"), ({"camera": {"width": 641}}, "camera.width"),
    ({"camera": {"fps": 1e-300}}, "camera.fps"),
    ({"markers": {"markers": []}}, "markers"), ({"format": "rhot-rig"}, "rhot-node"), ({"version": 2}, "version 2"),
    ({"name": ""}, "name"), ({"control_port": 5000, "preview_port": 5000}, "5000"), ({"udp_port": 47799}, "47799"),
]


@pytest.mark.parametrize(("changes", "sentence"), SAID)
def test_what_is_wrong_is_said_in_plain_words(tmp_path: Path, changes: dict[str, Any], sentence: str) -> None:
    path = tmp_path / "node.json"
    save_settings(path, SETTINGS)
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))
    with pytest.raises(SettingsError) as caught:
        load_settings(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: ") and sentence in said


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"\xff\xfe", b'{"format": "rhot-node"'])
def test_half_written_files_are_named(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "node.json"
    path.write_bytes(data)
    with pytest.raises(SettingsError, match=r"node\.json"):
        load_settings(path)


def test_changes_are_merged_field_by_field() -> None:
    changed = changed_settings(SETTINGS, {"camera": {"gain": 2.5}, "preview_hz": 2})
    assert changed.camera.gain == 2.5 and changed.camera.width == SETTINGS.camera.width
    assert changed.preview_hz == 2 and changed.markers == SETTINGS.markers
    assert needs_restart(SETTINGS, changed) == []


def test_changes_that_need_a_restart_are_told() -> None:
    changed = changed_settings(SETTINGS, {"udp_port": 1234, "clock": {"offset_s": 5}, "name": "right"})
    assert needs_restart(SETTINGS, changed) == ["udp_port", "clock"]


@pytest.mark.parametrize("changes", [{"camera": 3}, {"camera": {"fps": "fast"}}, {"wrong": 1}, {"node_id": None},
                                     {"version": 2}])
def test_wrong_changes_are_refused_as_a_whole(changes: dict[str, Any]) -> None:
    with pytest.raises(SettingsError, match="new settings"):
        changed_settings(SETTINGS, changes)


def test_the_simulated_clock_begins_to_drift_at_its_origin() -> None:
    clock = changed_settings(SETTINGS, {"clock": {"offset_s": -7200.5, "drift_ppm": 50}}).clock.clock(10**12)
    assert clock.from_host_ns(10**12) == 10**12 - 7_200_500_000_000
    assert clock.from_host_ns(2 * 10**12) - clock.from_host_ns(10**12) == 10**12 + 50_000_000
