"""The lamps that a colour model must bear, colours as a camera would show them by these, and drift of the illuminant.

A lamp is a temperature shift (`rhot_node.detect.illuminant`) and a brightness. Pictures are taken to have a gamma of
2.2: a factor on the light is its 2.2th root on a grey level. Nobody knows by which lamp the colours were learnt, so
every lamp of the range may become any other.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_node.detect.colour import Colours
from rhot_node.detect.fast import DOUBTFUL, FastDetector
from rhot_node.detect.illuminant import RGB_FROM_YCC, YCC_FROM_RGB, balance_matrix, gains_of, paint_rgb
from rhot_node.detect.image import Plane, YuvImage
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerObservation

Array = NDArray[np.float64]

GAMMA = 2.2
WARMTH_PER_MIRED = 0.54 / 179.5
"""From 6500 K (154 mired) to 3000 K (333 mired); along Planck's curve warmth is close to linear in mired."""

LEARNT_KELVIN = 4300.0
"""Taken for the lamp of a calibration where a temperature must be named: the middle of 3000 to 6500 K, in mired."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp compared with the one of the calibration: `temperature_shift`, 0 for the same, and factor on the light."""

    temperature_shift: float = 0.0
    brightness: float = 1.0

    @property
    def gains(self) -> NDArray[np.float64]:
        """(3,) factors on the grey levels of red, green and blue."""
        return np.asarray(self.brightness ** (1.0 / GAMMA) * gains_of(self.temperature_shift))


SAME = Lamp()
WARMTH_SPAN, WARMTH_STEP = 0.54, 0.27
LAMPS = tuple(Lamp(WARMTH_STEP * step, brightness) for step in (-2, -1, 0, 1, 2) for brightness in (0.8, 1.0, 1.2))
"""±20 % of light, and every change between 3000 and 6500 K."""


def chances(lamps: Sequence[Lamp]) -> NDArray[np.float64]:
    """(N,) how often each of the lamps comes, 1 in all, when any two of 3000 to 6500 K meet.

    The lamp of the calibration and the one of tomorrow are both even over the range in mired, so their difference is
    triangular: the whole range is between them only if one is its one end and the other its other. `lamps` are
    WARMTH_STEP apart; those of one warmth share.
    """
    warmths = np.array([lamp.temperature_shift for lamp in lamps])
    edges = np.clip(np.abs(warmths)[:, None] + (-0.5 * WARMTH_STEP, 0.5 * WARMTH_STEP), -WARMTH_SPAN, WARMTH_SPAN)
    within = np.sign(edges) * (1.0 - (1.0 - np.abs(edges) / WARMTH_SPAN) ** 2)
    shared = np.array([np.count_nonzero(np.isclose(warmths, temperature_shift)) for temperature_shift in warmths])
    share = (within[:, 1] - within[:, 0]) / shared
    return np.asarray(share / share.sum())


def kelvin_of(temperature_shift: float) -> float:
    """About the colour temperature of a lamp of this warmth, K, when the calibration's lamp had LEARNT_KELVIN."""
    return 1e6 / max(1e6 / LEARNT_KELVIN + temperature_shift / WARMTH_PER_MIRED, 40.0)


def relit(colours: Colours, lamp: Lamp) -> Colours:
    """(N, 3) Y, Cb, Cr by another lamp; channels clip at 0 and 255, bytes are rounded."""
    to_rgb = (RGB_FROM_YCC.T * lamp.gains).astype(np.float32)
    rgb = np.clip(colours.astype(np.float32) @ to_rgb, 0.0, 255.0)
    return np.rint(rgb @ YCC_FROM_RGB.T.astype(np.float32))


def balanced(colours: Colours, temperature_shift: float) -> Colours:
    """(N, 3) Y, Cb, Cr as the detector corrects them when it takes the light to have this warmth."""
    chroma = np.clip(np.rint(colours @ balance_matrix(temperature_shift).T.astype(np.float32)), -128.0, 127.0)
    return np.column_stack([colours[:, 0], chroma])


