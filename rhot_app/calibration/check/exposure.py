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
from rhot_node.detect.colour import MAGNITUDE_LEAST, Box, Colours, box_mask, colours_of
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
CHANNELS = ("red", "green", "blue")
SCENES_CAST = 1.5  # no more than skin and wood have: their red is 1.2 to 1.45 times their green


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

    @property
    def cut_off(self) -> float:
        """The share at the top of the range, in luma or in any colour channel."""
        return max(self.over, *self.channels)

    @property
    def channel(self) -> str:
        """The colour channel that is cut off most."""
        return CHANNELS[int(np.argmax(self.channels))]


@dataclass(frozen=True, slots=True)
class Range:
    """What a picture spans: `luma` from its 1st to its 99th percentile, and `chroma`, the 99.9th of its magnitude, grey
    levels. `cast`: the medians of red and blue over green, of pixels that are neither black nor cut off."""

    luma: float
    chroma: float
    cast: tuple[float, float]


@dataclass(frozen=True, slots=True)
class ExposureResult:
    """The `picture` as a whole, its `markers` by name, and the `factor` on the exposure that would suit."""

    picture: Exposed
    range: Range
    markers: dict[str, Exposed]
    factor: float
    findings: tuple[Finding, ...]

    @property
    def summary(self) -> str:
        """The main figures of the picture."""
        return f"{100.0 * self.picture.cut_off:.1f} % too bright, {100.0 * self.picture.under:.1f} % black"


def measure_exposure(image: YuvImage, markers: Mapping[str, Mask] | None = None,
                     settings: CameraSettings | None = None) -> ExposureResult:
    """How a picture is exposed. `markers`: chroma pixels (H/2, W/2) of each, as the detector's `paint_mask` gives them.

    `settings`: what the camera is set to now, so that the advice can name values.
    """
    colours = colours_of(image, np.ones(image.u.shape, dtype=np.bool_))
    picture, spans = _exposed(colours, image.y.reshape(-1)), _range(colours, image.y)
    inside = {name: _exposed(painted) for name, mask in (markers or {}).items()
              if len(painted := colours_of(image, mask))}
    factor = _factor(picture, inside)
    advice = _Remedies(settings, factor, spans.cast)
    findings = (*_marker_findings(inside, advice), *_picture_findings(picture, spans, bool(inside), advice))
    return ExposureResult(picture, spans, inside, factor, findings)


def _range(colours: Colours, luma: NDArray[np.uint8]) -> Range:
    low, high = np.percentile(luma, (1.0, 99.0))
    rgb = colours @ RGB_FROM_YCC.T
    telling = (colours[:, 0] > DARK) & (rgb.max(axis=1) < CUT_OFF)
    red, green, blue = np.median(rgb[telling], axis=0) if telling.mean() > PICTURE_OVER[1] else (1.0, 1.0, 1.0)
    return Range(float(high - low), float(np.percentile(np.hypot(colours[:, 1], colours[:, 2]), 99.9)),
                 (float(red / max(green, 1.0)), float(blue / max(green, 1.0))))


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


def _marker_findings(markers: Mapping[str, Exposed], advice: _Remedies) -> list[Finding]:
    over = {name: one.cut_off for name, one in markers.items() if one.cut_off >= MARKER_OVER[0]}
    dim = {name: one.median for name, one in markers.items() if name not in over and one.median <= MARKER_DIM[0]}
    findings = []
    if over:
        worst = max(over, key=lambda name: over[name])
        findings.append(Finding(
            "marker_over", _grade(over[worst], MARKER_OVER),
            f"{_and(over)} too bright for the camera: {100.0 * over[worst]:.0f} % of {worst} is cut off in "
            f"{markers[worst].channel}.", "The hue is wrong there.", advice.darker(markers[worst])))
    if dim:
        worst = min(dim, key=lambda name: dim[name])
        findings.append(Finding(
            "marker_under", Grade.POOR if dim[worst] <= MARKER_DIM[1] else Grade.FAIR,
            f"{_and(dim)} too dark: {worst} reaches a level of {dim[worst]:.0f} of 255 only.",
            "Noise blurs the hue.", advice.brighter()))
    return findings


def _picture_findings(picture: Exposed, spans: Range, markers: bool, advice: _Remedies) -> list[Finding]:
    """`markers`: whether any is seen, which tell more of the exposure than the room does."""
    if picture.cut_off >= PICTURE_OVER[0]:
        share = f"{100.0 * picture.cut_off:.0f} % of the picture is"
        white = picture.over >= PICTURE_OVER[0]
        return [Finding(
            "over", _grade(picture.cut_off, PICTURE_OVER),
            f"{share} white beyond what the camera can tell." if white else f"{share} cut off in {picture.channel}.",
            "The exposure is too long, or a lamp or window is in the picture." if white else "",
            advice.darker(picture) + (" A lamp in the picture does no harm while no marker passes before it."
                                      if markers and white else ""))]
    black, dim = picture.under >= PICTURE_UNDER[0] and picture.peak < AIM, picture.peak <= MARKER_DIM[0] and not markers
    if black or dim:
        worst = Grade.POOR if picture.peak <= MARKER_DIM[1] or picture.under >= PICTURE_UNDER[1] else Grade.FAIR
        figure = f"{100.0 * picture.under:.0f} % of the picture is black." if black else \
            f"The picture reaches a level of {picture.peak:.0f} of 255 only."
        return [Finding("under", worst, figure, "There is too little light.", advice.brighter())]
    if spans.luma < MAGNITUDE_LEAST:
        return [Finding("flat", Grade.POOR, f"The whole picture is of one brightness, within {spans.luma:.0f} levels.",
                        "The lens is covered, or the contrast is taken away.",
                        advice.raised("contrast") or "Uncover the lens.")]
    if spans.chroma < MAGNITUDE_LEAST:
        return [Finding("colourless", Grade.POOR,
                        f"Nothing in the picture has a colour: its chroma reaches {spans.chroma:.0f} levels, and a "
                        f"paint needs {MAGNITUDE_LEAST:.0f}.", "Markers are found by their colour.",
                        advice.raised("saturation", "contrast") or "Hold the hand before the camera. A camera without "
                        "colours sees no markers.")]
    return []


