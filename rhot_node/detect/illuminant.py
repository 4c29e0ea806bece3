"""The light that the markers are seen in: how much warmer it is than the light their colours were learnt in.

A camera with its white balance fixed, as it must be, shows every colour shifted when the lamp changes: a magenta paint
learnt in daylight looks red by a light bulb. Black bodies, daylight and white LEDs lie near one curve, along which the
camera's colour channels change by factors exp(WARMTH * warmth): one number tells the light. The markers themselves are
the colour chart that it is read from, and the detector searches the picture as it would look in the light of the
calibration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.colour import MAGNITUDE_MIN
from rhot_node.detect.coverage import luma_at
from rhot_node.detect.image import GREY, WHITE, YuvImage
from rhot_node.detect.search import AREA_MIN, ColourGate
from rhot_node.markers import Marker, MarkerSet

Array = NDArray[np.float64]

WARMTH = (0.55, 0.0, -1.0)
"""Log gains of red, green and blue for a warmth of one: the direction of Planck's curve. 3000 and 6500 K are 1.2 apart
in linear light, 0.54 in a picture with the usual gamma of 2.2."""
WARMTH_MOST = 1.3
DEAD_ZONE = 0.05  # less is no other light: hues move by 3 degrees at most
STEP = 0.05  # of the table of predicted hues
WARMTH_SIGMA = 0.35  # how far lights are from the light of the calibration
TURN_DEG = 360.0
HUE_SIGMA_DEG = 3.0  # how well a paint's hue is known
HUE_CAP_DEG = 15.0  # a marker that is further off is not itself, and counts no more than this
INFORMATION_LEAST = 50.0  # 1 / variance of a warmth that is worth as much as the last known one
MARKERS_LEAST = 3  # the hues of fewer markers agree with several lights
SWITCHED = 0.12  # of warmth in one frame: no lamp drifts so fast
STRENGTH_LEAST = 0.3  # of the chroma that a paint should show in this light: less is something else, or deep shade

KR, KB = 0.299, 0.114
"""Shares of red and blue in luma (ITU-R BT.601)."""

_LUMA = np.array([KR, 1.0 - KR - KB, KB])
YCC_FROM_RGB = np.array([_LUMA, (np.eye(3)[2] - _LUMA) / (2.0 - 2.0 * KB), (np.eye(3)[0] - _LUMA) / (2.0 - 2.0 * KR)])
RGB_FROM_YCC = np.linalg.inv(YCC_FROM_RGB)


def gains_of(temperature_shift: float) -> Array:
    """(3,) factors of the red, green and blue of a picture; grey keeps its luma."""
    gains = np.exp(temperature_shift * np.array(WARMTH))
    return np.asarray(gains / (YCC_FROM_RGB[0] @ gains))


def paint_rgb(marker: Marker) -> Array:
    """(3,) grey levels of a marker's paint in the light it was learnt in: its chroma, with the luma that goes with it.

    The file's display colour says how bright a paint of this chroma is.
    """
    shown = YCC_FROM_RGB @ np.array(marker.display_rgb, dtype=np.float64)
    strength = marker.chroma.magnitude / max(float(np.hypot(shown[1], shown[2])), 1.0)
    colour = RGB_FROM_YCC @ np.array([strength * shown[0], marker.chroma.cb, marker.chroma.cr])
    return np.clip(colour, 1.0, WHITE)


class Illuminant:
    """The light of the last frames, and pictures as they would look in the light of the calibration."""

    def __init__(self, markers: MarkerSet) -> None:
        self.temperature_shift = 0.0
        self.grid = np.arange(-WARMTH_MOST, WARMTH_MOST + 0.5 * STEP, STEP)
        self._hues = predicted_hues(markers.markers, self.grid)
        self._strengths = np.hypot(*predicted_chroma(markers.markers, self.grid).transpose(2, 0, 1))
        self._u = self._v = np.zeros((0, 0), dtype=np.uint8)

    def balanced(self, image: YuvImage, step: int = 1, first: int = 0) -> YuvImage:
        """The picture in the light of the calibration: its chroma corrected; `image` itself when that is the light.

        Only every `step`-th chroma row from `first` on is valid, and only until the next call.
        """
        if abs(self.temperature_shift) < DEAD_ZONE:
            return image
        if self._u.shape != image.u.shape:
            self._u, self._v = np.empty_like(image.u), np.empty_like(image.v)
        balance(image.y, image.u, image.v, balance_matrix(self.temperature_shift), step, first, self._u, self._v)
        return YuvImage(image.y, self._u, self._v)

    def unbalanced(self, colours: Array) -> Array:
        """(..., 3) Y, Cb, Cr as the camera shows them, of colours in a balanced picture."""
        if abs(self.temperature_shift) < DEAD_ZONE:
            return colours
        balance = np.vstack([(1.0, 0.0, 0.0), balance_matrix(self.temperature_shift)])
        return np.asarray(colours @ np.linalg.inv(balance).T)

    def strong(self, indices: list[int], colours: Array) -> NDArray[np.bool_]:
        """(N,) whether colours (N, 3) Y, Cb, Cr, as the camera shows them, are as strong as the paints of the markers
        `indices` should be in this light."""
        here = int(np.argmin(np.abs(self.grid - self.temperature_shift)))
        expected = STRENGTH_LEAST * self._strengths[np.asarray(indices, dtype=np.intp), here]
        return np.asarray(np.hypot(colours[:, 1], colours[:, 2]) >= np.maximum(expected, MAGNITUDE_MIN))

    def read(self, indices: list[int], colours: Array, steady: float = 0.0) -> float:
        """Read the light from the paint of the markers `indices`, (N, 3) Y, Cb, Cr as the camera shows them.

        `steady`, 0 to 1: weight of the last known light, which also replaces what the colours do not determine. It is
        0 when MARKERS_LEAST or more strong colours show that a lamp was switched. Returns by how much the warmth
        changed.
        """
        chosen, strong = np.asarray(indices, dtype=np.intp), self.strong(indices, colours)
        if not strong.any():
            return 0.0
        hues = np.degrees(np.arctan2(colours[strong, 2], colours[strong, 1]))
        fitted, information = fit_temperature_shift(hues, self._hues[chosen[strong]], self.grid)
        away = fitted - self.temperature_shift
        if np.count_nonzero(strong) >= MARKERS_LEAST and abs(away) >= max(SWITCHED, 2.0 / math.sqrt(information + 1.0)):
            steady = 0.0
        change = (1.0 - steady) * information / (information + INFORMATION_LEAST) * away
        self.temperature_shift += change
        return abs(change)


def predicted_chroma(markers: Sequence[Marker], warmths: Array) -> Array:
    """(M, K, 2) Cb and Cr of every marker's paint in the light of every warmth (K,)."""
    gains = np.array([gains_of(float(temperature_shift)) for temperature_shift in warmths])
    colours = np.array([paint_rgb(marker) for marker in markers])
    return np.asarray((colours[:, None, :] * gains) @ YCC_FROM_RGB[1:].T)


