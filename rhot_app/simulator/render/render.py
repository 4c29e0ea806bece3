"""One camera of the twin: what a painter paints becomes YUV420 frames, through lamp, lens and sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.simulator.render.camera_controls import (
    Controls,
    Development,
    Lamp,
    development,
    flicker_gain,
    lamp_gains,
    level_gain,
)
from rhot_app.simulator.render.exposure_samples import FrameTime, Shutter
from rhot_app.simulator.render.painter import Box, Image, Painter, PoseSource, lit_image
from rhot_app.simulator.render.sensor import Sensor

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Optics:
    """How the image degrades: PSF sigma px, noise sigma in grey levels at 128 and at 0."""

    psf_sigma_px: float
    noise_mid_grey: float
    noise_read: float


@dataclass(frozen=True, slots=True)
class Exposure:
    """How the picture comes about: the lamp, the shutter, the camera's settings, the exposure time (s) at which a
    lamp of brightness 1 gives the scene its own grey levels, and whether a cap is on the lens."""

    shutter: Shutter
    nominal_s: float
    lamp: Lamp
    controls: Controls
    covered: bool = False

    @property
    def level(self) -> Array:
        """(3,) factors on the grey levels of red, green and blue."""
        if self.covered:
            return np.zeros(3)
        return level_gain(lamp_gains(self.lamp) * self.shutter.exposure_s / self.nominal_s * self.controls.gain)


class FrameRenderer:
    """Renders frames of one camera. Holds work space: one thread only, results are valid until the next call."""

    def __init__(self, painter: Painter, background: Image, optics: Optics, exposure: Exposure, seed: int) -> None:
        """`background` (3, H, W) grey levels 0..255 as `background.background_image` makes it."""
        _, self._height, width = background.shape
        self._painter, self._background, self._optics = painter, background, optics
        self._frame = np.empty(self._height * 3 // 2 * width, np.uint8)
        self._light(exposure)
        self._sensor = Sensor(self._lit.background, optics.psf_sigma_px, self._development(), seed)

    @property
    def exposure(self) -> Exposure:
        """How the pictures come about."""
        return self._exposure

    def expose(self, exposure: Exposure) -> None:
        """Another lamp, another shutter, other settings, from the next frame on."""
        self._light(exposure)
        self._sensor.adjust(self._lit.background, self._development())

    def show(self, painter: Painter) -> None:
        """Something else before the camera, from the next frame on."""
        self._painter = painter
        self._lit.image[:] = self._lit.background

    def render(self, source: PoseSource, t_row0_s: float, number: int) -> tuple[NDArray[np.uint8], Array]:
        """Packed I420 frame (H * 3 / 2 * W,) whose row 0 is mid-exposed at `t_row0_s`, and visible fractions (M,)."""
        image, box, visible = self.radiance(source, t_row0_s, number)
        self._sensor.expose(image, box, self._frame)
        x0, y0, x1, y1 = box
        image[:, y0:y1, x0:x1] = self._lit.background[:, y0:y1, x0:x1]
        return self._frame, visible

    def radiance(self, source: PoseSource, t_row0_s: float, number: int) -> tuple[Image, Box, Array]:
        """The image before lens and sensor (3, H, W), the box that may differ from the background, visible parts."""
        time = FrameTime(self._exposure.shutter, self._height, t_row0_s)
        box, visible = self._painter.paint(self._lit, source, time, number)
        image = self._lit.image
        if self._exposure.lamp.flickers:
            image *= self._flicker(time)[:, None]
            box = (0, 0, image.shape[2], self._height)
        return image, box, visible

    def _light(self, exposure: Exposure) -> None:
        self._exposure, self._lit = exposure, lit_image(self._background, exposure.level)

    def _flicker(self, time: FrameTime) -> Image:
        """(H,) factors on the rows' grey levels."""
        rows_s = time.t_row0_s + time.shutter.row_time_s * np.arange(time.height, dtype=np.float64)
        return level_gain(flicker_gain(self._exposure.lamp, rows_s, time.shutter.exposure_s)).astype(np.float32)

    def _development(self) -> Development:
        return development(self._exposure.controls, self._optics.noise_mid_grey, self._optics.noise_read)
