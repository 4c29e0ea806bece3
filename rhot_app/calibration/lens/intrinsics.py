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

from rhot_app.calibration.board.boards import AprilGrid, Board, CharucoBoard, CircleGrid, parse_size
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import BoardErrors
from rhot_app.calibration.board.shared_views import Dropped
from rhot_app.calibration.bundle.robust_error import tilt_spread
from rhot_app.calibration.lens.coverage import Coverage, cover
from rhot_app.calibration.lens.fit import LensFit, LensStart, fit_lens
from rhot_app.calibration.lens.intrinsics_checks import ExpectedErrors, Figures, check, expected_errors
from rhot_app.calibration.lens.misfit import ResidualField, blind_share, residual_field
from rhot_app.calibration.verdict import Finding, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.geometry.camera import PARAMETERS, lens_parameters, own_parameters, rig_intrinsics
from rhot_app.progress import Progress, silent, within
from rhot_app.project import Distortion, Focal, Intrinsics, Pixel, Pixels, require_distortion
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
class IntrinsicsResult:
    """Everything a page or a file needs to know.

    `lens` (12,), see `geometry.camera`, for pictures of `size` (width, height), and its `covariance` (12, 12) with
    poses and board errors marginalised. `rms_px` over all corners. `undetermined` names the coefficients that the views
    leave open; `errors` what the uncertainty means in millimetres at the working distance.
    `error_inflation`: 1 where independent corner errors explain all; it is in all standard deviations. `camera`: its
    name in the rig, "" for one without a rig.
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
    camera: str = ""

    @property
    def std(self) -> Array:
        """(12,) standard deviations of the lens parameters."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def intrinsics(self) -> Intrinsics:
        """As a rig holds them."""
        return rig_intrinsics(self.size, self.lens)

    @property
    def parameters(self) -> dict[str, tuple[float, float]]:
        """Value and standard deviation of every parameter that a lens of this kind has, by name."""
        own = own_parameters(self.lens)
        return {name: (float(value), float(std)) for name, value, std, has
                in zip(PARAMETERS, self.lens, self.std, own, strict=True) if has}


def solve(views: Sequence[BoardView], board: Board, *, square_pixels: bool = False, dropped: Sequence[Dropped] = (),
          noticed: Sequence[Finding] = (), progress: Progress = silent) -> IntrinsicsResult:
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
            noticed: Sequence[Finding]) -> IntrinsicsResult:
    used = [views[index] for index in fit.kept]
    size = used[0].size
    usual = float(np.median(fit.view_rms))
    dropped += tuple(Dropped(views[index].source, _why_off(views[index], rms, usual, used), "residual")
                     for index, rms in sorted(fit.dropped.items()))
    field = residual_field(fit.seen.pixels, fit.bundle.residuals, fit.seen.shot, size)
    rms = field.rms_px
    coverage = cover(used, board)
    errors = expected_errors(fit.lens, fit.covariance, size)
    figures = Figures(
        lens=fit.lens, std=np.sqrt(np.maximum(np.diag(fit.covariance), 0.0)), size=size, rms_px=rms,
        views=len(used), outliers=len(fit.dropped), coverage=coverage, field=field,
        tilt_rad=tilt_spread(fit.bundle.state.world_from_board), undetermined=fit.undetermined,
        error_inflation=fit.error_inflation, blind=blind_share(fit.lens, size), errors=errors, board=board,
        board_errors=fit.board_errors, blur_px=float(np.nanmedian([view.blur_px for view in used] + [0.0])),
        square_px=float(np.median([view.square_px for view in used])))
    summary = f"rms {rms:.2f} px over {len(used)} views, f {fit.lens[0]:.1f} px."
    return IntrinsicsResult(
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


# -- the file ``rhot-intrinsics`` --------------------------------------------------------------------------------------
# docs/calibration-files.md describes the format. The master itself reads rigs only: this file carries a lens from its
# own calibration to the one that puts cameras together, or to another program.

FORMAT: Final = "rhot-intrinsics"
VERSION: Final = 1

Count = Annotated[int, Meta(ge=0)]
Millimetres = Annotated[float, Meta(gt=0, le=10_000)]
Share = Annotated[float, Meta(gt=0, le=1)]
NotNegative = Annotated[float, Meta(ge=0)]


class BoardUsed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The board: `size` is in inner corners for a chessboard, in squares for a ChArUco board, in tags or circles;
    `square_mm` the side of a square or of a tag, or the spacing of circles."""

    kind: Literal["chessboard", "charuco", "aprilgrid", "circles"]
    size: tuple[Count, Count]
    square_mm: Millimetres
    marker_mm: Millimetres | None = None
    dictionary: str | None = None
    legacy_pattern: bool = False
    tag_spacing: Share | None = None


class IntrinsicsFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Pinhole with OpenCV's distortion (`project.Intrinsics`), px; (0, 0) is the centre of the top-left pixel."""

    size: tuple[Pixels, Pixels]
    fx: Focal
    fy: Focal
    cx: Pixel
    cy: Pixel
    distortion: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)
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
        require_distortion(self.distortion)
        if not np.isfinite([self.fx, self.fy, self.cx, self.cy, *self.distortion]).all():
            raise ValueError("a parameter is not a number")

    @property
    def intrinsics(self) -> Intrinsics:
        """As a rig holds them."""
        return Intrinsics(*self.size, self.fx, self.fy, self.cx, self.cy, self.distortion)

    @property
    def lens(self) -> LensStart:
        """As other calibrations begin with them."""
        lens = lens_parameters(self.intrinsics)
        own = [name for name, has in zip(PARAMETERS, own_parameters(lens), strict=True) if has]
        std = np.array([self.std.get(name, 0.0) for name in PARAMETERS]) if set(own) <= set(self.std) else None
        return LensStart(lens, self.size, std)


def load_intrinsics(path: Path) -> IntrinsicsFile:
    """Read and validate a file; raises CalibrationError naming file and field."""
    return read_document(path, IntrinsicsFile, format_name=FORMAT, version=VERSION, error=CalibrationError)


def save_intrinsics(path: Path, result: IntrinsicsResult) -> None:
    """Write a calibration atomically. Raises CalibrationError when the folder cannot be written."""
    document = to_file(result)
    try:
        write_document(path, document)
    except OSError as exc:
        raise CalibrationError(f"{path}: cannot be written ({exc.strerror}); nothing was changed.") from exc


def to_file(result: IntrinsicsResult) -> IntrinsicsFile:
    """What is kept of a calibration."""
    lens = result.intrinsics
    return IntrinsicsFile(
        result.size, lens.fx, lens.fy, lens.cx, lens.cy, lens.distortion,
        {name: std for name, (_, std) in result.parameters.items()}, result.rms_px, len(result.views),
        _board(result.board), datetime.now(UTC).isoformat(timespec="seconds"))


def _board(board: Board) -> BoardUsed:
    size, square_mm = parse_size(board.size_text), board.square_m * 1e3
    match board:
        case CharucoBoard():
            return BoardUsed("charuco", size, square_mm, board.marker_m * 1e3, board.dictionary, board.legacy)
        case AprilGrid():
            return BoardUsed("aprilgrid", size, square_mm, tag_spacing=board.spacing)
        case _:
            return BoardUsed("circles" if isinstance(board, CircleGrid) else "chessboard", size, square_mm)
