"""Wizards that need a hand or a marker, from start to saved rig on the simulated rig, by clicks and real processes."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from paint_scene import other_colours
from PySide6.QtCore import Qt

from rhot_app.calibration.colour.separability import SKIN
from rhot_app.project import FilterSettings, OneEuroSettings
from rhot_app.simulator.scene.scene_description import HandShow, MarkerShow
from rhot_node.config import load_settings
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr

SOLVING_S = 120.0
TIMES = 3
"""A busy computer sees too little of a movement at times; a person repeats it when the page says so."""


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/calibration/time")
def test_the_time_of_the_cameras_is_found(simulated_rig, open_on_rig):
    truth = simulated_rig.truth
    late = msgspec.structs.replace(truth.nodes[1], time_offset_s=0.02)
    simulated_rig.use(msgspec.structs.replace(truth, nodes=(truth.nodes[0], late)))
    simulated_rig.twin.show(HandShow("brisk"))
    hands = open_on_rig("time")
    hands.record(15.0, "time-wave", TIMES)
    hands.next()
    hands.solved(SOLVING_S)
    hands.keep("time-result")
    hands.next()
    hands.keep("time-accept", 8)
    hands.use()
    assert simulated_rig.saved.nodes[1].time_offset_s == pytest.approx(0.0, abs=0.003)


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/calibration/depth")
def test_depth_is_found_without_a_board(simulated_rig, open_on_rig):
    hands = open_on_rig("depth")
    page = hands.window.page
    page.marker.setCurrentText("index")
    for number, distance_m in enumerate((0.3, 0.4, 0.55, 0.75, 1.0), 1):
        simulated_rig.twin.show(MarkerShow(marker="index", distance_m=distance_m))
        page.distance.setValue(100.0 * distance_m)
        for _ in range(40):
            hands.run(0.5)
            hands.click(page.take_button)
            if len(page.distances.rows) == number:
                break
        assert len(page.distances.rows) == number, hands.frame.hint.text()
    hands.keep("depth-measure")
    hands.next()
    hands.until(lambda: hands.frame.verdict.verdict is not None)
    hands.keep("depth-law")
    hands.next()
    hands.keep("depth-accept", 8)
    hands.use()
    left, right = simulated_rig.truth.nodes
    baseline_m = float(np.linalg.norm(np.subtract(right.pose.translation_m, left.pose.translation_m)))
    depth = simulated_rig.saved.depth
    assert depth.mode == "disparity" and depth.z == pytest.approx(-1.0, abs=0.05)
    assert depth.k == pytest.approx(baseline_m * left.intrinsics.fx, rel=0.06)


def click_marker(hands, camera, at):
    view = hands.frame.grid.views[camera]
    hands.click(view, view.to_widget(*at))


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/calibration/colour")
def test_colours_are_learnt(simulated_rig, open_on_rig):
    truth = simulated_rig.truth
    simulated_rig.use(msgspec.structs.replace(truth, markers=other_colours(truth.markers)))
    simulated_rig.twin.show(HandShow("still"))
    hands = open_on_rig("colours")
    step = hands.window.step
    hands.until(lambda: step.masked and hands.window.feed.newest("left") is not None)
    hands.run(1.0)
    image = from_bgr(hands.window.feed.newest("left").bgr)
    seen = {truth.markers.ids[mark.index]: (mark.x, mark.y) for mark in FastDetector(truth.markers).detect(image)}
    for name in truth.markers.ids:
        assert step.chosen == name
        click_marker(hands, "left", seen[name])
        assert name in step.gathering.names, step.problem
    assert step.chosen == SKIN
    click_marker(hands, "left", (seen["wrist"][0], seen["wrist"][1] + 40.0))
    simulated_rig.twin.show(HandShow("grasp"))
    hands.until(lambda: step.view().may_go_on, 90.0)
    hands.keep("colours-pick")
    hands.next()
    hands.solved(SOLVING_S)
    hands.run(1.0)
    hands.keep("colours-mask")
    hands.next()
    hands.solved(SOLVING_S)
    hands.keep("colours-apart")
    hands.next()
    hands.keep("colours-accept", 10)
    hands.use()
    saved = simulated_rig.saved.markers
    for name in ("left", "right"):
        assert load_settings(simulated_rig.session.directory / f"{name}.node.json").markers == saved
    found = FastDetector(saved).detect(image)
    for mark in found:
        x, y = seen[saved.ids[mark.index]]
        assert mark.found and np.hypot(mark.x - x, mark.y - y) < 3.0, saved.ids[mark.index]
    hands.restore()


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/calibration/hand")
def test_bones_are_measured(simulated_rig, open_on_rig):
    simulated_rig.twin.show(HandShow("sweep"))
    hands = open_on_rig("bones")
    for bone, length_mm in (("index.proximal", 44.0), ("index.medial", 25.5)):
        hands.window.page.boxes[bone].setValue(length_mm)
    hands.keep("bones-entry", 10)
    for _ in range(2):
        hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    hands.next()
    hands.record(25.0, "bones-movement", TIMES)
    hands.next()
    hands.solved(SOLVING_S)
    hands.keep("bones-hand", 12)
    hands.next()
    hands.keep("bones-accept", 8)
    hands.use()
    true, found = (rig.hand.fingers["index"] for rig in (simulated_rig.truth, simulated_rig.saved))
    assert sum(found.bones_mm) == pytest.approx(sum(true.bones_mm), rel=0.1)


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/calibration/filters")
def test_filters_are_tuned(simulated_rig, open_on_rig):
    lazy = OneEuroSettings(min_cutoff_hz=0.05, beta=0.0)
    simulated_rig.use(msgspec.structs.replace(simulated_rig.truth, filters=FilterSettings(pixel=lazy, position=lazy)))
    simulated_rig.twin.show(HandShow("still"))
    hands = open_on_rig("filters")
    hands.record(12.0, "filters-still", TIMES)
    hands.next()
    simulated_rig.twin.show(HandShow("brisk"))
    hands.record(20.0, "filters-fast", TIMES)
    assert hands.window.step.view().done, hands.sentence
    hands.next()
    hands.solved(SOLVING_S)
    hands.keep("filters-result")
    hands.next()
    hands.keep("filters-accept", 8)
    hands.use()
    saved = simulated_rig.saved.filters
    assert saved.position.min_cutoff_hz > 0.05 and saved.position.beta > 0.0, "a fast hand is followed"
