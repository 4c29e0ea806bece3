"""Colours and camera advice on the digital twin: skin, wood, changing lamps, mains flicker."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from colour_twin import HandScene, calibrate, repainted, tally

from rhot_app.calibration.check.camera_advice import FlickerWatch
from rhot_app.calibration.colour.colours import ColourResult
from rhot_app.calibration.verdict import Grade
from rhot_app.simulator.render.body import SKIN_RGB
from rhot_app.simulator.render.camera_controls import Lamp
from rhot_node.detect.image import from_i420
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

LEARN_S = np.array([0.2, 0.9])
OTHER_S = np.array([3.1, 4.6])
MARKERS = load_markers(resource_path("markers", "rhot6.json"))


def warned(report: ColourResult, name: str) -> bool:
    return any(finding.grade is not Grade.GOOD and name in finding.figure for finding in report.verdict.findings)


@pytest.mark.parametrize("background", ["cloth", "clutter"])
def test_no_marker_that_can_be_seen_is_lost_by_another_lamp_without_a_warning(background: str) -> None:
    scene = HandScene(background, 2)
    report = calibrate(scene, LEARN_S)
    for kelvin, brightness in ((3000.0, 1.2), (6500.0, 0.8)):
        frames = list(scene.frames(OTHER_S, kelvin, brightness))
        for stills in (True, False):
            got = tally(report.markers, frames, stills)
            assert got.visible.min() == len(frames)
            for name, failed in zip(scene.markers.ids, got.failed, strict=True):
                assert failed == 0.0 or warned(report, name), (kelvin, brightness, stills, name)
            assert got.failed.mean() < 0.1


@pytest.mark.parametrize(("name", "towards", "share"), [
    ("index", SKIN_RGB, 0.95), ("little", MARKERS.markers[3].display_rgb, 1.0)])
def test_a_paint_that_is_another_colour_fails_and_is_warned_of(name: str, towards: tuple[float, float, float],
                                                               share: float) -> None:
    scene = HandScene("cloth", 2, markers=repainted(MARKERS, name, towards, share))
    report = calibrate(scene, LEARN_S)
    frames = [frame for kelvin in (3000.0, 6500.0) for frame in scene.frames(OTHER_S, kelvin)]
    index = MARKERS.ids.index(name)
    tallies = [tally(report.markers, frames, stills) for stills in (True, False)]
    assert max(one.lost[index] + one.misplaced[index] + one.second[index] for one in tallies) > 0.05 * len(frames)
    assert warned(report, name) and not report.verdict.acceptable


@pytest.mark.parametrize("mains", [0.0, 50.0])
def test_mains_flicker_of_the_twins_lamp_is_seen(mains: float) -> None:
    scene = HandScene("clutter", 2, "wave")
    renderer, preset = scene.renderer, scene.scene.preset
    renderer.expose(dataclasses.replace(renderer.exposure, lamp=Lamp(mains_hz=mains, flicker=0.3)))
    watch = FlickerWatch()
    for number in range(12):
        time_s = 1.0 + number / preset.fps
        data, _ = renderer.render(scene.source, time_s, number)
        watch.add(from_i420(data.copy(), preset.width, preset.height), time_s)
    report = watch.report(1e-6 * preset.row_time_us, 1e-9 * scene.scene.exposure_ns, preset.fps)
    assert report.mains_hz == (mains or None)
    assert [finding.code for finding in report.findings if finding.grade is not Grade.GOOD] == ["flicker"] * (mains > 0)
    if mains:
        swing = 0.3 * np.sinc(2.0 * mains * 1e-9 * scene.scene.exposure_ns) / 2.2
        assert report.depth == pytest.approx(swing, rel=0.3)
