"""What a simulated camera is told, and what that does to a picture: gains, white balance, contrast, saturation.

The units are libcamera's, so that a setting found on the twin means the same on a Raspberry Pi.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Final, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_node.config import CameraSettings

# Colours of the scene are grey levels 0..255 as a camera delivers them, encoded with a gamma of 2.2. Light adds up
# before that encoding, so a factor g on the light is a factor g^(1/2.2) on the grey level.

Array = NDArray[np.float64]

GAMMA: Final = 2.2
NEUTRAL_KELVIN: Final = 6500.0
"""The white that the simulated cameras are balanced for when nobody sets their gains."""

_SRGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])


class Lamp(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The only lamp. `brightness` is a factor on the light, `kelvin` its colour temperature (6500 is neutral).

    `mains_hz` 50 or 60 makes its light swing at twice that frequency by the share `flicker` of its mean; 0: steady.
    """

    brightness: Annotated[float, Meta(gt=0, le=32)] = 1.0
    kelvin: Annotated[float, Meta(ge=1700, le=20000)] = NEUTRAL_KELVIN
    mains_hz: Annotated[float, Meta(ge=0, le=400)] = 0.0
    flicker: Annotated[float, Meta(ge=0, le=1)] = 0.3

    @property
    def flickers(self) -> bool:
        """Whether the light swings at all."""
        return self.mains_hz > 0.0 and self.flicker > 0.0


def lamp_gains(lamp: Lamp) -> Array:
    """(3,) factors on linear red, green and blue: those of a black body at `kelvin` over one at 6500 K, of equal
    luminance, times the brightness."""
    white, neutral = (_SRGB_FROM_XYZ @ _planck_xyz(kelvin) for kelvin in (lamp.kelvin, NEUTRAL_KELVIN))
    return np.asarray(lamp.brightness * np.maximum(white, 0.0) / neutral)


def level_gain(light_gain: Array | float) -> Array:
    """What factors on the light are as factors on grey levels."""
    return np.asarray(light_gain, dtype=np.float64) ** (1.0 / GAMMA)


def flicker_gain(lamp: Lamp, times_s: Array, exposure_s: float) -> Array:
    """Factors on the light that rows mid-exposed at `times_s` collect: the swing, averaged over the exposure."""
    frequency = 2.0 * lamp.mains_hz
    depth = lamp.flicker * float(np.sinc(frequency * exposure_s))
    return np.asarray(1.0 + depth * np.cos(2.0 * math.pi * frequency * times_s))


def _planck_xyz(kelvin: float) -> Array:
    """(3,) XYZ of a black body with Y = 1 (Kim et al. 2002: cubic splines of the Planckian locus, 1667 to 25000 K)."""
    t = 1e3 / kelvin
    if kelvin <= 4000.0:
        x = ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910
    else:
        x = ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.240390
    if kelvin <= 2222.0:
        y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
    elif kelvin <= 4000.0:
        y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
    else:
        y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483
    return np.array([x / y, 1.0, (1.0 - x - y) / y])


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


_RANGES: Final = {"gain": (1e-3, 1000.0), "red_gain": (1e-3, 1000.0), "blue_gain": (1e-3, 1000.0),
                  "saturation": (0.0, 32.0), "brightness": (-1.0, 1.0), "contrast": (0.0, 32.0)}


def controls_of(camera: CameraSettings) -> Controls:
    """What a node tells its camera; what it leaves open stays neutral, what is out of range is taken to its end."""
    told = {name: getattr(camera, name) for name in _RANGES}
    return Controls(**{name: min(max(told[name], low), high) for name, (low, high) in _RANGES.items()
                       if told[name] is not None})


Triple = tuple[np.float32, np.float32, np.float32]


class Development(NamedTuple):
    """From the sensor's grey levels (red, green, blue) to Y, U and V: `mix` @ min(`white` * level, `full`) + `offset`.

    `read` and `shot`: noise variance of a channel before `white` is read + shot * level, grey levels squared.
    """

    white: Triple
    full: Triple
    mix: tuple[Triple, Triple, Triple]
    offset: Triple
    read: np.float32
    shot: np.float32


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
        white=_triple(white), full=_triple(FULL * np.minimum(white, 1.0)),
        mix=(_triple(mix[0]), _triple(mix[1]), _triple(mix[2])), offset=_triple([luma, _MID_GREY, _MID_GREY]),
        read=np.float32((controls.gain * noise_read)**2), shot=np.float32(controls.gain * shot))


def _triple(values: Iterable[float]) -> Triple:
    a, b, c = (np.float32(value) for value in values)
    return a, b, c
