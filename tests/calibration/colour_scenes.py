"""Pictures for the colour calibrations: markers on skin and wood, by any lamp."""

from __future__ import annotations

import sys
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "detect"))

from marker_rendering import Canvas, Rgb, capsule, disc

from rhot_node.detect.image import YuvImage

SKIN: Rgb = (201, 152, 128)
WOOD: Rgb = (142, 104, 70)
PAINTS: dict[str, Rgb] = {"thumb": (205, 40, 165), "index": (225, 200, 30), "middle": (40, 165, 60),
                          "ring": (25, 165, 205), "little": (45, 70, 205), "wrist": (210, 35, 55)}
PLACES = {name: (52.0 + 43 * k, 70.0 + 17 * (k % 3)) for k, name in enumerate(PAINTS)}
RADIUS = 9.0


def picture(paints: dict[str, Rgb] = PAINTS, *, background: Rgb = WOOD, shift: tuple[float, float] = (0.0, 0.0),
            light: float = 1.0, gains: tuple[float, float, float] = (1.0, 1.0, 1.0), seed: int = 0,
            clutter: list[tuple[float, float, float, Rgb]] | None = None) -> YuvImage:
    """Painted fingertips on fingers before `background`, 320 x 240 px; clutter: discs of (x, y, radius, colour)."""
    canvas = Canvas(320, 240)
    canvas.rgb = _drawn(tuple(paints.items()), background, shift, tuple(clutter or ())) * light * np.asarray(gains)
    return canvas.expose(np.random.default_rng(seed))


@lru_cache(maxsize=32)
def _drawn(paints: tuple[tuple[str, Rgb], ...], background: Rgb, shift: tuple[float, float],
           clutter: tuple[tuple[float, float, float, Rgb], ...]) -> NDArray[np.float64]:
    """(H, W, 3) RGB before the lens."""
    canvas = Canvas(320, 240, background)
    for x, y, radius, rgb in clutter:
        canvas.paint(disc(x, y, radius), rgb, (x, y), radius + 3)
    for name, rgb in paints:
        x, y = place(name, shift)
        canvas.paint(capsule((x, y), (x, y + 90), RADIUS), SKIN, (x, y + 45), 60, 0.3)
        canvas.paint(disc(x, y, RADIUS), rgb, (x, y), RADIUS + 3, 0.3)
    return canvas.rgb


def place(name: str, shift: tuple[float, float] = (0.0, 0.0)) -> tuple[float, float]:
    """Where a marker is, luma px."""
    return PLACES[name][0] + shift[0], PLACES[name][1] + shift[1]


def box(name: str, half: int = 5, shift: tuple[float, float] = (0.0, 0.0)) -> tuple[int, int, int, int]:
    """A box inside a marker, (x0, y0, x1, y1)."""
    x, y = place(name, shift)
    return round(x) - half, round(y) - half, round(x) + half, round(y) + half