def predicted_hues(markers: Sequence[Marker], warmths: Array) -> Array:
    """(M, K) degrees: the hue of every marker's paint in the light of every warmth (K,)."""
    chroma = predicted_chroma(markers, warmths)
    return np.asarray(np.degrees(np.arctan2(chroma[..., 1], chroma[..., 0])))


def balance_matrix(temperature_shift: float) -> Array:
    """(2, 3): Cb and Cr in the light of the calibration from Y, Cb and Cr in a light of this warmth."""
    return np.asarray(YCC_FROM_RGB[1:] @ np.diag(1.0 / gains_of(temperature_shift)) @ RGB_FROM_YCC)


@njit(cache=True)
def balance(y, u, v, matrix, step, first, out_u, out_v):
    """Write every `step`-th row from `first` on of the chroma planes in another light, rounded and clipped to 8 bits.

    `matrix` (2, 3) as `balance_matrix` gives it.
    """
    for row in range(first, u.shape[0], step):
        for column in range(u.shape[1]):
            luma = luma_at(y, row, column)
            cb, cr = np.float64(u[row, column]) - GREY, np.float64(v[row, column]) - GREY
            out_u[row, column] = _byte(matrix[0, 0] * luma + matrix[0, 1] * cb + matrix[0, 2] * cr)
            out_v[row, column] = _byte(matrix[1, 0] * luma + matrix[1, 1] * cb + matrix[1, 2] * cr)


@njit(cache=True)
def _byte(chroma):
    return min(max(int(np.floor(chroma + GREY + 0.5)), 0), WHITE)


@njit(cache=True)
def fit_temperature_shift(hues, predicted, grid):
    """The warmth (of the `grid` (K,), interpolated) that explains the hues (N,) deg best, and how much they tell of it.

    Least squares over the difference to the `predicted` hues (N, K), each capped, and over the warmth itself. The
    information is the curvature of the hues' share: 1 / variance.
    """
    misfit = np.zeros(len(grid))
    for k in range(len(grid)):
        for n in range(len(hues)):
            away = hues[n] - predicted[n, k]
            away -= TURN_DEG * np.floor(away / TURN_DEG + 0.5)
            misfit[k] += (min(abs(away), HUE_CAP_DEG) / HUE_SIGMA_DEG) ** 2
    costs = (grid / WARMTH_SIGMA) ** 2 + misfit
    best = np.argmin(costs)
    if best == 0 or best == len(grid) - 1:
        return grid[best], 0.0
    bend = costs[best - 1] - 2.0 * costs[best] + costs[best + 1]
    shift = 0.5 * (costs[best - 1] - costs[best + 1]) / bend if bend > 0.0 else 0.0
    curvature = (misfit[best - 1] - 2.0 * misfit[best] + misfit[best + 1]) / STEP**2
    return grid[best] + shift * STEP, max(0.5 * curvature, 0.0)


# -- illuminant estimation without a prior -----------------------------------------------------------------------------

GUESS_EVERY = 4  # steps of the grid: as far as a guess beside the light leaves twice HUE_SIGMA_DEG
COMPACT = 0.5  # of the bounding box: a marker fills as much
RECOGNISED = 0.25  # score of a marker
ADVANTAGE = 1.0  # markers more than in the last known light
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
    for guess in light.grid[::GUESS_EVERY]:
        light.temperature_shift = float(guess)
        scores = _scores(image, light, gate, hues)
        if scores.sum() > best_score and np.count_nonzero(scores > RECOGNISED) >= MARKERS_LEAST:
            best, best_score = light.temperature_shift, float(scores.sum())
    light.temperature_shift = best
    return best != present


def _scores(image: YuvImage, light: Illuminant, gate: ColourGate, marker_hues: Array) -> Array:
    """(M,) 0..1: how well each marker's best blob has its hue, as far as it is compact."""
    scores = np.zeros(len(marker_hues))
    for blob in gate.blobs(light.balanced(image, ROW_STEP), range(len(marker_hues)), 2 * AREA_MIN, ROW_STEP):
        index = int(blob.label) - 1
        match = math.exp(-0.5 * (blob.off_hue(marker_hues[index]) / math.radians(2.0 * HUE_SIGMA_DEG)) ** 2)
        scores[index] = max(scores[index], min(blob.compactness / COMPACT, 1.0) * match)
    return scores
