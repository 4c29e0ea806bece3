"""The intrinsics of one camera from views of a board: the fit, what it leaves, how certain it is, and the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board, CharucoBoard
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import BoardErrors
from rhot_app.calibration.board.shared_views import Dropped
from rhot_app.calibration.bundle.robust_error import tilt_spread
from rhot_app.calibration.lens.coverage import Coverage, cover
from rhot_app.calibration.lens.fit import PARAMETERS, LensFit, LensStart, fit_lens
from rhot_app.calibration.lens.intrinsics_checks import ExpectedErrors, Figures, blind_share, check, expected_errors
from rhot_app.calibration.verdict import Finding, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent, within
from rhot_app.project import Coefficient, Focal, Intrinsics, Pixel, Pixels
from rhot_node.files import read_document, write_document

Array = NDArray[np.float64]

_BLURRIER = 1.6  # times the median view's blur: that explains a bad fit
_MIXED_UP_PX = 3.0


@dataclass(frozen=True, slots=True)
class ViewFit:
    """One view that was used: its file or name, rms px of its corners, how many there are, blur and square side, px."""

    source: str
    rms_px: float
    corners: int
    blur_px: float
    square_px: float


@dataclass(frozen=True, slots=True)
class IntrinsicsReport:
    """Everything a page or a file needs to know.

    `lens` (9,): fx, fy, cx, cy, k1, k2, p1, p2, k3 for pictures of `size` (width, height), and its `covariance` (9, 9)
    with poses and board errors marginalised. `rms_px` over all corners. `undetermined` names the coefficients that the
    views leave open; `errors` what the uncertainty means in millimetres at the working distance.
    `error_inflation`: 1 where independent corner errors explain all; it is in all standard deviations.
    """

    board: Board
    lens: Array
    covariance: Array
    size: tuple[int, int]
    rms_px: float
    views: tuple[ViewFit, ...]
    dropped: tuple[Dropped, ...]
    field: ResidualField
    coverage: Coverage
    undetermined: tuple[str, ...]
    board_errors: BoardErrors | None
    errors: ExpectedErrors
    error_inflation: float
    verdict: Verdict

    @property
    def std(self) -> Array:
        """(9,) standard deviations of the lens parameters."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def intrinsics(self) -> Intrinsics:
        """As a rig holds them."""
        fx, fy, cx, cy, k1, k2, p1, p2, k3 = map(float, self.lens)
        return Intrinsics(*self.size, fx, fy, cx, cy, (k1, k2, p1, p2, k3))


def solve(views: Sequence[BoardView], board: Board, *, square_pixels: bool = False, dropped: Sequence[Dropped] = (),
          noticed: Sequence[Finding] = (), progress: Progress = silent) -> IntrinsicsReport:
    """Calibrate one camera from `views`, all of one picture size.

    `square_pixels` forces fx = fy. `dropped` pictures and `noticed` findings of whoever read the views join the report.
    Raises CalibrationError when the views do not determine a lens at all; anything doubtful is in the verdict.
    """
    if len({view.size for view in views}) > 1:
        raise CalibrationError("The pictures have different sizes: calibrate each size by itself.")
    fit = fit_lens(views, board, square_pixels=square_pixels, progress=within(progress, 0.0, 0.95))
    if not (np.isfinite(fit.lens).all() and np.isfinite(fit.covariance).all() and (fit.lens[:2] > 0.0).all()):
        raise CalibrationError("No lens explains these views: are they of one camera, with one zoom, and one board?")
    progress("judging the result", 0.97)
    return _report(fit, views, board, tuple(dropped), noticed)


