"""A board in one picture: its inner corners to a fraction of a pixel, in an order that the board alone decides."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import Board, Chessboard
from rhot_app.calibration.charuco_search import find_charuco
from rhot_app.calibration.chessboard_search import find_chessboard
from rhot_app.calibration.subpixel import refine, side_px

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

FEWEST_CORNERS = 6  # of a board that is seen in part
SMALLEST_PX = 48  # the shorter side of a picture; smaller ones hold no board, and OpenCV's searches fail on them


@dataclass(frozen=True, slots=True)
class BoardView:
    """The corners of one board in one picture.

    `pixels` (N, 2) raw px and `ids` (N,) of the corners found, sorted by id (see `board`); `width`, `height` px of the
    picture; `square_px` the shortest side of a square in the picture; `blur_px` the SD of the blur across the edges,
    in the blurrier direction (1 is sharp, 2 and more is not), NaN when unknown; `source` the file or camera it came
    from, for messages.
    """

    pixels: Array
    ids: NDArray[np.int64]
    width: int
    height: int
    square_px: float
    blur_px: float
    source: str = ""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, px."""
        return self.width, self.height

    def object_points(self, board: Board) -> Array:
        """(N, 3) m, the corners found in the board's frame."""
        return board.object_points()[self.ids]

    def grid(self, board: Board) -> Array:
        """(rows, cols, 2) raw px, NaN where a corner was not found."""
        return to_grid(self.pixels, self.ids, board)

    def turned(self, board: Board) -> BoardView:
        """The same corners counted from the other end; for boards that are not `one_way_up`."""
        ids = board.count - 1 - self.ids[::-1]
        return replace(self, pixels=self.pixels[::-1].copy(), ids=ids)


def to_gray(image: NDArray[np.uint8]) -> Gray:
    """A grey picture (H, W) uint8 of a grey (H, W) or BGR (H, W, 3) one."""
    gray = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.ascontiguousarray(gray, np.uint8)


def detect(image: NDArray[np.uint8], board: Board, *, thorough: bool = True, source: str = "") -> BoardView | None:
    """The board in `image`, (H, W) grey or (H, W, 3) BGR uint8; None when it is not there.

    A chessboard is found whole or not at all, a ChArUco board in parts. `thorough` looks again, enlarged, where the
    quick search fails: for pictures from files; live pictures come again.
    """
    gray = to_gray(image)
    if min(gray.shape) < SMALLEST_PX:
        return None
    if isinstance(board, Chessboard):
        rough = find_chessboard(gray, board, thorough=thorough)
    else:
        rough = find_charuco(gray, board)
    if rough is None:
        return None
    grid, blur = refine(gray, rough, free=board.free_space)
    if isinstance(board, Chessboard) and not _bordered(grid, gray.shape):
        return None
    return _view(grid, blur, gray.shape, source)


def _bordered(grid: Array, shape: tuple[int, ...]) -> bool:
    """Whether the picture shows most corners of each outer line of a plain board's grid (rows, cols, 2).

    A board whose last line is beyond the picture's rim is found as well, put one line too far to either side.
    """
    inside = np.all((grid >= 0.0) & (grid <= np.array(shape[::-1]) - 1.0), axis=-1)
    return min(line.mean() for line in (inside[0], inside[-1], inside[:, 0], inside[:, -1])) > 0.5


def to_grid(pixels: Array, ids: NDArray[np.int64], board: Board) -> Array:
    """(rows, cols, 2) px of `pixels` (N, 2) with `ids` (N,), NaN where a corner is absent."""
    grid = np.full((board.count, 2), np.nan)
    grid[ids] = pixels
    return grid.reshape(board.rows, board.cols, 2)


def _view(grid: Array, blur: float, shape: tuple[int, ...], source: str) -> BoardView | None:
    height, width = shape
    flat = grid.reshape(-1, 2)
    inside = (flat >= 0.0).all(axis=1) & (flat[:, 0] <= width - 1) & (flat[:, 1] <= height - 1)
    ids = np.flatnonzero(inside)
    sides = side_px(grid)
    if len(ids) < FEWEST_CORNERS or not len(sides):
        return None
    return BoardView(flat[ids], ids, width, height, float(sides.min()), blur, source)
