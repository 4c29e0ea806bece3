"""Wizards that need a board or only the cameras, from start to saved rig on the simulated rig, by real processes."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from board_scene import compile_search
from PySide6.QtCore import Qt

from rhot_app.project import CameraPose
from rhot_app.simulator.scene.scene_description import BoardShow
from rhot_node.config import load_settings


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


def baseline_of(rig):
    left, right = (np.array(node.pose.translation_m) for node in rig.nodes)
    return float(np.linalg.norm(right - left))


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/calibration/stereo")
def test_cameras_are_put_together(simulated_rig, open_on_rig):
    truth = simulated_rig.truth
    right = msgspec.structs.replace(truth.nodes[1], pose=CameraPose(translation_m=(0.06, 0.0, 0.0)))
    simulated_rig.use(msgspec.structs.replace(truth, nodes=(truth.nodes[0], right)))
    hands = open_on_rig("stereo")
    simulated_rig.twin.show(BoardShow())
    hands.type(hands.window.page.square, "25")
    hands.until(lambda: hands.sentence == "Seen by left, right: this is the board.", 60.0)
    hands.keep("stereo-board")
    hands.next()
    hands.until(lambda: len(hands.window.step.views.shots) >= 9, 120.0)
    hands.keep("stereo-show")
    hands.until(lambda: hands.sentence == "Enough: press Next.", 120.0)
    hands.next()
    hands.window.page.baseline.setValue(75.0)
    hands.keep("stereo-length")
    hands.next()
    hands.until(lambda: hands.verdict is not None, 60.0)
    hands.keep("stereo-result")
    assert hands.verdict.acceptable, hands.verdict
    hands.next()
    simulated_rig.twin.show(BoardShow(on_table=True))
    for _ in range(20):  # pictures of before may still be on their way
        hands.run(0.5)
        hands.key(Qt.Key.Key_Space)
        if hands.sentence == "The table is known: press Next.":
            break
    assert hands.sentence == "The table is known: press Next.", hands.hint
    hands.keep("stereo-table")
    hands.next()
    hands.keep("stereo-accept", 8)
    hands.use()
    saved = simulated_rig.saved
    assert saved.up == "z" and saved.nodes[0].pose.translation_m[2] > 0.1
    assert baseline_of(saved) == pytest.approx(baseline_of(truth), abs=0.0005)


def saved_exposures(simulated_rig):
    return [load_settings(simulated_rig.session.directory / f"{name}.node.json").camera.exposure_us
            for name in ("left", "right")]


def obeyed_exposures(simulated_rig):
    return [camera.exposure_us for camera in simulated_rig.twin.state().cameras.values()]


def test_cameras_are_set_and_the_nodes_keep_it(simulated_rig, open_on_rig):
    before = saved_exposures(simulated_rig)
    hands = open_on_rig("camera")
    hands.window.page.rows["exposure_us"].box.setValue(6.0)
    hands.until(lambda: obeyed_exposures(simulated_rig) == [6000.0, 6000.0])
    assert saved_exposures(simulated_rig) == before, "nothing is saved before it is used"
    hands.until(lambda: hands.verdict is not None)
    hands.keep("cameras-settings")
    hands.next()
    hands.keep("cameras-accept", 8)
    hands.use()
    assert saved_exposures(simulated_rig) == [6000.0, 6000.0]
    hands.restore()
    assert saved_exposures(simulated_rig) == before
    hands.until(lambda: obeyed_exposures(simulated_rig) == before)


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/calibration/lens")
def test_a_lens_is_found(simulated_rig, open_on_rig):
    truth = simulated_rig.truth
    lens = msgspec.structs.replace(truth.nodes[0].intrinsics, fx=600.0, fy=600.0)
    left = msgspec.structs.replace(truth.nodes[0], intrinsics=lens)
    simulated_rig.use(msgspec.structs.replace(truth, nodes=(left, truth.nodes[1])))
    hands = open_on_rig("lens")
    simulated_rig.twin.show(BoardShow())
    hands.type(hands.window.page.square, "25")
    hands.until(lambda: hands.sentence == "Seen by left: this is the board.", 60.0)
    hands.keep("lens-board")
    hands.next()
    hands.until(lambda: len(hands.window.step.views) >= 9, 120.0)
    hands.keep("lens-show")
    hands.until(lambda: hands.window.step.view().done, 240.0)
    hands.next()
    hands.until(lambda: hands.verdict is not None, 60.0)
    hands.keep("lens-result")
    assert hands.verdict.acceptable, hands.verdict
    hands.next()
    hands.keep("lens-accept", 8)
    hands.use()
    found, true = simulated_rig.saved.nodes[0].intrinsics, truth.nodes[0].intrinsics
    assert found.fx == pytest.approx(true.fx, rel=0.01) and found.cx == pytest.approx(true.cx, abs=4.0)
