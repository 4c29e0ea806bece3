"""In which light is a picture taken, when nothing is known of it? The light in which it shows the most markers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.gate import ColourGate
from rhot_node.detect.image import YuvImage
from rhot_node.detect.light import WARMTH_MOST, Light
from rhot_node.detect.search import AREA, LABEL, SUM_U, SUM_V, SUM_X, SUM_Y, X_MAX, X_MIN, Y_MAX, Y_MIN
from rhot_node.detect.whereabouts import middle_of
from rhot_node.markers import MarkerSet

GUESSES = np.arange(-6, 7) * (WARMTH_MOST / 6.5)
HUE_SIGMA_DEG = 6.0  # what a guess half a step beside the light leaves
COMPACT = 0.5  # of the bounding box: a marker fills as much
RECOGNISED = 0.25  # score of a marker
MARKERS_LEAST = 3  # that must be recognised for another light to be believed
ADVANTAGE = 1.0  # markers more than in the last known light
AREA_MIN = 3  # pixels of every other chroma row and column, which are enough to guess by
ALL_THERE = 0.6  # of the greatest score: no other light can be much better


def guess_light(image: YuvImage, light: Light, gate: ColourGate, markers: MarkerSet) -> bool:
    """Set the light in which clearly more markers are recognised than in the present one; says whether it did.

    Two colours may be explained by many a light: with fewer than MARKERS_LEAST nothing is guessed.
    """
    if len(markers.markers) < MARKERS_LEAST:
        return False
    image = _every_other(image)
    present = light.warmth
    scores = _scores(light.balanced(image), gate, markers)
    if scores.sum() >= ALL_THERE * len(markers.markers):
        return False
    best, best_score = present, float(scores.sum()) + ADVANTAGE
    for guess in GUESSES:
        light.warmth = float(guess)
        scores = _scores(light.balanced(image), gate, markers)
        if scores.sum() > best_score and np.count_nonzero(scores > RECOGNISED) >= MARKERS_LEAST:
            best, best_score = light.warmth, float(scores.sum())
    light.warmth = best
    return best != present


def _every_other(image: YuvImage) -> YuvImage:
    """Every other row and column of the chroma planes, with the luma that belongs to them."""
    rows, columns = (np.arange(0, size, 2)[:, None] for size in image.u.shape)
    luma = image.y[np.ix_((2 * rows + (0, 1)).ravel(), (2 * columns + (0, 1)).ravel())]
    return YuvImage(luma, np.ascontiguousarray(image.u[::2, ::2]), np.ascontiguousarray(image.v[::2, ::2]))


def _scores(image: YuvImage, gate: ColourGate, markers: MarkerSet) -> NDArray[np.float64]:
    """(M,) 0..1: how well each marker's best blob has its hue, as far as it is compact and near the others."""
    blobs = gate.blobs(image, range(len(markers.markers)), AREA_MIN)
    box = (blobs[:, X_MAX] - blobs[:, X_MIN] + 1) * (blobs[:, Y_MAX] - blobs[:, Y_MIN] + 1)
    compact = np.minimum(blobs[:, AREA] / (COMPACT * box), 1.0)
    hues = np.arctan2(blobs[:, SUM_V], blobs[:, SUM_U])
    scores, worn, places = np.zeros(len(markers.markers)), [], []
    for index, marker in enumerate(markers.markers):
        own = blobs[:, LABEL] == index + 1
        if own.any():
            away = np.degrees(np.remainder(hues[own] - marker.chroma.hue_rad + math.pi, 2.0 * math.pi) - math.pi)
            merit = compact[own] * np.exp(-0.5 * (away / HUE_SIGMA_DEG) ** 2)
            best = int(np.argmax(merit))
            scores[index] = merit[best]
            if marker.role is not None:
                blob = blobs[own][best]
                worn.append(index)
                places.append((blob[SUM_X] / blob[AREA], blob[SUM_Y] / blob[AREA], blob[AREA]))
    middle = middle_of(places)
    if middle is not None:
        x, y, area = np.array(places).T
        alike = [float(middle.likeness(area[k], markers.markers[index].shape)) for k, index in enumerate(worn)]
        scores[worn] *= middle.nearness(x, y) * alike
    return scores
