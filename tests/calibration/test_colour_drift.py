"""The light drifts: said with brightness and colour, before a marker is lost."""

from __future__ import annotations

import numpy as np
import pytest
from colour_scenes import PAINTS, box, picture

from rhot_app.calibration.colour.colours import solve_colours
from rhot_app.calibration.colour.illuminant import DriftResult, IlluminantDrift
from rhot_app.calibration.colour.samples import ColourSamples
from rhot_app.calibration.verdict import Grade
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.illuminant import gains_of
from rhot_node.markers import MarkerSet


@pytest.fixture(scope="module")
def learnt() -> MarkerSet:
    image, collector = picture(), ColourSamples()
    for name in PAINTS:
        collector.add(name, image, box(name))
    return solve_colours(collector.samples, collector.views).markers


def watch(markers: MarkerSet, frames: int = 6, **light) -> DriftResult:
    drift = IlluminantDrift(markers)
    for seed in range(frames):
        drift.update(picture(seed=seed, **light))
    return drift.report()


def test_the_light_of_the_calibration_is_no_drift(learnt: MarkerSet) -> None:
    report = watch(learnt)
    assert report.verdict.grade is Grade.GOOD and report.verdict.findings == ()
    assert abs(report.temperature_shift) < 0.06
    assert report.light == pytest.approx(1.0, abs=0.06)
    assert [drift.marker for drift in report.markers] == list(PAINTS)
    assert min(drift.margin for drift in report.markers) > 0.6


@pytest.mark.parametrize(("temperature_shift", "word"), [(0.35, "warmer"), (-0.35, "colder")])
def test_another_lamp_is_named_while_every_marker_is_still_found(learnt: MarkerSet, temperature_shift: float,
                                                                 word: str) -> None:
    gains = tuple(gains_of(temperature_shift))
    report = watch(learnt, gains=gains)
    assert report.temperature_shift == pytest.approx(temperature_shift, abs=0.06)
    (finding,) = [one for one in report.verdict.findings if one.code == "temperature"]
    assert word in finding.figure and "learn the colours again" in finding.remedy
    assert (report.kelvin < 4000) == (temperature_shift > 0)
    assert all(seen.found for seen in FastDetector(learnt).detect(picture(gains=gains)))


def test_less_light_is_measured_and_said_before_a_marker_is_lost(learnt: MarkerSet) -> None:
    said = lost = 1.0
    for light in np.arange(1.0, 0.2, -0.04):
        report = watch(learnt, frames=4, light=light)
        if len(report.markers) == 6:
            assert report.light == pytest.approx(light**2.2, rel=0.15)
        if said == 1.0 and report.verdict.grade is not Grade.GOOD:
            said = light
        if not all(seen.found for seen in FastDetector(learnt).detect(picture(light=light, seed=9))):
            lost = light
            break
    assert 0.9 > said > lost
    assert any(one.code in ("brightness", "margin") for one in report.verdict.findings)


def test_a_worn_paint_is_named(learnt: MarkerSet) -> None:
    worn = {**PAINTS, "middle": (52, 120, 66)}
    report = watch(learnt, paints=worn)
    assert any(one.code == "margin" and "middle" in one.figure for one in report.verdict.findings)


def test_a_detector_that_runs_already_is_asked_instead_of_a_second_one(learnt: MarkerSet) -> None:
    detector = FastDetector(learnt)
    drift = IlluminantDrift(learnt, detector)
    for seed in range(4):
        image = picture(seed=seed)
        drift.update(image, detector.detect(image))
    assert len(drift.report().markers) == 6


def test_without_markers_nothing_is_claimed(learnt: MarkerSet) -> None:
    report = watch(learnt, paints={})
    assert report.markers == () and report.verdict.findings == ()
    assert "no marker" in report.verdict.sentence
