"""The fit of one camera's lens to its views of a board: without the views that do not fit, and with the board's own
errors.

All distortion coefficients are estimated; where the views do not determine one, what is known of lenses in general
keeps it near zero. Leaving coefficients out when they are insignificant would bias the others: with a true k3 of 0.04
the stated intervals of k1 and k2 then hold one time in two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.errors import BoardErrors, find_board_errors
from rhot_app.calibration.board.poses import pose_view
from rhot_app.calibration.lens.search import find_lens
from rhot_app.calibration.lens.start import loose_prior
from rhot_app.calibration.outliers import MOST_DROPPED, misfit_limit
from rhot_app.calibration.robust_error import error_inflation
from rhot_app.calibration.stereo.bundle import Bundle, adjust
from rhot_app.calibration.stereo.bundle_layout import LensFreedom
from rhot_app.calibration.stereo.bundle_model import LENS, BundleState, Observations
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent, within

Array = NDArray[np.float64]

FEWEST_VIEWS = 3
PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Names of the lens parameters, in their order."""

_OPEN = 0.5  # of what is known of any lens: a standard deviation above it says that the views have added nothing
_LOOSE = 0.05  # of the focal length: a standard deviation above it


@dataclass(frozen=True, slots=True)
class LensFit:
    """The adjusted lens.

    `bundle` of one camera and the corners `seen` in it; `kept` indices of the views in it, in its order; `dropped`
    index -> rms px of those left out; `board_errors` if any were found; `error_inflation` of the views, 1 where
    independent corner errors explain all.
    """

    bundle: Bundle
    seen: Observations
    kept: tuple[int, ...]
    dropped: dict[int, float]
    board_errors: BoardErrors | None
    error_inflation: float

    @property
    def lens(self) -> Array:
        """(9,) fx, fy, cx, cy, k1, k2, p1, p2, k3."""
        return self.bundle.state.lenses[0]

    @property
    def covariance(self) -> Array:
        """(9, 9) of the lens, poses and board errors marginalised; the views' disagreement is in it."""
        return self._by_corners * self.error_inflation**2

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Distortion coefficients that these views leave open: they stay near zero, where they most often are."""
        std = np.sqrt(np.diag(self._by_corners))
        known = self.bundle.layout.lenses[0].prior_std
        return tuple(name for place, name in enumerate(PARAMETERS) if place >= 4
                     and std[place] > _OPEN * known[place])

    @property
    def view_rms(self) -> Array:
        """(K,) px, rms distance of each kept view's corners from where they are expected."""
        return _view_rms(self.bundle, self.seen)

    @property
    def _by_corners(self) -> Array:
        """(9, 9), the covariance by independent errors of the corners alone."""
        basis = self.bundle.layout.lenses[0].basis
        at = self.bundle.layout.lens(0)
        return np.asarray(basis @ self.bundle.covariance[at, at] @ basis.T)


def fit_lens(views: Sequence[BoardView], board: Board, *, square_pixels: bool = False, name: str = "camera",
             progress: Progress = silent) -> LensFit:
    """Fit the lens to `views`, all of one size. Raises CalibrationError when they do not determine it."""
    kept = list(range(len(views)))
    dropped: dict[int, float] = {}
    while True:
        kept, bundle, seen = _plain_fit(views, kept, board, square_pixels, name, within(progress, 0.0, 0.3))
        strange = {kept[row]: rms for row, rms in _strange(_view_rms(bundle, seen)).items()}
        if not strange or len(dropped) + len(strange) > MOST_DROPPED * len(views):
            break
        dropped |= strange
        kept = [index for index in kept if index not in dropped]
    plain = LensFit(bundle, seen, tuple(kept), dropped, None, error_inflation(bundle, seen))
    if plain.covariance[0, 0] > (_LOOSE * plain.lens[0]) ** 2:
        return plain  # what leaves the lens open says nothing about the board
    freedom = _freedom(bundle.state.lenses[0], views[0].size, square_pixels)
    bundle, errors = find_board_errors(bundle, seen, [freedom], board.count, board.square_m,
                                       progress=within(progress, 0.3, 0.95))
    return LensFit(bundle, seen, tuple(kept), dropped, errors, error_inflation(bundle, seen))


def _plain_fit(views: Sequence[BoardView], kept: Sequence[int], board: Board, square_pixels: bool, name: str,
               progress: Progress) -> tuple[list[int], Bundle, Observations]:
    """Everything free but the board's shape; returns the views that could be placed, too."""
    progress("finding a first lens", 0.0)
    start = find_lens([views[index] for index in kept], board, name).lens
    if square_pixels:
        start[:2] = start[:2].mean()
    posed = {index: pose_view(views[index], board, start) for index in kept}
    poses = {index: each.camera_from_board[0] for index, each in posed.items() if each is not None}
    if len(poses) < FEWEST_VIEWS:
        raise CalibrationError(f"{name}: only {len(poses)} views fit together; {FEWEST_VIEWS} are the least, 15 are "
                               "good.")
    seen = _observations([views[index] for index in poses], board)
    state = BundleState(start[None], np.eye(4)[None], np.array(list(poses.values())))
    freedom = _freedom(start, views[0].size, square_pixels)
    return list(poses), adjust(state, seen, [freedom], progress=progress), seen


def _view_rms(bundle: Bundle, seen: Observations) -> Array:
    squares = np.bincount(seen.shot, np.square(bundle.residuals).sum(axis=1))
    return np.sqrt(squares / np.bincount(seen.shot))


def _freedom(lens: Array, size: tuple[int, int], square_pixels: bool) -> LensFreedom:
    mean = np.concatenate([lens[:4], np.zeros(LENS - 4)])
    return LensFreedom.free([True] * LENS, mean, loose_prior(lens, size), square_pixels=square_pixels)


def _observations(views: Sequence[BoardView], board: Board) -> Observations:
    counts = [len(view.ids) for view in views]
    return Observations(np.zeros(sum(counts), np.intp), np.repeat(np.arange(len(views)), counts),
                        np.concatenate([view.object_points(board) for view in views]),
                        np.concatenate([view.pixels for view in views]), np.concatenate([view.ids for view in views]))


def _strange(rms: Array) -> dict[int, float]:
    """Rows of the views that fit far worse than the others, and their rms."""
    limit, _ = misfit_limit(rms)
    return {int(row): float(rms[row]) for row in np.flatnonzero(rms > limit)}
