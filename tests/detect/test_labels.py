"""Colour tables: which chroma belongs to which marker."""

import math

import numpy as np
import pytest
from marker_rendering import to_yuv
from shipped_markers import RHOT6

from rhot_node.detect.colour import acquisition_table, sector_table
from rhot_node.markers import ChromaModel, Marker, MarkerSet


def label_of(table: np.ndarray, rgb: tuple[float, float, float]) -> int:
    image = to_yuv(np.full((2, 2, 3), rgb, dtype=np.float64))
    return int(table[image.u[0, 0], image.v[0, 0]])


@pytest.mark.parametrize("light", [0.6, 0.75, 1.0, 1.15])
def test_shipped_colours_keep_their_label_in_shade_and_light(light: float) -> None:
    table = acquisition_table(RHOT6)
    for index, marker in enumerate(RHOT6.markers):
        red, green, blue = (min(255.0, light * channel) for channel in marker.display_rgb)
        assert label_of(table, (red, green, blue)) == index + 1, marker.id


@pytest.mark.parametrize("rgb", [
    (205, 160, 135), (240, 195, 170), (220, 150, 130), (210, 130, 110), (160, 115, 90), (110, 75, 55), (60, 40, 30),
    (180, 140, 95), (140, 100, 60), (190, 160, 120), (90, 55, 30), (200, 140, 80),  # wood
    (128, 128, 128), (250, 250, 245), (10, 10, 12),
])
@pytest.mark.parametrize("light", [0.5, 1.0, 1.2])
def test_skin_wood_and_grey_are_nobodys(rgb: tuple[int, int, int], light: float) -> None:
    red, green, blue = (min(255.0, light * channel) for channel in rgb)
    assert label_of(acquisition_table(RHOT6), (red, green, blue)) == 0


def test_the_nearest_hue_wins_where_sectors_overlap() -> None:
    def marker(name: str, hue_deg: float, tolerance: float) -> Marker:
        hue = math.radians(hue_deg)
        return Marker(id=name, display_rgb=(0, 0, 0), chroma=ChromaModel(
            cb=60 * math.cos(hue), cr=60 * math.sin(hue), hue_tolerance_deg=tolerance))

    table = sector_table(MarkerSet(markers=(marker("wide", 170, 30), marker("near", -170, 12))))
    for hue_deg, expected in ((150, 1), (178, 1), (-178, 2), (-165, 2), (-159, 2), (-157, 0), (120, 0)):
        hue = math.radians(hue_deg)
        found = table[round(128 + 80 * math.cos(hue)), round(128 + 80 * math.sin(hue))]
        assert found == expected, hue_deg


def test_acquisition_asks_for_magnitude_and_tracking_does_not() -> None:
    chroma = RHOT6.markers[0].chroma
    weak = 0.8 * chroma.magnitude_min / chroma.magnitude
    u, v = round(128 + weak * chroma.cb), round(128 + weak * chroma.cr)
    assert acquisition_table(RHOT6)[u, v] == 0
    assert sector_table(RHOT6)[u, v] == 1
