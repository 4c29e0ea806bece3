"""The quick lane: precise, cheap, and left as soon as something is not as plain as it was."""

from __future__ import annotations

import math
import tracemalloc

import msgspec
import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, Rgb, capsule, disc
from shipped_markers import RHOT6

from rhot_node.detect import outline_pixels
from rhot_node.detect.fast import GLANCE, FastDetector
from rhot_node.detect.illuminant import Illuminant, gains_of
from rhot_node.detect.image import YuvImage
from rhot_node.detect.outline_pixels import COSINES, HALF_COSINES, HALF_SINES, NODES, SINES
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag

TIPS = MarkerSet(markers=RHOT6.markers[:5])
PLACES = [(40.0 + 55.0 * k, 60.0 + 20.0 * (k % 2)) for k in range(5)]
GREY: Rgb = (120, 122, 118)


def tips(shift: tuple[float, float] = (0.0, 0.0)) -> Canvas:
    canvas = Canvas(320, 160)
    for marker, (x, y) in zip(TIPS.markers, PLACES, strict=True):
        canvas.paint(disc(x + shift[0], y + shift[1], 9), marker.display_rgb, (x, y), 13, 0.25)
    return canvas


def single(name: str, x: float, y: float, edge: bool = False) -> tuple[FastDetector, Canvas]:
    """A disc of 20 px on grey, or across the edge of skin and desk."""
    marker = msgspec.structs.replace(RHOT6.markers[RHOT6.ids.index(name)], shape="disc")
    canvas = Canvas(112, 96, (142, 104, 70) if edge else GREY)
    if edge:
        canvas.paint(lambda px, py: px + 0.0 * py < 50.0, SKIN, (0, 48), 120)
    return (FastDetector(MarkerSet(markers=(marker,))),
            canvas.paint(disc(x, y, 10), marker.display_rgb, (50, 44), 13, 0.25))


def test_an_edge_is_as_wide_as_the_lens_and_the_mean_of_four_pixels_make_it() -> None:
    places, shares = [], []
    for shift in np.arange(128) / 64.0:
        edge = 60.0 + float(shift)  # luma px; a chroma pixel's centre is at 2 x + 0.5
        canvas = Canvas(120, 16, (0, 0, 0)).paint(capsule((-900, 8), (edge - 400, 8), 400), (1, 1, 1), (60, 8), 90)
        shares.append(canvas.seen()[8, :, 0].reshape(60, 2).mean(axis=1))
        places.append(np.arange(60) - 0.5 * (edge - 0.5))
    away, share = np.concatenate(places), np.concatenate(shares)
    near = np.abs(away) < 2.0
    variance = 2.0 / 128.0 * (away * (share - (away < 0.0)))[near].sum()
    assert variance == pytest.approx(outline_pixels.BLUR_VARIANCE, abs=0.003)


@pytest.mark.parametrize("name", ["thumb", "index", "ring"])
def test_a_disc_is_placed_at_the_limit_of_its_noise(name: str) -> None:
    rng = np.random.default_rng(7)
    errors = []
    for x, y in np.array((50, 44)) + rng.uniform(-1, 1, (5, 2)):
        detector, canvas = single(name, x, y)
        seen = [detector.detect(canvas.expose(rng, 4.0))[0] for _ in range(36)][12:]
        errors.append([(mark.x - x, mark.y - y) for mark in seen])
    spread = np.array(errors)
    assert np.sqrt(spread.var(axis=1, ddof=1).mean()) < 0.016
    assert np.sqrt((spread.mean(axis=1) ** 2).mean()) < 0.013  # 0.01 over many places (benchmarks/centroid.py)


@pytest.mark.parametrize("name", ["thumb", "ring"])
def test_an_edge_behind_the_marker_does_not_draw_it(name: str) -> None:
    rng = np.random.default_rng(3)
    for x, y in np.array((50, 44)) + rng.uniform(-1, 1, (3, 2)):
        detector, canvas = single(name, x, y, edge=True)
        seen = [detector.detect(canvas.expose(rng, 4.0))[0] for _ in range(30)][12:]
        assert math.hypot(np.mean([mark.x for mark in seen]) - x, np.mean([mark.y for mark in seen]) - y) < 0.04


def test_a_frame_in_plain_view_allocates_no_arrays() -> None:
    rng = np.random.default_rng(5)
    images = [tips().expose(rng) for _ in range(4)]
    detector = FastDetector(TIPS)
    for k in range(12):
        detector.detect(images[k % 4])
    peaks = []
    tracemalloc.start()
    try:
        for k in range(3 * GLANCE):
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            detector.detect(images[k % 4])
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
    finally:
        tracemalloc.stop()
    assert np.median(peaks) < 4096  # the observations themselves
    assert sorted(peaks)[-4] < 4096  # all but the glances


def test_another_light_costs_a_followed_frame_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(6)
    canvas = tips()
    canvas.rgb *= gains_of(0.4)
    detector = FastDetector(TIPS)
    for _ in range(6):
        detector.detect(canvas.expose(rng))
    assert detector.temperature_shift == pytest.approx(0.4, abs=0.06)
    rows: list[float] = []
    balanced = Illuminant.balanced

    def watched(light: Illuminant, image: YuvImage, step: int = 1, first: int = 0) -> YuvImage:
        rows.append(len(image.u[first::step]) / len(image.u))
        return balanced(light, image, step, first)

    monkeypatch.setattr(Illuminant, "balanced", watched)
    for _ in range(4 * GLANCE):
        assert all(mark.found for mark in detector.detect(canvas.expose(rng)))
    assert sum(rows) < 0.02 * 4 * GLANCE  # of every picture, by the rows that are searched at a glance


def test_what_is_hidden_in_part_leaves_the_lane_and_comes_back() -> None:
    rng = np.random.default_rng(8)
    detector, canvas = single("ring", 50.0, 44.0)
    for _ in range(8):
        assert not detector.detect(canvas.expose(rng))[0].flags & MarkerFlag.PARTIAL
    half = single("ring", 50.0, 44.0)[1].paint(lambda px, py: px + 0.0 * py > 52.0, SKIN, (112, 48), 61)
    seen = detector.detect(half.expose(rng))[0]
    assert seen.flags & MarkerFlag.PARTIAL
    for _ in range(4):
        seen = detector.detect(canvas.expose(rng))[0]
    assert not seen.flags
    assert math.hypot(seen.x - 50.0, seen.y - 44.0) < 0.06


def test_the_angle_of_a_pixel_is_right_all_round() -> None:
    angles = np.linspace(0.0, 2.0 * math.pi, 721, endpoint=False)
    turns = [outline_pixels._turn(3.7 * math.cos(angle), 3.7 * math.sin(angle)) for angle in angles]
    np.testing.assert_allclose(turns, angles * NODES / (2.0 * math.pi), atol=1e-3)
    assert max(turns) < NODES
    half = np.exp(1j * math.pi / NODES) * (COSINES + 1j * SINES)
    np.testing.assert_allclose(half, HALF_COSINES + 1j * HALF_SINES, atol=1e-12)
