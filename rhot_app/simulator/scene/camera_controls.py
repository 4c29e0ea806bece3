"""What a simulated camera is told, and what that does to a picture: gains, white balance, contrast, saturation.

The units are libcamera's, so that a setting found on the twin means the same on a Raspberry Pi.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.simulator.scene.lamp import level_gain
from rhot_node.config import CameraSettings

Image = NDArray[np.float32]

FULL: Final = 255.0
_MID_GREY: Final = 128.0
_BT601: Final = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])

Factor = Annotated[float, Meta(gt=0, le=1000)]


class Controls(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the simulated sensor (RHOT 7.1); the defaults change nothing.

    `gain`: of the amplifier, on light and noise. `red_gain`, `blue_gain`: white balance, on linear light. `contrast`:
    about mid grey. `brightness`: -1..1, added in halves of the range. `saturation`: on chroma, 0 is grey.
    """

    gain: Factor = 1.0
    red_gain: Factor = 1.0
    blue_gain: Factor = 1.0
    saturation: Annotated[float, Meta(ge=0, le=32)] = 1.0
    brightness: Annotated[float, Meta(ge=-1, le=1)] = 0.0
    contrast: Annotated[float, Meta(ge=0, le=32)] = 1.0


def controls_of(camera: CameraSettings) -> Controls:
    """What a node tells its camera; what it leaves open stays neutral, what is out of range is taken to its end."""
    def within(value: float | None, default: float, low: float, high: float) -> float:
        return default if value is None else min(max(value, low), high)

    return Controls(
        gain=within(camera.gain, 1.0, 1e-3, 1000.0),
        red_gain=within(camera.red_gain, 1.0, 1e-3, 1000.0),
        blue_gain=within(camera.blue_gain, 1.0, 1e-3, 1000.0),
        saturation=within(camera.saturation, 1.0, 0.0, 32.0),
        brightness=within(camera.brightness, 0.0, -1.0, 1.0),
        contrast=within(camera.contrast, 1.0, 0.0, 32.0))


@dataclass(frozen=True, slots=True)
class Development:
    """From the sensor's grey levels (red, green, blue) to Y, U and V: `mix` @ min(`white` * level, `full`) + `offset`.

    `white`, `full`, `offset` (3,), `mix` (3, 3). `read` and `shot`: noise variance of a channel before `white` is
    read + shot * level, grey levels squared.
    """

    white: Image
    full: Image
    mix: Image
    offset: Image
    read: float
    shot: float


def development(controls: Controls, noise_mid_grey: float, noise_read: float) -> Development:
    """What `controls` do. `noise_mid_grey`, `noise_read`: sigma of a channel at level 128 and at 0 with a gain of 1.

    A gain makes do with less light for the same level: read noise grows with the gain, shot noise with its root.
    """
    white = level_gain(np.array([controls.red_gain, 1.0, controls.blue_gain]))
    mix = controls.contrast * _BT601
    mix[1:] *= controls.saturation
    luma = _MID_GREY * (1.0 - controls.contrast + controls.brightness)
    shot = max(noise_mid_grey**2 - noise_read**2, 0.0) / _MID_GREY
    return Development(
        white=white.astype(np.float32), full=(FULL * np.minimum(white, 1.0)).astype(np.float32),
        mix=mix.astype(np.float32), offset=np.array([luma, _MID_GREY, _MID_GREY], dtype=np.float32),
        read=(controls.gain * noise_read)**2, shot=controls.gain * shot)
