"""Finding a plain chessboard's inner corners, roughly, and putting them in the board's own order."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import Chessboard

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

_EVEN_LIGHT = cv2.CALIB_CB_FAST_CHECK
_UNEVEN_LIGHT = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
_QUICK = ((1.0, _EVEN_LIGHT), (0.4, cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_FAST_CHECK))  # scale, flags
_THOROUGH = ((1.0, _UNEVEN_LIGHT), (0.5, _UNEVEN_LIGHT))
_LARGE_PX, _SMALL_PX = 1500, 1000  # longest sides: also searched at a quarter, at twice the size
_SECTORS = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
_SAME_LEVEL = 1.0  # grey levels: nearer ones are the same colour


def find_chessboard(gray: Gray, board: Chessboard, *, thorough: bool) -> Array | None:
    """(rows, cols, 2) px in the board's order, good to a pixel or two; None when the whole board is not there.

    Without `thorough` only what fits between two frames of a live picture is tried.
    """
    size = (board.cols, board.rows)
    for scale, flags in (*_QUICK, *(_more(gray) if thorough else ())):
        corners = _search(gray, size, scale, flags)
        if corners is not None:
            return in_order(gray, corners)
    if thorough:
        found, sectors = cv2.findChessboardCornersSB(gray, size, flags=_SECTORS)
        if found:
            return in_order(gray, np.asarray(sectors, float).reshape(board.rows, board.cols, 2))
    return None


def _more(gray: Gray) -> list[tuple[float, int]]:
    """What else to try: squares of a few pixels survive the search's erosions when enlarged, blurred ones when not."""
    longest = max(gray.shape)
    more = list(_THOROUGH)
    if longest > _LARGE_PX:
        more.append((0.25, _UNEVEN_LIGHT))
    if longest < _SMALL_PX:
        more.append((2.0, _UNEVEN_LIGHT))
    return more


def _search(gray: Gray, size: tuple[int, int], scale: float, flags: int) -> Array | None:
    scaled = gray
    if scale != 1.0:
        smooth = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        scaled = np.asarray(cv2.resize(gray, None, fx=scale, fy=scale, interpolation=smooth), np.uint8)
    found, corners = cv2.findChessboardCorners(scaled, size, flags=flags)
    if not found:
        return None
    return (np.asarray(corners, float).reshape(size[1], size[0], 2) + 0.5) / scale - 0.5


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