def _report(fit: LensFit, views: Sequence[BoardView], board: Board, dropped: tuple[Dropped, ...],
            noticed: Sequence[Finding]) -> IntrinsicsReport:
    used = [views[index] for index in fit.kept]
    size = used[0].size
    usual = float(np.median(fit.view_rms))
    dropped += tuple(Dropped(views[index].source, _why_off(views[index], rms, usual, used), "residual")
                     for index, rms in sorted(fit.dropped.items()))
    residuals = fit.bundle.residuals
    rms = float(np.sqrt(np.mean(np.sum(np.square(residuals), axis=1))))
    field = residual_field(fit.seen.pixels, residuals, fit.seen.shot, size)
    coverage = cover(used, board)
    errors = expected_errors(fit.lens, fit.covariance, size)
    figures = Figures(
        lens=fit.lens, std=np.sqrt(np.maximum(np.diag(fit.covariance), 0.0)), size=size, rms_px=rms,
        views=len(used), outliers=len(fit.dropped), coverage=coverage, pattern_px=field.pattern_px,
        tilt_rad=tilt_spread(fit.bundle.state.world_from_board), undetermined=fit.undetermined,
        error_inflation=fit.error_inflation, blind=blind_share(fit.lens, size), errors=errors, board=board,
        board_errors=fit.board_errors, blur_px=float(np.nanmedian([view.blur_px for view in used] + [0.0])),
        square_px=float(np.median([view.square_px for view in used])))
    summary = f"rms {rms:.2f} px over {len(used)} views, f {fit.lens[0]:.1f} px."
    return IntrinsicsReport(
        board, fit.lens, fit.covariance, size, rms,
        tuple(ViewFit(view.source, float(off), len(view.ids), view.blur_px, view.square_px)
              for view, off in zip(used, fit.view_rms, strict=True)),
        dropped, field, coverage, fit.undetermined, fit.board_errors, errors, fit.error_inflation,
        judge(summary, [*noticed, *check(figures)]))


def _why_off(view: BoardView, rms: float, usual: float, used: Sequence[BoardView]) -> str:
    """Why a view fits so much worse than the others."""
    figure = f"its corners are {rms:.2f} px from where the other views place them (usual: {usual:.2f} px)"
    if view.blur_px > _BLURRIER * float(np.median([each.blur_px for each in used])):
        return f"{figure}: it is blurred, the board moved or is out of focus"
    if rms > _MIXED_UP_PX:
        return f"{figure}: corners are mixed up, or it is another board, zoom or focus"
    return f"{figure}: the board was bent or moved, or something covers a part of it"


# -- residual pattern over the image -----------------------------------------------------------------------------------

CELLS = (6, 8)
"""Rows and columns of the means."""

_FEWEST = 4  # corners in a cell that make a mean


@dataclass(frozen=True, slots=True)
class ResidualField:
    """All residuals of a fit and their means over the picture.

    `places` (M, 2) px, where each corner was seen; `residuals` (M, 2) px, seen minus expected; `view` (M,) the index of
    its view. `mean` (rows, cols, 2) px per part of the picture, NaN where too few corners are; `count` (rows, cols).
    """

    places: Array
    residuals: Array
    view: NDArray[np.intp]
    mean: Array
    count: NDArray[np.int64]

    @property
    def pattern_px(self) -> float:
        """Rms of the means, less what the corners' own scatter leaves in them: 0 where the model explains all."""
        known = np.isfinite(self.mean).all(axis=-1)
        if not known.any():
            return 0.0
        scatter = float(np.mean(np.square(self.residuals).sum(axis=1)))
        excess = np.square(self.mean[known]).sum(axis=-1) - scatter / self.count[known]
        return float(np.sqrt(max(float(np.mean(excess)), 0.0)))


def residual_field(places: Array, residuals: Array, view: NDArray[np.intp], size: tuple[int, int]) -> ResidualField:
    """The field over a picture of `size` (width, height) px."""
    rows, cols = CELLS
    scale = np.array([cols / size[0], rows / size[1]])
    col, row = np.clip(((places + 0.5) * scale).astype(int), 0, [cols - 1, rows - 1]).T
    cell = row * cols + col
    count = np.bincount(cell, minlength=rows * cols)
    sums = np.stack([np.bincount(cell, residuals[:, axis], minlength=rows * cols) for axis in (0, 1)], axis=1)
    mean = np.where(count[:, None] >= _FEWEST, sums / np.maximum(count, 1)[:, None], np.nan)
    return ResidualField(places, residuals, view, mean.reshape(rows, cols, 2), count.reshape(rows, cols))


