"""Why a picture shows no board of the size that was said: found out slowly, for pictures that were turned down."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board, CharucoBoard
from rhot_app.calibration.board.charuco_search import find_charuco, markers_seen

Gray = NDArray[np.uint8]

_FEW_MARKERS = 3
_ANY_SIZE = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE


def why_missing(gray: Gray, board: Board) -> str:
    """The reason in words, without a full stop, for a picture (H, W) uint8 in which `board` was not found."""
    if float(np.ptp(np.percentile(gray, (2, 98)))) < 12.0:
        return "the picture is nearly of one brightness: covered, far too dark or far too bright"
    return _no_charuco(gray, board) if isinstance(board, CharucoBoard) else _no_chessboard(gray, board)


def guess_size(gray: Gray) -> tuple[int, int] | None:
    """Inner corners (cols, rows), the longer side first, of whatever chessboard the picture shows; None for none.

    A guess: now and then a row is missed. Ask several pictures.
    """
    found, _, meta = cv2.findChessboardCornersSBWithMeta(gray, (4, 4), _ANY_SIZE)
    if not found:
        return None
    rows, cols = meta.shape[:2]
    return max(cols, rows), min(cols, rows)


def _no_chessboard(gray: Gray, board: Board) -> str:
    seen = guess_size(gray)
    if seen is not None and seen != (max(board.cols, board.rows), min(board.cols, board.rows)):
        return (f"no board with {board.size_text} inner corners; there is one that seems to have {seen[0]}x{seen[1]}, "
                "or part of the board is hidden")
    return f"no board with {board.size_text} inner corners: all of them must be visible, with a white rim around"


def _no_charuco(gray: Gray, board: CharucoBoard) -> str:
    seen = markers_seen(gray, board)
    if markers_seen(np.ascontiguousarray(gray[:, ::-1]), board) > seen:  # a few are read by chance either way
        return "the picture is mirrored: its markers can be read only when it is flipped; switch the mirroring off"
    other_layout = replace(board, legacy=not board.legacy)
    if seen >= _FEW_MARKERS and board.layouts_differ and find_charuco(gray, other_layout) is not None:
        other = "the one of OpenCV before 4.6" if not board.legacy else "today's, not the one of OpenCV before 4.6"
        return f"the board's layout is {other}"
    if seen >= _FEW_MARKERS:
        return (f"{seen} markers of {board.dictionary}, but not as on a board of {board.size_text} squares "
                "(squares counted, not corners)")
    return f"no markers of {board.dictionary}: wrong dictionary, too small (a marker needs 20 pixels), or blurred"
