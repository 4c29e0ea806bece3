"""Lamps that are not the one of the calibration: read from the markers, and no marker lost for it."""

from __future__ import annotations

import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, capsule, disc, to_yuv
from shipped_markers import RHOT6

from rhot_node.detect.fast import FastDetector
from rhot_node.detect.illuminant import (
    HUE_SIGMA_DEG,
    Illuminant,
    balance_matrix,
    fit_temperature_shift,
    gains_of,
    paint_rgb,
)
from rhot_node.detect.image import YuvImage
from rhot_node.markers import MarkerSet

PLACES = {name: (40.0 + 47 * k, 60.0 + 31 * (k % 3)) for k, name in enumerate(RHOT6.ids)}

# Encoded gains of red, green and blue: Planck's law through sRGB with its gamma, from 4100 K, luma of grey kept.
BULB = (1.245, 0.938, 0.721)  # 3000 K
SKY = (0.884, 1.023, 1.156)  # 6500 K


def lit(gains: tuple[float, float, float], names: tuple[str, ...] = RHOT6.ids, seed: int = 1) -> YuvImage:
    """The markers on skin before grey, in another light; noise comes after the light."""
    canvas = Canvas(320, 240, (100, 100, 100)).paint(capsule((30, 200), (290, 180), 25), SKIN, (160, 190), 160, 0.3)
    for name in names:
        marker, (x, y) = RHOT6.markers[RHOT6.ids.index(name)], PLACES[name]
        canvas.paint(disc(x, y, 9), tuple(0.85 * c for c in marker.display_rgb), (x, y), 12, 0.25)
    canvas.rgb *= gains
    return canvas.expose(np.random.default_rng(seed))


def found_at_their_places(seen: tuple, names: tuple[str, ...] = RHOT6.ids) -> bool:
    marks = {RHOT6.ids[mark.index]: mark for mark in seen}
    return all(marks[name].found and np.hypot(marks[name].x - PLACES[name][0], marks[name].y - PLACES[name][1]) < 0.3
               for name in names)


@pytest.mark.parametrize("lamp", [BULB, SKY])
@pytest.mark.parametrize("brightness", [0.8, 1.0])
def test_no_marker_is_lost_in_a_single_picture_by_another_lamp(lamp: tuple[float, float, float],
                                                               brightness: float) -> None:
    detector = FastDetector(RHOT6)
    red, green, blue = lamp
    seen = detector.detect(lit((brightness * red, brightness * green, brightness * blue)))
    assert found_at_their_places(seen)
    expected = np.log(red / blue) / 1.55
    assert detector.temperature_shift == pytest.approx(expected, abs=0.06)


def test_a_lamp_that_changes_slowly_is_followed_even_by_one_marker_in_view() -> None:
    detector = FastDetector(RHOT6)
    for step in range(60):
        temperature_shift = 0.004 * step
        seen = detector.detect(lit(tuple(gains_of(temperature_shift)), ("thumb",), seed=step))
        assert found_at_their_places(seen, ("thumb",)), step
    assert detector.temperature_shift == pytest.approx(0.24, abs=0.1)


def test_a_lamp_that_is_switched_costs_no_frame() -> None:
    detector = FastDetector(RHOT6)
    for number, lamp in enumerate([SKY, SKY, SKY, BULB, BULB, SKY, BULB]):
        assert found_at_their_places(detector.detect(lit(lamp, seed=number))), number


def test_the_light_of_the_calibration_leaves_the_picture_as_it_is() -> None:
    light, image = Illuminant(RHOT6), lit((1.0, 1.0, 1.0))
    assert light.balanced(image) is image
    detector = FastDetector(RHOT6)
    for seed in range(5):
        detector.detect(lit((1.0, 1.0, 1.0), seed=seed))
    assert abs(detector.temperature_shift) < 0.05


def test_two_markers_in_a_picture_make_nobody_believe_in_another_light() -> None:
    pair = MarkerSet(markers=RHOT6.markers[:2])
    detector = FastDetector(pair)
    detector.detect(lit(BULB, ("ring", "wrist")))  # neither is in the set
    assert detector.temperature_shift == 0.0


def test_reset_forgets_the_light() -> None:
    detector = FastDetector(RHOT6)
    detector.detect(lit(BULB))
    detector.reset()
    assert detector.temperature_shift == 0.0


def test_a_balanced_picture_shows_the_colours_of_the_calibration() -> None:
    rng = np.random.default_rng(3)
    colours = rng.uniform(30, 170, (12, 16, 3))
    plain = to_yuv(np.kron(colours, np.ones((2, 2, 1))))
    light = Illuminant(RHOT6)
    light.temperature_shift = 0.4
    other = to_yuv(np.asarray(np.kron(colours * gains_of(0.4), np.ones((2, 2, 1)))))
    balanced = light.balanced(other)
    assert np.abs(balanced.u.astype(int) - plain.u).max() <= 2
    assert np.abs(balanced.v.astype(int) - plain.v).max() <= 2
    assert balanced.y is other.y
    grey = np.full(3, 90.0) * gains_of(0.4)
    assert grey @ (0.299, 0.587, 0.114) == pytest.approx(90.0)
    np.testing.assert_allclose(balance_matrix(0.0), [[0, 1, 0], [0, 0, 1]], atol=1e-5)


def test_the_warmth_is_where_the_hues_agree_and_one_wrong_marker_does_no_harm() -> None:
    grid = np.linspace(-1.0, 1.0, 41)
    predicted = np.array([10.0 + 80.0 * grid, 170.0 + 50.0 * grid, -60.0 - 50.0 * grid])
    hues = np.array([10.0 + 80.0 * 0.33, 170.0 + 50.0 * 0.33 - 360.0, 100.0])
    temperature_shift, information = fit_temperature_shift(hues, predicted, grid)
    assert temperature_shift == pytest.approx(0.33, abs=0.02)
    assert information == pytest.approx((80**2 + 50**2) / HUE_SIGMA_DEG**2, rel=0.01)


def test_a_colour_that_no_lamp_changes_tells_nothing_of_the_lamp() -> None:
    grid = np.linspace(-1.0, 1.0, 41)
    temperature_shift, information = fit_temperature_shift(np.array([3.0]), np.zeros((1, 41)), grid)
    assert (temperature_shift, information) == (pytest.approx(0.0, abs=1e-9), 0.0)
    light = Illuminant(RHOT6)
    light.temperature_shift = 0.3
    little = RHOT6.markers[RHOT6.ids.index("little")].chroma
    assert light.read([RHOT6.ids.index("little")], np.array([[80.0, little.cb, little.cr]])) < 0.1


def test_the_paints_colour_is_told_as_the_camera_showed_it() -> None:
    detector = FastDetector(RHOT6)
    image = lit(BULB)
    detector.detect(image)
    for (x, y), colour in zip(PLACES.values(), detector.paint_colours(), strict=True):
        row, column = round((y - 0.5) / 2), round((x - 0.5) / 2)
        around = np.s_[row - 2:row + 3, column - 2:column + 3]
        luma = image.y[2 * row - 4:2 * row + 6, 2 * column - 4:2 * column + 6].mean()
        shown = (luma, image.u[around].mean() - 128.0, image.v[around].mean() - 128.0)
        np.testing.assert_allclose(colour, shown, atol=6.0)


def test_the_paints_brightness_follows_from_its_chroma() -> None:
    for marker in RHOT6.markers:
        np.testing.assert_allclose(paint_rgb(marker), marker.display_rgb, atol=1.5)