# -- the file ``rhot-intrinsics`` --------------------------------------------------------------------------------------
# docs/calibration-files.md describes the format. The master itself reads rigs only: this file carries a lens from its
# own calibration to the one that puts cameras together, or to another program.

FORMAT: Final = "rhot-intrinsics"
VERSION: Final = 1

Count = Annotated[int, Meta(ge=0)]
Millimetres = Annotated[float, Meta(gt=0, le=10_000)]
NotNegative = Annotated[float, Meta(ge=0)]


class BoardUsed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The board: `size` is in inner corners for a chessboard, in squares for a ChArUco board."""

    kind: Literal["chessboard", "charuco"]
    size: tuple[Count, Count]
    square_mm: Millimetres
    marker_mm: Millimetres | None = None
    dictionary: str | None = None
    legacy_pattern: bool = False


class IntrinsicsFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Pinhole with OpenCV's distortion (k1, k2, p1, p2, k3), px; (0, 0) is the centre of the top-left pixel."""

    size: tuple[Pixels, Pixels]
    fx: Focal
    fy: Focal
    cx: Pixel
    cy: Pixel
    distortion: tuple[Coefficient, Coefficient, Coefficient, Coefficient, Coefficient] = (0.0, 0.0, 0.0, 0.0, 0.0)
    std: dict[str, NotNegative] = {}
    rms_px: NotNegative | None = None
    views: Count | None = None
    board: BoardUsed | None = None
    calibrated: str = ""
    format: Literal["rhot-intrinsics"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        unknown = sorted(set(self.std) - set(PARAMETERS))
        if unknown:
            raise ValueError(f"std names {unknown[0]!r}; the parameters are {', '.join(PARAMETERS)}")
        if not np.isfinite([self.fx, self.fy, self.cx, self.cy, *self.distortion]).all():
            raise ValueError("a parameter is not a number")

    @property
    def intrinsics(self) -> Intrinsics:
        """As a rig holds them."""
        return Intrinsics(*self.size, self.fx, self.fy, self.cx, self.cy, self.distortion)

    @property
    def lens(self) -> LensStart:
        """As other calibrations begin with them."""
        std = np.array([self.std[name] for name in PARAMETERS]) if len(self.std) == len(PARAMETERS) else None
        return LensStart(np.array([self.fx, self.fy, self.cx, self.cy, *self.distortion]), self.size, std)


def load_intrinsics(path: Path) -> IntrinsicsFile:
    """Read and validate a file; raises CalibrationError naming file and field."""
    return read_document(path, IntrinsicsFile, format_name=FORMAT, version=VERSION, error=CalibrationError)


def save_intrinsics(path: Path, report: IntrinsicsReport) -> None:
    """Write a calibration atomically. Raises CalibrationError when the folder cannot be written."""
    document = to_file(report)
    try:
        write_document(path, document)
    except OSError as exc:
        raise CalibrationError(f"{path}: cannot be written ({exc.strerror}); nothing was changed.") from exc


def to_file(report: IntrinsicsReport) -> IntrinsicsFile:
    """What is kept of a calibration."""
    lens = report.intrinsics
    return IntrinsicsFile(
        report.size, lens.fx, lens.fy, lens.cx, lens.cy, lens.distortion,
        dict(zip(PARAMETERS, map(float, report.std), strict=True)), report.rms_px, len(report.views),
        _board(report.board), datetime.now(UTC).isoformat(timespec="seconds"))


def _board(board: Board) -> BoardUsed:
    if isinstance(board, CharucoBoard):
        return BoardUsed("charuco", (board.squares_x, board.squares_y), board.square_m * 1e3, board.marker_m * 1e3,
                         board.dictionary, board.legacy)
    return BoardUsed("chessboard", (board.cols, board.rows), board.square_m * 1e3)
