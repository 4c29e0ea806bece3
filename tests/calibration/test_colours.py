"""Colour calibration: models that bear other lamps, and a verdict that says what will go wrong."""

from __future__ import annotations

import math
import time

import msgspec
import numpy as np
import pytest
from colour_scenes import PAINTS, RADIUS, SKIN, WOOD, box, picture, place
from marker_rendering import Rgb
from patience import quickest

from rhot_app.calibration.colour.colours import NO_COLOURS, ColourResult, solve_colours
from rhot_app.calibration.colour.illuminant import LAMPS
from rhot_app.calibration.colour.samples import ColourSamples
from rhot_app.calibration.colour.surroundings import hue_histogram
from rhot_app.calibration.kinds.colours import report as said_of
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_node.detect.colour import box_mask, colours_of
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.illuminant import gains_of
from rhot_node.detect.image import YuvImage
from rhot_node.detect.reference import ReferenceDetector
from rhot_node.detect.search import ColourGate
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

RHOT6 = load_markers(resource_path("markers", "rhot6.json"))


def calibrate(image: YuvImage, names: tuple[str, ...] = tuple(PAINTS), skin: bool = False, **given) -> ColourResult:
    collector = ColourSamples()
    for name in names:
        collector.add(name, image, box(name))
    x, y = place(names[0])
    finger = box_mask(image, [(round(x) - 5, round(y) + 30, round(x) + 5, round(y) + 60)])
    return solve_colours(collector.samples, collector.views, skin=colours_of(image, finger) if skin else NO_COLOURS,
                         **given)


def misplaced(report: ColourResult, image: YuvImage, shift: tuple[float, float] = (0.0, 0.0)) -> list[str]:
    wrong = []
    for name, seen in zip(report.names, FastDetector(report.markers).detect(image), strict=False):
        x, y = place(name, shift)
        if not seen.found or math.hypot(seen.x - x, seen.y - y) > 0.3 * RADIUS:
            wrong.append(name)
    return wrong


@pytest.fixture(scope="module")
def six() -> ColourResult:
    return calibrate(picture(), skin=True)


def test_six_paints_are_learnt_named_and_told_apart(six: ColourResult) -> None:
    assert six.verdict.acceptable
    assert not {"overlap", "same-colour", "skin", "room", "fails", "lamp"} & six.verdict.codes
    assert [marker.role for marker in six.markers.markers] == [
        "thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip", "wrist"]
    assert six.markers.markers[5].shape == "band"
    assert min(six.separability.coverage) >= 0.99
    for marker, nominal in zip(six.markers.markers, RHOT6.markers, strict=True):
        away = math.remainder(marker.chroma.hue_rad - nominal.chroma.hue_rad, 2 * math.pi)
        assert abs(math.degrees(away)) < 3.0


def test_paint_before_a_wall_of_its_colour_is_said(six: ColourResult) -> None:
    blue = {**PAINTS, "thumb": (60, 90, 160)}
    assert "runs-on" in calibrate(picture(blue, background=(70, 100, 165)), names=("thumb",)).verdict.codes
    assert "runs-on" not in six.verdict.codes


@pytest.mark.parametrize("lamp", [lamp for lamp in LAMPS if lamp.temperature_shift in (-0.54, 0.54, 0.0)], ids=str)
def test_no_marker_is_lost_by_another_lamp(six: ColourResult, lamp) -> None:
    shift = (11.0, 23.0)
    shown = picture(shift=shift, light=lamp.brightness ** (1 / 2.2), gains=tuple(gains_of(lamp.temperature_shift)),
                    seed=7)
    assert misplaced(six, shown, shift) == []


def test_the_thesis_detector_gets_bounds_of_its_own(six: ColourResult) -> None:
    for name, seen in zip(six.names, ReferenceDetector(six.markers).detect(picture(seed=3)), strict=True):
        assert math.hypot(seen.x - place(name)[0], seen.y - place(name)[1]) < 0.35 * RADIUS, name


