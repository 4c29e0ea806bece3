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

from rhot_app.calibration.board.aprilgrid import FEWEST_TAGS, has_spacing, measured_spacing, place_tags, read_tags
from rhot_app.calibration.board.boards import AprilGrid, Board, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.board.circles import find_circles
from rhot_app.calibration.board.corners import BoardView, refine
from rhot_app.calibration.board.saddle import MarkersSeen, find_charuco, negated, read_markers
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


def look_beyond(gray: Gray, view: BoardView, board: Board) -> Beyond | None:
    """Look at the ring after next around the corners of `view` in its picture; None for boards whose markers or number
    of circles tell their size."""
    if not isinstance(board, Chessboard):
        return None
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


def size_finding(seen: Sequence[Beyond], board: Board) -> Finding | None:
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
_CELL_LEAST_PX = 2  # of a marker's bit: two samples of each, the least that tells it from the next
_ASTRAY = 0.3  # of a marker's side: corners farther off belong to another board
_SMALL_PX = 1500  # longest side of a picture that is enlarged to look for small squares
_ANY_LIGHT = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
_ANY_SIZE = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE


def why_missing(gray: Gray, board: Board) -> str:
    """The reason in words, without a full stop, for a picture (H, W) uint8 in which `board` was not found."""
    if float(np.ptp(np.percentile(gray, (2, 98)))) < 12.0:
        return "the picture is nearly of one brightness: covered, far too dark or far too bright"
    match board:
        case CharucoBoard():
            return _no_charuco(gray, board)
        case AprilGrid():
            return _no_aprilgrid(gray, board)
        case CircleGrid():
            return _no_circles(gray, board)
        case _:
            return _no_chessboard(gray, board)


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
    either = (gray, negated(gray))
    plain, negative = (read_markers(each, board, 2.0) for each in either)
    seen = max(plain, negative, key=lambda one: len(one.ids))
    flipped = np.ascontiguousarray(either[0 if seen is plain else 1][:, ::-1])
    if len(read_markers(flipped, board, 2.0).ids) > len(seen.ids):  # a few are read by chance either way
        return "the picture is mirrored: its markers can be read only when it is flipped; switch the mirroring off"
    count, least = len(seen.ids), _CELL_LEAST_PX * (board.marker_family().markerSize + 2)
    other_layout = replace(board, legacy=not board.legacy)
    if count >= _FEW_MARKERS and board.layouts_differ and find_charuco(gray, other_layout) is not None:
        other = "the one of OpenCV before 4.6" if not board.legacy else "today's, not the one of OpenCV before 4.6"
        return f"the board's layout is {other}"
    if count >= _FEW_MARKERS and not _fit_the_board(seen, board):
        return (f"{count} markers of {board.dictionary}, but not as on a board of {board.size_text} squares "
                "(squares counted, not corners)")
    by_squares = (px for each in either if (px := _expected_marker_px(each, board)) is not None)
    side_px = _marker_px(seen) if count >= _FEW_MARKERS else next(by_squares, None)
    if side_px is not None and side_px < least:
        return (f"the board is too small in the picture: its markers have {side_px:.0f} px, and {least} are needed; "
                "come nearer, or use larger squares")
    if count >= _FEW_MARKERS:
        held = board.squares_x * board.squares_y // 2
        return f"only {count} of the board's {held} markers can be read: blurred, or hidden"
    if side_px is not None:
        return (f"a board of {board.size_text} squares without markers of {board.dictionary}: wrong dictionary, a "
                "plain chessboard, or blurred")
    return f"no markers of {board.dictionary}: not in view, too small, wrong dictionary, or blurred"


def _no_aprilgrid(gray: Gray, board: AprilGrid) -> str:
    seen, thin = read_tags(gray), read_tags(gray, border=1)
    if len(thin.ids) > max(FEWEST_TAGS, len(seen.ids)):
        return ("the tags have a black border of one bit, as other programs print them; those of Kalibr's AprilGrid "
                "have two (rhot target aprilgrid)")
    if len(seen.ids) < FEWEST_TAGS:
        return "no tags of the family 36h11 as Kalibr prints them: not in view, too small, or blurred"
    rough = place_tags(seen, board)
    if rough is None:
        return f"{len(seen.ids)} tags, but not as on an AprilGrid of {board.size_text} tags (columns first, then rows)"
    grid, _ = refine(gray, rough, board.lines(), free=board.free_space)
    if not has_spacing(grid, board):
        return f"the tags are {measured_spacing(grid):.2f} of their side apart, not {board.spacing:g}"
    return f"only {len(seen.ids)} of the grid's {board.count // 4} tags can be read: blurred, or hidden"


def _no_circles(gray: Gray, board: CircleGrid) -> str:
    turned = CircleGrid(board.rows, board.cols, board.square_m)
    if find_circles(gray, turned, thorough=True) is not None:
        return (f"there is a grid of {turned.size_text} circles, not of {board.size_text}: first the circles in a row "
                "are counted, then the rows")
    return (f"no asymmetric grid of {board.size_text} circles: all of them must be visible, with white around, and no "
            "others beside them")


def _marker_px(seen: MarkersSeen) -> float:
    """The shorter side of a usual marker."""
    sides = np.linalg.norm(seen.corners - np.roll(seen.corners, 1, axis=1), axis=2)
    return float(np.median(sides.min(axis=1)))


def _fit_the_board(seen: MarkersSeen, board: CharucoBoard) -> bool:
    """Whether most of the markers lie to each other as they do on the board."""
    drawn = board.opencv()
    numbers = np.asarray(drawn.getIds()).reshape(-1)
    places = dict(zip(numbers.tolist(), np.asarray(drawn.getObjPoints(), float)[..., :2], strict=True))
    own = [k for k, number in enumerate(seen.ids.tolist()) if number in places]
    if len(own) < _FEW_MARKERS:
        return False
    on_board = np.concatenate([places[int(seen.ids[k])] for k in own])
    _, inlier = cv2.findHomography(on_board, np.concatenate(seen.corners[own]), cv2.RANSAC, _ASTRAY * _marker_px(seen))
    return inlier is not None and float(inlier.sum()) > 2.0 * len(seen.ids)


def _expected_marker_px(gray: Gray, board: CharucoBoard) -> float | None:
    """How large the board's markers are by its squares alone; None where no such squares are seen."""
    small = max(gray.shape) < _SMALL_PX
    large = cv2.resize(gray, None, fx=3.0, fy=3.0, interpolation=cv2.INTER_CUBIC) if small else gray
    found, corners = cv2.findChessboardCorners(large, (board.cols, board.rows), flags=_ANY_LIGHT)
    if not found:
        return None
    grid = np.asarray(corners, float).reshape(board.rows, board.cols, 2) / (3.0 if small else 1.0)
    sides = [float(np.median(np.linalg.norm(np.diff(grid, axis=axis), axis=2))) for axis in (0, 1)]
    return min(sides) * board.marker_m / board.square_m
