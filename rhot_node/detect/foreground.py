"""Foreground probability of single pixels, from a learnt background and a colour model. Each part is optional.

A pixel is weighed by Bayes' rule: the density of its colour on the hand against that of the background at its place.
What was not learnt has the density of any colour, so it decides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Array32 = NDArray[np.float32]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

BINS = 32
"""Bins of a colour histogram per channel, as in Jones and Rehg 1999, section 3."""

_BIN = 8  # values of a channel in one bin
COLOURS = BINS * BINS * BINS  # bins of a histogram

ANY = 1.0 / (COLOURS * _BIN * _BIN * _BIN)
"""Density of a colour of which nothing is known."""

SKIN_CB, SKIN_CR = (77, 127), (133, 173)
"""Chroma of skin of any tone (Chai and Ngan 1999)."""

UNUSUAL = 0.02
"""Probability that a pixel shows what the learnt colours do not: highlights, shadows, new things."""

PRIOR_IMAGES = 8
"""Weight, in images, of the median variance of all pixels when one pixel's variance is estimated (shrinkage; chosen: as
many as show a background in a quarter of a second)."""

_INVERSE_ROOT_2PI = 1.0 / math.sqrt(2.0 * math.pi)
_SAMPLES = 1200  # pixels of which the exposure is estimated, about
_DARK, _BRIGHT = 16.0, 240.0  # of 255: less is noise, more is clipped
_LEAST_SAMPLES = 70  # the median of so many ratios errs by 15 % of one ratio's standard deviation
_BEYOND_SD = 8.0  # a colour so far from the background is 10^7 times less probable there than an unusual one
_FOREIGN = 4.0  # standard deviations of the background
_OPEN_PX, _LEAST_PIXELS = 3, 400  # smaller patches of skin are none
_LEAST_SD = 2.0  # of 255: quantisation and compression, below which no background is known


class Foreground(NamedTuple):
    """Densities of hand and background. `hand`, `rest` (BINS^3,) densities of colours; `mean`, `sd` (H, W, 3) of
    the background, empty while it is not learnt."""

    hand: Array32
    rest: Array32
    mean: Array32
    sd: Array32

    @property
    def _has_colours(self) -> bool:
        return bool(np.ptp(self.hand) > 0.0)

    @property
    def informative(self) -> bool:
        """Whether it has a background or colours of the hand."""
        return bool(self.mean.size) or self._has_colours

    @property
    def sentence(self) -> str:
        """What is known, for the operator."""
        background = "The background is learnt" if self.mean.size else "No background is learnt"
        colours = "the hand's colours are known" if self._has_colours else "no colours of the hand are known"
        return f"{background}; {colours}."


def no_foreground() -> Foreground:
    """A model without information: every pixel has probability 1/2."""
    flat, empty = np.full(COLOURS, ANY, np.float32), np.empty((0, 0, 3), np.float32)
    return Foreground(flat, flat, empty, empty)


def skin_foreground() -> Foreground:
    """Skin of any tone, by its chroma alone."""
    centres = (np.arange(BINS) * _BIN + _BIN // 2).astype(np.uint8)
    grid = np.stack(np.meshgrid(centres, centres, centres, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    skin = skin_mask(grid).ravel()
    hand = np.where(skin, (1.0 - UNUSUAL) / max(skin.mean(), 1e-6), UNUSUAL) * ANY
    nothing = no_foreground()
    return nothing._replace(hand=hand.astype(np.float32))


def skin_mask(image: Image) -> Mask:
    """(H, W) where an image (H, W, 3) RGB has the chroma of skin."""
    chroma = cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2YCrCb)
    cr, cb = chroma[..., 1], chroma[..., 2]
    return np.asarray((cb >= SKIN_CB[0]) & (cb <= SKIN_CB[1]) & (cr >= SKIN_CR[0]) & (cr <= SKIN_CR[1]))


class BackgroundSums:
    """Sums over images of the empty scene, from which a background is learnt without keeping them."""

    def __init__(self) -> None:
        self.count = 0
        self._sum: NDArray[np.float64] = np.empty(0)
        self._squares: NDArray[np.float64] = np.empty(0)

    def add(self, image: Image) -> None:
        """Take one image (H, W, 3) RGB. Raises ValueError when it has another size than those before."""
        if not self.count:
            self._sum, self._squares = np.zeros(image.shape), np.zeros(image.shape)
        if image.shape != self._sum.shape:
            raise ValueError(f"an image of {image.shape[1]} x {image.shape[0]} px came among others")
        cv2.accumulate(image, self._sum)
        cv2.accumulateSquare(image, self._squares)
        self.count += 1

    def learnt(self, model: Foreground) -> Foreground:
        """The model with this background. Raises ValueError without images."""
        if not self.count:
            raise ValueError("the background needs at least one image of the scene without a hand")
        mean = self._sum / self.count
        square = np.maximum(self._squares / self.count - mean * mean, 0.0)
        prior = np.median(square.reshape(-1, square.shape[2]), axis=0)
        variance = (self.count * square + PRIOR_IMAGES * prior) / (self.count + PRIOR_IMAGES) * (1.0 + 1.0 / self.count)
        return model._replace(mean=mean.astype(np.float32),
                              sd=np.sqrt(np.maximum(variance, _LEAST_SD**2)).astype(np.float32))


def learn_background(model: Foreground, images: Sequence[Image]) -> Foreground:
    """The model with a background from images (H, W, 3) RGB of the empty scene. Raises ValueError without images."""
    sums = BackgroundSums()
    for image in images:
        sums.add(image)
    return sums.learnt(model)


def learn_colours(model: Foreground, image: Image, hand: Mask, rest: Mask) -> Foreground:
    """The model with the colours of the pixels of `hand` and of `rest`, masks (H, W) of an image."""
    return model._replace(hand=_density(image[hand]), rest=_density(image[rest]))


def learn_skin(image: Image, model: Foreground | None = None) -> Foreground:
    """The model with the colours of one image's skin, which is segmented by its chroma. `model` None: one without
    background. An image without skin gives the generic colours of skin."""
    model = no_foreground() if model is None else model
    skin = skin_mask(image)
    if model.mean.size:  # skin of which the background, at this exposure, has none
        gain = gain_of(image, model)
        sd = model.sd * np.maximum(gain, np.float32(1.0))
        skin &= np.max(np.abs(image - gain * model.mean) / sd, axis=2) > _FOREIGN
    kernel = np.ones((2 * _OPEN_PX + 1, 2 * _OPEN_PX + 1), np.uint8)
    large = cv2.morphologyEx(skin.astype(np.uint8), cv2.MORPH_OPEN, kernel)
    hand, rest = cv2.erode(large, kernel) > 0, cv2.dilate(large, kernel) == 0
    if np.count_nonzero(hand) < _LEAST_PIXELS:
        return skin_foreground()._replace(mean=model.mean, sd=model.sd)
    return learn_colours(model, image, hand, rest)


def _density(pixels: Image) -> Array32:
    index = (pixels // _BIN).astype(np.int64)
    counts = np.bincount((index[:, 0] * BINS + index[:, 1]) * BINS + index[:, 2], minlength=COLOURS)
    cube = counts.reshape(BINS, BINS, BINS).astype(np.float32)
    for axis in range(3):  # smoothed over neighbouring bins
        padded = np.pad(cube, [(1, 1) if k == axis else (0, 0) for k in range(3)], mode="edge")
        before, after = np.take(padded, range(BINS), axis), np.take(padded, range(2, BINS + 2), axis)
        cube = (0.5 * cube + 0.25 * (before + after)).astype(np.float32)
    total = max(float(cube.sum()), 1.0)
    return ((1.0 - UNUSUAL) * COLOURS * ANY * cube / total + UNUSUAL * ANY).astype(np.float32).ravel()


def gain_of(image: Image, model: Foreground) -> Array32:
    """(3,) ratio of an image's brightness to the learnt background's, per channel: automatic exposure, white balance.
    That of the half of the pixels that agree best, robust while the hand covers less than the background; factors
    beyond 2 are none of an exposure."""
    gain = np.ones(3, np.float32)
    if model.mean.size:
        _gain(image, model.mean, gain)
    return gain


@njit(cache=True)
def _gain(image, mean, gain):
    step = max(1, int(np.sqrt(image.shape[0] * image.shape[1] / _SAMPLES)))
    rows, columns = image.shape[0] // step, image.shape[1] // step
    ratio, used = np.empty((rows * columns, 3)), 0
    for n in range(rows * columns):
        row, column = n // columns * step + step // 2, n % columns * step + step // 2
        usable = True
        for k in range(3):
            now, before = float(image[row, column, k]), float(mean[row, column, k])
            usable = usable and _DARK < now < _BRIGHT and _DARK < before < _BRIGHT and 0.5 < now / before < 2.0
            ratio[used, k] = now / before if usable else 1.0
        used += usable
    if used < _LEAST_SAMPLES:
        return
    ratio = ratio[:used]
    whole = ratio[:, 0] * ratio[:, 1] * ratio[:, 2]
    ordered, half = np.sort(whole), used // 2  # the shortest half: Rousseeuw 1984, least median of squares
    first = np.argmin(ordered[half:] / ordered[:used - half])
    kept = (whole >= ordered[first]) & (whole <= ordered[first + half])
    for k in range(3):
        gain[k] = np.median(ratio[:, k][kept])


@njit(cache=True, error_model="numpy")
def foreground_at(image, row, column, model, gain):
    """Probability that a pixel shows the hand, in an image `gain` (3,) times brighter than the background's."""
    r, g, b = image[row, column, 0], image[row, column, 1], image[row, column, 2]
    index = (np.int64(r) // _BIN * BINS + np.int64(g) // _BIN) * BINS + np.int64(b) // _BIN
    ours, theirs, mean = model.hand[index], model.rest[index], model.mean
    if mean.shape[0] == 0:
        return ours / (ours + theirs)
    squared, density = 0.0, 1.0
    for k in range(3):
        precision = 1.0 / (model.sd[row, column, k] * max(gain[k], np.float32(1.0)))
        z = (image[row, column, k] - gain[k] * mean[row, column, k]) * precision
        squared += z * z
        density *= _INVERSE_ROOT_2PI * precision
    background = UNUSUAL * theirs
    if squared < _BEYOND_SD**2:
        background += (1.0 - UNUSUAL) * density * math.exp(-0.5 * squared)
    return ours / (ours + background)


@njit(cache=True)
def _fill(image, model, gain, step, out):
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = foreground_at(image, i * step + step // 2, j * step + step // 2, model, gain)


def foreground_map(image: Image, model: Foreground, step: int = 4) -> Array32:
    """(H // step, W // step) foreground probabilities of an image (H, W, 3) RGB, of every `step`-th pixel."""
    out = np.empty((image.shape[0] // step, image.shape[1] // step), np.float32)
    _fill(image, model, gain_of(image, model), step, out)
    return out
