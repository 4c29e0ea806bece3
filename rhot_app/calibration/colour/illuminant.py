"""The lamps that a colour model must bear, and colours as a camera would show them by these.

A lamp is a temperature shift (`rhot_node.detect.illuminant`) and a brightness. Pictures are taken to have a gamma of
2.2: a factor on the light is its 2.2th root on a grey level. Nobody knows by which lamp the colours were learnt, so
every lamp of the range may become any other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.colour import Colours
from rhot_node.detect.illuminant import RGB_FROM_YCC, YCC_FROM_RGB, balance_matrix, gains_of
from rhot_node.detect.image import Plane, YuvImage

GAMMA = 2.2
WARMTH_PER_MIRED = 0.54 / 179.5
"""From 6500 K (154 mired) to 3000 K (333 mired); along Planck's curve warmth is close to linear in mired."""

LEARNT_KELVIN = 4300.0
"""Taken for the lamp of a calibration where a temperature must be named: the middle of 3000 to 6500 K, in mired."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp compared with the one of the calibration: `temperature_shift`, 0 for the same, and factor on the light."""

    temperature_shift: float = 0.0
    brightness: float = 1.0

    @property
    def gains(self) -> NDArray[np.float64]:
        """(3,) factors on the grey levels of red, green and blue."""
        return np.asarray(self.brightness ** (1.0 / GAMMA) * gains_of(self.temperature_shift))


SAME = Lamp()
WARMTH_SPAN, WARMTH_STEP = 0.54, 0.27
LAMPS = tuple(Lamp(WARMTH_STEP * step, brightness) for step in (-2, -1, 0, 1, 2) for brightness in (0.8, 1.0, 1.2))
"""+-20 % of light, and every change between 3000 and 6500 K."""


def chances(lamps: Sequence[Lamp]) -> NDArray[np.float64]:
    """(N,) how often each of the lamps comes, 1 in all, when any two of 3000 to 6500 K meet.

    The lamp of the calibration and the one of tomorrow are both even over the range in mired, so their difference is
    triangular: the whole range is between them only if one is its one end and the other its other. `lamps` are
    WARMTH_STEP apart; those of one warmth share.
    """
    warmths = np.array([lamp.temperature_shift for lamp in lamps])
    edges = np.clip(np.abs(warmths)[:, None] + (-0.5 * WARMTH_STEP, 0.5 * WARMTH_STEP), -WARMTH_SPAN, WARMTH_SPAN)
    within = np.sign(edges) * (1.0 - (1.0 - np.abs(edges) / WARMTH_SPAN) ** 2)
    shared = np.array([np.count_nonzero(np.isclose(warmths, temperature_shift)) for temperature_shift in warmths])
    share = (within[:, 1] - within[:, 0]) / shared
    return np.asarray(share / share.sum())


def kelvin_of(temperature_shift: float) -> float:
    """About the colour temperature of a lamp of this warmth, K, when the calibration's lamp had LEARNT_KELVIN."""
    return 1e6 / max(1e6 / LEARNT_KELVIN + temperature_shift / WARMTH_PER_MIRED, 40.0)


def relit(colours: Colours, lamp: Lamp) -> Colours:
    """(N, 3) Y, Cb, Cr by another lamp; channels clip at 0 and 255, bytes are rounded."""
    to_rgb = (RGB_FROM_YCC.T * lamp.gains).astype(np.float32)
    rgb = np.clip(colours.astype(np.float32) @ to_rgb, 0.0, 255.0)
    return np.rint(rgb @ YCC_FROM_RGB.T.astype(np.float32))


def balanced(colours: Colours, temperature_shift: float) -> Colours:
    """(N, 3) Y, Cb, Cr as the detector corrects them when it takes the light to have this warmth."""
    chroma = np.clip(np.rint(colours @ balance_matrix(temperature_shift).T.astype(np.float32)), -128.0, 127.0)
    return np.column_stack([colours[:, 0], chroma])


def relit_image(image: YuvImage, lamp: Lamp) -> YuvImage:
    """The picture by another lamp. Luma keeps the contrast that it has inside every chroma pixel."""
    height, width = image.u.shape
    mean = cv2.resize(image.y, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
    colours = cv2.merge([mean, image.u - np.float32(128.0), image.v - np.float32(128.0)])
    rgb = cv2.transform(colours, lamp.gains[:, None] * RGB_FROM_YCC)
    lit = cv2.transform(np.clip(rgb, 0.0, 255.0, out=rgb), YCC_FROM_RGB)
    factor = cv2.resize(lit[:, :, 0] / np.maximum(mean, 1.0), image.size, interpolation=cv2.INTER_NEAREST)
    luma = cv2.multiply(image.y, factor, dtype=cv2.CV_8U)
    return YuvImage(_bytes(luma), _bytes(lit[:, :, 1] + 128.0), _bytes(lit[:, :, 2] + 128.0))


def _bytes(plane: NDArray[Any]) -> Plane:
    return np.clip(np.rint(plane), 0.0, 255.0).astype(np.uint8)
