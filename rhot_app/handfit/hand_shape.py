"""The shape of a hand as the numbers that a fit may change, and the hand file that they make of another one.

The first 34 numbers are those of `barehand.surface`, logarithms of sizes relative to the base hand. Then follow the
places of the finger roots, Rehg's anchor points: m from the base hand's, in a right hand of the base hand's size.
"""

from __future__ import annotations

from functools import lru_cache

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand import key_frames
from rhot_app.barehand.surface import (
    FINGER_SIZE,
    FOREARM_RADIUS,
    FOREARM_TURN,
    HAND_SIZE,
    LENGTH,
    RADIUS,
    THICKNESS,
    Surface,
    surface_of,
)
from rhot_app.calibration.hand.marker_places import BASE_SD_M
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.skeleton import FINGERS

Array = NDArray[np.float64]

ROOTS = FOREARM_TURN
"""Where the 15 coordinates of the finger roots begin: in place of the forearm's rotation, which belongs to a pose."""

SIZE = ROOTS + 15

SHAPE_SD = np.append(key_frames.SHAPE_SD, np.full(SIZE - ROOTS, BASE_SD_M))
"""(SIZE,) standard deviations of the numbers in adults, relative to the base hand."""

SHAPE_LIMIT = 4.0 * SHAPE_SD
"""(SIZE,) a number's largest amount: one hand in 16 000 lies beyond."""

_DIGITS = 6  # of mm: a nanometre, as in `hand.anthropometry`


def anatomy_of(base: HandAnatomy, shape: Array) -> HandAnatomy:
    """The hand file of a hand with `shape` (SIZE,) relative to `base`. Its name, side, limits and rotations stay.

    A joint between two phalanges has the mean of their radii there, as in any hand file (`barehand.surface`).
    """
    whole, thick = np.exp(shape[HAND_SIZE]), np.exp(shape[THICKNESS])
    fingers = {}
    for k, name in enumerate(FINGERS):
        old, own = base.fingers[name], slice(3 * k, 3 * k + 3)
        bones = np.array(old.bones_mm) * whole * np.exp(shape[FINGER_SIZE] + shape[LENGTH:RADIUS][own])
        radii = np.array(old.radii_mm) * whole * thick * np.exp(shape[RADIUS:FOREARM_RADIUS][own])
        place = (np.array(old.base_mm) + 1e3 * shape[ROOTS:][own]) * whole
        fingers[name] = msgspec.structs.replace(
            old, base_mm=_three(place), bones_mm=_three(bones), radii_mm=_three(radii), bones_sd_mm=None,
            radii_sd_mm=None,
            marker_mm=min(round(float(old.marker_mm * bones[2] / old.bones_mm[2]), _DIGITS), _three(bones)[2]))
    flat = base.wrist_thickness_mm * whole * np.exp(shape[FOREARM_RADIUS])
    side = max(base.wrist_breadth_mm - base.wrist_thickness_mm, 0.0) * whole
    return msgspec.structs.replace(
        base, fingers=fingers, wrist_thickness_mm=round(float(flat), _DIGITS),
        wrist_breadth_mm=round(float(flat + side), _DIGITS),
        palm_thickness_mm=round(float(base.palm_thickness_mm * whole * thick), _DIGITS))


class Shapes:
    """Hands of one base hand by their shape; the newest are kept."""

    def __init__(self, base: HandAnatomy) -> None:
        self.base = base
        self._kept = lru_cache(maxsize=8)(self._make)

    def anatomy(self, shape: Array) -> HandAnatomy:
        """The hand file."""
        return self.model(shape).anatomy

    def model(self, shape: Array) -> HandModel:
        """The kinematic model."""
        return self._kept(shape.tobytes())[0]

    def surface(self, shape: Array) -> Surface:
        """The capsules."""
        return self._kept(shape.tobytes())[1]

    def _make(self, shape: bytes) -> tuple[HandModel, Surface]:
        model = build_model(anatomy_of(self.base, np.frombuffer(shape)))
        return model, surface_of(model)


def _three(values: Array) -> tuple[float, float, float]:
    a, b, c = (round(float(value), _DIGITS) for value in values)
    return a, b, c
