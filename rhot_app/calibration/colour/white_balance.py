"""White balance from a grey patch: which red and blue gains make grey grey."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.errors import CalibrationError
from rhot_node.config import CameraSettings
from rhot_node.detect.colour import Box, box_mask, colours_of
from rhot_node.detect.illuminant import RGB_FROM_YCC
from rhot_node.detect.image import YuvImage

EXPONENT = 1.5
"""A gain acts on linear light, and the picture is usually encoded with a gamma of 2.2: a correction by the ratio to the
power of 2.2 would be exact there, and overshoot without end in a picture without gamma. In between both come to rest: a
third of the error is left each time in one, half of it with the other sign in the other."""

GREY_CAST = (0.04, 0.15)  # of the luma: fair from, poor from
SPREAD_MOST = 12.0  # grey levels of chroma inside a patch that is of one colour
LEVELS = (30.0, 240.0)  # grey levels of luma that a patch may have: else it is black or cut off


@dataclass(frozen=True, slots=True)
class WhiteBalance:
    """`cast` (red, blue): how far the patch is from grey, as factors on green.

    `red_gain`, `blue_gain`: what to set next, in the camera's units; None where the present ones are unknown.
    `findings`: empty when the patch is grey.
    """

    cast: tuple[float, float]
    red_gain: float | None
    blue_gain: float | None
    findings: tuple[Finding, ...]


def balance_on_grey(image: YuvImage, box: Box, settings: CameraSettings | None = None) -> WhiteBalance:
    """Look at a grey patch in `box` (x0, y0, x1, y1) luma px; repeat after every change until it says nothing more.

    Raises CalibrationError when the box holds no patch of one colour, or one that is black or cut off.
    """
    colours = colours_of(image, box_mask(image, [box]))
    if len(colours) < 12:
        raise CalibrationError("the grey patch is too small; draw the box larger, inside the picture.")
    luma, cb, cr = np.median(colours, axis=0)
    spread = float(np.max(np.percentile(colours[:, 1:], 95, axis=0) - np.percentile(colours[:, 1:], 5, axis=0)))
    if spread > SPREAD_MOST:
        raise CalibrationError(f"the patch is not of one colour (its chroma differs by {spread:.0f} grey levels); draw "
                               "the box inside a sheet of grey or white paper.")
    red, green, blue = RGB_FROM_YCC @ (luma, cb, cr)
    if not LEVELS[0] <= luma <= LEVELS[1] or max(red, green, blue) > 250.0:
        which = "dark" if luma < LEVELS[0] else "bright"
        raise CalibrationError(f"the patch is too {which} (level {luma:.0f}) to show its colour; change the exposure, "
                               "or use a grey that is lit well.")
    cast = float(red / green), float(blue / green)
    gains = settings and (settings.red_gain, settings.blue_gain)
    red_gain, blue_gain = (None if gain is None else round(gain * one ** -EXPONENT, 3)
                           for gain, one in zip(gains or (None, None), cast, strict=True))
    return WhiteBalance(cast, red_gain, blue_gain, tuple(_findings(cast, red_gain, blue_gain, settings)))


def _findings(cast: tuple[float, float], red_gain: float | None, blue_gain: float | None,
              settings: CameraSettings | None) -> list[Finding]:
    worst = max(abs(one - 1.0) for one in cast)
    if worst < GREY_CAST[0]:
        return []
    parts = []
    for name, one, gain in (("red", cast[0], red_gain), ("blue", cast[1], blue_gain)):
        if abs(one - 1.0) >= GREY_CAST[0] / 2.0:
            change = "Lower" if one > 1.0 else "Raise"
            parts.append(f"{change} {name}_gain" + (f" to {gain:g}." if gain is not None else f" by a factor of "
                                                    f"{one ** -EXPONENT:.2f}."))
    return [Finding("white_balance", Grade.POOR if worst >= GREY_CAST[1] else Grade.FAIR,
                    f"Grey has {100.0 * (cast[0] - 1.0):+.0f} % red and {100.0 * (cast[1] - 1.0):+.0f} % blue.",
                    "The camera's white balance does not suit this lamp.", " ".join(parts))]
