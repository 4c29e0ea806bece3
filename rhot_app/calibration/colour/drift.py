"""Has the light drifted since the colours were learnt? Said before a marker is lost, from the markers themselves."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.illuminant import GAMMA, LEARNT_KELVIN, kelvin_of
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_node.detect.fast import DOUBTFUL, FastDetector
from rhot_node.detect.illuminant import YCC_FROM_RGB, gains_of, paint_rgb
from rhot_node.detect.image import YuvImage
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerObservation

Array = NDArray[np.float64]

SIGHTS = 20  # of every marker, of which the median counts
SIGHTS_LEAST = 3
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
    factor on its light. `luma`: grey levels. `sights`: how many pictures that rests on.
    """

    marker: str
    hue_deg: float
    margin: float
    light: float
    luma: float
    sights: int


@dataclass(frozen=True, slots=True)
class DriftReport:
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
        self._seen: list[deque[Array]] = [deque(maxlen=SIGHTS) for _ in markers.markers]
        self._warmth: deque[float] = deque(maxlen=SIGHTS)

    def update(self, image: YuvImage, seen: Sequence[MarkerObservation] | None = None) -> None:
        """Take in a picture; `seen`: what the given detector found in it."""
        found = self._detector.detect(image) if self._own or seen is None else seen
        colours = self._detector.paint_colours()
        for mark in found[:len(self._seen)]:  # what follows are other things of the markers' colours
            if mark.found and not mark.flags & DOUBTFUL:
                self._seen[mark.index].append(colours[mark.index])
        self._warmth.append(self._detector.temperature_shift)

    def report(self) -> DriftReport:
        """How the light stands now."""
        temperature_shift = float(np.median(self._warmth)) if self._warmth else 0.0
        drifts = tuple(self._drift(index, temperature_shift) for index, sights in enumerate(self._seen)
                       if len(sights) >= SIGHTS_LEAST)
        light = float(np.median([drift.light for drift in drifts])) if drifts else 1.0
        return DriftReport(temperature_shift, light, drifts, _judge(temperature_shift, light, drifts))

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


def drift_findings(reports: Mapping[str, DriftReport]) -> tuple[Finding, ...]:
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