def test_one_paint_twice_is_not_usable() -> None:
    report = calibrate(picture({"thumb": PAINTS["ring"], "index": PAINTS["ring"], "middle": PAINTS["middle"]}),
                       ("thumb", "index", "middle"))
    assert "same-colour" in report.verdict.codes
    assert report.verdict.grade is Grade.POOR
    worst = report.verdict.findings[0]
    assert worst.figure.startswith("thumb and index overlap by")
    assert "Use another paint" in worst.remedy
    assert report.separability.pair("thumb", "index") > 0.35 > report.separability.pair("thumb", "middle")


ORANGE: Rgb = (214, 140, 104)  # nearly skin


def test_a_paint_like_skin_is_refused_with_what_shows_it_and_what_to_do() -> None:
    report = calibrate(picture({**PAINTS, "thumb": ORANGE}, background=(60, 62, 66)), skin=True)
    (finding,) = [one for one in report.verdict.findings if one.code == "skin"]
    share = round(100 * report.separability.pair("thumb", "skin"))
    assert finding.grade is Grade.POOR
    assert finding.figure.startswith(f"thumb has the colour of skin: thumb and skin overlap by {share} %; hue 1")
    assert "another paint" in finding.remedy
    assert f"thumb and skin overlap by {share} %" in report.separability.sentences


def test_a_thing_in_the_room_of_the_same_colour_is_named_with_its_place() -> None:
    clutter = [(150.0, 50.0, 11.0, PAINTS["middle"])]
    report = calibrate(picture(clutter=clutter, background=(60, 62, 66)))
    (finding,) = [one for one in report.verdict.findings if one.code == "room"]
    rival = report.room.rivals[report.names.index("middle")]
    assert rival is not None and rival.merit > 0.7
    assert math.hypot(rival.x - 150, rival.y - 50) < 3.0
    assert rival.area_px == pytest.approx(math.pi * 11**2, rel=0.15)
    assert "middle" in finding.figure
    green = round((math.degrees(RHOT6.markers[2].chroma.hue_rad) + 180) / 5)
    assert report.room.hue_px[green - 1:green + 1].sum() == pytest.approx(math.pi * 5.5**2, rel=0.25)


def test_a_large_thing_across_the_room_is_a_rival_and_the_marker_is_found_all_the_same() -> None:
    report = calibrate(picture(clutter=[(291.0, 200.0, 30.0, PAINTS["middle"])], background=(60, 62, 66)))
    (finding,) = [one for one in report.verdict.findings if one.code == "room"]
    assert "middle" in finding.figure and "finds that first, and the marker after it" in finding.cause
    assert max(rival.merit for rival in report.room.rivals if rival is not None) > 1.0
    assert not {"fails", "lamp"} & report.verdict.codes and max(report.rehearsal.lost) == 0.0
    second = [failure for failure in report.rehearsal.failures if failure.outcome == "second"]
    assert {failure.marker for failure in second} == {"middle"}
    assert "What is found first is at 29" in second[0].cause.sentence


def test_a_marker_behind_four_larger_things_of_its_colour_is_said_to_be_so_and_where_they_are() -> None:
    clutter = [(x, y, 22.0, PAINTS["ring"]) for x, y in ((270.0, 205.0), (30.0, 205.0), (150.0, 215.0), (290.0, 25.0))]
    report = calibrate(picture(clutter=clutter, background=(60, 62, 66)))
    (finding,) = [one for one in report.verdict.findings if one.code == "fails"]
    assert finding.figure == "ring is found in another place in picture 1 itself."
    assert finding.cause.startswith("4 other objects of its colour are likelier, the first at ")
    assert "plainer background" in finding.remedy and finding.grade is Grade.POOR
    (said,) = {(one["cause"], one["sentence"]) for one in said_of(report, None).to_json()["failures"]
               if one["same_lamp"] and not one["tracked"]}
    assert said == ("crowded", finding.cause)


def test_paint_that_a_bound_refuses_is_not_blamed_on_the_room() -> None:
    learnt = calibrate(picture(background=(60, 62, 66)))
    (ring,) = [marker.chroma for marker in learnt.markers.markers if marker.id == "ring"]
    given = {"ring": msgspec.structs.replace(ring, luma_max=90)}
    report = calibrate(picture(background=(60, 62, 66)), given=given)
    (finding,) = [one for one in report.verdict.findings if one.code == "fails"]
    assert finding.figure == "ring is not found in picture 1 itself."
    assert "Its paint is too bright: luma 1" in finding.cause and "at most 90 is taken" in finding.cause
    assert "exposure" in finding.remedy


