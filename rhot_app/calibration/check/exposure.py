"""Is a picture exposed well? What is too bright and too dark for the camera, in the picture and inside the markers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.illuminant import GAMMA
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.errors import CalibrationError
from rhot_node.config import CameraSettings
from rhot_node.detect.colour import Box, Colours, box_mask, colours_of
from rhot_node.detect.illuminant import RGB_FROM_YCC
from rhot_node.detect.image import YuvImage

Mask = NDArray[np.bool_]

BRIGHT, DARK = 250, 8  # grey levels of luma, inclusive
CUT_OFF = 252.0  # grey levels of a colour channel
PICTURE_OVER = (0.02, 0.15)  # of the picture: fair from, poor from
PICTURE_UNDER = (0.6, 0.9)  # dark cloth is no mistake
MARKER_OVER = (0.05, 0.4)
MARKER_DIM = (60.0, 30.0)  # grey levels of a marker's brightest channel, median
AIM = 200.0  # grey levels that the brightest channel of the brightest markers should reach
BLUR_MS = 8.0  # longer exposures blur a moving hand: 2 m/s at 0.6 m by 14 px


@dataclass(frozen=True, slots=True)
class Exposed:
    """Shares 0..1 of the pixels of a picture, or of one marker in it.

    `over`, `under`: luma at the ends of the range. `channels` (red, green, blue): that colour cut off at the top, which
    falsifies the hue long before luma shows it. `peak`: 95th percentile of the brightest channel, grey levels, `median`
    its median.
    """

    over: float
    under: float
    channels: tuple[float, float, float]
    peak: float
    median: float


@dataclass(frozen=True, slots=True)
class ExposureReport:
    """The `picture` as a whole, its `markers` by name, and the `factor` on the exposure that would suit."""

    picture: Exposed
    markers: dict[str, Exposed]
    factor: float
    findings: tuple[Finding, ...]


def measure_exposure(image: YuvImage, markers: Mapping[str, Mask] | None = None,
                     settings: CameraSettings | None = None) -> ExposureReport:
    """How a picture is exposed. `markers`: chroma pixels (H/2, W/2) of each, as the detector's `paint_mask` gives them.

    `settings`: what the camera is set to now, so that the advice can name values.
    """
    whole = np.ones(image.u.shape, dtype=np.bool_)
    picture = _exposed(colours_of(image, whole), image.y.reshape(-1))
    inside = {name: _exposed(colours) for name, mask in (markers or {}).items()
              if len(colours := colours_of(image, mask))}
    factor = _factor(picture, inside)
    return ExposureReport(picture, inside, factor, tuple(_findings(picture, inside, factor, settings)))


def _exposed(colours: Colours, luma: NDArray[np.uint8] | None = None) -> Exposed:
    rgb = colours @ RGB_FROM_YCC.T
    brightest = rgb.max(axis=1)
    levels = colours[:, 0] if luma is None else luma
    red, green, blue = np.mean(rgb >= CUT_OFF, axis=0)
    return Exposed(float(np.mean(levels >= BRIGHT)), float(np.mean(levels <= DARK)),
                   (float(red), float(green), float(blue)), float(np.percentile(brightest, 95.0)),
                   float(np.median(brightest)))


def _factor(picture: Exposed, markers: Mapping[str, Exposed]) -> float:
    """On the exposure time. Cut-off channels hide how far beyond they are: then at least a third less."""
    peak = max((one.peak for one in markers.values()), default=picture.peak)
    factor = (AIM / max(peak, 10.0)) ** GAMMA
    over = max((max(one.channels) for one in markers.values()), default=max(picture.channels))
    return float(min(max(factor if over < PICTURE_OVER[0] else min(factor, 0.67), 0.1), 10.0))


def _findings(picture: Exposed, markers: Mapping[str, Exposed], factor: float,
              settings: CameraSettings | None) -> list[Finding]:
    darker, brighter = _darker(min(factor, 0.67), settings), _brighter(max(factor, 1.5), settings)
    shares = {name: max(one.over, *one.channels) for name, one in markers.items()}
    over = {name: share for name, share in shares.items() if share >= MARKER_OVER[0]}
    dim = {name: one.median for name, one in markers.items() if name not in over and one.median <= MARKER_DIM[0]}
    findings = []
    if over:
        worst = max(over, key=lambda name: over[name])
        channel = ("red", "green", "blue")[int(np.argmax(markers[worst].channels))]
        findings.append(Finding(
            "marker_over", _grade(over[worst], MARKER_OVER),
            f"{_and(over)} too bright for the camera: {100.0 * over[worst]:.0f} % of {worst} is cut off in {channel}.",
            "The hue is wrong there.", darker))
    if dim:
        worst = min(dim, key=lambda name: dim[name])
        findings.append(Finding(
            "marker_under", Grade.POOR if dim[worst] <= MARKER_DIM[1] else Grade.FAIR,
            f"{_and(dim)} too dark: {worst} reaches a level of {dim[worst]:.0f} of 255 only.",
            "Noise blurs the hue.", brighter))
    if picture.over >= PICTURE_OVER[0]:
        findings.append(Finding(
            "over", _grade(picture.over, PICTURE_OVER),
            f"{100.0 * picture.over:.0f} % of the picture is white beyond what the camera can tell.",
            "The exposure is too long, or a lamp or window is in the picture.",
            darker + (" A lamp in the picture does no harm while no marker passes before it." if markers else "")))
    if picture.under >= PICTURE_UNDER[0] and picture.peak < AIM:
        findings.append(Finding("under", _grade(picture.under, PICTURE_UNDER),
                                f"{100.0 * picture.under:.0f} % of the picture is black.",
                                "There is too little light.", brighter))
    return findings


def _and(names: Iterable[str]) -> str:
    """E.g. "thumb, index and wrist are"."""
    *others, last = names
    return f"{', '.join(others)} and {last} are" if others else f"{last} is"


def _grade(share: float, limits: tuple[float, float]) -> Grade:
    return Grade.POOR if share >= limits[1] else Grade.FAIR


def _darker(factor: float, settings: CameraSettings | None) -> str:
    if settings is None:
        return "Shorten the exposure time; if it is short already, lower the gain."
    wanted = _rounded(factor * settings.exposure_us)
    return f"Shorten exposure to {_ms(wanted)}."


def _brighter(factor: float, settings: CameraSettings | None) -> str:
    if settings is None:
        return "Give more light; else lengthen the exposure time, then raise the gain."
    now, longest_us = settings.exposure_us, min(1e6 / settings.fps, 1e3 * BLUR_MS)
    wanted = _rounded(min(factor * now, longest_us))
    if wanted <= 1.2 * now:
        return (f"Give more light, or raise the gain {factor:.1f} times: an exposure beyond {_ms(longest_us)} blurs "
                "a moving hand.")
    rest = factor * now / wanted
    more = "" if rest < 1.2 else f", and give more light or raise the gain {rest:.1f} times"
    return f"Lengthen exposure to {_ms(wanted)}{more}."


def _ms(exposure_us: float) -> str:
    """An exposure time as the camera wizard shows it, e.g. "11.7 ms"."""
    return f"{exposure_us / 1000.0:.{1 if exposure_us >= 1000.0 else 2}f} ms"


def _rounded(value_us: float) -> float:
    return round(value_us, -2) if value_us >= 1000.0 else round(value_us, -1)


# -- white balance from a grey patch -----------------------------------------------------------------------------------

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
    return WhiteBalance(cast, red_gain, blue_gain, tuple(_balance_findings(cast, red_gain, blue_gain, settings)))


def _balance_findings(cast: tuple[float, float], red_gain: float | None, blue_gain: float | None,
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
