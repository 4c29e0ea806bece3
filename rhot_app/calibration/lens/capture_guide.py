"""Guides whoever holds a board before one camera: takes a view when the board is still and somewhere new, and says in
one sentence what to do next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.lens.coverage import Coverage, cover, place

Array = NDArray[np.float64]

ENOUGH = 12
"""Views at least; more come where the bars are not full."""

_STILL_PX, _STILL_PX_S = 0.7, 15.0  # noise between two frames; and the speed whose blur in 30 ms is half a pixel
_LOOKED_AWAY_S = 1.0  # frames farther apart say nothing about movement
_NEW = 0.2  # sum of the changes of x, y, size and skew since the most similar view
_BLURRED_PX, _SMALL_PX = 2.2, 8.0
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
        new = not self._places or min(float(np.abs(where - each).sum()) for each in self._places) > _NEW
        trouble = self._trouble(view, moved, new)
        if trouble:
            return Decision(False, trouble)
        self._views.append(view)
        self._places.append(where)
        return Decision(True, f"Taken: {len(self._views)}. {self._wish() or 'That is enough.'}")

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
        if view.blur_px > _BLURRED_PX:
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
        return step / max(_STILL_PX, _STILL_PX_S * (t_s - then))

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
