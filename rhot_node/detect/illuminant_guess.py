"""In which light is a picture taken, when nothing is known of it? The light in which it shows the most markers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.gate import ColourGate
from rhot_node.detect.illuminant import MARKERS_LEAST, WARMTH_MOST, Illuminant
from rhot_node.detect.image import YuvImage
from rhot_node.detect.search import AREA, LABEL, SUM_U, SUM_V, X_MAX, X_MIN, Y_MAX, Y_MIN
from rhot_node.markers import MarkerSet

GUESSES = np.arange(-6, 7) * (WARMTH_MOST / 6.5)
HUE_SIGMA_DEG = 6.0  # what a guess half a step beside the light leaves
COMPACT = 0.5  # of the bounding box: a marker fills as much
RECOGNISED = 0.25  # score of a marker
ADVANTAGE = 1.0  # markers more than in the last known light
AREA_MIN = 12  # chroma pixels
ROW_STEP = 4  # chroma rows: every fourth is searched
ALL_THERE = 0.6  # of the greatest score: no other light can be much better


def guess_illuminant(image: YuvImage, light: Illuminant, gate: ColourGate, markers: MarkerSet) -> bool:
    """Set the light in which clearly more markers are recognised than in the present one; says whether it did.

    Two colours may be explained by many a light: with fewer than MARKERS_LEAST nothing is guessed.
    """
    if len(markers.markers) < MARKERS_LEAST:
        return False
    hues, present = np.array([marker.chroma.hue_rad for marker in markers.markers]), light.temperature_shift
    scores = _scores(image, light, gate, hues)
    if scores.sum() >= ALL_THERE * len(hues):
        return False
    best, best_score = present, float(scores.sum()) + ADVANTAGE
    for guess in GUESSES:
        light.temperature_shift = float(guess)
        scores = _scores(image, light, gate, hues)
        if scores.sum() > best_score and np.count_nonzero(scores > RECOGNISED) >= MARKERS_LEAST:
            best, best_score = light.temperature_shift, float(scores.sum())
    light.temperature_shift = best
    return best != present


def _scores(image: YuvImage, light: Illuminant, gate: ColourGate,
            marker_hues: NDArray[np.float64]) -> NDArray[np.float64]:
    """(M,) 0..1: how well each marker's best blob has its hue, as far as it is compact."""
    blobs = gate.blobs(light.balanced(image, ROW_STEP), range(len(marker_hues)), AREA_MIN, ROW_STEP)
    index = blobs[:, LABEL].astype(np.intp) - 1
    box = (blobs[:, X_MAX] - blobs[:, X_MIN] + 1) * (blobs[:, Y_MAX] - blobs[:, Y_MIN] + 1)
    away = np.remainder(np.arctan2(blobs[:, SUM_V], blobs[:, SUM_U]) - marker_hues[index] + math.pi, math.tau) - math.pi
    merit = np.minimum(blobs[:, AREA] / (COMPACT * box), 1.0) * np.exp(
        -0.5 * (away / math.radians(HUE_SIGMA_DEG)) ** 2)
    scores = np.zeros(len(marker_hues))
    np.maximum.at(scores, index, merit)
    return scores
