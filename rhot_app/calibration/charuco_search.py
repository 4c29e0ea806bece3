"""Finding a ChArUco board's inner corners, roughly; parts of the board suffice."""

from __future__ import annotations

import functools

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import CharucoBoard

Array = NDArray[np.float64]


def find_charuco(gray: NDArray[np.uint8], board: CharucoBoard) -> Array | None:
    """(rows, cols, 2) px, NaN for corners that are not visible; None when fewer than four are."""
    corners, ids, _, _ = _detector(board).detectBoard(gray)
    if corners is None or ids is None or len(ids) < 4:
        return None
    grid = np.full((board.count, 2), np.nan)
    grid[ids.reshape(-1)] = corners.reshape(-1, 2)
    return grid.reshape(board.rows, board.cols, 2)


def markers_seen(gray: NDArray[np.uint8], board: CharucoBoard) -> int:
    """How many markers of the board's dictionary the picture shows, whatever their arrangement."""
    _, ids, _ = cv2.aruco.ArucoDetector(board.marker_family()).detectMarkers(gray)
    return 0 if ids is None else len(ids)


@functools.lru_cache(maxsize=8)
def _detector(board: CharucoBoard) -> cv2.aruco.CharucoDetector:
    return cv2.aruco.CharucoDetector(board.opencv())
