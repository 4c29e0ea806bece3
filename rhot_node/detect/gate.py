"""The gate of the full search: which pixels of a picture it takes for which marker's paint.

`FastDetector` searches with it, and whoever shows or judges the colours asks the same object: what is drawn as the mask
is what the detector computes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.colour import Table, acquisition_table
from rhot_node.detect.illuminant import MARKERS_LEAST, WARMTH_MOST, Illuminant
from rhot_node.detect.image import YuvImage
from rhot_node.detect.search import AREA, LABEL, SUM_U, SUM_V, X_MAX, X_MIN, Y_MAX, Y_MIN, Searcher, label_at
from rhot_node.markers import Marker, MarkerSet

AREA_MIN = 6  # chroma pixels; smaller blobs are specks (a marker of 5.5 px across)

Labels = NDArray[np.uint8]


class ColourGate:
    """The colours of one marker set: hue sectors, magnitude and luma gates, and the search for their blobs.

    Holds buffers: one thread only.
    """

    def __init__(self, markers: MarkerSet) -> None:
        self.table: Table = acquisition_table(markers)
        self.luma_limits = np.array([(mark.chroma.luma_min, mark.chroma.luma_max) for mark in markers.markers],
                                    dtype=np.uint8)
        self._searcher = Searcher(self.table, self.luma_limits)
        self._wanted = np.zeros(len(markers.markers) + 1, dtype=np.bool_)

    def labels(self, image: YuvImage) -> Labels:
        """(H/2, W/2) for every chroma pixel 1 + the index of the marker it is taken for, 0 for none."""
        out = np.empty(image.u.shape, dtype=np.uint8)
        label_plane(image.y, image.u, image.v, self.table, self.luma_limits, out)
        return out

    def blobs(self, image: YuvImage, indices: list[int] | range, area_min: int = AREA_MIN,
              step: int = 1, first: int = 0) -> NDArray[np.float64]:
        """(N, 10) blobs of the markers `indices`, columns as in rhot_node.detect.search; a view, valid until the next.

        A blob has at least `area_min` chroma pixels. Every `step`-th chroma row from `first` on stands for the others.
        """
        self._wanted[:] = False
        for index in indices:
            self._wanted[index + 1] = True
        return self._searcher.find(image.y, image.u, image.v, self._wanted, area_min, step=step,
                                   first=first)


def merits(blobs: NDArray[np.float64], marker: Marker, shape: tuple[int, int]) -> NDArray[np.float64]:
    """(N,) scores of blobs (N, 10) as the marker; higher is likelier. `shape`: (H/2, W/2) of the chroma planes.

    A score grows with a blob's area, compactness and match of the marker's hue. Half is taken off at the border.
    """
    chroma, area = marker.chroma, blobs[:, AREA]
    box = (blobs[:, X_MAX] - blobs[:, X_MIN] + 1) * (blobs[:, Y_MAX] - blobs[:, Y_MIN] + 1)
    away = np.angle(np.exp(1j * (np.arctan2(blobs[:, SUM_V], blobs[:, SUM_U]) - chroma.hue_rad)))
    match = np.exp(-(away / math.radians(chroma.hue_tolerance_deg)) ** 2)
    height, width = shape
    cut = ((blobs[:, X_MIN] == 0) | (blobs[:, Y_MIN] == 0)
           | (blobs[:, X_MAX] == width - 1) | (blobs[:, Y_MAX] == height - 1))
    return np.asarray(area * area / box * match * np.where(cut, 0.5, 1.0))


@njit(cache=True)
def label_plane(y, u, v, table, luma_limits, out):
    """Write the label of every chroma pixel to `out`."""
    for row in range(u.shape[0]):
        for column in range(u.shape[1]):
            out[row, column] = label_at(y, u, v, row, column, table, luma_limits)


# -- illuminant estimation without a prior -----------------------------------------------------------------------------

GUESSES = np.arange(-6, 7) * (WARMTH_MOST / 6.5)
HUE_SIGMA_DEG = 6.0  # what a guess half a step beside the light leaves
COMPACT = 0.5  # of the bounding box: a marker fills as much
RECOGNISED = 0.25  # score of a marker
ADVANTAGE = 1.0  # markers more than in the last known light
GUESS_AREA_MIN = 12  # chroma pixels
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
    blobs = gate.blobs(light.balanced(image, ROW_STEP), range(len(marker_hues)), GUESS_AREA_MIN, ROW_STEP)
    index = blobs[:, LABEL].astype(np.intp) - 1
    box = (blobs[:, X_MAX] - blobs[:, X_MIN] + 1) * (blobs[:, Y_MAX] - blobs[:, Y_MIN] + 1)
    away = np.remainder(np.arctan2(blobs[:, SUM_V], blobs[:, SUM_U]) - marker_hues[index] + math.pi, math.tau) - math.pi
    merit = np.minimum(blobs[:, AREA] / (COMPACT * box), 1.0) * np.exp(
        -0.5 * (away / math.radians(HUE_SIGMA_DEG)) ** 2)
    scores = np.zeros(len(marker_hues))
    np.maximum.at(scores, index, merit)
    return scores
