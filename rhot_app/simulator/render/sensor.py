"""The image sensor: point spread of the lens, settings, conversion to planar YUV420, shot and read noise, 8 bits.

Grey levels 0..255. Each colour channel of a pixel has noise of variance read + shot * level; its share in Y and, after
the mean over 2 x 2 pixels, in U and V is what independent channels would give. What is brighter than the sensor can
tell is cut off before the white balance.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.simulator.render.camera_controls import Development, Triple

Image = NDArray[np.float32]
Bytes = NDArray[np.uint8]
Box = tuple[int, int, int, int]
Planes = tuple[Image, Image, Image]
"""Of Y (H, W), U and V (H / 2, W / 2)."""

_TABLE_BITS = 20
_REACH = 3  # px, half width of the point spread kernel


class Sensor:
    """Turns radiance (3, H, W) into packed I420 bytes. The background is exposed once; frames change only a box."""

    def __init__(self, background: Image, psf_sigma_px: float, development: Development, seed: int) -> None:
        """`background` (3, H, W): what every frame shows outside its box."""
        _, height, width = background.shape
        self._kernel = psf_kernel(psf_sigma_px)
        self._noise = np.random.default_rng([seed, 77]).standard_normal(1 << _TABLE_BITS, dtype=np.float32)
        self._random = np.random.default_rng([seed, 78])
        self._blurred = np.empty_like(background)
        self._work = np.empty_like(background)
        self._means, self._sigmas = _empty_planes(width, height), _empty_planes(width, height)
        self.adjust(background, development)

    def adjust(self, background: Image, development: Development) -> None:
        """From now on another background, other settings."""
        _, height, width = background.shape
        self._development = development
        self._develop(background, (0, 0, width, height))
        self._empty = [plane.copy() for plane in (*self._means, *self._sigmas)]

    def expose(self, image: Image, box: Box, out: Bytes) -> None:
        """Write the packed I420 frame (H * 3 / 2 * W,) of `image`, which differs from the background only in `box`."""
        grown = self._grow(box)
        if grown[0] < grown[2]:
            self._develop(image, grown)
        width = self._means[0].shape[1]
        flat, start = out.reshape(-1), 0
        for mean, sigma in zip(self._means, self._sigmas, strict=True):
            offsets = self._random.integers(0, (1 << _TABLE_BITS) - width, mean.shape[0])
            read_out(mean, sigma, self._noise, offsets, flat[start:start + mean.size].reshape(mean.shape))
            start += mean.size
        if grown[0] < grown[2]:
            self._restore(grown)

    def _develop(self, image: Image, box: Box) -> None:
        blur(image, self._kernel, box, self._work, self._blurred)
        to_planes(self._blurred, self._development, box, self._means, self._sigmas)

    def _restore(self, box: Box) -> None:
        x0, y0, x1, y1 = box
        for k, (plane, empty) in enumerate(zip((*self._means, *self._sigmas), self._empty, strict=True)):
            step = 1 if k % 3 == 0 else 2
            area = np.s_[y0 // step:y1 // step, x0 // step:x1 // step]
            plane[area] = empty[area]

    def _grow(self, box: Box) -> Box:
        """The box that the point spread reaches, on even pixels inside the image."""
        height, width = self._means[0].shape
        x0, y0, x1, y1 = box
        if x0 >= x1:
            return 0, 0, 0, 0
        return (max(x0 - _REACH, 0) & ~1, max(y0 - _REACH, 0) & ~1,
                min((x1 + _REACH + 1) & ~1, width), min((y1 + _REACH + 1) & ~1, height))


def psf_kernel(sigma_px: float) -> Image:
    """Gaussian of 7 taps that sums to one; a single tap of one for sigma 0."""
    offsets = np.arange(-_REACH, _REACH + 1)
    taps = np.exp(-0.5 * (offsets / sigma_px) ** 2) if sigma_px > 0.0 else (offsets == 0).astype(np.float64)
    return np.asarray(taps / taps.sum(), dtype=np.float32)


def _empty_planes(width: int, height: int) -> Planes:
    half = height // 2, width // 2
    return np.empty((height, width), np.float32), np.empty(half, np.float32), np.empty(half, np.float32)


@njit(cache=True, fastmath=True)
def blur(image: Image, kernel: Image, box: Box, work: Image, out: Image) -> None:
    """Separable convolution of `image` (3, H, W) into `out` inside the box; borders repeat the edge pixel."""
    x0, y0, x1, y1 = box
    _, height, width = image.shape
    reach = len(kernel) // 2
    left, right = max(x0 - reach, 0), min(x1 + reach, width)
    inner, outer = max(x0, reach), min(x1, width - reach)
    for c in range(3):
        for y in range(y0, y1):
            rows, columns = work[c, y], out[c, y]
            _scale(rows[left:right], kernel[reach], image[c, y, left:right])
            for k in range(1, reach + 1):
                _add(rows[left:right], kernel[reach + k], image[c, max(y - k, 0), left:right],
                     image[c, min(y + k, height - 1), left:right])
            _scale(columns[inner:outer], kernel[reach], rows[inner:outer])
            for k in range(1, reach + 1):
                _add(columns[inner:outer], kernel[reach + k], rows[inner - k:outer - k], rows[inner + k:outer + k])
            _blur_border(rows, kernel, x0, inner, columns)
            _blur_border(rows, kernel, outer, x1, columns)


@njit(cache=True, fastmath=True)
def _scale(target: Image, weight: float, source: Image) -> None:
    for i in range(len(target)):
        target[i] = weight * source[i]


@njit(cache=True, fastmath=True)
def _add(target: Image, weight: float, before: Image, after: Image) -> None:
    for i in range(len(target)):
        target[i] += weight * (before[i] + after[i])


@njit(cache=True, fastmath=True)
def _blur_border(source: Image, kernel: Image, x0: int, x1: int, result: Image) -> None:
    reach, width = len(kernel) // 2, len(source)
    for x in range(x0, x1):
        total = np.float32(0.0)
        for k in range(-reach, reach + 1):
            total += kernel[reach + k] * source[min(max(x + k, 0), width - 1)]
        result[x] = total


@njit(cache=True, fastmath=True)
def to_planes(rgb: Image, how: Development, box: Box, means: Planes, sigmas: Planes) -> None:
    """Means and standard deviations of Y, U and V inside an even box."""
    x0, y0, x1, y1 = box
    wr, wg, wb = how.white
    fr, fg, fb = how.full
    (luma, cb, cr), (sigma_luma, sigma_cb, sigma_cr) = means, sigmas
    for y in range(y0, y1):
        for x in range(x0, x1):
            r, g, b = min(wr * rgb[0, y, x], fr), min(wg * rgb[1, y, x], fg), min(wb * rgb[2, y, x], fb)
            luma[y, x] = _mixed(how.mix[0], r, g, b) + how.offset[0]
            sigma_luma[y, x] = _sigma(how.mix[0], how, r, g, b)
    half, quarter = np.float32(0.5), np.float32(0.25)
    for y in range(y0 // 2, y1 // 2):
        for x in range(x0 // 2, x1 // 2):
            j, i = 2 * y, 2 * x
            r = min(quarter * wr * (rgb[0, j, i] + rgb[0, j, i + 1] + rgb[0, j + 1, i] + rgb[0, j + 1, i + 1]), fr)
            g = min(quarter * wg * (rgb[1, j, i] + rgb[1, j, i + 1] + rgb[1, j + 1, i] + rgb[1, j + 1, i + 1]), fg)
            b = min(quarter * wb * (rgb[2, j, i] + rgb[2, j, i + 1] + rgb[2, j + 1, i] + rgb[2, j + 1, i + 1]), fb)
            cb[y, x] = _mixed(how.mix[1], r, g, b) + how.offset[1]
            cr[y, x] = _mixed(how.mix[2], r, g, b) + how.offset[2]
            sigma_cb[y, x] = half * _sigma(how.mix[1], how, r, g, b)
            sigma_cr[y, x] = half * _sigma(how.mix[2], how, r, g, b)


@njit(cache=True, fastmath=True, inline="always")
def _mixed(mix: Triple, r: float, g: float, b: float) -> np.float32:
    return mix[0] * r + mix[1] * g + mix[2] * b


@njit(cache=True, fastmath=True, inline="always")
def _sigma(mix: Triple, how: Development, r: float, g: float, b: float) -> float:
    """Standard deviation of a mixture of channels, each of which has the variance base + slope * level."""
    wr, wg, wb = how.white
    nr = how.read * wr * wr + how.shot * wr * r
    ng = how.read * wg * wg + how.shot * wg * g
    nb = how.read * wb * wb + how.shot * wb * b
    return math.sqrt(mix[0] * mix[0] * nr + mix[1] * mix[1] * ng + mix[2] * mix[2] * nb)


@njit(cache=True, fastmath=True)
def read_out(mean: Image, sigma: Image, noise: Image, offsets: NDArray[np.int64], out: Bytes) -> None:
    """Add noise from the table of standard normals, from row `offsets` on, and quantise to 8 bits."""
    height, width = mean.shape
    for y in range(height):
        source = noise[offsets[y]:offsets[y] + width]
        for x in range(width):
            value = mean[y, x] + sigma[y, x] * source[x] + np.float32(0.5)
            value = min(max(value, np.float32(0.0)), np.float32(255.0))
            out[y, x] = np.uint8(np.int32(value))
