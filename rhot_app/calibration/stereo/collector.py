"""Collecting shared views live: what to keep, which cameras still need each other, where the board should go next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews

Array = NDArray[np.float64]

ENOUGH = 15
"""Shared shots of a pair of cameras."""

_STILL_PX = 1.0  # the board moved less than this since the frames before, in every camera
_NEW_PLACE = 0.06  # of the picture's diagonal: corners that moved less since every kept shot add nothing
_ZONES = (3, 3)  # columns and rows of the picture
_COVERED = 0.7  # of the zones of each camera, over all shared shots
_SIZES = 1.5  # ratio of the largest to the smallest board seen: near and far
_TILTED_RAD = np.radians(20.0)  # between the board's normal and the line of sight


@dataclass(frozen=True, slots=True)
class Offer:
    """What became of one set of pictures: `taken` into the calibration or not, and `why` in words for the operator."""

    taken: bool
    why: str


@dataclass(frozen=True, slots=True)
class PairNeed:
    """Two cameras and how many shots they share; `missing` until there are enough along the tree that links them."""

    first: str
    second: str
    shared: int
    missing: int


@dataclass(frozen=True, slots=True)
class Guidance:
    """What is still missing.

    `pairs` of cameras that need more shared shots; `covered` (C,) share of each camera's picture that shared shots
    reach; `near_and_far`, `tilted`: whether the board was seen so; `advice` the next thing to do in words, empty when
    done.
    """

    pairs: tuple[PairNeed, ...]
    covered: tuple[float, ...]
    near_and_far: bool
    tilted: bool
    advice: str

    @property
    def complete(self) -> bool:
        """Whether a solve will not be short of views."""
        return not self.advice


class StereoCollector:
    """Takes the board as all cameras see it, moment by moment, and keeps the moments that add something."""

    def __init__(self, cameras: Sequence[str], board: Board) -> None:
        self._cameras = tuple(cameras)
        self._board = board
        self._shots: list[BoardShot] = []
        self._before: tuple[BoardView | None, ...] = (None,) * len(self._cameras)

    def offer(self, views: Sequence[BoardView | None], *, still: bool = False) -> Offer:
        """Offer the views of one moment, one per camera; kept when the board is still and somewhere new.

        `still` says that the operator vouches for it, as with a button or pictures from files.
        """
        before, self._before = self._before, tuple(views)
        seen = [camera for camera, view in enumerate(views) if view is not None]
        if len(seen) < 2:
            return Offer(False, "Hold the board where at least two cameras see it whole.")
        if not still and not all(_moved(before[camera], views[camera]) < _STILL_PX for camera in seen):
            return Offer(False, "Hold still.")
        diagonal = max(float(np.hypot(*view.size)) for view in views if view is not None)
        if any(self._alike(shot, views, diagonal) for shot in self._shots):
            return Offer(False, f"This view is there already. {self.guidance().advice or 'There is enough.'}")
        self.keep(BoardShot(f"{len(self._shots) + 1}", tuple(views)))
        return Offer(True, f"Taken: {len(self._shots)}.")

    def keep(self, shot: BoardShot) -> None:
        """Take a shot that was chosen already, as of films."""
        self._shots.append(shot)

    def resize(self, board: Board) -> None:
        """The board's squares have another size: what was kept stays."""
        self._board = board

    def discard_last(self) -> None:
        """Forget the shot that was kept last."""
        if self._shots:
            self._shots.pop()

    def views(self) -> SharedViews:
        """Everything kept so far."""
        return SharedViews(self._cameras, self._board, tuple(self._shots))

    def guidance(self) -> Guidance:
        """What is still missing, by what was kept."""
        return guide(self.views())

    @staticmethod
    def _alike(shot: BoardShot, views: Sequence[BoardView | None], diagonal: float) -> bool:
        """Whether a kept shot shows the board at the same place to all cameras that see it now."""
        return all(_moved(kept, view) < _NEW_PLACE * diagonal
                   for kept, view in zip(shot.views, views, strict=True) if view is not None)


def guide(views: SharedViews) -> Guidance:
    """What shared views still lack."""
    pairs = _needs(views)
    shared = [shot for shot in views.shots if len(shot.seen_by) >= 2]
    covered = tuple(_coverage([shot.views[camera] for shot in shared]) for camera in range(len(views.cameras)))
    each = [view for shot in shared for view in shot.views if view is not None]
    sizes = [view.square_px for view in each]
    near_and_far = bool(sizes) and max(sizes) > _SIZES * min(sizes)
    tilted = sum(_tilt_rad(view, views.board) > _TILTED_RAD for view in each) >= max(4, len(each) // 4)
    return Guidance(pairs, covered, near_and_far, tilted, _advice(views.cameras, pairs, covered, near_and_far, tilted))


def _advice(cameras: Sequence[str], pairs: Sequence[PairNeed], covered: Sequence[float], near_and_far: bool,
            tilted: bool) -> str:
    if pairs:
        worst = max(pairs, key=lambda pair: pair.missing)
        return f"Show the board to {worst.first} and {worst.second} at once, {worst.missing} more times."
    if not tilted:
        return "Tilt the board by 30 degrees: left, right, up and down."
    if not near_and_far:
        return "Take the board nearer and farther away."
    least = int(np.argmin(covered))
    if covered[least] < _COVERED:
        return f"Bring the board to the edges of what {cameras[least]} sees."
    return ""


def _needs(views: SharedViews) -> tuple[PairNeed, ...]:
    """The pairs on the tree that links all cameras by the most shared shots, where these are still too few."""
    counts = {(a, b): views.shared(a, b) for a, b in combinations(range(len(views.cameras)), 2)}
    linked, needs = {0}, []
    while len(linked) < len(views.cameras):
        a, b = max(((a, b) for a, b in counts if (a in linked) != (b in linked)), key=lambda pair: counts[pair])
        linked |= {a, b}
        if counts[a, b] < ENOUGH:
            needs.append(PairNeed(views.cameras[a], views.cameras[b], counts[a, b], ENOUGH - counts[a, b]))
    return tuple(needs)


def _coverage(views: Sequence[BoardView | None]) -> float:
    """The share of a picture's zones in which a corner was seen."""
    zones = set()
    for view in views:
        if view is not None:
            cells = np.floor(view.pixels / np.array(view.size) * np.array(_ZONES)).astype(int)
            zones |= {tuple(cell) for cell in np.clip(cells, 0, np.array(_ZONES) - 1)}
    return len(zones) / (_ZONES[0] * _ZONES[1])


def _moved(before: BoardView | None, view: BoardView | None) -> float:
    """Largest move of a corner in px; infinite when they have no corner in common."""
    if before is None or view is None:
        return float("inf")
    _, a, b = np.intersect1d(before.ids, view.ids, return_indices=True)
    if not len(a):
        return float("inf")
    return float(np.max(np.linalg.norm(before.pixels[a] - view.pixels[b], axis=1)))


def _tilt_rad(view: BoardView, board: Board) -> float:
    """How far the board is turned away from the line of sight, about any axis.

    Foreshortening makes its picture narrower one way by the cosine, whatever the lens and the distance; opposite sides
    that differ in length only show where the board is close.
    """
    points, pixels = view.object_points(board)[:, :2], view.pixels
    linear = np.linalg.lstsq(points - points.mean(axis=0), pixels - pixels.mean(axis=0), rcond=None)[0]
    wide, narrow = np.linalg.svd(linear, compute_uv=False)
    return float(np.arccos(np.clip(narrow / wide, 0.0, 1.0)))
