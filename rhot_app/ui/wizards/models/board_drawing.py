"""How a board that was found is drawn over its picture."""

from __future__ import annotations

import numpy as np

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.ui.models.palette import STAGE_COLOURS
from rhot_app.ui.wizards.models.drawing import Array, Dots, Line, Overlay, Tag


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
