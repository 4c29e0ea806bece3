"""The fit of one camera's lens to its views of a board: without the views that do not fit, and with the board's own
errors.

A lens is plain, with five distortion coefficients, or wide, with eight: the views decide, by a likelihood-ratio test.
All coefficients of its kind are estimated; where the views do not determine one, what is known of lenses in general
keeps it near zero. Leaving coefficients out when they are insignificant would bias the others: with a true k3 of 0.04
the stated intervals of k1 and k2 then hold one time in two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import BoardErrors, find_board_errors, pose_view
from rhot_app.calibration.bundle.adjustment import Bundle, adjust, misfit
from rhot_app.calibration.bundle.model import BundleState, LensFreedom, Observations
from rhot_app.calibration.bundle.robust_error import MOST_DROPPED, error_inflation, misfit_limit
from rhot_app.calibration.lens.misfit import residual_field, wider_than_model
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.estimation.quantiles import chi_squared_isf
from rhot_app.geometry.camera import LENS, PARAMETERS, PLAIN, TANGENTIAL, is_wide
from rhot_app.progress import Progress, silent, within

# -- what is known of a lens beforehand --------------------------------------------------------------------------------

Array = NDArray[np.float64]

@dataclass(frozen=True, slots=True)
class LensStart:
    """One camera's lens: `lens` (12,), see `geometry.camera`, for pictures of `size` (width, height).

    `std` (12,) the standard deviations, when known. `origin`: "given" by a file or the rig, or found from the same
    "views" that now calibrate stereo. `trouble`: why those views leave no usable lens.
    """

    lens: Array
    size: tuple[int, int]
    std: Array | None = None
    origin: Literal["given", "views"] = "given"
    trouble: Finding | None = None

    def freedom(self, *, refine: bool) -> LensFreedom:
        """How the bundle adjustment may change it.

        Found from the same views: all of it, for these corners say it all. Given: not at all, or with `refine` within
        its standard deviations; coefficients from k3 on that are zero then stay zero, because that lens was described
        without them.
        """
        if self.origin == "views":
            if is_wide(self.lens):
                return likely_lens(self.lens, wide=True, size=self.size)
            return LensFreedom.free(self.lens, loose_prior(self.lens, self.size))
        if not refine:
            return LensFreedom.fixed()
        free = (self.lens != 0.0) | (np.arange(LENS) < PLAIN - 1)
        std = None if self.std is None else np.where(free, self.std, np.inf)
        return LensFreedom.free(self.lens, std, only=free)

    def mirrored(self) -> LensStart:
        """The lens of the same camera when its pictures are flipped left to right."""
        flipped = self.lens.copy()
        flipped[2] = self.size[0] - 1 - flipped[2]
        flipped[7] = -flipped[7]
        return replace(self, lens=flipped)


WIDE: Array = np.array([19250.0, 5943.0, 0.0, 0.0, 256.0, 24255.0, 11025.0, 1225.0]) / 15015.0
"""Distortion of an equidistant lens: Pade's approximant of the arctangent."""


def likely_lens(lens: Array, *, wide: bool, size: tuple[int, int], square_pixels: bool = False) -> LensFreedom:
    """Everything free of a lens of that kind: about the focal length and centre of `lens` (12,), without distortion or,
    if it is wide, equidistant."""
    mean = np.concatenate([lens[:4], WIDE if wide else np.zeros(LENS - 4)])
    return LensFreedom.free(mean, loose_prior(lens, size), square_pixels=square_pixels)


def loose_prior(lens: Array, size: tuple[int, int]) -> Array:
    """Standard deviations (12,) of what lenses are: they keep a fit from running away, and pull at nothing that
    pictures determine.

    Radial coefficients are limited by what they do in the picture's corner, or at 45 degrees where that is nearer, each
    power less than the one before.
    """
    longest = float(max(size))
    corner = min((size[0] ** 2 + size[1] ** 2) / (4.0 * lens[0] * lens[1]), 1.0)  # squared radius, normalised
    radial = [1.0 / corner, 0.3 / corner**2, 0.05 / corner**3]
    return np.array([longest, longest, 0.2 * longest, 0.2 * longest, *radial[:2], 0.05, 0.05, radial[2], *radial])


# -- first estimate from the shared views ------------------------------------------------------------------------------

FEWEST_VIEWS = 3
_CHANCE = 1e-3  # of taking a plain lens for a wide one


