"""The lamps that a colour model must bear, and colours as a camera would show them by these.

A lamp is a warmth (`rhot_node.detect.light`) and a brightness. Pictures are taken to have the usual gamma of 2.2: a
factor on the light is its 2.2th root on a grey level. Nobody knows by which lamp the colours were learnt, so every lamp
of the range may become any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.colour import Colours
from rhot_node.detect.image import Plane, YuvImage
from rhot_node.detect.light import RGB_FROM_YCC, YCC_FROM_RGB, balance_matrix, gains_of

GAMMA = 2.2
WARMTH_PER_MIRED = 0.54 / 179.5
"""From 6500 K (154 mired) to 3000 K (333 mired); along Planck's curve warmth is close to linear in mired."""

LEARNT_KELVIN = 4300.0
"""Taken for the lamp of a calibration where a temperature must be named: the middle of 3000 to 6500 K, in mired."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp compared with the one of the calibration: `warmth`, 0 for the same, and factor on the light."""

    warmth: float = 0.0
    brightness: float = 1.0

    @property
    def gains(self) -> NDArray[np.float64]:
        """(3,) factors on the grey levels of red, green and blue."""
        return np.asarray(self.brightness ** (1.0 / GAMMA) * gains_of(self.warmth))


SAME = Lamp()
LAMPS = tuple(Lamp(warmth, brightness) for warmth in (-0.54, -0.27, 0.0, 0.27, 0.54) for brightness in (0.8, 1.0, 1.2))
"""+-20 % of light, and every change between 3000 and 6500 K."""


def kelvin_of(warmth: float) -> float:
    """About the colour temperature of a lamp of this warmth, K, when the calibration's lamp had LEARNT_KELVIN."""
    return 1e6 / max(1e6 / LEARNT_KELVIN + warmth / WARMTH_PER_MIRED, 40.0)


def relit(colours: Colours, lamp: Lamp) -> Colours:
    """(N, 3) Y, Cb, Cr by another lamp; channels clip at 0 and 255, bytes are rounded."""
    to_rgb = (RGB_FROM_YCC.T * lamp.gains).astype(np.float32)
    rgb = np.clip(colours.astype(np.float32) @ to_rgb, 0.0, 255.0)
    return np.rint(rgb @ YCC_FROM_RGB.T.astype(np.float32))


def balanced(colours: Colours, warmth: float) -> Colours:
    """(N, 3) Y, Cb, Cr as the detector corrects them when it takes the light to have this warmth."""
    chroma = np.clip(np.rint(colours @ balance_matrix(warmth).T.astype(np.float32)), -128.0, 127.0)
    return np.column_stack([colours[:, 0], chroma])


def relit_image(image: YuvImage, lamp: Lamp) -> YuvImage:
    """The picture by another lamp. Luma keeps the contrast that it has inside every chroma pixel."""
    height, width = image.u.shape
    luma = image.y.astype(np.float32)
    mean = luma.reshape(height, 2, width, 2).mean(axis=(1, 3))
    colours = np.stack([mean, image.u - np.float32(128.0), image.v - np.float32(128.0)], axis=2).reshape(-1, 3)
    lit = relit(colours, lamp).reshape(height, width, 3)
    factor = np.repeat(np.repeat(lit[:, :, 0] / np.maximum(mean, 1.0), 2, axis=0), 2, axis=1)
    return YuvImage(_bytes(luma * factor), _bytes(lit[:, :, 1] + 128.0), _bytes(lit[:, :, 2] + 128.0))


def _bytes(plane: NDArray[np.float32]) -> Plane:
    return np.clip(np.rint(plane), 0.0, 255.0).astype(np.uint8)
