"""Colour models learnt from samples of paint."""

import math

import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, capsule, disc
from shipped_markers import RHOT6

from rhot_node.detect.colour import learn_chroma, learn_chroma_from_pixels
from rhot_node.detect.fast import FastDetector
from rhot_node.errors import SettingsError
from rhot_node.markers import Marker, MarkerSet


@pytest.mark.parametrize("marker", RHOT6.markers, ids=RHOT6.ids)
def test_the_paint_is_learnt_from_a_box_that_holds_a_little_skin_too(marker: Marker) -> None:
    rng = np.random.default_rng(0)
    canvas = Canvas(120, 100).paint(capsule((20, 90), (60, 50), 10), SKIN, (40, 70), 60)
    image = canvas.paint(disc(60, 50, 11), marker.display_rgb, (60, 50), 14, 0.25).expose(rng)
    learnt = learn_chroma(image, [(50, 42, 70, 62)])
    away = math.remainder(learnt.hue_rad - marker.chroma.hue_rad, 2 * math.pi)
    assert abs(math.degrees(away)) < 2.0
    assert learnt.magnitude == pytest.approx(0.87 * marker.chroma.magnitude, rel=0.08)
    assert learnt.hue_tolerance_deg <= 12
    assert 8 <= learnt.magnitude_min < 0.7 * learnt.magnitude
    taught = MarkerSet(markers=(Marker(id="m", chroma=learnt, display_rgb=marker.display_rgb),))
    seen = FastDetector(taught).detect(image)[0]
    assert math.hypot(seen.x - 60, seen.y - 50) < 0.15


def test_noisier_paint_gets_a_wider_tolerance_within_bounds() -> None:
    rng = np.random.default_rng(1)
    canvas = Canvas(120, 100).paint(disc(60, 50, 20), (40, 165, 60), (60, 50), 23)
    narrow = learn_chroma(canvas.expose(rng, 2.0), [(46, 36, 74, 64)]).hue_tolerance_deg
    wide = learn_chroma(canvas.expose(rng, 25.0), [(46, 36, 74, 64)]).hue_tolerance_deg
    assert 8 <= narrow < wide <= 22


def test_grey_or_too_few_pixels_are_refused_in_words() -> None:
    image = Canvas(120, 100).expose()
    with pytest.raises(SettingsError, match="almost grey"):
        learn_chroma(image, [(10, 10, 40, 40)])
    with pytest.raises(SettingsError, match="Draw the box larger"):
        learn_chroma(image, [(10, 10, 14, 14), (500, 500, 600, 600)])


def test_pixels_may_be_given_as_a_mask() -> None:
    image = Canvas(120, 100).paint(disc(60, 50, 20), (225, 200, 30), (60, 50), 23).expose()
    mask = np.zeros((50, 60), dtype=np.bool_)
    mask[22:28, 27:33] = True
    learnt = learn_chroma_from_pixels(image, mask)
    assert learnt.cb == pytest.approx(-89.2, abs=1.5)
    assert learnt.cr == pytest.approx(26.3, abs=1.5)
