"""The twin's scene: documented defaults, seeds, and the rig and node settings that follow from it."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import pytest

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import load_rig, save_rig
from rhot_app.simulator.scene.scene import build_rig, make_scene, node_settings, twin_defaults
from rhot_app.simulator.scene.scene_arguments import add_scene_arguments, scene_of
from rhot_app.sources.local_nodes import NodePorts
from rhot_node.files import resource_path

PORTS = (NodePorts(1001, 1002, 1003), NodePorts(2001, 2002, 2003))


def scene_from(*arguments: str):  # type: ignore[no-untyped-def]
    parser = argparse.ArgumentParser()
    add_scene_arguments(parser)
    return scene_of(parser.parse_args(arguments))


def test_presets_are_the_documented_cameras() -> None:
    wide, fast = scene_from("--preset", "wide"), scene_from("--preset", "fast")
    assert wide.intrinsics.fx == pytest.approx(320.0 / math.tan(math.radians(31.1)))
    assert fast.intrinsics.fx == pytest.approx(320.0 / math.tan(math.radians(13.25)))
    assert (wide.preset.fps, fast.preset.fps) == (40.0, 120.0)
    assert (wide.row_time_ns, fast.row_time_ns, wide.exposure_ns) == (48_000, 10_000, 4_000_000)
    assert wide.intrinsics.distortion[0] == -0.05


def test_the_hand_wears_the_markers_of_ones_own_file(tmp_path: Path) -> None:
    own = tmp_path / "mine.json"
    own.write_bytes(resource_path("markers", "rhot8.json").read_bytes())
    assert scene_from("--markers", str(own)).markers == scene_from("--markers", "rhot8").markers
    own.write_text("{}")
    with pytest.raises(SimulatorError, match=r"mine\.json: this is not a"):
        scene_from("--markers", str(own))
    with pytest.raises(SimulatorError, match=r"no 'rhot9'; there are .*nails6, rhot6, rhot8, rich.*or give a file"):
        scene_from("--markers", "rhot9")
    with pytest.raises(SimulatorError, match=r"no '/nowhere/mine\.json'"):
        scene_from("--markers", "/nowhere/mine.json")


def test_seed_decides_clocks_and_phases() -> None:
    one, again, other = (make_scene(twin_defaults(), seed) for seed in (1, 1, 2))
    assert (one.clocks, one.phases_s) == (again.clocks, again.phases_s)
    assert one.clocks != other.clocks and one.phases_s != other.phases_s
    assert one.phases_s[0] != one.phases_s[1], "the cameras are not synchronised"
    assert all(abs(clock.drift_ppm) <= 50.0 for clock in one.clocks)
    assert abs(one.clocks[0].offset_s - one.clocks[1].offset_s) > 60.0


def test_frame_times_cover_the_seconds_at_the_cameras_rate() -> None:
    scene = make_scene(twin_defaults(), 3)
    times = np.array(scene.frame_times_ns(0, 2.0))
    assert len(times) == 80 and times[0] >= 0 and times[-1] < 2e9
    np.testing.assert_allclose(np.diff(times), 25e6, atol=1)


def test_rig_is_a_perfect_calibration_and_survives_its_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    scene = scene_from("--distance", "0.4")
    rig = build_rig(scene, PORTS)
    save_rig(tmp_path / "rig.json", rig)
    assert load_rig(tmp_path / "rig.json") == rig
    assert [node.udp_port for node in rig.nodes] == [1001, 2001]
    for index, node in enumerate(rig.nodes):
        ours, theirs = scene.camera(index), CameraModel.from_rig(node.intrinsics, node.pose)
        np.testing.assert_array_equal(ours.project(scene.centre), theirs.project(scene.centre))
    left, right = (scene.camera(index).project(scene.centre)[0] for index in (0, 1))
    assert left[0] > 320 > right[0] and left[1] == pytest.approx(239.5)


def test_nodes_share_the_markers_and_keep_to_this_machine() -> None:
    scene = make_scene(twin_defaults(), 1)
    settings = node_settings(scene, 1, ports=PORTS[1])
    assert settings.markers.checksum == scene.markers.checksum
    assert settings.bind_address == "127.0.0.1" and settings.broadcast_port is None
    assert (settings.udp_port, settings.control_port, settings.preview_port) == (2001, 2002, 2003)
    assert settings.clock.offset_s == scene.clocks[1].offset_s
