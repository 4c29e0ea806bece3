"""Exposure and white balance: what is seen, and whether the advice leads where it should."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from colour_scenes import PAINTS, picture, place
from marker_rendering import Canvas

from rhot_app.calibration.check.camera_advice import CameraAdvisor
from rhot_app.calibration.check.exposure import balance_on_grey, measure_exposure
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_app.simulator.render.camera_controls import controls_of, development
from rhot_node.config import CameraSettings
from rhot_node.detect.colour import colours_of
from rhot_node.detect.illuminant import RGB_FROM_YCC
from rhot_node.detect.image import YuvImage

GAMMA = 2.2


def masks(shape: tuple[int, ...]) -> dict[str, np.ndarray]:
    rows, columns = np.mgrid[:shape[0], :shape[1]]
    return {name: (2 * columns + 0.5 - place(name)[0]) ** 2 + (2 * rows + 0.5 - place(name)[1]) ** 2 <= 6**2
            for name in PAINTS}


def test_a_good_exposure_needs_no_words() -> None:
    image = picture()
    report = measure_exposure(image, masks(image.u.shape), CameraSettings())
    assert report.findings == ()
    assert 0.7 < report.factor < 1.4


def test_cut_off_paint_is_named_with_its_channel_and_a_shorter_time() -> None:
    image = picture(light=1.35)
    report = measure_exposure(image, masks(image.u.shape), CameraSettings(exposure_us=4000.0))
    finding = next(one for one in report.findings if one.code == "marker_over" and "index" in one.figure)
    assert "cut off in red" in finding.figure
    assert finding.remedy.startswith("Shorten exposure to ") and finding.remedy.endswith(" ms.")
    wanted = 1000.0 * float(finding.remedy.split()[-2])
    again = picture(light=1.35 * (wanted / 4000.0) ** (1 / GAMMA))
    assert not [one for one in measure_exposure(again, masks(again.u.shape)).findings if one.code == "marker_over"]


def test_all_markers_share_one_sentence() -> None:
    for light, exposure_us, code in ((1.6, 4000.0, "marker_over"), (0.2, 1000.0, "marker_under")):
        image = picture(light=light)
        report = measure_exposure(image, masks(image.u.shape), CameraSettings(exposure_us=exposure_us))
        (finding,) = [one for one in report.findings if one.code == code]
        assert " and " in finding.figure and " are too " in finding.figure


def test_the_paint_is_judged_even_where_luma_is_fine() -> None:
    blue_only = Canvas(64, 64, (20, 40, 300)).expose(np.random.default_rng(1))
    inside = np.ones((32, 32), np.bool_)
    report = measure_exposure(blue_only, {"little": inside})
    assert report.markers["little"].over == 0.0
    assert report.markers["little"].channels[2] > 0.9
    assert report.findings[0].grade is Grade.POOR


def test_dark_markers_get_light_and_after_that_gain() -> None:
    image = picture(light=0.2, background=(60, 62, 66))
    report = measure_exposure(image, masks(image.u.shape), CameraSettings(exposure_us=1000.0))
    assert {one.code for one in report.findings} >= {"marker_under"}
    assert "Lengthen exposure to " in report.findings[0].remedy
    long = measure_exposure(image, masks(image.u.shape), CameraSettings(exposure_us=8000.0))
    assert "more light, or raise the gain" in long.findings[0].remedy
    unknown = measure_exposure(image, masks(image.u.shape))
    assert "more light" in unknown.findings[0].remedy


def as_set(settings: CameraSettings) -> YuvImage:
    """The painted hand as a camera with these settings shows it."""
    developed = development(controls_of(settings), 1.0, 1.0)
    ycc = colours_of(picture(), np.ones((120, 160), np.bool_))
    levels = np.minimum((ycc @ RGB_FROM_YCC.T).clip(0.0, 255.0) * (settings.gain or 1.0) ** (1.0 / GAMMA)
                        * developed.white, developed.full)
    yuv = np.clip(levels @ np.transpose(developed.mix) + developed.offset, 0, 255).astype(np.uint8)
    y, u, v = yuv.T.reshape(3, 120, 160)
    return YuvImage(np.kron(y, np.ones((2, 2), np.uint8)), u, v)


@pytest.mark.parametrize(("settings", "code", "remedy"), [
    ({"saturation": 0.0}, "colourless", "Raise saturation to 1"),
    ({"contrast": 0.0}, "flat", "Raise contrast to 1"),
    ({"brightness": -1.0}, "under", "Raise brightness to 0"),
    ({"red_gain": 3.0}, "marker_over", "Lower red_gain"),
    ({"blue_gain": 4.0}, "marker_over", "lower blue_gain"),
    ({"saturation": 4.0}, "marker_over", "Lower saturation to 1"),
    ({"contrast": 4.0}, "marker_over", "Lower contrast to 1"),
    ({"brightness": 0.6}, "marker_over", "Lower brightness to 0"),
    ({"gain": 4.0}, "marker_over", "Lower gain to"),
])
def test_a_setting_that_spoils_the_picture_is_named(settings: dict[str, Any], code: str, remedy: str) -> None:
    told = CameraSettings(**settings)
    report = measure_exposure(as_set(told), masks((120, 160)), told) if code == "marker_over" else \
        measure_exposure(as_set(told), {}, told)
    (finding,) = [one for one in report.findings if one.code == code]
    assert finding.grade is Grade.POOR and remedy in finding.remedy and "Shorten exposure" not in finding.remedy
    if code == "marker_over":
        assert not report.summary.startswith("0.0 %"), "one channel that is cut off is too bright, too"


def test_nothing_is_good_before_every_marker_and_the_lamp_were_seen() -> None:
    advisor, settings, image = CameraAdvisor(tuple(PAINTS)), CameraSettings(row_time_us=48.0), picture()
    inside = masks(image.u.shape)
    half = {name: inside[name] for name in tuple(PAINTS)[:3]}
    codes = [advisor.update(image, k / 33.0, settings, half).verdict.codes for k in range(12)]
    assert codes[0] >= {"unseen", "flicker_waiting"}
    assert "unseen" in codes[-1] and "flicker_waiting" not in codes[-1]
    assert advisor.update(image, 12 / 33.0, settings, inside).verdict.grade is Grade.GOOD
    advisor.restart()
    assert "unseen" in advisor.update(image, 0.0, settings, half).verdict.codes


def test_a_covered_lens_is_not_good() -> None:
    covered = Canvas(64, 64, (130, 130, 130)).expose(np.random.default_rng(1))
    assert [one.code for one in measure_exposure(covered).findings] == ["flat"]
    dim = picture(light=0.1)
    assert [one.code for one in measure_exposure(dim).findings] == ["under"]


def test_a_lamp_in_the_picture_and_a_black_picture_are_told() -> None:
    lamp = picture(clutter=[(280.0, 40.0, 38.0, (255, 255, 255))])
    assert [one.code for one in measure_exposure(lamp).findings] == ["over"]
    dark = picture(light=0.02)
    assert [one.code for one in measure_exposure(dark).findings] == ["under"]


def patch(red: float, blue: float, level: float = 120.0):
    return Canvas(80, 60, (level * red, level, level * blue)).expose(np.random.default_rng(2))


@pytest.mark.parametrize("gamma", [1.0, GAMMA])
def test_grey_comes_to_rest_in_a_few_rounds_with_or_without_gamma(gamma: float) -> None:
    red_gain, blue_gain = 1.0, 1.0
    for _ in range(6):
        image = patch((1.5 * red_gain) ** (1 / gamma), (0.6 * blue_gain) ** (1 / gamma))
        advice = balance_on_grey(image, (20, 10, 60, 50), CameraSettings(red_gain=red_gain, blue_gain=blue_gain))
        if not advice.findings:
            break
        assert advice.red_gain is not None and advice.blue_gain is not None
        red_gain, blue_gain = advice.red_gain, advice.blue_gain
    assert advice.findings == ()
    assert red_gain == pytest.approx(1 / 1.5, rel=0.1)
    assert blue_gain == pytest.approx(1 / 0.6, rel=0.1)


def test_the_remedy_names_the_control_and_the_direction() -> None:
    (finding,) = balance_on_grey(patch(1.2, 0.8), (20, 10, 60, 50)).findings
    assert "Lower red_gain" in finding.remedy and "Raise blue_gain" in finding.remedy
    assert "+20 % red" in finding.figure


@pytest.mark.parametrize(("image", "box", "said"), [
    (patch(1.0, 1.0), (200, 200, 220, 220), "too small"),
    (patch(1.0, 1.0, 12.0), (20, 10, 60, 50), "too dark"),
    (patch(1.0, 1.0, 252.0), (20, 10, 60, 50), "too bright"),
    (picture(), (30, 40, 100, 120), "not of one colour"),
])
def test_no_grey_patch_is_a_sentence(image, box: tuple[int, int, int, int], said: str) -> None:
    with pytest.raises(CalibrationError, match=said):
        balance_on_grey(image, box)
