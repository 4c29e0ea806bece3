"""From samples of paint to colour models: each as wide as the lamps ask for, as narrow as the neighbours demand.

All hues are angles of chroma, degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.illuminant import LAMPS, balanced, relit
from rhot_app.calibration.colour.paint_region import hue_of, polar
from rhot_app.calibration.colour.samples import PaintSamples
from rhot_app.calibration.colour.surroundings import SurroundingColours
from rhot_node.detect.colour import Colours
from rhot_node.detect.illuminant import MARKERS_LEAST, RGB_FROM_YCC
from rhot_node.markers import ChromaModel, RangeModel

Array = NDArray[np.float64]

COVERAGE = 0.99  # of a marker's samples that its model shall let through by any lamp
TOLERANCE_DEG = (6.0, 25.0)
WANTED_DEG = 10.0  # where nothing is in the way: tomorrow's noise and shade are not in the samples
MARGIN_DEG = 2.0  # beyond the samples
LIGHT_ERROR = 0.08  # of warmth: what the detector leaves of another lamp
UNKNOWN_LIGHT = 0.3  # of warmth: the same where too few markers tell the lamp
MAGNITUDE_LEAST = 8.0
SHADE = 0.5  # of the weakest sample: what shadow on the paint may leave of its chroma
WINDOW_LEVEL = 0.5  # of a tracked marker's chroma, from which on its window takes pixels (`detect.segment`)
PIXELS = 1500  # per marker and lamp that are tried
HSV_MARGIN = 4.0  # OpenCV hue steps of 2 degrees
TRIES = 8  # tolerances, and magnitudes, that are compared


@dataclass(frozen=True, slots=True)
class Obstacles:
    """What must not be taken for paint.

    `skin` (N, 3) Y, Cb, Cr: it adjoins markers. `rooms`, per marker: what surrounds it in the pictures that show it.
    """

    skin: Colours
    rooms: tuple[SurroundingColours, ...]


@dataclass(frozen=True, slots=True)
class _Paint:
    """One marker's robust samples by all lamps as the detector sees them.

    `hue`: its middle. `core`, `wanted`: half-widths in degrees that hold it by the lamp of the calibration, and by all.
    `seen`: (|hue - middle|, magnitude) per lamp. `level`, `weakest`: magnitude by the lamp of the calibration, its
    median and its 5th percentile.
    """

    hue: float
    core: float
    wanted: float
    seen: list[tuple[Array, Array]]
    level: float
    weakest: float
    mean: tuple[float, float]
    luma: tuple[float, float]
    area: float


def solve_models(samples: Sequence[PaintSamples], obstacles: Obstacles) -> tuple[ChromaModel, ...]:
    """A colour model for every marker.

    It lets COVERAGE of the samples through by every lamp, unless a neighbouring hue, skin or the room is in the way:
    then as much as costs least in lost paint and in what is mistaken for it.
    """
    error = LIGHT_ERROR if len(samples) >= MARKERS_LEAST else UNKNOWN_LIGHT
    paints = [_paint(one, error) for one in samples]
    models = []
    for index, paint in enumerate(paints):
        most = min(paint.wanted, _neighbours_leave(index, paints))
        tolerance, magnitude = _gate(paint, most, obstacles.skin, obstacles.rooms[index])
        dark, bright = paint.luma
        models.append(ChromaModel(
            cb=round(paint.mean[0], 1), cr=round(paint.mean[1], 1), hue_tolerance_deg=round(tolerance, 1),
            magnitude_min=round(magnitude, 1), luma_min=int(max(8.0, 0.35 * dark)),
            luma_max=250 if bright < 200.0 else 255))
    return tuple(models)


def range_of_samples(samples: PaintSamples) -> RangeModel:
    """HSV bounds for the thesis's detector (RHOT 7.1): what the typical samples span, and shade."""
    rgb = np.clip(samples.typical @ RGB_FROM_YCC.T, 0, 255).astype(np.uint8)
    hsv = cv2.cvtColor(rgb[None], cv2.COLOR_RGB2HSV)[0].astype(np.float64)
    middle = 0.5 * math.degrees(np.angle(np.mean(np.exp(2j * np.radians(hsv[:, 0])))))
    away = np.remainder(hsv[:, 0] - middle + 90.0, 180.0) - 90.0
    low, high = middle + np.percentile(away, 1.0) - HSV_MARGIN, middle + np.percentile(away, 99.0) + HSV_MARGIN
    saturation, value = 0.7 * np.percentile(hsv[:, 1], 2.0), 0.5 * np.percentile(hsv[:, 2], 2.0)
    return RangeModel(space="hsv", lower=(round(low) % 180, int(saturation), int(max(value, 20.0))),
                      upper=(round(high) % 180, 255, 255))


