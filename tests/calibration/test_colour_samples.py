"""Collecting samples: what a click, a box and a moving hand give."""

from __future__ import annotations

import numpy as np
import pytest
from colour_scenes import PAINTS, SKIN, box, picture, place

from rhot_app.calibration.colour.colours import solve_colours
from rhot_app.calibration.colour.paint_region import region_at, region_in
from rhot_app.calibration.colour.samples import ColourSamples
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_node.detect.image import YuvImage
from rhot_node.detect.search import ColourGate


def test_a_click_takes_the_marker_and_nothing_else() -> None:
    image = picture()
    region = region_at(image, place("ring"))
    rows, columns = np.nonzero(region.sample)
    assert abs(2 * columns.mean() + 0.5 - place("ring")[0]) < 1.0
    assert abs(2 * rows.mean() + 0.5 - place("ring")[1]) < 1.0
    assert region.area == pytest.approx(np.pi * 4.5**2, rel=0.15)
    assert not region.runs_on


@pytest.mark.parametrize(("point", "said"), [((160.0, 230.0), "marker|no colour"), ((400.0, 10.0), "outside")])
def test_clicks_that_hit_no_marker_are_refused_in_words(point: tuple[float, float], said: str) -> None:
    with pytest.raises(CalibrationError, match=said):
        region_at(picture(background=(150, 90, 40)), point)


def test_a_click_on_grey_says_that_there_is_no_colour() -> None:
    with pytest.raises(CalibrationError, match="no colour"):
        region_at(picture(background=(90, 90, 90)), (5.0, 5.0))


def test_a_tiny_box_says_where_the_paint_is_and_the_paint_round_it_is_taken() -> None:
    tiny = region_in(picture(), [box("middle", 3)])
    assert np.count_nonzero(tiny.sample) > 20
    assert tiny.area == pytest.approx(np.pi * 4.5**2, rel=0.2)


def test_paint_without_an_end_is_noticed() -> None:
    skin_paint = {**PAINTS, "thumb": SKIN}
    region = region_in(picture(skin_paint, background=(205, 156, 130)), [box("thumb")])
    assert region.runs_on
    assert np.count_nonzero(region.whole) < 200


def test_a_moving_hand_is_followed_and_gives_new_places_and_light() -> None:
    collector = ColourSamples()
    first = picture()
    for name in PAINTS:
        collector.add(name, first, box(name))
    for step in range(1, 12):
        collector.follow(picture(shift=(2.0 * step, 3.0 * step), light=1.0 - 0.03 * step, seed=step))
    for samples in collector.samples:
        assert samples.frames >= 4, samples.name
        assert np.ptp([np.median(samples.colours[samples.frame == k, 0]) for k in set(samples.frame)]) > 10
        expected = 0.85 * np.array(PAINTS[samples.name])
        assert np.abs(np.array(samples.rgb) - 0.85 * expected).max() < 35
        assert collector.variety(samples.name) >= 0.4


def test_a_hand_that_rests_adds_nothing() -> None:
    collector = ColourSamples()
    collector.add("ring", picture(), box("ring"))
    taken = [bool(collector.follow(picture(seed=seed))) for seed in range(1, 6)]
    assert sum(taken) <= 1


def test_a_larger_thing_of_the_colour_is_not_followed() -> None:
    clutter = [(270.0, 200.0, 30.0, PAINTS["ring"])]
    collector = ColourSamples()
    collector.add("ring", picture(clutter=clutter), box("ring"))
    for step in range(1, 6):
        for region in collector.follow(picture(shift=(0.0, 6.0 * step), clutter=clutter, seed=step)).values():
            assert region.area < 100
    assert collector.samples[0].frames >= 3


def test_a_marker_may_be_forgotten_and_named_again() -> None:
    collector = ColourSamples()
    collector.add("ring", picture(), box("little"))
    collector.forget("ring")
    assert collector.names == () and collector.variety("ring") == 0.0
    collector.add("ring", picture(), box("ring"))
    red, green, blue = collector.samples[0].rgb
    assert red < 60 < green < blue
    assert all("ring" in view.paint for view in collector.views[-1:])


def test_a_grey_box_is_refused_with_the_markers_name() -> None:
    with pytest.raises(CalibrationError, match=r"wrist: .*almost grey"):
        ColourSamples().add("wrist", picture(background=(120, 120, 120)), (4, 4, 30, 30))


def half_in_other_light(turn_deg: float) -> YuvImage:
    """The painted hand; right of the middle of "ring" the hue of its paint is turned."""
    image = picture(seed=3)
    x, y = (int(part) // 2 for part in place("ring"))
    part = np.s_[y - 7:y + 8, x:x + 8]
    turned = (image.u[part] - 128.0 + 1j * (image.v[part] - 128.0)) * np.exp(1j * np.radians(turn_deg))
    u, v = image.u.copy(), image.v.copy()
    u[part], v[part] = np.rint(turned.real + 128.0), np.rint(turned.imag + 128.0)
    return YuvImage(image.y, u, v)


def halves() -> list[tuple[int, int, int, int]]:
    """A large box in the left half of "ring" and a small one in the right half."""
    x, y = (round(part) for part in place("ring"))
    return [(x - 7, y - 5, x - 1, y + 5), (x + 2, y - 2, x + 6, y + 4)]


def test_a_paint_whose_hue_varies_with_the_light_is_learnt_that_wide_and_it_is_said() -> None:
    image = half_in_other_light(20.0)
    collector = ColourSamples()
    collector.add("ring", image, halves())
    for name in ("thumb", "index", "middle", "wrist"):
        collector.add(name, image, box(name))
    report = solve_colours(collector.samples, collector.views)
    uneven = next(one for one in report.verdict.findings if one.code == "uneven")
    assert uneven.grade is Grade.FAIR and "ring" in uneven.figure and report.verdict.acceptable
    labels = ColourGate(report.markers).labels(image)
    index = report.markers.ids.index("ring") + 1
    for x0, y0, x1, y1 in halves():
        assert np.mean(labels[y0 // 2 + 1:y1 // 2, x0 // 2 + 1:x1 // 2] == index) > 0.8


def test_boxes_that_no_light_explains_are_refused_or_not_usable() -> None:
    with pytest.raises(CalibrationError, match="something else"):
        ColourSamples().add("ring", half_in_other_light(45.0), halves())
    collector = ColourSamples()
    collector.add("ring", picture(), box("ring"))
    collector.add("ring", picture(seed=1), box("little"))
    verdict = solve_colours(collector.samples, collector.views).verdict
    assert "uneven" in verdict.codes and not verdict.acceptable
