"""The image sensor: point spread of the lens, colour conversion to planar YUV420, shot and read noise, 8 bits.

Grey levels 0..255. Each colour channel of a pixel has noise of variance read^2 + shot * level; its share in Y and,
after the mean over 2 x 2 pixels, in U and V is what independent channels would give.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Image = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_TABLE_BITS = 20
_REACH = 3  # px, half width of the point spread kernel
_MID_GREY = 128.0


class Sensor:
    """Turns radiance (3, H, W) into packed I420 bytes. The background is exposed once; frames change only a box."""

    def __init__(self, background: Image, psf_sigma_px: float, noise_mid_grey: float, noise_read: float,
                 seed: int) -> None:
        """`noise_mid_grey`: sigma of a channel at level 128, `noise_read`: at level 0, grey levels."""
        _, height, width = background.shape
        self._kernel = psf_kernel(psf_sigma_px)
        self._read = noise_read**2
        self._shot = max(noise_mid_grey**2 - noise_read**2, 0.0) / _MID_GREY
        self._noise = np.random.default_rng([seed, 77]).standard_normal(1 << _TABLE_BITS, dtype=np.float32)
        self._random = np.random.default_rng([seed, 78])
        self._blurred = np.empty_like(background)
        self._work = np.empty_like(background)
        self._means = [np.empty(shape, np.float32) for shape in _plane_shapes(width, height)]
        self._sigmas = [np.empty(shape, np.float32) for shape in _plane_shapes(width, height)]
        self._develop(background, (0, 0, width, height))
        self._empty = [plane.copy() for plane in (*self._means, *self._sigmas)]

    def expose(self, image: Image, box: tuple[int, int, int, int], out: Bytes) -> None:
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

    def _develop(self, image: Image, box: tuple[int, int, int, int]) -> None:
        x0, y0, x1, y1 = box
        blur(image, self._kernel, x0, y0, x1, y1, self._work, self._blurred)
        to_planes(self._blurred, self._read, self._shot, x0, y0, x1, y1, *self._means, *self._sigmas)

    def _restore(self, box: tuple[int, int, int, int]) -> None:
        x0, y0, x1, y1 = box
        for k, (plane, empty) in enumerate(zip((*self._means, *self._sigmas), self._empty, strict=True)):
            step = 1 if k % 3 == 0 else 2
            area = np.s_[y0 // step:y1 // step, x0 // step:x1 // step]
            plane[area] = empty[area]

    def _grow(self, box: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
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


def _plane_shapes(width: int, height: int) -> tuple[tuple[int, int], ...]:
    return (height, width), (height // 2, width // 2), (height // 2, width // 2)


@njit(cache=True, fastmath=True)
def blur(image: Image, kernel: Image, x0: int, y0: int, x1: int, y1: int, work: Image, out: Image) -> None:
    """Separable convolution of `image` (3, H, W) into `out` inside the box; borders repeat the edge pixel."""
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
def to_planes(rgb: Image, read: float, shot: float, x0: int, y0: int, x1: int, y1: int, luma: Image, cb: Image,
              cr: Image, sigma_luma: Image, sigma_cb: Image, sigma_cr: Image) -> None:
    """Full-range BT.601 means and standard deviations of Y, U, V inside an even box."""
    f = np.float32
    base, slope = f(read), f(shot)
    for y in range(y0, y1):
        for x in range(x0, x1):
            r, g, b = rgb[0, y, x], rgb[1, y, x], rgb[2, y, x]
            luma[y, x] = f(0.299) * r + f(0.587) * g + f(0.114) * b
            sigma_luma[y, x] = math.sqrt(f(0.089401) * (base + slope * r) + f(0.344569) * (base + slope * g)
                                         + f(0.012996) * (base + slope * b))
    for y in range(y0 // 2, y1 // 2):
        for x in range(x0 // 2, x1 // 2):
            j, i = 2 * y, 2 * x
            r = f(0.25) * (rgb[0, j, i] + rgb[0, j, i + 1] + rgb[0, j + 1, i] + rgb[0, j + 1, i + 1])
            g = f(0.25) * (rgb[1, j, i] + rgb[1, j, i + 1] + rgb[1, j + 1, i] + rgb[1, j + 1, i + 1])
            b = f(0.25) * (rgb[2, j, i] + rgb[2, j, i + 1] + rgb[2, j + 1, i] + rgb[2, j + 1, i + 1])
            cb[y, x] = f(128.0) - f(0.168736) * r - f(0.331264) * g + f(0.5) * b
            cr[y, x] = f(128.0) + f(0.5) * r - f(0.418688) * g - f(0.081312) * b
            vr, vg, vb = base + slope * r, base + slope * g, base + slope * b
            sigma_cb[y, x] = f(0.5) * math.sqrt(f(0.028472) * vr + f(0.109736) * vg + f(0.25) * vb)
            sigma_cr[y, x] = f(0.5) * math.sqrt(f(0.25) * vr + f(0.175300) * vg + f(0.006612) * vb)


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
