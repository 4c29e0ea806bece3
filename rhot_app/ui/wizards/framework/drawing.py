"""What a step wants drawn over a picture, in px of the full frame. The grid of pictures paints it; nothing here is Qt.

A colour is ``#rrggbb`` or the name of a tone of `rhot_app.ui.models.palette.Scheme` ("good", "accent").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.ui.models.palette import STAGE_COLOURS

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


# -- How a board that was found is drawn over its picture --------------------------------------------------------------

def board_marks(view: BoardView, board: Board, colour: str = "good") -> Overlay:
    """Every corner; each row as a line of its own colour, so that a wrong order is seen; a number at the first."""
    grid = view.grid(board)
    rows = tuple(Line(row[np.isfinite(row[:, 0])], STAGE_COLOURS[k % len(STAGE_COLOURS)], width=1.5)
                 for k, row in enumerate(grid) if np.isfinite(row[:, 0]).sum() > 1)
    first = view.pixels[0]
    return (*rows, Dots(view.pixels, colour, radius=3.0), Tag(float(first[0]) - 28, float(first[1]) - 32,
                                                              str(int(view.ids[0]) + 1)))


def outline(view: BoardView, board: Board) -> Array:
    """(4, 2) px, the outermost corners that were found, around the board; for its place in the picture."""
    grid = view.grid(board)
    filled = np.isfinite(grid[..., 0])
    rows, cols = np.flatnonzero(filled.any(axis=1)), np.flatnonzero(filled.any(axis=0))
    top, bottom = grid[rows[0]], grid[rows[-1]]
    corners = [row[np.flatnonzero(np.isfinite(row[:, 0]))[end]] for row, end in
               ((top, 0), (top, -1), (bottom, -1), (bottom, 0))]
    assert len(cols)
    return np.array(corners)
