"""One camera's intrinsics as a file (``rhot-intrinsics``), with their certainty and where they come from.

docs/calibration-files.md describes the format. The master itself reads rigs only: this file carries a lens from its own
calibration to the one that puts cameras together, or to another program.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta

from rhot_app.calibration.board.boards import Board, CharucoBoard
from rhot_app.calibration.lens.fit import PARAMETERS
from rhot_app.calibration.lens.intrinsics import IntrinsicsReport
from rhot_app.calibration.lens.start import LensStart
from rhot_app.errors import CalibrationError
from rhot_app.project import Coefficient, Focal, Intrinsics, Pixel, Pixels
from rhot_node.files import read_document, write_document

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
