"""A marker that another one hides by and by: its covariance grows as its centroid moves, in that direction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, disc
from shipped_markers import RHOT6

from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.detect.occlusion import moved_centroid, widen_touching
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerObservation

RADIUS, PLACE, TURN = 9.0, np.array([60.3, 50.7]), 0.5
WAY = np.array([math.cos(TURN), math.sin(TURN)])
SIZE = (128, 104)


def fingers(apart: float, front: str, back: str) -> YuvImage:
    """Two tips before skin: `back` at PLACE, `front` drawn over it, `apart` px away."""
    return tips(Canvas(*SIZE, SKIN), apart, front, back)


def tips(canvas: Canvas, apart: float, front: str, back: str) -> YuvImage:
    for name, place in ((back, PLACE), (front, PLACE + apart * WAY)):
        colour = RHOT6.markers[RHOT6.ids.index(name)].display_rgb
        canvas.paint(disc(*place, RADIUS), colour, tuple(place), RADIUS + 3.0, 0.25)
    return canvas.expose(np.random.default_rng(round(100.0 * apart)), 3.0)


def approaching(front: str, back: str, nearest: float) -> tuple[MarkerObservation, MarkerObservation]:
    """Both tips, the one behind first, after the other one came by a fifth of a px each picture."""
    pair = [RHOT6.markers[RHOT6.ids.index(name)] for name in (back, front)]
    detector = FastDetector(MarkerSet(markers=tuple(pair)))
    for apart in np.arange(24.0, nearest - 0.1, -0.2):
        seen = detector.detect(fingers(float(apart), front, back))
    return seen[0], seen[1]


@pytest.mark.parametrize(("front", "back"), [("ring", "little"), ("middle", "ring"), ("thumb", "index")])
def test_the_covariance_of_a_slowly_hidden_marker_holds_its_error(front: str, back: str) -> None:
    for nearest in (15.5, 14.0):
        hidden, _ = approaching(front, back, nearest)
        error = np.array([hidden.x, hidden.y]) - PLACE
        covariance = np.array([[hidden.cov_xx, hidden.cov_xy], [hidden.cov_xy, hidden.cov_yy]])
        moved = float(error @ WAY)
        assert moved < -0.2, "away from what hides it"
        assert error @ np.linalg.solve(covariance, error) < 9.0, (nearest, error, covariance)
        across = np.array([-WAY[1], WAY[0]])
        assert WAY @ covariance @ WAY > 4.0 * across @ covariance @ across, "not as uncertain across"
        assert math.sqrt(WAY @ covariance @ WAY) < 3.0 * abs(moved)


def test_markers_that_do_not_touch_keep_their_covariances() -> None:
    """Neither with skin between them, nor with a dark gap; side by side they touch."""
    dark = Canvas(*SIZE, (10.0, 10.0, 10.0))
    for picture, touching in ((fingers(22.5, "ring", "little"), False), (tips(dark, 21.5, "ring", "little"), False),
                              (fingers(18.0, "ring", "little"), True)):
        detector = FastDetector(MarkerSet(markers=tuple(RHOT6.markers[RHOT6.ids.index(name)]
                                                        for name in ("little", "ring"))))
        seen = detector.detect(picture)
        assert all(mark.found for mark in seen)
        assert (widen_touching(picture, seen, detector.paint_colours()) is not seen) == touching


def test_the_moved_centroid_is_that_of_a_disc_without_its_lens() -> None:
    x, y = np.meshgrid(np.arange(-12.0, 12.0, 0.02), np.arange(-12.0, 12.0, 0.02))
    for depth in (0.5, 1.0, 2.0, 3.0):
        visible = (x * x + y * y < 81.0) & ((x - 18.0 + depth) ** 2 + y * y > 81.0)
        moved = -x[visible].mean()
        radius = math.sqrt(np.count_nonzero(visible) * 0.02**2 / math.pi)
        assert moved_centroid(radius, 9.0, 9.0 - depth + moved) == pytest.approx(moved, rel=0.15, abs=0.01)
    assert moved_centroid(9.0, 9.0, 9.5) == 0.0
