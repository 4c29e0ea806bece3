"""Names for hues, and which paints a room leaves free."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.surroundings import HUE_BINS, HUE_STEP_DEG

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

    `room_px` (72,) as `colour_room.SurroundingsReport.hue_px`.
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
