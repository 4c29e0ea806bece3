"""What is doubtful about a camera's intrinsics: each check gives findings with the figure, the cause and the remedy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.poses import BoardErrors
from rhot_app.calibration.bundle.robust_error import in_words
from rhot_app.calibration.lens.coverage import Coverage
from rhot_app.calibration.lens.misfit import GRID, ResidualField, picture_grid, wider_than_model
from rhot_app.calibration.verdict import Finding, Grade, told_apart
from rhot_app.geometry.camera import FARTHEST_DEG, lens_rays

# -- uncertainty of a lens, as an error in space -----------------------------------------------------------------------

Array = NDArray[np.float64]

WORKING_DISTANCE_M = 0.6
"""Where hands are tracked; errors in space are stated there."""

_PERCENTILE = 95.0
_SMALL_STEP = 1e-3  # of a standard deviation, for the derivatives


@dataclass(frozen=True, slots=True)
class ExpectedErrors:
    """Standard deviation, m, of where points at the working distance are seen: `typical_m` the median over the picture,
    `worst_m` its 95th percentile, mostly in the corners; `map_m` (rows, cols) over the picture, NaN where the lens has
    no ray."""

    typical_m: float
    worst_m: float
    map_m: Array

    def __str__(self) -> str:
        if not np.isfinite(self.typical_m):
            return "not known"
        return f"{1e3 * self.typical_m:.2f} mm, {1e3 * self.worst_m:.2f} mm in the corners"


def expected_errors(lens: Array, covariance: Array, size: tuple[int, int],
                    distance_m: float = WORKING_DISTANCE_M) -> ExpectedErrors:
    """What the lens's uncertainty does to points `distance_m` away from the camera.

    `lens` (12,), `covariance` (12, 12), `size` (width, height) px. What a turn of the camera would do as well is left
    out: a wrong principal point and a camera that looks elsewhere are one to everything that follows, because the
    cameras' orientations are found with this lens. NaN when the lens has no ray for most pixels.
    """
    pixels = picture_grid(size)
    rays = lens_rays(pixels, lens)
    change = _derivatives(pixels, lens, covariance)
    usable = np.isfinite(rays).all(axis=1) & np.isfinite(change).all(axis=(1, 2))
    variance = np.full(len(pixels), np.nan)
    if usable.mean() > 0.5:
        variance[usable] = _variances(rays[usable], change[usable], covariance)
    errors = distance_m * np.sqrt(np.maximum(variance, 0.0))
    known = errors[np.isfinite(errors)] if usable.mean() > 0.5 else np.array([np.nan])
    return ExpectedErrors(float(np.median(known)), float(np.percentile(known, _PERCENTILE)), errors.reshape(GRID))


def _variances(rays: Array, change: Array, covariance: Array) -> Array:
    """(N,) rad^2, of the directions of `rays` (N, 2) that `change` (N, 2, 12) with the lens, but for the turn of the
    camera that takes most off them, each in units of its own standard deviation."""
    length = np.sqrt(1.0 + np.square(rays).sum(axis=1))
    towards = np.column_stack([rays, np.ones(len(rays))]) / length[:, None]
    by_ray = (np.eye(3)[:, :2] - towards[:, :, None] * towards[:, None, :2]) / length[:, None, None]
    change = by_ray @ change
    turn = np.cross(np.eye(3)[None], towards[:, None]).transpose(0, 2, 1)
    certain = 1.0 / np.sqrt(np.maximum(_traces(change, covariance), 1e-24))[:, None, None]
    best = np.linalg.lstsq((certain * turn).reshape(-1, 3), (certain * change).reshape(-1, change.shape[2]), rcond=None)
    return _traces(change - turn @ best[0], covariance)


def _traces(change: Array, covariance: Array) -> Array:
    """(N,) variances, summed over the axes, of what changes by `change` (N, 3, 12) with a lens of `covariance`."""
    return np.asarray(np.einsum("nai,ij,naj->n", change, covariance, change))


def _derivatives(pixels: Array, lens: Array, covariance: Array) -> Array:
    """(N, 2, 12), of the rays at fixed pixels by the lens parameters."""
    steps = _SMALL_STEP * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    derivatives = np.zeros((*pixels.shape, len(lens)))
    for place in np.flatnonzero(steps):
        up, down = lens.copy(), lens.copy()
        up[place] += steps[place]
        down[place] -= steps[place]
        derivatives[:, :, place] = (lens_rays(pixels, up) - lens_rays(pixels, down)) / (2.0 * steps[place])
    return derivatives


# -- findings ----------------------------------------------------------------------------------------------------------

MORE_VIEWS = "Add views: the board near each corner of the picture, near and far, tilted each way."


@dataclass(frozen=True, slots=True)
class Figures:
    """What the checks look at: a fit and what was measured on it, in px, rad and m (see `intrinsics`)."""

    lens: Array
    std: Array
    size: tuple[int, int]
    rms_px: float
    views: int
    outliers: int
    coverage: Coverage
    field: ResidualField
    tilt_rad: float
    undetermined: tuple[str, ...]
    error_inflation: float
    blind: float
    errors: ExpectedErrors
    board: Board
    board_errors: BoardErrors | None
    blur_px: float
    square_px: float

    @property
    def coarseness(self) -> float:
        """What a pixel is worth: 1 up to 1000 pixels of width, then in proportion."""
        return max(1.0, self.size[0] / 1000.0)


def check(figures: Figures) -> list[Finding]:
    """All findings; none says that all is well."""
    return [finding for each in CHECKS for finding in each(figures)]


def _grade(value: float, fair: float, poor: float) -> Grade | None:
    if not value > fair:  # NaN never passes for good: see `_certainty`
        return None
    return Grade.POOR if value > poor else Grade.FAIR


def _model(f: Figures) -> Iterator[Finding]:
    """First, because a lens that the model cannot describe spoils all that follows."""
    found = wider_than_model(f.lens, f.size, f.field)
    if found is not None:
        yield found


def _number_of_views(f: Figures) -> Iterator[Finding]:
    if f.views < 10:
        yield Finding("few_views", Grade.POOR if f.views < 4 else Grade.FAIR, f"{f.views} views were used; 10 to 20 "
                      "are good.", "", MORE_VIEWS)


def _alike(f: Figures) -> Iterator[Finding]:
    degrees = float(np.degrees(f.tilt_rad))
    grade = _grade(-degrees, -25.0, -10.0)
    if grade:
        yield Finding("alike", grade, f"The board is seen from nearly the same side in all views: its tilts differ by "
                      f"{told_apart(degrees, 30.0)} degrees at most (30 and more are good).",
                      "Focal length, principal point and distance then look alike and cannot be told apart.",
                      "Add views with the board turned by 20 to 40 degrees about each of its axes.")


def _covered(f: Figures) -> Iterator[Finding]:
    grade = _grade(1.0 - f.coverage.share, 0.45, 0.8)
    if grade:
        yield Finding("coverage", grade, f"The views reach {told_apart(100.0 * f.coverage.share, 55.0)} % of the "
                      "picture (55 % and more are good).", "Where no corner was seen, the distortion is a guess.",
                      "Bring the board to the edges and corners that the image map shows empty.")


def _fits(f: Figures) -> Iterator[Finding]:
    grade = _grade(f.rms_px, 0.5 * f.coarseness, 1.5 * f.coarseness)
    if grade:
        yield Finding("rms", grade, f"The corners are {f.rms_px:.2f} px rms from where they should be (0.3 is usual).",
                      "A board of another size, mixed-up corners, a bent board, blur, or an autofocus that moved.",
                      "Check the board's numbers of corners; glue it onto something flat; fix the focus; look at the "
                      "worst views.")
    if f.field.pattern_px > max(0.1 * f.coarseness, 0.5 * f.rms_px):
        yield Finding("pattern", Grade.FAIR, f"{f.field.pattern_px:.2f} px of it follow a pattern over the picture.",
                      "The lens is not described by this model (a digital stabiliser, a dewarped picture).",
                      "Switch off corrections inside the camera.")


def _misfits(f: Figures) -> Iterator[Finding]:
    if f.outliers > 0.2 * (f.views + f.outliers):
        yield Finding("misfits", Grade.FAIR, f"{f.outliers} of {f.views + f.outliers} views did not fit the others.",
                      "The board was bent or moved, or the focus changed.",
                      "Hold the board still or lay it against something; fix the focus.")


def _certainty(f: Figures) -> Iterator[Finding]:
    focal = 100.0 * float(np.max(f.std[:2] / f.lens[:2]))
    grade = _grade(focal, 0.3, 1.5)
    if grade:
        yield Finding("focal_length", grade,
                      f"The focal length is known to {told_apart(focal, 0.3, 1)} % only (0.3 % is good).",
                      "The views are few, far away, or little tilted.", MORE_VIEWS)
    centre, width = float(np.max(f.std[2:4])), f.size[0]
    grade = _grade(centre, 0.005 * width, 0.02 * width)
    if grade:
        yield Finding("principal_point", grade, "The principal point is known to "
                      f"{told_apart(centre, 0.005 * width, 1)} px only ({0.005 * width:.1f} px is good).",
                      "The board was little tilted.", MORE_VIEWS)
    if f.undetermined:
        yield Finding("open_distortion", Grade.FAIR, f"The views leave {' and '.join(f.undetermined)} open; they are "
                      "taken as near zero, as for most lenses.", "No view reaches far enough from the middle.",
                      "Bring the board to the picture's corners.")
    typical, worst = 1e3 * f.errors.typical_m, 1e3 * f.errors.worst_m
    grade = _grade(typical, 1.0, 5.0) or _grade(worst, 5.0, np.inf)
    if not np.isfinite(typical):
        yield Finding("expected_error", Grade.POOR, "The lens is known too loosely to say how far off a point at "
                      f"{WORKING_DISTANCE_M:.1f} m may be.", "", MORE_VIEWS)
    elif grade:
        yield Finding("expected_error", grade, f"By the lens alone a point at {WORKING_DISTANCE_M:.1f} m may be off by "
                      f"{told_apart(typical, 1.0, 1)} mm, in the picture's corners by {told_apart(worst, 5.0, 1)} mm "
                      "(SD; 1 and 5 mm are good).",
                      "The views determine the lens too loosely, most where none reaches."
                      f" {in_words(f.error_inflation)}".rstrip(), f"Lay a stiff board against something. {MORE_VIEWS}"
                      if in_words(f.error_inflation) else MORE_VIEWS)


def _plausible(f: Figures) -> Iterator[Finding]:
    middle = (np.array(f.size) - 1.0) / 2.0
    off = float(np.max(np.abs(f.lens[2:4] - middle) / np.array(f.size)))
    grade = _grade(off, 0.1, 0.25)
    if grade:
        yield Finding("off_centre", grade, f"The principal point ({f.lens[2]:.0f}, {f.lens[3]:.0f}) px is far from the "
                      "picture's middle.", "The picture is a crop, or the views do not determine it.",
                      "Use the whole sensor; add tilted views.")
    stretch = float(f.lens[0] / f.lens[1] - 1.0)
    if abs(stretch) > 0.01 and abs(stretch) > 4.0 * float(np.hypot(f.std[0] / f.lens[0], f.std[1] / f.lens[1])):
        yield Finding("not_square", Grade.FAIR, f"Pixels are {100 * abs(stretch):.1f} % "
                      f"{'wider' if stretch < 0 else 'narrower'} than high; cameras have square ones.",
                      "The picture is scaled, or the board was printed with another scale in one direction.",
                      "Measure the printed ruler along and across the sheet; check the camera's picture size.")
    grade = _grade(f.blind, 0.0, 0.1)
    if grade:
        yield Finding("blind", grade, f"No ray belongs to {100 * f.blind:.0f} % of the picture: its distortion turns "
                      "over there, or it looks back.", "No view reaches these parts, or they look more than "
                      f"{FARTHEST_DEG:.0f} degrees aside.", "Bring the board to the picture's corners; keep hands in "
                      "the rest of the picture.")


def _sharp(f: Figures) -> Iterator[Finding]:
    if f.blur_px > 2.0 * f.coarseness:
        yield Finding("blurred", Grade.FAIR, f"The board's edges are blurred by {f.blur_px:.1f} px (1 is sharp).",
                      "Out of focus, moved, or noise reduction.", "More light, a shorter exposure, focus at arm's "
                      "length; hold the board still.")
    if f.square_px < 7.0:
        yield Finding("small_squares", Grade.FAIR,
                      f"Squares are {told_apart(f.square_px, 7.0)} px small (7 and more are good).",
                      "The board is far away, or has many small squares.", "Bring it nearer, or print fewer, larger "
                      "squares.")


def _board(f: Figures) -> Iterator[Finding]:
    if f.board_errors is None:
        return
    across, along = 1e3 * f.board_errors.across_m, 1e3 * f.board_errors.in_plane_m
    limit = 0.01 * f.board.square_m * 1e3
    large = max(across / 2.0, along) > limit
    yield Finding("board_errors", Grade.FAIR if large else Grade.GOOD,
                  f"The board's corners are off by {along:.2f} mm in its plane and {across:.2f} mm across it (SD); "
                  "that was found from the views and taken into account.",
                  "It is printed on paper that stretched, or not glued flat." if large else "",
                  "Glue the sheet onto glass or a plate." if large else "")


CHECKS: tuple[Callable[[Figures], Iterator[Finding]], ...] = (
    _model, _number_of_views, _alike, _covered, _fits, _misfits, _certainty, _plausible, _sharp, _board)
