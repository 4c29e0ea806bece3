"""Finding a ChArUco board's inner corners, roughly; parts of the board suffice."""

from __future__ import annotations

import functools

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import CharucoBoard

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

_SMALL_PX = 1000  # longest side: pictures below are read at twice their size, where a marker's bits have 3 px, not 1.5
_FEWEST = 4


def find_charuco(gray: Gray, board: CharucoBoard) -> Array | None:
    """(rows, cols, 2) px, NaN for corners that are not visible; None when fewer than four are."""
    scale = 2.0 if max(gray.shape) < _SMALL_PX else 1.0
    corners, ids, _, _ = _detector(board).detectBoard(_scaled(gray, scale))
    if corners is None or ids is None or len(ids) < _FEWEST:
        return None
    grid = np.full((board.count, 2), np.nan)
    grid[ids.reshape(-1)] = (corners.reshape(-1, 2) + 0.5) / scale - 0.5
    return grid.reshape(board.rows, board.cols, 2)


def markers_seen(gray: Gray, board: CharucoBoard) -> int:
    """How many markers of the board's dictionary the picture shows, whatever their arrangement."""
    _, _, _, ids = _detector(board).detectBoard(gray)
    return 0 if ids is None else len(ids)


def _scaled(gray: Gray, scale: float) -> Gray:
    if scale == 1.0:
        return gray
    return np.asarray(cv2.resize(gray, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC), np.uint8)


@functools.lru_cache(maxsize=8)
def _detector(board: CharucoBoard) -> cv2.aruco.CharucoDetector:
    return cv2.aruco.CharucoDetector(board.opencv())
