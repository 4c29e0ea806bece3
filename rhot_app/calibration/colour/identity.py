"""Names of hues, and markers with ambiguous colours."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.paint_region import SEED_HUE_DEG, alike, surroundings
from rhot_app.calibration.colour.samples import MarkedPicture, PaintSamples
from rhot_app.calibration.colour.surroundings import HUE_BINS, HUE_STEP_DEG
from rhot_node.detect.colour import Colours
from rhot_node.markers import ChromaModel

# -- names of hues -----------------------------------------------------------------------------------------------------

PAINTS: tuple[tuple[str, float], ...] = (
    ("red", 105.0), ("orange", 134.0), ("yellow", 166.0), ("lime green", -160.0), ("green", -128.0),
    ("turquoise", -95.0), ("cyan", -62.0), ("azure", -38.0), ("blue", -14.0), ("violet", 20.0), ("magenta", 52.0),
    ("pink", 84.0))
"""Paints that can be bought, with the chroma angle of a fairly saturated one, degrees."""

APART_DEG = 25.0  # between hues of markers, as docs/markers.md asks for
SKIN_DEG = (95.0, 150.0)  # where skin and wood are: a paint there has to be more saturated than they are
ROOM_REACH_DEG = 10.0


def name_of_hue(hue_deg: float) -> str:
    """The paint whose chroma angle is nearest."""
    return min(PAINTS, key=lambda paint: _apart(paint[1], hue_deg))[0]


def free_paints(taken_deg: Sequence[float], room_px: NDArray[np.float64]) -> tuple[str, ...]:
    """Paints APART_DEG from all hues that are taken, not in the hues of skin, those that the room has least of first.

    `room_px` (72,) as `surroundings.SurroundingsResult`'s `hue_px`.
    """
    free = [(name, hue) for name, hue in PAINTS if not SKIN_DEG[0] <= hue <= SKIN_DEG[1]
            and all(_apart(hue, other) >= APART_DEG for other in taken_deg)]
    return tuple(name for name, hue in sorted(free, key=lambda paint: room_share(paint[1], room_px)))


def room_share(hue_deg: float, room_px: NDArray[np.float64]) -> float:
    """Chroma pixels of the room within ROOM_REACH_DEG of a hue."""
    middles = -180.0 + HUE_STEP_DEG * (np.arange(HUE_BINS) + 0.5)
    away = np.abs(np.remainder(middles - hue_deg + 180.0, 360.0) - 180.0)
    return float(room_px[away <= ROOM_REACH_DEG].sum())


def _apart(first: float, second: float) -> float:
    return abs((first - second + 180.0) % 360.0 - 180.0)


# -- ambiguous colours -------------------------------------------------------------------------------------------------
# Two markers of one colour, one of the colour of skin, or one of another's earlier colour.

SKIN_HUE_DEG, SKIN_REACH_DEG = 134.0, 20.0
"""Chroma angle of skin of all tones and its half width, degrees (`benchmarks/false_locks.py`)."""
SKIN_MAGNITUDE, SKIN_SATURATION = 50.0, 0.45
"""Chroma, grey levels, and chroma per luma that skin does not exceed. The ten tones of the Monk scale have at most
0.28, by a warm lamp 0.43; orange, brown and red paints have 0.5 to 1.2. The ratio does not change with the strength of
the light."""
VIEWS_MOST = 4  # pictures that are searched for skin: those with most markers
BESIDE = 0.1  # share of a marker's surroundings: a finger fills more of them


@dataclass(frozen=True, slots=True)
class Identity:
    """Markers that may be mistaken for another marker or for skin.

    `same`: pairs of markers of one colour and the difference of their hues, degrees. `skin`: markers of the colour of
    skin, with the evidence in words. `taken`: (marker, other), where the marker has the colour that the other had.
    """

    same: tuple[tuple[str, str, float], ...]
    skin: Mapping[str, str]
    taken: tuple[tuple[str, str], ...]

    @property
    def exchanged(self) -> str:
        """The colours that were another marker's, in a sentence; empty when none was."""
        words = "; ".join(f"{name} now has the colour that {other} had" for name, other in self.taken)
        return f"{words}." if words else ""


def hues_apart_deg(first: ChromaModel, second: ChromaModel) -> float:
    """The difference of two hues, degrees, 0 to 180."""
    return abs(math.degrees(math.remainder(first.hue_rad - second.hue_rad, math.tau)))