def find_lens(views: Sequence[BoardView], board: Board, name: str) -> LensStart:
    """The lens of one camera from its views, plain or wide: Zhang's closed form, then a robust fit of everything.

    Raises CalibrationError naming the camera when the views do not determine a lens.
    """
    if len(views) < FEWEST_VIEWS:
        raise CalibrationError(f"{name}: the board was found in {len(views)} pictures; {FEWEST_VIEWS} are the least to "
                               "estimate the intrinsics from, 15 are good. Or give the intrinsics' file.")
    size = views[0].size
    lens = _closed_form(views, board, size)
    posed = [(view, pose_view(view, board, lens)) for view in views]
    usable = [(view, found.camera_from_board[0]) for view, found in posed if found is not None]
    counts = [len(view.ids) for view, _ in usable]
    seen = Observations(np.zeros(sum(counts), np.intp), np.repeat(np.arange(len(usable)), counts),
                        np.concatenate([view.object_points(board) for view, _ in usable]),
                        np.concatenate([view.pixels for view, _ in usable]))
    start = BundleState(lens[None], np.eye(4)[None], np.array([pose for _, pose in usable]))
    try:
        plain = adjust(start, seen, [likely_lens(lens, wide=False, size=size)])
        found = _wide(plain, seen, size) or plain
    except CalibrationError as exc:
        raise CalibrationError(f"{name}: {exc}") from exc
    lens, field = found.state.lenses[0], residual_field(seen.pixels, found.residuals, seen.shot, size)
    return LensStart(lens, size, None, "views", wider_than_model(lens, size, field, f"the lens of {name}"))


def _wide(plain: Bundle, seen: Observations, size: tuple[int, int]) -> Bundle | None:
    """The fit of a wide lens, where it is better than the `plain` one by more than chance; else None.

    Residuals count in units of their scatter and of the views' disagreement, so that a bent board makes no lens wide.
    """
    wide = adjust(plain.state, seen, [likely_lens(plain.state.lenses[0], wide=True, size=size)])
    better = misfit(plain, seen, wide.noise_px) - misfit(wide, seen, wide.noise_px)
    limit = chi_squared_isf(_CHANCE, LENS - PLAIN)
    return wide if better > limit * error_inflation(wide, seen) ** 2 else None


def _closed_form(views: Sequence[BoardView], board: Board, size: tuple[int, int]) -> Array:
    points = [view.object_points(board).astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    matrix = cv2.initCameraMatrix2D(points, pixels, size, 1.0)
    focal = float(matrix[0, 0])
    longest = float(max(size))
    if not 0.3 * longest < focal < 10.0 * longest:  # views seen face on leave it open
        focal = longest
    return np.array([focal, focal, (size[0] - 1) / 2, (size[1] - 1) / 2, *np.zeros(LENS - 4)])


# -- the fit -----------------------------------------------------------------------------------------------------------
# Views that do not fit are left out.

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
        """(12,), see `geometry.camera`."""
        return self.bundle.state.lenses[0]

    @property
    def covariance(self) -> Array:
        """(12, 12) of the lens, poses and board errors marginalised; the views' disagreement is in it."""
        return self._by_corners * self.error_inflation**2

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Distortion coefficients that these views leave open: they stay near zero, where they most often are.

        The radial ones of a wide lens replace each other, and only together mean anything: none is named.
        """
        std = np.sqrt(np.diag(self._by_corners))
        known = self.bundle.layout.lenses[0].prior_std
        asked = TANGENTIAL if is_wide(self.lens) else range(4, PLAIN)
        return tuple(PARAMETERS[place] for place in asked if std[place] > _OPEN * known[place])

    @property
    def view_rms(self) -> Array:
        """(K,) px, rms distance of each kept view's corners from where they are expected."""
        return _view_rms(self.bundle, self.seen)

    @property
    def _by_corners(self) -> Array:
        """(12, 12), the covariance by independent errors of the corners alone."""
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
    return likely_lens(lens, wide=is_wide(lens), size=size, square_pixels=square_pixels)


def _observations(views: Sequence[BoardView], board: Board) -> Observations:
    counts = [len(view.ids) for view in views]
    return Observations(np.zeros(sum(counts), np.intp), np.repeat(np.arange(len(views)), counts),
                        np.concatenate([view.object_points(board) for view in views]),
                        np.concatenate([view.pixels for view in views]), np.concatenate([view.ids for view in views]))


def _strange(rms: Array) -> dict[int, float]:
    """Rows of the views that fit far worse than the others, and their rms."""
    limit, _ = misfit_limit(rms)
    return {int(row): float(rms[row]) for row in np.flatnonzero(rms > limit)}