def _paint(samples: PaintSamples, error: float) -> _Paint:
    kept = samples.typical
    mean = np.median(kept[:, 1:], axis=0)
    hue = hue_of(mean)
    kept = kept[::max(1, len(kept) // PIXELS)]
    seen = []
    for lamp in LAMPS:
        for wrong in (-error, 0.0, error):
            away, magnitude, _ = polar(balanced(relit(kept, lamp), lamp.temperature_shift + wrong), hue)
            seen.append((np.abs(away), magnitude))
    now, magnitude, level = polar(kept, hue)
    weakest = float(np.percentile(magnitude, 5.0))
    core = float(np.percentile(np.abs(now), 100.0 * COVERAGE))
    wanted = max(MARGIN_DEG + max(float(np.percentile(away, 100.0 * COVERAGE)) for away, _ in seen), WANTED_DEG)
    dark, bright = np.percentile(kept[:, 0], (2.0, 98.0))
    return _Paint(hue, core, wanted, seen, level, weakest, (float(mean[0]), float(mean[1])),
                  (float(dark), float(bright)), samples.area)


def _neighbours_leave(index: int, paints: list[_Paint]) -> float:
    """The half-width that the nearest other markers leave: each gets as much of the gap as it asks for."""
    own, room = paints[index], TOLERANCE_DEG[1]
    for other in (paint for k, paint in enumerate(paints) if k != index):
        apart = abs((other.hue - own.hue + 180.0) % 360.0 - 180.0)
        if own.wanted + other.wanted <= apart:
            continue
        gap = apart - own.core - other.core
        if gap > 0.0:
            share = (own.wanted - own.core) / max(own.wanted - own.core + other.wanted - other.core, 1e-6)
            room = min(room, own.core + share * gap)
        else:
            room = min(room, apart * own.core / max(own.core + other.core, 1e-6))
    return room


def _gate(paint: _Paint, most: float, skin: Colours, room: SurroundingColours) -> tuple[float, float]:
    """Hue tolerance and least magnitude that cost least; of equals the widest tolerance and the least magnitude."""
    low, high = TOLERANCE_DEG
    most = min(max(most, low), high)
    weakest = min(float(np.percentile(magnitude, 2.0)) for _, magnitude in paint.seen)
    least = max(min(SHADE * paint.weakest, weakest), MAGNITUDE_LEAST)
    touching, behind = _by_all_lamps(skin, paint.hue), _by_all_lamps(room.colours, paint.hue)
    around = room.weight * len(room.colours)
    best, best_cost = (most, least), math.inf
    for tolerance in np.linspace(most, max(min(paint.core, most), low), TRIES):
        for magnitude in np.linspace(least, max(weakest, least), TRIES):
            lost = max(float(np.mean((a > tolerance) | (m < magnitude))) for a, m in paint.seen)
            window = min(magnitude, WINDOW_LEVEL * paint.level)
            cost = (lost + min(4.0 * _share(touching, tolerance, window), 1.0)
                    + min(4.0 * around / room.size * _share(behind, tolerance, window), 1.0)
                    + min(around / paint.area * _share(behind, tolerance, magnitude), 1.0)
                    + 0.3 * max(magnitude / paint.weakest - SHADE, 0.0) + 0.1 * (1.0 - tolerance / most))
            if cost < best_cost - 1e-9:
                best, best_cost = (float(tolerance), float(magnitude)), cost
    return best


def _by_all_lamps(colours: Colours, hue: float) -> list[tuple[Array, Array]]:
    """(|degrees from `hue`|, magnitude) of colours as the detector sees them by every lamp."""
    few = colours[::max(1, len(colours) // PIXELS)]
    seen = [polar(balanced(relit(few, lamp), lamp.temperature_shift), hue) for lamp in LAMPS]
    return [(np.abs(away), magnitude / lamp.gains[1]) for (away, magnitude, _), lamp in zip(seen, LAMPS, strict=True)]


def _share(seen: list[tuple[Array, Array]], tolerance: float, least: float) -> float:
    """Share of colours that pass, by the lamp where most do."""
    return max(float(np.mean((away <= tolerance) & (magnitude >= least))) if len(away) else 0.0
               for away, magnitude in seen)
