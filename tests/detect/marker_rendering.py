"""Synthetic markers for the detection tests and benchmark: 8x8 supersampled shapes, shading, lens blur, sensor noise.

Pixels: (0, 0) is the centre of the top-left pixel. Colours are RGB grey levels.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.image import YuvImage

Array = NDArray[np.float64]
Inside = Callable[[Array, Array], NDArray[np.bool_]]
Rgb = tuple[float, float, float]

SUPERSAMPLING = 8
SKIN: Rgb = (205, 160, 135)
PSF_SIGMA = 0.7


def disc(x: float, y: float, radius: float) -> Inside:
    """A disc."""
    return lambda px, py: (px - x) ** 2 + (py - y) ** 2 <= radius**2


def capsule(start: tuple[float, float], end: tuple[float, float], radius: float) -> Inside:
    """A capsule: everything within `radius` of a segment."""
    (ax, ay), (bx, by) = start, end
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy

    def inside(px: Array, py: Array) -> NDArray[np.bool_]:
        t = np.clip(((px - ax) * dx + (py - ay) * dy) / square, 0.0, 1.0)
        return np.asarray((px - ax - t * dx) ** 2 + (py - ay - t * dy) ** 2 <= radius**2)

    return inside


def band(x: float, y: float, radius: float, length: float, tilt: float, turn: float) -> Inside:
    """The visible side of a cylinder of `radius` and `length` px whose axis point (x, y) is its middle.

    The axis lies `turn` rad from +y in the image and `tilt` rad out of it; orthographic.
    """

    def inside(px: Array, py: Array) -> NDArray[np.bool_]:
        across = (px - x) * math.cos(turn) + (py - y) * math.sin(turn)
        along = (py - y) * math.cos(turn) - (px - x) * math.sin(turn)
        arc = math.sin(tilt) * np.sqrt(np.clip(radius**2 - across**2, 0.0, None))
        return np.asarray((np.abs(across) <= radius) & (np.abs(along - arc) <= 0.5 * length * math.cos(tilt)))

    return inside


def _coverage(inside: Inside, px: Array, py: Array) -> Array:
    """(H, W) parts of pixels that a shape covers. Only those near its border are supersampled: by their neighbours'
    centres, of which a shape has some."""
    centres = np.asarray(np.broadcast_to(inside(px, py), px.shape), np.uint8)
    around = np.ones((5, 5), np.uint8)
    border = cv2.dilate(centres, around) != cv2.erode(centres, around)
    if not border.any():
        border[:] = True
    fine = (np.arange(SUPERSAMPLING) + 0.5) / SUPERSAMPLING - 0.5
    across, down = (one.ravel() for one in np.meshgrid(fine, fine))
    coverage = centres.astype(np.float64)
    coverage[border] = inside(px[border][:, None] + across, py[border][:, None] + down).mean(axis=1)
    return coverage


class Canvas:
    """An RGB picture in the making."""

    def __init__(self, width: int = 640, height: int = 480, background: Rgb = (120, 122, 118)) -> None:
        self.rgb: Array = np.empty((height, width, 3))
        self.rgb[:] = background

    def paint(self, inside: Inside, rgb: Rgb, center: tuple[float, float], reach: float,
              shading: float = 0.0, towards: float = 0.6) -> Canvas:
        """Paint a shape lying within `reach` px of `center`; it darkens by `shading` across, in direction `towards`."""
        height, width = self.rgb.shape[:2]
        x0, x1 = max(math.floor(center[0] - reach), 0), min(math.ceil(center[0] + reach) + 1, width)
        y0, y1 = max(math.floor(center[1] - reach), 0), min(math.ceil(center[1] + reach) + 1, height)
        if x0 >= x1 or y0 >= y1:
            return self
        px, py = np.meshgrid(np.arange(x0, x1), np.arange(y0, y1))
        coverage = _coverage(inside, px, py)[:, :, None]
        ramp = ((px - center[0]) * math.cos(towards) + (py - center[1]) * math.sin(towards)) / reach
        light = (1.0 - shading * 0.5 * (1.0 + np.clip(ramp, -1.0, 1.0)))[:, :, None]
        patch = self.rgb[y0:y1, x0:x1]
        patch += coverage * (np.asarray(rgb) * light - patch)
        return self

    def seen(self, psf_sigma: float = PSF_SIGMA) -> Array:
        """(H, W, 3) RGB behind the lens."""
        return np.asarray(cv2.GaussianBlur(self.rgb, (0, 0), psf_sigma)) if psf_sigma > 0 else self.rgb.copy()

    def expose(self, rng: np.random.Generator | None = None, noise: float = 3.0,
               psf_sigma: float = PSF_SIGMA) -> YuvImage:
        """Blur by the lens, add noise of `noise` grey levels per RGB sample when `rng` is given, convert to YUV420."""
        picture = self.seen(psf_sigma)
        if rng is not None:
            picture = picture + rng.normal(0.0, noise, picture.shape)
        return to_yuv(np.clip(picture, 0.0, 255.0))


def to_yuv(rgb: Array) -> YuvImage:
    """Full-range BT.601 YUV420 of (H, W, 3) RGB, chroma averaged over 2x2, rounded once."""
    height, width = rgb.shape[:2]
    luma = rgb @ np.array([0.299, 0.587, 0.114])
    mean = rgb.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    cb = mean @ np.array([-0.168736, -0.331264, 0.5]) + 128.0
    cr = mean @ np.array([0.5, -0.418688, -0.081312]) + 128.0
    planes = [np.clip(np.rint(plane), 0, 255).astype(np.uint8) for plane in (luma, cb, cr)]
    return YuvImage(*planes)
