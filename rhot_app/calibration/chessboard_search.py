"""Finding a plain chessboard's inner corners, roughly, and putting them in the board's own order."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import Chessboard

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

_QUICK = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
_SLOW = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
_SAME_LEVEL = 1.0  # grey levels: nearer ones are the same colour
_SECTORS = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY


def find_chessboard(gray: Gray, board: Chessboard, *, thorough: bool) -> Array | None:
    """(rows, cols, 2) px in the board's order, good to a pixel or two; None when the whole board is not there."""
    size = (board.cols, board.rows)
    found, corners = cv2.findChessboardCorners(gray, size, flags=_QUICK)
    if not found and thorough:
        found, corners = _search_again(gray, size)
    if not found:
        return None
    return in_order(gray, np.asarray(corners, float).reshape(board.rows, board.cols, 2))


def _search_again(gray: Gray, size: tuple[int, int]) -> tuple[bool, NDArray[Any]]:
    found, corners = cv2.findChessboardCorners(gray, size, flags=_SLOW)
    if found:
        return True, corners
    found, corners = cv2.findChessboardCorners(enlarged(gray), size, flags=_SLOW)
    if found:
        return True, (corners + 0.5) / 2 - 0.5
    found, corners = cv2.findChessboardCornersSB(gray, size, flags=_SECTORS)
    return found, corners


def enlarged(gray: Gray) -> Gray:
    """The picture at twice its size: small squares and thin gaps between them survive the search's erosions."""
    return np.asarray(cv2.resize(gray, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC), np.uint8)


def in_order(gray: Gray, grid: Array) -> Array:
    """`grid` (rows, cols, 2) px counted as `board.Chessboard` says, whatever end the search began at."""
    if not _right_handed(grid):
        grid = grid[:, ::-1]
    turns = range(4) if grid.shape[0] == grid.shape[1] else (0, 2)
    ways = [np.rot90(grid, turn) for turn in turns]
    first = [first_square_darkness(gray, way) for way in ways]
    darkest = max(first)
    margin = max((darkest - min(first)) / 2, _SAME_LEVEL)
    return max((way for way, dark in zip(ways, first, strict=True) if dark >= darkest - margin), key=_upright)


def first_square_darkness(gray: Gray, grid: Array) -> float:
    """How much darker the squares of the first one's colour are than the others, grey levels; negative when lighter."""
    centres = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    levels = cv2.remap(gray, centres[..., 0].astype(np.float32), centres[..., 1].astype(np.float32), cv2.INTER_LINEAR)
    row, col = np.indices(levels.shape)
    even = (row + col) % 2 == 0
    return float(levels[~even].mean() - levels[even].mean())


def _right_handed(grid: Array) -> bool:
    """Whether x right, y down as the printed side shows it: the board is never seen from behind."""
    along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return bool(along[0] * down[1] - along[1] * down[0] > 0)


def _upright(grid: Array) -> float:
    along = grid[:, -1].mean(axis=0) - grid[:, 0].mean(axis=0)
    return float(along[0] / (np.linalg.norm(along) + 1e-9))
