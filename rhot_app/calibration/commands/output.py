"""What calibration commands have in common: the printed verdict or JSON object, and the arguments of a board."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.board.standard_board import BOARD, CHARUCO, SQUARE_MM
from rhot_app.calibration.verdict import Verdict
from rhot_app.errors import CalibrationError, input_file, positive_number

if TYPE_CHECKING:
    from rhot_app.calibration.board.boards import Board


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """``--json``, the same everywhere."""
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output")


def add_rig_argument(parser: argparse.ArgumentParser) -> None:
    """``--rig FILE``; scripts from before it may give the file alone."""
    given = parser.add_mutually_exclusive_group()
    given.add_argument("--rig", type=Path, metavar="FILE", help="the rig file")
    given.add_argument("file", type=Path, nargs="?", help=argparse.SUPPRESS)


def rig_of(args: argparse.Namespace) -> Path:
    """The rig file of `add_rig_argument`. Raises RigError without one."""
    from rhot_app.errors import RigError

    if args.rig is None and args.file is None:
        raise RigError("--rig FILE is missing: it names the rig file.")
    path = Path(args.rig or args.file)
    if not path.name:
        raise RigError(f"{path} is a folder; name the rig file.")
    return path


def require_folder(out: Path | None) -> None:
    """Raise CalibrationError unless a file can be written there: before the work, not after."""
    from rhot_node.files import require_replaceable

    if out is not None and not out.parent.is_dir():
        raise CalibrationError(f"{out}: there is no folder {out.parent}. Make it first, or name another place.")
    if out is not None:
        try:
            require_replaceable(out)
        except OSError as exc:
            raise CalibrationError(f"{out}: cannot be written ({exc.strerror}).") from exc


def tell(fields: dict[str, Any], lines: list[str], verdict: Verdict, *, as_json: bool) -> None:
    """Print a result and its verdict: one JSON object, or sentences and `lines` for people."""
    if as_json:
        print(json.dumps({**fields, **verdict.to_json()}))
        return
    print(verdict.sentence)
    for finding in verdict.findings:
        print(f"  [{finding.grade.value}] {finding.sentence}")
    print(*lines, sep="\n")


def show(fields: dict[str, Any], lines: list[str], verdict: Verdict, *, as_json: bool, written: str = "") -> int:
    """Print a calibration's result and return the exit code: 0, or 2 when the verdict forbids its use.

    `fields` are the JSON's, the verdict's own are added; `lines` the figures for people; `written` the file that was
    written, empty for none.
    """
    tell({**fields, "written": written or None}, lines, verdict, as_json=as_json)
    if written and not as_json:
        print(f"Written: {written}")
    if verdict.acceptable:
        return 0
    worst = verdict.findings[0].sentence
    print(f"rhot: nothing was written, because the result must not be used. {worst}", file=sys.stderr)
    return 2


# -- arguments about the files of other programs -----------------------------------------------------------------------

FORMAT_NAMES = ("opencv", "ros", "kalibr", "anipose", "caliscope")
"""Of `exchange.formats.FORMATS`, which loads OpenCV."""

_UNITS_M = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}


def add_length_arguments(parser: argparse.ArgumentParser) -> None:
    """The unit of lengths in a format that does not say it."""
    unit = parser.add_mutually_exclusive_group()
    unit.add_argument("--unit", choices=tuple(_UNITS_M), help="of lengths, where the format does not say it (OpenCV, "
                      "anipose)")
    unit.add_argument("--square-mm", type=positive_number, metavar="S",
                      help="lengths are in sides of a board's square, of S mm")


def unit_of(args: argparse.Namespace) -> float | None:
    """Metres per unit of length as `add_length_arguments` says, None where nothing was given."""
    if args.square_mm is not None:
        return 1e-3 * float(args.square_mm)
    return None if args.unit is None else _UNITS_M[args.unit]


# -- arguments that describe a board -----------------------------------------------------------------------------------

def add_board_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, squares and markers."""
    board = parser.add_argument_group("board")
    board.add_argument("--board", metavar="COLSxROWS",
                       help=f"inner corners of the chessboard (default {BOARD}); with --marker-mm squares of a ChArUco "
                       f"board (default {CHARUCO}); or a board's file of Kalibr (.yaml) or caliscope (.toml)")
    board.add_argument("--square-mm", type=positive_number, metavar="S",
                       help=f"side of a square, as measured (default {SQUARE_MM:g}, as rhot target draws it; printers "
                       "scale)")
    board.add_argument("--marker-mm", type=positive_number, metavar="M",
                       help="side of a marker: the board is a ChArUco board")
    board.add_argument("--dictionary", default="", metavar="NAME", help="its markers (default DICT_4X4_50)")
    board.add_argument("--legacy-pattern", action="store_true", help="it was drawn by OpenCV before 4.6")


def board_of(args: argparse.Namespace) -> Board:
    """The board; raises CalibrationError for an impossible one."""
    from rhot_app.calibration.board.boards import DEFAULT_DICTIONARY, CharucoBoard, Chessboard, parse_size
    from rhot_app.calibration.exchange.boards import SUFFIXES, read_board

    if args.board is not None and args.board.lower().endswith(SUFFIXES):
        if args.square_mm is not None or args.marker_mm is not None:
            raise CalibrationError(f"{args.board} says how large the board is; leave --square-mm and --marker-mm out, "
                                   "or give the size by numbers.")
        return read_board(input_file(args.board))
    square_m = 1e-3 * (args.square_mm or SQUARE_MM)
    cols, rows = parse_size(args.board or (BOARD if args.marker_mm is None else CHARUCO))
    if args.marker_mm is None:
        return Chessboard(cols, rows, square_m)
    return CharucoBoard(cols, rows, square_m, args.marker_mm * 1e-3,
                        args.dictionary or DEFAULT_DICTIONARY, args.legacy_pattern)