def same_colour(first: ChromaModel, second: ChromaModel) -> bool:
    """Whether two markers have one colour: each one's hue lies in the other's sector, within SEED_HUE_DEG."""
    return hues_apart_deg(first, second) <= min(first.hue_tolerance_deg, second.hue_tolerance_deg, SEED_HUE_DEG)


def pairs_of_one_colour(models: Mapping[str, ChromaModel]) -> tuple[tuple[str, str, float], ...]:
    """All pairs of markers of one colour and the difference of their hues, degrees."""
    names = list(models)
    return tuple((first, second, hues_apart_deg(models[first], models[second]))
                 for k, first in enumerate(names) for second in names[k + 1:]
                 if same_colour(models[first], models[second]))


def has_hue_of_skin(colours: Colours) -> bool:
    """Whether the median of colours (N, 3) Y, Cb, Cr has the hue of skin, and no more chroma than skin."""
    luma, cb, cr = (float(part) for part in np.median(colours, axis=0))
    away = math.remainder(math.degrees(math.atan2(cr, cb)) - SKIN_HUE_DEG, 360.0)
    magnitude = math.hypot(cb, cr)
    return abs(away) <= SKIN_REACH_DEG and magnitude < SKIN_MAGNITUDE and magnitude < SKIN_SATURATION * luma


def beside(name: str, colours: Colours, views: Sequence[MarkedPicture]) -> tuple[str, ...]:
    """The other markers whose surroundings have the colour of `name`: their hand has it, too."""
    _, cb, cr = (float(part) for part in np.median(colours, axis=0))
    found: list[str] = []
    for view in views:
        same = alike(view.image, (cb, cr))
        for region in view.paint.values():
            same &= ~region.whole
        found += [other for other, region in view.paint.items() if other != name and other not in found
                  and np.mean(same[surroundings(region)]) >= BESIDE]
    return tuple(found)


def skin_shown(name: str, colours: Colours, views: Sequence[MarkedPicture]) -> str:
    """The evidence in words that a marker's colour is that of skin; empty without any."""
    luma, cb, cr = (float(part) for part in np.median(colours, axis=0))
    hue = math.degrees(math.atan2(cr, cb))
    shown = []
    if has_hue_of_skin(colours):
        shown.append(f"hue {hue:.0f}°, chroma {math.hypot(cb, cr):.0f} and luma {luma:.0f} are those of skin")
    telling = sorted(views, key=lambda view: -len(view.paint))[:VIEWS_MOST]
    others = {other for view in telling for other in view.paint if other != name}
    around = beside(name, colours, telling) if SKIN_DEG[0] <= hue <= SKIN_HUE_DEG + SKIN_REACH_DEG else ()
    if len(around) >= max(2.0, 0.5 * len(others)):
        shown.append(f"the same colour lies beside {', '.join(around)}")
    return "; ".join(shown)


def colours_taken(now: Mapping[str, ChromaModel], before: Mapping[str, Sequence[ChromaModel]],
                  ) -> tuple[tuple[str, str], ...]:
    """(marker, other) of every marker that has another's earlier colour and none of its own earlier ones.

    `before`: earlier colours by marker. A pair that still shares the colour is not listed: see `pairs_of_one_colour`.
    """
    found = []
    for name, model in now.items():
        if not before.get(name) or any(same_colour(model, old) for old in before[name]):
            continue
        others = [(hues_apart_deg(model, old), other) for other, olds in before.items() for old in olds
                  if other != name and same_colour(model, old) and not same_colour(model, now.get(other, old))]
        if others:
            found.append((name, min(others)[1]))
    return tuple(found)


def identify(samples: Sequence[PaintSamples], views: Sequence[MarkedPicture], models: Mapping[str, ChromaModel],
             before: Sequence[Mapping[str, Sequence[ChromaModel]]]) -> Identity:
    """The ambiguous colours of the sampled markers.

    `models`: of all markers of the set. `before`: earlier colours by marker, the latest first.
    """
    sampled = {one.name for one in samples}
    shown = {one.name: skin_shown(one.name, one.colours, views) for one in samples}
    taken: dict[str, str] = {}
    for earlier in before:
        for name, other in colours_taken(models, earlier):
            if name in sampled:
                taken.setdefault(name, other)
    return Identity(tuple(pair for pair in pairs_of_one_colour(models) if sampled.intersection(pair[:2])),
                    {name: words for name, words in shown.items() if words}, tuple(taken.items()))
