"""How much of what a calibration needs its views show, and guidance while they are taken.

X, Y, size and skew are those of ROS camera_calibration: where the board is, how large, how tilted. Each spans what is
needed.
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


# -- guidance while views are taken ------------------------------------------------------------------------------------
# A view is taken when the board is still and somewhere new. One sentence says what to do next.

ENOUGH = 12
"""Views at least; more come where the bars are not full."""

STILL_PX = 0.7
"""Movement of a still board between two frames: noise."""

NEW = 0.2
"""Sum of the changes of x, y, size and skew since the most similar view, from which on a view is another one."""

BLURRED_PX = 2.2
"""SD of the blur from which on a view is too blurred."""

_STILL_PX_S = 15.0  # the speed whose blur in 30 ms is half a pixel
_LOOKED_AWAY_S = 1.0  # frames farther apart say nothing about movement
_SMALL_PX = 8.0
_FULL = 0.999


@dataclass(frozen=True, slots=True)
class Decision:
    """Whether the view that was offered was taken, and what to say to the operator."""

    capture: bool
    sentence: str


class CaptureGuide:
    """Collects the views of one camera for its intrinsics."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._views: list[BoardView] = []
        self._places: list[Array] = []
        self._before: tuple[BoardView, float] | None = None

    def resize(self, board: Board) -> None:
        """The board's squares have another size: what was taken stays."""
        self._board = board

    @property
    def views(self) -> tuple[BoardView, ...]:
        """What was taken so far."""
        return tuple(self._views)

    @property
    def coverage(self) -> Coverage:
        """What the views cover so far."""
        return cover(self._views, self._board)

    @property
    def complete(self) -> bool:
        """Whether a solve will not be short of views."""
        return not self._wish()

    def offer(self, view: BoardView | None, t_s: float) -> Decision:
        """Offer what was found in the picture of `t_s`, None where the board was not; taken when still, sharp and new.

        Raises nothing: a view of another picture size than the first begins the collection anew.
        """
        if view is None:
            self._before = None
            return Decision(False, "Show the whole board to the camera." if not self.complete else "That is enough.")
        if self._views and view.size != self._views[0].size:
            self._views, self._places, self._before = [], [], None
        moved, self._before = self._moved(view, t_s), (view, t_s)
        where = place(view, self._board)
        new = not self._places or min(float(np.abs(where - each).sum()) for each in self._places) > NEW
        trouble = self._trouble(view, moved, new)
        if trouble:
            return Decision(False, trouble)
        self.keep(view)
        return Decision(True, f"Taken: {len(self._views)}. {self._wish() or 'That is enough.'}")

    def keep(self, view: BoardView) -> None:
        """Take a view that was chosen already, as of a film."""
        self._views.append(view)
        self._places.append(place(view, self._board))

    def discard_last(self) -> None:
        """Forget the view that was taken last."""
        if self._views:
            self._views.pop()
            self._places.pop()

    def _trouble(self, view: BoardView, moved: float | None, new: bool) -> str:
        """Why the view is not taken; empty when it is."""
        if view.square_px < _SMALL_PX:
            return "The board is too far away: bring it nearer."
        if not new:
            return self._wish() or "That is enough."
        if moved is None or moved > 1.0:
            return "Hold still."
        if view.blur_px > BLURRED_PX:
            return "The picture is blurred: more light, a shorter exposure, or focus the lens."
        return ""

    def _moved(self, view: BoardView, t_s: float) -> float | None:
        """How much the board moved since the frame before, 1 is the most that is still; None when that is not known."""
        if self._before is None or not 0.0 < t_s - self._before[1] < _LOOKED_AWAY_S:
            return None
        before, then = self._before
        _, mine, its = np.intersect1d(view.ids, before.ids, return_indices=True)
        if not len(mine):
            return None
        step = float(np.median(np.linalg.norm(view.pixels[mine] - before.pixels[its], axis=1)))
        return step / max(STILL_PX, _STILL_PX_S * (t_s - then))

    def _wish(self) -> str:
        """What is missing most, as something to do; empty when nothing is."""
        if not self._places:
            return "Hold the board still in the middle of the picture."
        coverage, places = self.coverage, np.array(self._places)
        bars = coverage.bars
        worst = min(bars, key=lambda name: bars[name])
        if bars[worst] < _FULL:
            return _WISHES[worst](places)
        corner = _empty_corner(coverage)
        if corner:
            return f"Bring the board to the {corner} corner of the picture."
        if len(places) < ENOUGH:
            return "Tilt the board another way, or bring it elsewhere."
        return ""


def _across(places: Array) -> str:
    left = places[:, 0].min() > 1.0 - places[:, 0].max()
    return f"Bring the board to the {'left' if left else 'right'} edge of the picture."


def _down(places: Array) -> str:
    upper = places[:, 1].min() > 1.0 - places[:, 1].max()
    return f"Bring the board to the {'upper' if upper else 'lower'} edge of the picture."


def _near(_places: Array) -> str:
    return "Bring the board nearer, until it nearly fills the picture."


def _tilt(_places: Array) -> str:
    return "Tilt the board: turn one side or corner of it towards the camera."


_WISHES = {"x": _across, "y": _down, "size": _near, "skew": _tilt}


def _empty_corner(coverage: Coverage) -> str:
    """A corner of the picture in which no corner of the board was seen."""
    cells = coverage.cells
    for name, block in (("upper left", cells[:2, :2]), ("upper right", cells[:2, -2:]),
                        ("lower left", cells[-2:, :2]), ("lower right", cells[-2:, -2:])):
        if not block.any():
            return name
    return ""
