"""What a step wants drawn over a picture, in px of the full frame. The picture wall paints it; nothing here is Qt.

A colour is ``#rrggbb`` or the name of a tone of `rhot_app.ui.models.palette.Scheme` ("good", "accent").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Dots:
    """Small rings at `points` (N, 2) px; `filled` makes discs of them."""

    points: Array
    colour: str = "accent"
    radius: float = 4.0  # px of the screen
    filled: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A polyline through `points` (N, 2) px, back to its start when `closed`."""

    points: Array
    colour: str = "accent"
    closed: bool = False
    width: float = 2.0  # px of the screen
    dashed: bool = False
    shaded: bool = False  # the inside is tinted


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """The frame divided into (R, C) equal cells, each tinted by `strength` (R, C) 0..1."""

    strength: Array
    colour: str = "good"


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """A picture over the picture: `rgba` (H, W, 4) uint8, stretched over the frame."""

    rgba: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Tag:
    """A word on a dark ground, its left edge at (`x`, `y`) px."""

    x: float
    y: float
    text: str


@dataclass(frozen=True, slots=True)
class Callout:
    """A word at the side of the picture with a line to (`x`, `y`) px, so that it covers nothing there."""

    x: float
    y: float
    text: str


Mark = Dots | Line | Cells | Layer | Tag | Callout
Overlay = tuple[Mark, ...]
