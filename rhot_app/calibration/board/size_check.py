"""Whether a board has more squares than was said: a 9x6 board searched as 8x6 is found, shifted by a square at times.

Around the inner corners of a true board lies one ring of squares, and then the paper's margin. Where the ring after
that is still black and white in turn, the board goes on. It is looked at near its inner edge, because a board's
outermost squares are often cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board, CharucoBoard, Chessboard
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.saddle import find_charuco, markers_seen
from rhot_app.calibration.verdict import Finding, Grade

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

_REACH = 1.25  # squares from the outermost corners to where the ring after next is looked at
_GOES_ON = 0.5  # of the board's own contrast
_IN_VIEW = 0.6  # of a ring's squares, to judge by
_ENOUGH = 0.25  # of the views; a hand or the picture's edge hides the rest


@dataclass(frozen=True, slots=True)
class Beyond:
    """Whether a further column (left or right) or row (above or below) of corners follows those that were counted."""

    column: bool
    row: bool


def look_beyond(gray: Gray, view: BoardView, board: Chessboard) -> Beyond:
    """Look at the ring after next around the corners of `view` in its picture."""
    targets = np.column_stack(np.divmod(view.ids, board.cols)[::-1]).astype(np.float64)
    found, _ = cv2.findHomography(targets, view.pixels)
    if found is None:
        return Beyond(False, False)
    pixel_from_board = np.asarray(found, dtype=np.float64)
    inner = np.array([(x + 0.5, y + 0.5) for y in range(board.rows - 1) for x in range(board.cols - 1)])
    contrast = _contrast(gray, inner, pixel_from_board)
    if not contrast:
        return Beyond(False, False)
    along, down = np.arange(board.cols - 1) + 0.5, np.arange(board.rows - 1) + 0.5

    def goes_on(squares: Array) -> bool:
        return _contrast(gray, squares, pixel_from_board) / contrast > _GOES_ON

    return Beyond(
        column=any(goes_on(np.column_stack([np.full(len(down), x), down])) for x in (-_REACH, board.cols - 1 + _REACH)),
        row=any(goes_on(np.column_stack([along, np.full(len(along), y)])) for y in (-_REACH, board.rows - 1 + _REACH)))


def size_finding(seen: Sequence[Beyond], board: Chessboard) -> Finding | None:
    """What the pictures say about the size of the board; None when it is as said."""
    if not seen:
        return None
    columns, rows = (float(np.mean([getattr(each, side) for each in seen])) for side in ("column", "row"))
    if max(columns, rows) < _ENOUGH:
        return None
    larger = f"{board.cols + (columns >= _ENOUGH)}x{board.rows + (rows >= _ENOUGH)}"
    return Finding(
        "board_size", Grade.POOR,
        f"The board is larger than {board.size_text}: in {100 * max(columns, rows):.0f} % of the pictures its squares "
        "go on beyond the corners that were counted.",
        f"Inner corners are counted, where four squares meet; {larger} or more would fit.",
        f"Count again and give --board {larger}: otherwise the cameras may take different corners for the first one.")


def _contrast(gray: Gray, squares: Array, pixel_from_board: Array) -> float:
    """How much lighter even squares (x + y of the upper left corner) are than odd ones, grey levels; 0 when too few are
    in the picture. `squares` (N, 2): their middles in squares from the first corner."""
    pixels = cv2.perspectiveTransform(squares[:, None], pixel_from_board)[:, 0]
    height, width = gray.shape
    inside = ((pixels >= 0) & (pixels <= np.array([width, height]) - 1.0)).all(axis=1)
    if np.mean(inside) < _IN_VIEW:
        return 0.0
    even = np.floor(squares).sum(axis=1).astype(int) % 2 == 0
    levels = cv2.remap(gray, pixels[:, :1].astype(np.float32), pixels[:, 1:].astype(np.float32), cv2.INTER_LINEAR)[:, 0]
    if not np.any(inside & even) or not np.any(inside & ~even):
        return 0.0
    return float(levels[inside & even].mean() - levels[inside & ~even].mean())


# -- diagnosis of a board that was not found ---------------------------------------------------------------------------
# Slow: only for pictures without a board of the stated size.

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
