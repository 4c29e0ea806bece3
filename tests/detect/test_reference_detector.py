"""The thesis's detector: threshold, clean, largest contour, box centre, ROI."""

import math

import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, capsule, disc
from shipped_markers import RHOT6

from rhot_node.detect import reference as r
from rhot_node.markers import Marker, MarkerSet, RangeModel
from rhot_node.wire.messages import MarkerFlag


def scene(x: float, y: float, radius: float = 10.0, name: str = "ring") -> Canvas:
    rgb = RHOT6.markers[RHOT6.ids.index(name)].display_rgb
    return Canvas(320, 240).paint(disc(x, y, radius), rgb, (x, y), radius + 3, 0.2)


@pytest.mark.parametrize("name", RHOT6.ids)
def test_each_shipped_colour_is_found_by_its_derived_range(name: str) -> None:
    seen = r.ReferenceDetector(RHOT6).detect(scene(150.3, 100.7, name=name).expose())
    for marker, observation in zip(RHOT6.markers, seen, strict=True):
        assert observation.flags & MarkerFlag.REFERENCE
        assert observation.found == (marker.id == name)
    own = seen[RHOT6.ids.index(name)]
    assert math.hypot(own.x - 150.3, own.y - 100.7) < 1.2
    assert own.diameter == pytest.approx(20, abs=3.5)


def test_skin_is_not_taken_for_the_red_wrist() -> None:
    image = Canvas(320, 240).paint(capsule((100, 120), (220, 120), 40), SKIN, (160, 120), 110, 0.3).expose()
    assert not any(seen.found for seen in r.ReferenceDetector(RHOT6).detect(image))


def test_the_largest_contour_wins_and_the_roi_keeps_the_rest_out() -> None:
    detector = r.ReferenceDetector(RHOT6)
    ring = RHOT6.ids.index("ring")
    small = scene(60, 60)
    assert detector.detect(small.expose())[ring].flags & MarkerFlag.ACQUIRED
    far = scene(60, 60).paint(disc(250, 180, 25), RHOT6.markers[ring].display_rgb, (250, 180), 28)
    tracked = detector.detect(far.expose())[ring]
    assert tracked.x == pytest.approx(60, abs=1)
    assert not tracked.flags & MarkerFlag.ACQUIRED
    detector.reset()
    assert detector.detect(far.expose())[ring].x == pytest.approx(250, abs=1)
    assert [round(blob.x, -1) for blob in detector.all_blobs(far.expose())[ring]] == [250, 60]


def test_lost_then_searched_as_a_whole() -> None:
    detector = r.ReferenceDetector(RHOT6)
    ring = RHOT6.ids.index("ring")
    detector.detect(scene(40, 40).expose())
    assert not detector.detect(scene(280, 200).expose())[ring].found  # outside the ROI: the frame is dropped
    assert detector.detect(scene(280, 200).expose())[ring].x == pytest.approx(280, abs=1)


def test_the_border_is_flagged() -> None:
    ring = RHOT6.ids.index("ring")
    assert r.ReferenceDetector(RHOT6).detect(scene(4, 100).expose())[ring].flags & MarkerFlag.EDGE


def test_a_hue_range_may_wrap_across_red() -> None:
    model = RangeModel(space="hsv", lower=(170, 100, 50), upper=(8, 255, 255))
    bgr = np.array([[[20, 20, 220], [60, 20, 220], [20, 220, 220], [220, 20, 20]]], dtype=np.uint8)
    assert (r.threshold(bgr, model) > 0).tolist() == [[True, True, False, False]]


def test_an_rgb_range_is_read_as_rgb() -> None:
    model = RangeModel(space="rgb", lower=(150, 0, 0), upper=(255, 90, 90))
    bgr = np.array([[[20, 20, 220], [220, 20, 20]]], dtype=np.uint8)
    assert (r.threshold(bgr, model) > 0).tolist() == [[True, False]]
    marker = Marker(id="a", chroma=RHOT6.markers[5].chroma, display_rgb=(220, 20, 20), range=model)
    assert r.range_of(marker) is model


def test_single_noisy_pixels_are_cleaned_away() -> None:
    mask = np.zeros((60, 60), dtype=np.uint8)
    mask[::7, ::9] = 255
    mask[20:40, 20:40] = 255
    mask[28, 30] = 0
    cleaned = r.clean_mask(mask)
    assert (cleaned[23:37, 23:37] == 255).all()
    assert cleaned[:15].max() == 0


def test_quality_and_markers_keep_the_order_of_the_set() -> None:
    swapped = MarkerSet(markers=RHOT6.markers[::-1])
    seen = r.ReferenceDetector(swapped).detect(scene(100, 100).expose())
    assert [observation.index for observation in seen] == list(range(6))
    assert seen[swapped.ids.index("ring")].found
