"""How much of what a calibration needs its views show: X, Y, size and skew, and which parts of the picture.

The four bars are those of ROS camera_calibration: where the board is, how large, how tilted; each spans what is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView

Array = NDArray[np.float64]

CELLS = (6, 8)
"""Rows and columns of the image map."""

_ENOUGH = np.array([0.7, 0.7, 0.4, 0.5])  # spans of x, y, size and skew that count as complete


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the views cover: bars `x`, `y`, `size`, `skew` 0..1, and `cells` (rows, cols), corners per part of the
    picture."""

    x: float
    y: float
    size: float
    skew: float
    cells: NDArray[np.int64]

    @property
    def share(self) -> float:
        """Share of the picture's parts in which some corner was seen."""
        return float(np.mean(self.cells > 0))

    @property
    def bars(self) -> dict[str, float]:
        """The four bars by name."""
        return {"x": self.x, "y": self.y, "size": self.size, "skew": self.skew}


def cover(views: Sequence[BoardView], board: Board) -> Coverage:
    """What `views`, all of one size, cover."""
    if not views:
        return Coverage(0.0, 0.0, 0.0, 0.0, np.zeros(CELLS, np.int64))
    where = np.array([place(view, board) for view in views])
    low, high = where.min(axis=0), where.max(axis=0)
    low[2:] = 0.0  # a large or a tilted board is worth its whole bar
    bars = np.clip((high - low) / _ENOUGH, 0.0, 1.0)
    width, height = views[0].size
    corners = np.concatenate([view.pixels for view in views])
    rows, cols = CELLS
    picture = ((-0.5, height - 0.5), (-0.5, width - 0.5))
    cells, _, _ = np.histogram2d(corners[:, 1], corners[:, 0], (rows, cols), picture)
    x, y, size, skew = map(float, bars)
    return Coverage(x, y, size, skew, cells.astype(np.int64))


def place(view: BoardView, board: Board) -> Array:
    """(4,) x, y, size and skew of the board in the picture, 0..1 each: how far right and down it is of what its size
    allows, the side of its area over the picture's, and how far its corners are from right angles."""
    quad = board_corners_px(view, board)
    width, height = view.size
    area = abs(float(cv2.contourArea(quad.astype(np.float32))))
    border = np.sqrt(area)
    middle = view.pixels.mean(axis=0)
    at = np.clip((middle - border / 2) / np.maximum(np.array([width, height]) - border, 1.0), 0.0, 1.0)
    return np.array([*at, np.sqrt(area / (width * height)), _skew(quad)])


def board_corners_px(view: BoardView, board: Board) -> Array:
    """(4, 2) px, where the outermost inner corners are or, of a board that is seen in part, would be."""
    last_col, last_row = board.cols - 1, board.rows - 1
    ids = np.array([0, last_col, board.count - 1, board.count - 1 - last_col])
    if len(view.ids) == board.count:
        return view.pixels[ids]
    flat = view.object_points(board)[:, :2] / board.square_m
    picture_from_board, _ = cv2.findHomography(flat, view.pixels)
    outer = np.array([[0, 0], [last_col, 0], [last_col, last_row], [0, last_row]], float)
    if picture_from_board is None:
        return np.repeat(view.pixels.mean(axis=0)[None], 4, axis=0)
    return np.asarray(cv2.perspectiveTransform(outer[:, None], picture_from_board), float)[:, 0]


def _skew(quad: Array) -> float:
    """How far the corner angle that is farthest from a right one is, 1 at 30 degrees."""
    back, ahead = np.roll(quad, 1, axis=0) - quad, np.roll(quad, -1, axis=0) - quad
    lengths = np.linalg.norm(back, axis=1) * np.linalg.norm(ahead, axis=1)
    angles = np.arccos(np.clip((back * ahead).sum(axis=1) / np.maximum(lengths, 1e-9), -1.0, 1.0))
    return float(min(1.0, np.max(np.abs(angles - np.pi / 2)) / (np.pi / 6)))