def relit_image(image: YuvImage, lamp: Lamp) -> YuvImage:
    """The picture by another lamp. Luma keeps the contrast that it has inside every chroma pixel."""
    height, width = image.u.shape
    mean = cv2.resize(image.y, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
    colours = cv2.merge([mean, image.u - np.float32(128.0), image.v - np.float32(128.0)])
    rgb = cv2.transform(colours, lamp.gains[:, None] * RGB_FROM_YCC)
    lit = cv2.transform(np.clip(rgb, 0.0, 255.0, out=rgb), YCC_FROM_RGB)
    factor = cv2.resize(lit[:, :, 0] / np.maximum(mean, 1.0), image.size, interpolation=cv2.INTER_NEAREST)
    luma = cv2.multiply(image.y, factor, dtype=cv2.CV_8U)
    return YuvImage(_bytes(luma), _bytes(lit[:, :, 1] + 128.0), _bytes(lit[:, :, 2] + 128.0))


def _bytes(plane: NDArray[Any]) -> Plane:
    return np.clip(np.rint(plane), 0.0, 255.0).astype(np.uint8)


# -- drift of the illuminant -------------------------------------------------------------------------------------------
# From the markers' own colours, before a marker is lost.

OBSERVATIONS_KEPT = 20  # of every marker, of which the median counts
OBSERVATIONS_LEAST = 3
WARMTH_FAIR, WARMTH_POOR = 0.2, 0.6
"""A change of lamp that is worth a sentence, and one that is more than between 3000 and 6500 K."""
LIGHT_FAIR, LIGHT_POOR = 0.4, 0.65
"""Relative loss of light that is worth a sentence, and one that soon loses markers. A paint that turns from the lamp
gets 40 % less: that is no drift."""
MARGIN_FAIR, MARGIN_POOR = 0.35, 0.1  # of the hue tolerance, or of the way to the least chroma, that is left
BURNT_LUMA = 240.0


@dataclass(frozen=True, slots=True)
class MarkerDrift:
    """One marker now. `hue_deg`: how far its hue is from the learnt one, the light's share taken off, degrees.

    `margin`: 0..1, what is left of the hue tolerance or of the chroma above the least, whichever is less. `light`:
    factor on its light. `luma`: grey levels. `observations`: how many pictures that rests on.
    """

    marker: str
    hue_deg: float
    margin: float
    light: float
    luma: float
    observations: int


@dataclass(frozen=True, slots=True)
class DriftResult:
    """`temperature_shift`: how much warmer the light is (`rhot_node.detect.illuminant`), `light`: factor on it, median
    of the markers.

    `markers`: those that have been seen often enough; none before that, and the verdict then says so.
    """

    temperature_shift: float
    light: float
    markers: tuple[MarkerDrift, ...]
    verdict: Verdict

    @property
    def kelvin(self) -> float:
        """About the colour temperature of the light now, if it was 4300 K at the calibration."""
        return kelvin_of(self.temperature_shift)


class IlluminantDrift:
    """Watches the markers' paint in live pictures of one camera.

    The learnt colours are the marker set's: `rhot calibrate colours` writes the paint's median colour there.
    """

    def __init__(self, markers: MarkerSet, detector: FastDetector | None = None) -> None:
        """`detector`: one that has seen the pictures already; without it the pictures are searched here."""
        self._markers = markers
        self._detector = detector or FastDetector(markers)
        self._own = detector is None
        self._learnt = np.array([paint_rgb(marker) for marker in markers.markers]) @ YCC_FROM_RGB.T
        self._seen: list[deque[Array]] = [deque(maxlen=OBSERVATIONS_KEPT) for _ in markers.markers]
        self._warmth: deque[float] = deque(maxlen=OBSERVATIONS_KEPT)

    def update(self, image: YuvImage, seen: Sequence[MarkerObservation] | None = None) -> None:
        """Take in a picture; `seen`: what the given detector found in it."""
        found = self._detector.detect(image) if self._own or seen is None else seen
        colours = self._detector.paint_colours()
        for mark in found[:len(self._seen)]:  # what follows are other things of the markers' colours
            if mark.found and not mark.flags & DOUBTFUL:
                self._seen[mark.index].append(colours[mark.index])
        self._warmth.append(self._detector.temperature_shift)

    def report(self) -> DriftResult:
        """How the light stands now."""
        temperature_shift = float(np.median(self._warmth)) if self._warmth else 0.0
        drifts = tuple(self._drift(index, temperature_shift) for index, observations in enumerate(self._seen)
                       if len(observations) >= OBSERVATIONS_LEAST)
        light = float(np.median([drift.light for drift in drifts])) if drifts else 1.0
        return DriftResult(temperature_shift, light, drifts, _judge(temperature_shift, light, drifts))

    def _drift(self, index: int, temperature_shift: float) -> MarkerDrift:
        chroma = self._markers.markers[index].chroma
        luma, cb, cr = np.median(np.array(self._seen[index]), axis=0)
        inverse = np.linalg.inv(YCC_FROM_RGB)
        now = YCC_FROM_RGB @ (inverse @ (luma, cb, cr) / gains_of(temperature_shift))
        hue = math.degrees(math.remainder(math.atan2(now[2], now[1]) - chroma.hue_rad, 2.0 * math.pi))
        magnitude = math.hypot(now[1], now[2])
        room = max(chroma.magnitude - chroma.magnitude_min, 1e-6)
        margin = min(1.0 - abs(hue) / chroma.hue_tolerance_deg, (magnitude - chroma.magnitude_min) / room, 1.0)
        light = (max(now[0], 1.0) / max(float(self._learnt[index, 0]), 1.0)) ** GAMMA
        return MarkerDrift(self._markers.ids[index], hue, max(margin, 0.0), light, float(luma), len(self._seen[index]))


def drift_findings(reports: Mapping[str, DriftResult]) -> tuple[Finding, ...]:
    """What the camera that sees most drift says, by camera; usable at worst: the colours are right for their light."""
    drifted = {camera: report for camera, report in reports.items() if report.verdict.grade is not Grade.GOOD}
    if not drifted:
        return ()
    camera, worst = max(drifted.items(), key=lambda one: (one[1].verdict.grade.rank, abs(one[1].temperature_shift)))
    return tuple(replace(finding, grade=Grade.FAIR, figure=f"Camera {camera}: {finding.figure}")
                 for finding in worst.verdict.findings)


def _judge(temperature_shift: float, light: float, drifts: Sequence[MarkerDrift]) -> Verdict:
    if not drifts:
        return judge("no marker was seen plainly for long enough to judge the light by.", [])
    findings = []
    if abs(temperature_shift) >= WARMTH_FAIR:
        grade = Grade.POOR if abs(temperature_shift) >= WARMTH_POOR else Grade.FAIR
        findings.append(Finding(
            "temperature", grade, f"The light has become {'warmer' if temperature_shift > 0 else 'colder'}: as from "
            f"{LEARNT_KELVIN:.0f} K to about {round(kelvin_of(temperature_shift), -2):.0f} K.",
            "Another lamp, daylight, or an automatic white balance.",
            "Go back to the light of the calibration, check that the camera's automatic modes are off, or learn the "
            "colours again."))
    if not 1.0 - LIGHT_FAIR < light < 1.0 / (1.0 - LIGHT_FAIR):
        grade = Grade.FAIR if 1.0 - LIGHT_POOR < light < 1.0 / (1.0 - LIGHT_POOR) else Grade.POOR
        remedy = "Give more light, a longer exposure or more gain" if light < 1.0 else "Shorten the exposure"
        findings.append(Finding(
            "brightness", grade, f"The markers get {100.0 * light:.0f} % of the light that they were learnt in.",
            "Lamps, daylight, or an automatic exposure.", f"{remedy}, or learn the colours again."))
    for drift in drifts:
        if drift.margin < MARGIN_FAIR:
            findings.append(Finding(
                "margin", Grade.POOR if drift.margin < MARGIN_POOR else Grade.FAIR,
                f"{drift.marker} is near the edge of its colour: {100.0 * drift.margin:.0f} % of the margin is left.",
                _cause(drift), "Learn its colour again."))
    warmer = "warmer" if temperature_shift > 0 else "colder"
    words = f"the light is at {100.0 * light:.0f} %, {abs(temperature_shift):.2f} {warmer}"
    return judge(f"{words}, by {len(drifts)} {'marker' if len(drifts) == 1 else 'markers'}.", findings)


def _cause(drift: MarkerDrift) -> str:
    if drift.luma > BURNT_LUMA:
        return "It is too bright for the camera."
    return "Its paint is worn or dirty, or the light has a colour that no lamp has." if abs(drift.hue_deg) > 4.0 else \
        "It is too dark, or has faded."
