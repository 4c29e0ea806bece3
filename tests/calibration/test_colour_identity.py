"""Whose colour is whose: one paint under two names, skin under a marker's name, paints that changed fingers."""

from __future__ import annotations

import numpy as np
import pytest
from colour_scenes import PAINTS, box, picture, place
from marker_rendering import Rgb

from rhot_app.calibration.colour.colours import ColourResult, solve_colours
from rhot_app.calibration.colour.gathering import ColourGathering
from rhot_app.calibration.colour.identity import Identity, colours_taken, has_hue_of_skin, identify, skin_shown
from rhot_app.calibration.verdict import Grade
from rhot_node.detect.colour import learn_chroma_from_colours
from rhot_node.detect.illuminant import YCC_FROM_RGB, gains_of
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet, load_markers

RHOT6 = load_markers(resource_path("markers", "rhot6.json"))
MONK = ("d7bd96", "a07e56", "825c43", "604134", "3a312a")
"""The medium and dark tones of the Monk skin tone scale; the light ones are grey for a camera."""
LIGHTS = (1.0, 0.6, 0.35)


def colours_of_rgb(rgb: Rgb, light: float = 1.0) -> np.ndarray:
    return np.tile((YCC_FROM_RGB @ (light * np.array(rgb))).astype(np.float32), (20, 1))


@pytest.mark.parametrize("tone", MONK)
@pytest.mark.parametrize("light", LIGHTS)
def test_skin_of_every_tone_is_taken_for_skin_in_any_amount_of_light(tone: str, light: float) -> None:
    red, green, blue = bytes.fromhex(tone)
    assert has_hue_of_skin(colours_of_rgb((red, green, blue), light))


@pytest.mark.parametrize("rgb", [(230, 120, 30), (255, 106, 0), (220, 20, 60), (210, 35, 55), (255, 127, 80),
                                 (123, 63, 0), (225, 200, 30), (212, 160, 23), (255, 20, 147)], ids=str)
@pytest.mark.parametrize("light", LIGHTS)
def test_orange_crimson_brown_and_yellow_paints_are_no_skin_in_any_amount_of_light(rgb: Rgb, light: float) -> None:
    assert not has_hue_of_skin(colours_of_rgb(rgb, light))


def gathered(paints: dict[str, Rgb], where: dict[str, tuple[float, float]] | None = None, **options) -> ColourGathering:
    gathering, image = ColourGathering(("left",)), picture(paints, background=(60, 62, 66), **options)
    for name in paints:
        gathering.pick(name, "left", image, (where or {}).get(name, place(name)))
    return gathering


def identity(gathering: ColourGathering, *, rig: MarkerSet | None = None) -> Identity:
    models = {one.name: learn_chroma_from_colours(one.colours) for one in gathering.samples}
    before = {} if rig is None else {marker.id: (marker.chroma,) for marker in rig.markers}
    return identify(gathering.samples, gathering.views, models, (gathering.earlier, before))


def solved(gathering: ColourGathering, **options) -> ColourResult:
    return solve_colours(gathering.samples, gathering.views, before=gathering.earlier, **options)


@pytest.mark.parametrize("orange", [(230, 120, 30), (220, 20, 60)], ids=str)
@pytest.mark.parametrize("temperature_shift", [0.0, 0.35])
def test_a_saturated_paint_of_skins_hue_is_usable_beside_skin_that_a_warm_lamp_colours(orange: Rgb,
                                                                                      temperature_shift: float) -> None:
    paints = {**PAINTS, "wrist": orange}
    report = solved(gathered(paints, light=0.8, gains=tuple(gains_of(temperature_shift))))
    assert report.verdict.acceptable and "skin" not in report.verdict.codes, report.verdict


def test_skin_by_a_warm_lamp_is_known_by_lying_beside_the_other_markers() -> None:
    x, y = place("index")
    gathering = gathered(PAINTS, {"index": (x, y + 45.0)}, gains=tuple(gains_of(0.5)))
    (index,) = [one for one in gathering.samples if one.name == "index"]
    assert not has_hue_of_skin(index.colours)
    assert "lies beside" in skin_shown("index", index.colours, gathering.views)
    report = solved(gathering)
    (finding,) = [one for one in report.verdict.findings if one.code == "skin"]
    assert finding.grade is Grade.POOR and finding.figure.startswith("index has the colour of skin: ")
    assert "Pick the paint of index again" in finding.remedy


def test_every_paint_of_the_set_is_itself() -> None:
    assert identity(gathered(PAINTS), rig=RHOT6) == Identity((), {}, ())


def test_a_shade_of_the_same_paint_is_the_same_colour_for_the_camera() -> None:
    dark = (13, 83, 103)  # half of the ring's
    found = identity(gathered({**PAINTS, "little": dark}))
    assert [pair[:2] for pair in found.same] == [("ring", "little")] and found.same[0][2] < 8.0
    report = solved(gathered({**PAINTS, "little": dark}))
    finding = report.verdict.findings[0]
    assert finding.code == "same-colour" and finding.grade is Grade.POOR and "their hues are" in finding.figure


def test_a_marker_that_gets_the_colour_of_one_that_is_not_learnt_anew_is_refused_with_that_ones_name() -> None:
    gathering = gathered({"thumb": PAINTS["ring"]})
    report = solved(gathering, base=RHOT6)
    finding = report.verdict.findings[0]
    assert finding.code == "same-colour" and "thumb and ring have one colour" in finding.figure
    assert "Pick ring too if it has new paint" in finding.remedy


def test_paints_that_changed_fingers_since_the_rig_are_named() -> None:
    turned = {**PAINTS, "thumb": PAINTS["index"], "index": PAINTS["thumb"]}
    assert identity(gathered(turned), rig=RHOT6).taken == (("thumb", "index"), ("index", "thumb"))
    report = solved(gathered(turned), base=RHOT6)
    (finding,) = [one for one in report.verdict.findings if one.code == "exchanged"]
    assert finding.figure == "thumb now has the colour that index had; index now has the colour that thumb had."
    assert finding.grade is Grade.FAIR and report.verdict.acceptable


def test_a_colour_that_was_picked_wrongly_once_and_then_rightly_is_not_called_anothers() -> None:
    gathering, image = ColourGathering(("left",)), picture(background=(60, 62, 66))
    gathering.pick("thumb", "left", image, place("index"))
    for name in PAINTS:
        gathering.pick(name, "left", image, place(name))
    assert identity(gathering).taken == ()


def test_earlier_picks_are_forgotten_when_they_are_taken_back() -> None:
    gathering, image = ColourGathering(("left",)), picture()
    gathering.pick("thumb", "left", image, box("thumb"))
    gathering.pick("thumb", "left", image, box("ring"))
    assert len(gathering.earlier["thumb"]) == 1
    gathering.take_back()
    assert gathering.earlier == {"thumb": ()}


def test_nothing_is_taken_from_a_marker_that_still_has_its_colour() -> None:
    red, blue = RHOT6.markers[5].chroma, RHOT6.markers[4].chroma
    assert colours_taken({"a": red, "b": red}, {"a": (blue,), "b": (red,)}) == ()
    assert colours_taken({"a": red, "b": blue}, {"a": (blue,), "b": (red,)}) == (("a", "b"), ("b", "a"))
