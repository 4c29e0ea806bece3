"""The two colour schemes, dark and light, as plain hexadecimal strings. One accent; the states add shapes (`words`).

The state colours are from the colour-blind-safe set of Okabe and Ito (2008), made lighter or darker until each has a
contrast of at least 3:1 (WCAG 2.2, graphical objects) against its scheme's panels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rhot_app.charts import hex_of

SchemeName = Literal["dark", "light"]


@dataclass(frozen=True, slots=True)
class Scheme:
    """Every colour the app uses by itself; marker colours come from the marker set."""

    name: SchemeName
    window: str
    panel: str
    raised: str
    border: str
    text: str
    muted: str
    accent: str
    on_accent: str
    good: str
    caution: str
    bad: str
    fault: str
    neutral: str
    scene: str
    grid: str
    grid_strong: str
    shadow: str
    hand: str
    guessed: str
    frustum: str

    def tone(self, name: str) -> str:
        """Colour of a tone named in `words`: good, caution, bad, fault, neutral or accent."""
        return str(getattr(self, name))


DARK = Scheme(
    name="dark", window="#14171b", panel="#1b1f25", raised="#262b33", border="#39404a", text="#e8eaed", muted="#a3abb6",
    accent="#56b4e9", on_accent="#0b1a24", good="#3fc79a", caution="#f0b93a", bad="#f5805a", fault="#ff5c5c",
    neutral="#aab2bd", scene="#101317", grid="#262c34", grid_strong="#414a56", shadow="#0a0c0f", hand="#d8c3b0",
    guessed="#8b929c", frustum="#6f7b89",
)

LIGHT = Scheme(
    name="light", window="#eceef1", panel="#f9fafb", raised="#ffffff", border="#c3c9d1", text="#1b1f25",
    muted="#58616c", accent="#0a6fb0", on_accent="#ffffff", good="#0b7d5b", caution="#9a6700", bad="#b8430f",
    fault="#c21f1f", neutral="#68717c", scene="#f1f3f5", grid="#d5dae0", grid_strong="#aab2bc", shadow="#d3d7dc",
    hand="#d9b99b", guessed="#8a929b", frustum="#76818d",
)

SCHEMES: dict[str, Scheme] = {"dark": DARK, "light": LIGHT}

STAGE_COLOURS: tuple[str, ...] = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#0072b2", "#d55e00", "#b8a800",
                                  "#999999")
"""Okabe and Ito's colours (yellow darkened) for lines that have no colour of their own, in drawing order."""


def relative_luminance(colour: str) -> float:
    """Relative luminance 0..1 of ``#rrggbb`` (WCAG 2.2)."""
    channels = [byte / 255 for byte in rgb_of(colour)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(first: str, second: str) -> float:
    """Contrast ratio 1..21 of two colours (WCAG 2.2)."""
    high, low = sorted((relative_luminance(first), relative_luminance(second)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def rgb_of(colour: str) -> tuple[int, int, int]:
    """Three bytes of ``#rrggbb``."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def visible_on(colour: str, background: str, ratio: float = 1.8) -> str:
    """`colour`, moved towards white or black in small steps until it stands out from `background` by `ratio`.

    A black or a pale yellow marker must still be seen as a line in a plot; its hue stays.
    """
    toward = 255 if relative_luminance(background) < 0.2 else 0
    rgb = rgb_of(colour)
    for step in range(20):
        part = 0.05 * step
        mixed = hex_of((round(rgb[0] + part * (toward - rgb[0])), round(rgb[1] + part * (toward - rgb[1])),
                        round(rgb[2] + part * (toward - rgb[2]))))
        if contrast(mixed, background) >= ratio:
            break
    return mixed