def unseen_finding(unseen: Iterable[str], settings: CameraSettings) -> list[Finding]:
    """What is to be said of markers that no picture with these settings has shown; nothing without any."""
    names = tuple(unseen)
    if not names:
        return []
    weak = _Remedies(settings, 1.0, (1.0, 1.0)).raised("saturation", "contrast")
    return [Finding("unseen", Grade.FAIR, f"{_and(names)} not seen yet.",
                    "Nothing can be said of a marker that is out of sight, or whose colour is not found.",
                    weak or "Hold the hand with all its markers before the camera.")]


def _and(names: Iterable[str]) -> str:
    """E.g. "thumb, index and wrist are"."""
    *others, last = names
    return f"{', '.join(others)} and {last} are" if others else f"{last} is"


def _grade(share: float, limits: tuple[float, float]) -> Grade:
    return Grade.POOR if share >= limits[1] else Grade.FAIR


_NEUTRAL = {"brightness": 0.0, "contrast": 1.0, "saturation": 1.0}


@dataclass(frozen=True, slots=True)
class _Remedies:
    """What to change of `settings` (None: they are unknown) in a picture with this `cast` of red and blue, when the
    light should be `factor` times what it is."""

    settings: CameraSettings | None
    factor: float
    cast: tuple[float, float]

    def darker(self, seen: Exposed) -> str:
        """For something that is cut off: what amplifies is taken back first."""
        amplified = ("brightness", "contrast", *(("saturation",) if seen.over < max(seen.channels) else ()))
        return self._changed(amplified, "Lower", 1.0) or self._less_of(seen) or self._less()

    def raised(self, *fields: str) -> str:
        """The first of these settings that takes something away."""
        return self._changed(fields, "Raise", -1.0)

    def _changed(self, fields: tuple[str, ...], verb: str, sign: float) -> str:
        """The first of `fields` that is beyond neutral, in the units of a Pi camera; a webcam's numbers differ."""
        for field in fields:
            value = getattr(self.settings, field) if self.settings is not None else None
            if value is not None and sign * (value - _NEUTRAL[field]) > 0.0:
                return f"{verb} {field} to {_NEUTRAL[field]:g}: it is {value:g}."
        return ""

    def _less_of(self, seen: Exposed) -> str:
        """What to do about red or blue that is cut off alone: its gain is too high, surely so when the whole picture
        has more of that colour than a scene has."""
        channel = seen.channel
        if channel == "green" or seen.over >= PICTURE_OVER[1]:
            return ""
        gain = getattr(self.settings, f"{channel}_gain") if self.settings is not None else None
        cast = self.cast[0 if channel == "red" else 1]
        lower = f"lower {channel}_gain" + (f" to {gain * cast ** -EXPONENT:.2f}" if gain else "")
        if cast >= SCENES_CAST:
            return f"{lower.capitalize()}: the whole picture is {channel}."
        less = self._less()
        return f"If white looks {channel}, lower {channel}_gain; else {less[0].lower()}{less[1:]}" if gain else ""

    def _less(self) -> str:
        factor = min(self.factor, 0.67)
        if self.settings is None:
            return "Shorten the exposure time; if it is short already, lower the gain."
        gain = self.settings.gain
        if gain is not None and gain > 1.0:
            first = f"Lower gain to {max(factor * gain, 1.0):.1f}"
            rest = factor * gain
            return f"{first}." if rest >= 1.0 else f"{first}, and shorten exposure to " \
                f"{_ms(_rounded(rest * self.settings.exposure_us))}."
        return f"Shorten exposure to {_ms(_rounded(factor * self.settings.exposure_us))}."

    def brighter(self) -> str:
        """For something that is too dark."""
        factor, settings = max(self.factor, 1.5), self.settings
        if settings is None:
            return "Give more light; else lengthen the exposure time, then raise the gain."
        taken = self.raised("brightness", "contrast")
        if taken:
            return taken
        now, longest_us = settings.exposure_us, min(1e6 / settings.fps, 1e3 * BLUR_MS)
        wanted = _rounded(min(factor * now, longest_us))
        if wanted <= 1.2 * now:
            return (f"Give more light, or raise the gain {factor:.1f} times: an exposure beyond {_ms(longest_us)} "
                    "blurs a moving hand.")
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