def test_a_marker_cut_by_the_border_is_said_to_be_found_in_doubt_and_why() -> None:
    shift = (0.0, -66.0)
    image, collector = picture(background=(60, 62, 66), shift=shift), ColourSamples()
    for name in ("thumb", "ring"):
        collector.add(name, image, box(name, 4, shift))
    report = solve_colours(collector.samples, collector.views)
    said = {one.figure: one for one in report.verdict.findings if one.code == "doubtful"}
    assert set(said) == {"thumb is found in doubt in picture 1.", "ring is found in doubt in picture 1."}
    assert all("cut by the picture's border" in one.cause and one.grade is Grade.GOOD for one in said.values())


def test_a_dull_thing_of_the_same_hue_is_kept_out_by_the_magnitude() -> None:
    dull = (110, 135, 113)
    report = calibrate(picture(clutter=[(291.0, 30.0, 24.0, dull)], background=(60, 62, 66)))
    assert not {"room", "fails"} & report.verdict.codes
    assert misplaced(report, picture(clutter=[(291.0, 30.0, 24.0, dull)], background=(60, 62, 66), seed=4)) == []


def test_free_paints_are_far_from_all_that_are_worn(six: ColourResult) -> None:
    three = calibrate(picture({name: PAINTS[name] for name in ("thumb", "middle", "index")}, background=(90, 92, 95)),
                      ("thumb", "middle", "index"))
    assert not {"magenta", "green", "yellow", "orange", "red"} & set(three.free)
    assert {"cyan", "azure", "blue"} & set(three.free)
    assert not {"magenta", "green", "yellow", "cyan", "blue", "pink"} & set(six.free)


def test_base_markers_keep_what_is_not_a_colour() -> None:
    report = calibrate(picture(), ("ring", "thumb"), base=RHOT6)
    assert report.markers.ids == RHOT6.ids
    assert report.names == ("thumb", "ring")
    ring, nominal = report.markers.markers[3], RHOT6.markers[3]
    assert (ring.radius_mm, ring.shape, ring.role) == (nominal.radius_mm, nominal.shape, nominal.role)
    assert ring.chroma != nominal.chroma
    assert report.markers.markers[1] == RHOT6.markers[1]
    with pytest.raises(CalibrationError, match="no marker 'toe'"):
        collector = ColourSamples()
        collector.add("toe", picture(), box("ring"))
        solve_colours(collector.samples, collector.views, base=RHOT6)


def test_burnt_and_weak_paint_is_told_with_the_remedy() -> None:
    burnt = calibrate(picture({**PAINTS, "index": (300, 280, 40)}, background=(60, 62, 66)))
    assert "exposure" in next(one for one in burnt.verdict.findings if one.code == "burnt").remedy
    weak = calibrate(picture({**PAINTS, "ring": (100, 132, 142)}, background=(60, 62, 66)))
    assert any(one.code == "pale" and "ring" in one.figure for one in weak.verdict.findings)


def test_nothing_is_solved_without_samples() -> None:
    with pytest.raises(CalibrationError, match="no samples"):
        solve_colours([], [])


def test_mask_and_histogram_of_a_live_picture_take_little_of_a_tenth_of_a_second() -> None:
    gate, image = ColourGate(RHOT6), picture()
    large = YuvImage(*(np.tile(plane, (2, 2)) for plane in (image.y, image.u, image.v)))

    def look() -> None:
        labels = gate.labels(large)
        hue_histogram(large, labels == 0)
        [np.count_nonzero(labels == k + 1) for k in range(6)]

    assert quickest(look, 0.04, 12, time.process_time) < 0.04


def test_wood_and_skin_are_no_markers_colour(six: ColourResult) -> None:
    gate = ColourGate(six.markers)
    bare = picture({}, background=WOOD)
    finger = picture({"thumb": SKIN}, background=WOOD)
    assert np.count_nonzero(gate.labels(bare)) == np.count_nonzero(gate.labels(finger)) == 0
