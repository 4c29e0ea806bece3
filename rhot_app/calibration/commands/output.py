"""What calibration commands have in common: the printed verdict or JSON object, and the arguments of a board."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.board.standard_board import KINDS, SPACING_MM, SQUARE_MM, TAG_SPACING
from rhot_app.calibration.verdict import Verdict
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_rig_argument

if TYPE_CHECKING:
    from rhot_app.calibration.board.boards import Board


def add_rig_or_file(parser: argparse.ArgumentParser) -> None:
    """``--rig FILE``; scripts from before it may give the file alone."""
    given = parser.add_mutually_exclusive_group()
    add_rig_argument(given, exists=False)
    given.add_argument("file", type=Path, nargs="?", help=argparse.SUPPRESS)


def rig_of(args: argparse.Namespace) -> Path:
    """The rig file of `add_rig_or_file`. Raises RigError without one."""
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

UNITS_M = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Of `add_length_arguments`."""


def add_length_arguments(parser: argparse.ArgumentParser) -> None:
    """The unit of lengths in a format that does not say it."""
    unit = parser.add_mutually_exclusive_group()
    unit.add_argument("--unit", choices=tuple(UNITS_M), help="of lengths, where the format does not say it (OpenCV, "
                      "anipose)")
    unit.add_argument("--square-mm", type=positive_number, metavar="S",
                      help="lengths are in sides of a board's square, of S mm")


def unit_of(args: argparse.Namespace) -> float | None:
    """Metres per unit of length as `add_length_arguments` says, None where nothing was given."""
    if args.square_mm is not None:
        return 1e-3 * float(args.square_mm)
    return None if args.unit is None else UNITS_M[args.unit]


# -- arguments that describe a board -----------------------------------------------------------------------------------

_SIZES = {kind: size for kind, (size, _) in KINDS.items()}
SIZE_HELP = (f"inner corners of a chessboard (default {_SIZES['chessboard']}), squares of a ChArUco board "
             f"({_SIZES['charuco']}), tags of an AprilGrid ({_SIZES['aprilgrid']}), circles in a row and rows "
             f"({_SIZES['circles']})")
SQUARE_HELP = (f"side of a square or of a tag (default {SQUARE_MM:g}), distance of the rows of circles "
               f"({SPACING_MM:g})")

def add_board_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, squares and markers."""
    board = parser.add_argument_group("board")
    board.add_argument("--kind", dest="board_kind", choices=tuple(KINDS),
                       help="what it is (default: a chessboard; with --marker-mm a ChArUco board)")
    board.add_argument("--board", metavar="COLSxROWS",
                       help=f"its size, or its file of Kalibr (.yaml), caliscope or anipose (.toml); {SIZE_HELP}")
    board.add_argument("--square-mm", type=positive_number, metavar="S", help=f"as measured, for printers scale: "
                       f"{SQUARE_HELP}")
    board.add_argument("--tag-spacing", type=positive_number, metavar="R", help="gap between the tags of an AprilGrid, "
                       f"as a part of their side (default {TAG_SPACING:g})")
    board.add_argument("--marker-mm", type=positive_number, metavar="M",
                       help="side of a marker: the board is a ChArUco board")
    board.add_argument("--dictionary", default="", metavar="NAME", help="its markers (default DICT_4X4_50)")
    board.add_argument("--legacy-pattern", action="store_true", help="it was drawn by OpenCV before 4.6")


def board_of(args: argparse.Namespace) -> Board:
    """The board; raises CalibrationError for an impossible one."""
    from rhot_app.calibration.board.boards import make_board
    from rhot_app.calibration.exchange.boards import SUFFIXES, read_board

    if args.board is not None and args.board.lower().endswith(SUFFIXES):
        told = (args.board_kind, args.square_mm, args.marker_mm, args.tag_spacing)
        if any(one is not None for one in told) or args.dictionary or args.legacy_pattern:
            raise CalibrationError(f"{args.board} says what the board is; leave --kind, --square-mm, --marker-mm, "
                                   "--tag-spacing, --dictionary and --legacy-pattern out, or give the size by numbers.")
        return read_board(input_file(args.board))
    kind = args.board_kind or ("chessboard" if args.marker_mm is None else "charuco")
    return make_board(kind, args.board, square_mm=args.square_mm, marker_mm=args.marker_mm,
                      dictionary=args.dictionary or None, legacy=args.legacy_pattern, tag_spacing=args.tag_spacing)
