"""A thing of a marker's colour is not the marker when it lies far from the rest of the hand."""

from __future__ import annotations

import numpy as np
import pytest
from marker_rendering import Canvas, disc

from rhot_node.detect.fast import FastDetector
from rhot_node.detect.whereabouts import FAR, middle_of
from rhot_node.files import resource_path
from rhot_node.markers import Marker, MarkerSet, load_markers

RHOT6 = load_markers(resource_path("markers", "rhot6.json"))
PLACES = {"thumb": (90.0, 150.0), "index": (120.0, 100.0), "middle": (155.0, 90.0), "ring": (188.0, 98.0),
          "little": (218.0, 116.0), "wrist": (160.0, 230.0)}


def hand_before_things(book: str, radius: float, place: tuple[float, float]) -> Canvas:
    canvas = Canvas(640, 480, (90, 92, 95))
    for marker in RHOT6.markers:
        canvas.paint(disc(*PLACES[marker.id], 9), marker.display_rgb, PLACES[marker.id], 12, 0.25)
        if marker.id == book:
            canvas.paint(disc(*place, radius), marker.display_rgb, place, radius + 3)
    return canvas


@pytest.mark.parametrize("name", RHOT6.ids)
def test_a_large_thing_across_the_room_is_not_taken_for_a_worn_marker(name: str) -> None:
    image = hand_before_things(name, 28, (560.0, 400.0)).expose(np.random.default_rng(1))
    for marker, seen in zip(RHOT6.markers, FastDetector(RHOT6).detect(image), strict=True):
        assert np.hypot(seen.x - PLACES[marker.id][0], seen.y - PLACES[marker.id][1]) < 0.3, marker.id


def test_a_marker_that_was_sought_elsewhere_while_the_hand_was_away_comes_back_with_it() -> None:
    detector = FastDetector(RHOT6)
    alone = Canvas(640, 480, (90, 92, 95)).paint(disc(560, 400, 28), RHOT6.markers[3].display_rgb, (560, 400), 31)
    for _ in range(3):
        assert detector.detect(alone.expose())[3].found
    for seed in range(3):
        seen = detector.detect(hand_before_things("ring", 28, (560.0, 400.0)).expose(np.random.default_rng(seed)))
    assert np.hypot(seen[3].x - PLACES["ring"][0], seen[3].y - PLACES["ring"][1]) < 0.3


def test_markers_that_no_hand_wears_may_be_anywhere() -> None:
    free = MarkerSet(markers=tuple(Marker(id=m.id, chroma=m.chroma, display_rgb=m.display_rgb) for m in RHOT6.markers))
    image = hand_before_things("ring", 28, (560.0, 400.0)).expose()
    ring = FastDetector(free).detect(image)[3]
    assert np.hypot(ring.x - 560, ring.y - 400) < 0.5


def test_the_middle_and_the_size_bear_a_few_wrong_markers() -> None:
    markers = [
        (100.0, 100.0, 50.0), (110.0, 100.0, 49.0), (105.0, 95.0, 64.0), (104.0, 108.0, 50.0), (900.0, 20.0, 4e3)]
    hand = middle_of(markers)
    assert hand is not None
    assert (hand.x, hand.y) == (105.0, 100.0)
    assert hand.side == pytest.approx(7.07, abs=0.01)
    near, far = hand.nearness(np.array([105.0, 900.0]), np.array([110.0, 20.0]))
    assert near > 0.9 and far == FAR
    assert hand.beyond(900.0, 20.0) and not hand.beyond(105.0, 160.0)
    assert middle_of(markers[:2]) is None
