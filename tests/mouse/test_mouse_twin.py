"""The scripted hand of the twin works the mouse: observations, tracker, mouse; the truth only judges."""

from __future__ import annotations

import pytest

from rhot_app.mouse.measure import coupling, latency, one_camera, place_once, resolution, throughput
from rhot_app.mouse.pointer import MouseSettings
from rhot_app.mouse.script import carrying, motion_file
from rhot_app.simulator.scene.motion import Sway, read_motion_file
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.files import resource_path


def test_the_shipped_motion_fits_the_mouse_and_its_scene() -> None:
    made = motion_file(carrying(), make_scene(twin_defaults(), 1).hand, MouseSettings(), Sway())
    assert read_motion_file(resource_path("motions", "mouse.json")) == made, "write resources/motions/mouse.json anew"


@pytest.mark.parametrize("seed", range(1, 7))
def test_pick_and_place(seed: int) -> None:
    done = place_once(seed)
    assert done["placed"], done


def test_resolution_coupling_and_one_camera() -> None:
    still = resolution(0.0, 1)
    assert still["x_mm"] < 1.0 and still["y_mm"] < 1.5 and still["height_mm"] < 5.0
    assert all(one["rms"]["x_mm"] < 2.0 and one["rms"]["height_mm"] < 5.0 for one in coupling(2))
    covered = one_camera(1)
    assert covered["on_table"]["y_mm"] < 0.5 * covered["free"]["y_mm"]


def test_throughput_and_latency() -> None:
    figures, run = throughput(1)
    assert figures["tracked"]["missed"] == 0
    assert figures["tracked"]["bits_per_s"] > 0.9 * figures["true"]["bits_per_s"]
    late = latency(run)
    assert 5.0 < late["ready_p50_ms"] < 60.0 and late["lag_ms"] < 10.0
