"""What calibration commands have in common: the printed verdict or JSON object, and the arguments of a board."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.board.standard_board import KINDS, SPACING_MM, SQUARE_MM, TAG_SPACING
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_rig_argument

if TYPE_CHECKING:
    from rhot_app.calibration.board.boards import Board
    from rhot_app.calibration.board.shared_views import Dropped
    from rhot_app.calibration.report import Report


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


def tell(report: Report, *, as_json: bool, **fields: Any) -> None:
    """Print a report: one JSON object with more `fields`, or sentences and figures for people."""
    if as_json:
        print(json.dumps({**report.to_json(), **fields}))
        return
    print(report.verdict.sentence)
    for finding in report.verdict.findings:
        print(f"  [{finding.grade.value}] {finding.sentence}")
    print(*report.lines(), sep="\n")


def show(report: Report, *, as_json: bool, written: str = "") -> int:
    """Print a calibration's report and return the exit code: 0, or 2 when the verdict forbids the result's use.

    `written` is the file that was written, empty for none.
    """
    tell(report, as_json=as_json, written=written or None)
    if written and not as_json:
        print(f"Written: {written}")
    if report.verdict.acceptable:
        return 0
    worst = report.verdict.findings[0].sentence
    print(f"rhot: nothing was written, because the result must not be used. {worst}", file=sys.stderr)
    return 2


def dropped_fields(dropped: Sequence[Dropped]) -> dict[str, Any]:
    """What JSON says of pictures that were not used."""
    return {"views_rejected": [{"name": each.name, "reason": each.reason, "code": each.code} for each in dropped]}


def left_out(dropped: Sequence[Dropped]) -> list[str]:
    """The same for people."""
    return [f"left out: {each.name}: {each.reason}" for each in dropped]


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

_SIZE = re.compile(r"(?<![^,])\s*(\d+)\s*,\s*(\d+)\s*(?![^,])")  # 9,6 is a size too
_SIZES = {kind: size for kind, (size, _) in KINDS.items()}
SIZE_HELP = (f"inner corners of a chessboard (default {_SIZES['chessboard']}), squares of a ChArUco board "
             f"({_SIZES['charuco']}), tags of an AprilGrid ({_SIZES['aprilgrid']}), circles in a row and rows "
             f"({_SIZES['circles']})")
SQUARE_HELP = (f"side of a square or of a tag (default {SQUARE_MM:g}), distance of the rows of circles "
               f"({SPACING_MM:g})")


BOARD_HELP = ("what it is, parts with commas between them, as charuco,10x7,marker_mm=18: the kind "
              f"({', '.join(KINDS)}; default chessboard), its size ({SIZE_HELP}), and of a ChArUco board marker_mm=M, "
              "dictionary=NAME, legacy (drawn by OpenCV before 4.6), of an AprilGrid tag_spacing=R (gap by side, "
              f"default {TAG_SPACING:g})")
_PARTS: dict[str, Callable[[str], Any]] = {"marker_mm": positive_number, "tag_spacing": positive_number,
                                           "dictionary": str}


def add_board_arguments(parser: argparse.ArgumentParser) -> None:
    """The board and its squares."""
    board = parser.add_argument_group("board")
    board.add_argument("--board", default="", metavar="PART,PART,...",
                       help=f"its file of Kalibr (.yaml), caliscope or anipose (.toml), or {BOARD_HELP}")
    add_square_argument(board, "as measured, for printers scale: ")


def add_square_argument(parser: argparse._ActionsContainer, what: str = "") -> None:
    """The length that is measured on a board."""
    parser.add_argument("--square-mm", type=positive_number, metavar="S", help=f"{what}{SQUARE_HELP}")


def board_of(args: argparse.Namespace) -> Board:
    """The board; raises CalibrationError for an impossible one."""
    from rhot_app.calibration.exchange.boards import SUFFIXES, read_board

    text = args.board
    if not any(part.lower().endswith(SUFFIXES) for part in text.split(",")):
        return described_board(text, args.square_mm)
    if args.square_mm is not None or not text.lower().endswith(SUFFIXES):
        raise CalibrationError(f"--board {text}: the file says what the board is; leave --square-mm and further parts "
                               "out, or give the size by numbers.")
    return read_board(input_file(text))


def described_board(text: str, square_mm: float | None) -> Board:
    """The board of parts with commas between them. Raises CalibrationError."""
    from rhot_app.calibration.board.boards import make_board

    kind, size, chosen = "", None, dict[str, Any]()
    for part in filter(None, map(str.strip, _SIZE.sub(r"\1x\2", text).split(","))):
        name, equals, value = part.partition("=")
        if part in KINDS and not kind:
            kind = part
        elif part == "legacy":
            chosen["legacy"] = True
        elif name in _PARTS and equals:
            try:
                chosen[name] = _PARTS[name](value)
            except argparse.ArgumentTypeError as exc:
                raise CalibrationError(f"board {text}: {name}={exc}.") from exc
        elif size is None and part[0].isdigit():
            size = part
        else:
            raise CalibrationError(f"board {text}: {part!r} is no part of a board. Write the kind "
                                   f"({', '.join(KINDS)}), the size (9x6), {', '.join(f'{one}=...' for one in _PARTS)} "
                                   "or legacy.")
    marked = chosen.keys() & {"marker_mm", "dictionary", "legacy"}
    return make_board(kind or ("charuco" if marked else "chessboard"), size, square_mm=square_mm, **chosen)
