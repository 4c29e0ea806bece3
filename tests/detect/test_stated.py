"""What is stated of a marker is true: on round bodies shaded by a lamp, at rest and smeared by motion."""

from __future__ import annotations

import math

import cv2
import msgspec
import numpy as np
import pytest
from marker_rendering import SKIN, to_yuv
from shipped_markers import RHOT6

from rhot_node.detect import track as st
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerObservation

GREY = np.array([96.0, 104.0, 118.0])
LAMPS = {"above left": (-0.42, -0.62, 0.66), "right": (0.8, 0.1, 0.6), "in front": (0.0, -0.1, 1.0)}
FINE = 4
Array = np.ndarray


def fingertip(rgb: tuple[float, ...], x: float, y: float, lamp: tuple[float, float, float], radius: float,
              smear: float, rng: np.random.Generator) -> YuvImage:
    """A painted capsule on a finger below it, both under Lambert's law with 25 % shading; moved by `smear` px in x."""
    width, height = 120, 112
    px, py = np.meshgrid((np.arange(width * FINE) + 0.5) / FINE - 0.5, (np.arange(height * FINE) + 0.5) / FINE - 0.5)
    towards = np.array(lamp) / np.linalg.norm(lamp)
    picture = np.broadcast_to(GREY, (*px.shape, 3)).copy()
    for colour, top, bottom in ((SKIN, y + 4.0, y + 90.0), (rgb, y - 5.0, y + 5.0)):
        dx, dy = px - x, py - np.clip(py, top, bottom)
        across2 = (dx * dx + dy * dy) / radius**2
        inside = across2 <= 1.0
        facing = np.clip((dx * towards[0] + dy * towards[1]) / radius
                         + np.sqrt(np.clip(1.0 - across2, 0.0, None)) * towards[2], 0.0, None)
        picture[inside] = np.array(colour) * (0.75 + 0.25 * facing[inside])[:, None]
    if smear > 0.0:
        picture = cv2.blur(picture, (round(smear * FINE) | 1, 1))
    small = cv2.GaussianBlur(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), (0, 0), 0.7)
    return to_yuv(np.clip(small + rng.normal(0.0, 3.0, small.shape), 0.0, 255.0))


def seen_in(name: str, lamp: tuple[float, float, float], shape: str, smear: float = 0.0,
            radius: float = 8.0, frames: range = range(3, 7)) -> list[tuple[Array, MarkerObservation]]:
    """(error, observation) of frames, settled ones for a start, at several places."""
    marker = msgspec.structs.replace(RHOT6.markers[RHOT6.ids.index(name)], shape=shape)
    rng = np.random.default_rng(3)
    found = []
    for x, y in np.array([58.0, 40.0]) + rng.uniform(-1.0, 1.0, (2, 2)):
        detector = FastDetector(MarkerSet(markers=(marker,)))
        for number in range(frames.stop):
            seen = detector.detect(fingertip(marker.display_rgb, x, y, lamp, radius, smear, rng))[0]
            if number in frames:
                found.append((np.array([seen.x - x, seen.y - y]), seen))
    return found


def normalised(error: Array, seen: MarkerObservation) -> float:
    return float(error @ np.linalg.solve([[seen.cov_xx, seen.cov_xy], [seen.cov_xy, seen.cov_yy]], error))


@pytest.mark.parametrize("lamp", list(LAMPS))
@pytest.mark.parametrize("name", ["thumb", "ring"])
def test_the_covariance_of_a_round_fingertip_is_its_error(name: str, lamp: str) -> None:
    found = seen_in(name, LAMPS[lamp], "capsule")
    squared = [normalised(error, seen) for error, seen in found]
    assert 0.05 < np.median(squared) < 4.0
    assert np.percentile(squared, 95) < 9.0
    assert np.mean([math.sqrt(seen.cov_xx + seen.cov_yy) for _, seen in found]) < 0.15


def test_the_shade_of_a_limb_does_not_draw_a_round_marker() -> None:
    to_one_side = {shape: abs(np.mean([error[0] for error, _ in seen_in("thumb", LAMPS["right"], shape)]))
                   for shape in ("capsule", "disc")}
    assert to_one_side["capsule"] < 0.04 < 0.07 < to_one_side["disc"]


def test_a_smeared_edge_widens_the_covariance() -> None:
    still, smeared = (seen_in("thumb", LAMPS["right"], "capsule", smear, 16.0, range(1)) for smear in (0.0, 9.0))
    assert smeared[0][1].cov_xx > 2.0 * still[0][1].cov_xx
    assert np.median([normalised(error, seen) for error, seen in smeared]) < 9.0


@pytest.mark.parametrize("sigma", [0.5, 1.0])
def test_the_width_of_an_edge_is_read_from_the_coverage(sigma: float) -> None:
    x, y = np.meshgrid(np.arange(60.0), np.arange(60.0))
    away = (np.hypot(x - 30.2, y - 29.7) - 12.0) / (sigma * math.sqrt(2.0))
    cover = np.array([0.5 * math.erfc(d) for d in away.ravel()])
    area = float(cover.sum())
    moment = area / (4.0 * math.pi)
    width = st.edge_width(float((cover * (1.0 - cover)).sum()) / area, area, moment, moment)
    assert width == pytest.approx(sigma, rel=0.06)


def test_a_smeared_marker_may_change_its_area_more() -> None:
    assert st.hidden_bias(0.92, 10.0, 60.0, st.SHARP) == pytest.approx(0.4)
    assert st.hidden_bias(0.92, 10.0, 60.0, st.SHARP + 0.2) == 0.0
    assert st.hidden_bias(1.0 / 0.7, 10.0, 60.0, st.SHARP) == pytest.approx(1.5)
