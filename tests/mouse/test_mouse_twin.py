"""The scripted hand of the twin works the mouse: observations, tracker, mouse; the truth only judges."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.mouse.measure import buttons, coupling, latency, one_camera, place_once, resolution, throughput
from rhot_app.mouse.play import SetUp, play
from rhot_app.mouse.pointer import MouseSettings
from rhot_app.mouse.script import LEAD_S, Script, carrying, motion_file
from rhot_app.simulator.scene.motion import Sway
from rhot_app.simulator.scene.motion_file import read_motion_file
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.files import resource_path


def test_the_shipped_motion_is_that_of_the_script() -> None:
    made = motion_file(carrying(), make_scene(twin_defaults(), 1).hand, MouseSettings(), Sway())
    assert read_motion_file(resource_path("motions", "mouse.json")) == made, "write resources/motions/mouse.json anew"


@pytest.mark.parametrize(("seed", "cameras"), [(1, 2), (2, 2), (1, 1)])
def test_pick_and_place(seed: int, cameras: int) -> None:
    """With one camera, the plane of the table is known."""
    done = place_once(seed, set_up=SetUp(cameras=cameras))
    assert done["placed"], done


def test_resolution_coupling_and_one_camera() -> None:
    still = resolution(0.0, 1)
    assert still["x_mm"] < 1.0 and still["y_mm"] < 1.5 and still["height_mm"] < 5.0
    assert all(one["rms"]["x_mm"] < 2.0 and one["rms"]["height_mm"] < 5.0 for one in coupling(2))
    covered = one_camera(1)
    assert covered["on_table"]["y_mm"] < 0.5 * covered["free"]["y_mm"]


@pytest.mark.parametrize("cameras", [1, 2])
def test_tracked_presses_are_those_of_the_hand(cameras: int) -> None:
    for one in buttons(1, set_up=SetUp(cameras=cameras)).values():
        assert one["presses"] == one["right"] == 4 and one["wrong"] == 0


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours", "rhot_app/mouse")
@pytest.mark.timeout(900)
def test_a_bare_hand_before_one_camera_works_the_mouse() -> None:
    """It is found as it comes in, and followed where it has come to, without markers."""
    script = Script()
    script.move((0.06, 0.04, 0.0), 0.6)
    script.wait(0.3)
    script.click("thumb", 0.3)
    run = play(script, 1, SetUp("contours", 1, facing="back"))
    moving = run.during(LEAD_S, script.end_s)
    palms = np.array([state.world_from_palm[:3, 3] for state in run.states])
    assert moving.sum() > 30
    assert np.median(np.linalg.norm(palms - run.true_palm, axis=1)[moving]) < 0.015
    assert np.sqrt(np.square(run.cursor - run.true_cursor)[moving].mean(axis=0))[:2] == pytest.approx(0.0, abs=0.03)


def test_throughput_and_latency() -> None:
    figures, run = throughput(1)
    assert figures["tracked"]["missed"] == 0
    assert figures["tracked"]["bits_per_s"] > 0.9 * figures["true"]["bits_per_s"]
    late = latency(run)
    assert 5.0 < late["ready_p50_ms"] < 60.0 and late["lag_ms"] < 10.0
