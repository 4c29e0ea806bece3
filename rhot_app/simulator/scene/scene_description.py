"""What can stand before the simulated cameras, as files and programs name it."""

from __future__ import annotations

import argparse
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from rhot_app.calibration.board.boards import (
    BOARD,
    CHARUCO,
    DEFAULT_DICTIONARY,
    MARKER_SHARE,
    SQUARE_MM,
    Board,
    CharucoBoard,
    Chessboard,
    parse_size,
)

NEAREST_M: Final = 0.15
FARTHEST_M: Final = 5.0

Distance = Annotated[float, Meta(ge=NEAREST_M, le=FARTHEST_M)]
Millimetres = Annotated[float, Meta(gt=0, le=2000)]


class _Show(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="show"):
    """Root of all; the field "show" tells them apart."""


class HandShow(_Show, frozen=True, tag="hand"):
    """A hand that wears the scene's markers. `motion` is a name of resources/motions or a file; see `load_motion`."""

    motion: str = "grasp"


class BoardShow(_Show, frozen=True, tag="board"):
    """A calibration board, moved about with pauses, or lying on the table.

    `size` counts inner corners of a chessboard, squares of a ChArUco board, whose markers measure `marker_mm` (3/4 of a
    square when null). `legacy`: the layout of OpenCV before 4.6.
    """

    pattern: Literal["chessboard", "charuco"] = "chessboard"
    size: str = BOARD
    square_mm: Millimetres = SQUARE_MM
    marker_mm: Millimetres | None = None
    dictionary: str = DEFAULT_DICTIONARY
    legacy: bool = False
    on_table: bool = False

    def board(self) -> Board:
        """The board itself; raises CalibrationError when there can be none like it."""
        across, down = parse_size(self.size)
        square_m = 1e-3 * self.square_mm
        if self.pattern == "chessboard":
            return Chessboard(across, down, square_m)
        marker_m = MARKER_SHARE * square_m if self.marker_mm is None else 1e-3 * self.marker_mm
        return CharucoBoard(across, down, square_m, marker_m, self.dictionary, self.legacy)


class RulerShow(_Show, frozen=True, tag="ruler"):
    """A paper ruler with two crosses `length_mm` apart, held still."""

    length_mm: Millimetres = 200.0


class MarkerShow(_Show, frozen=True, tag="marker"):
    """One painted ball on a stick, `distance_m` from the cameras' plane, before the middle of the cameras.

    `marker` is its id (null: the set's first). `moving`: it sweeps fast to and fro at that distance.
    """

    marker: str | None = None
    distance_m: Distance = 0.6
    moving: bool = False


Show = HandShow | BoardShow | RulerShow | MarkerShow


# -- Command line arguments that choose what stands before the simulated cameras ---------------------------------------

def add_show_arguments(parser: argparse.ArgumentParser) -> None:
    """What is shown, besides the hand's ``--motion``."""
    room = parser.add_argument_group("instead of a hand")
    room.add_argument("--show", default="hand", choices=("hand", "board", "ruler", "marker"),
                      help="what stands before the cameras (default hand)")
    room.add_argument("--board", default=None, metavar="COLSxROWS",
                      help=f"inner corners of a chessboard (default {BOARD}), squares of a ChArUco board (default "
                      f"{CHARUCO})")
    room.add_argument("--square-mm", type=float, default=SQUARE_MM, metavar="S",
                      help=f"side of its squares (default {SQUARE_MM:g})")
    room.add_argument("--charuco", action="store_true", help="a ChArUco board (DICT_4X4_50) instead of a chessboard")
    room.add_argument("--marker-mm", type=float, default=None, metavar="S",
                      help="side of the ChArUco board's markers (default 3/4 of a square)")
    room.add_argument("--dictionary", default=None, metavar="NAME", help="family of the ChArUco board's markers")
    room.add_argument("--legacy-pattern", "--legacy", dest="legacy", action="store_true",
                      help="ChArUco layout of OpenCV before 4.6")
    room.add_argument("--on-table", action="store_true", help="the board lies on the table below")
    room.add_argument("--ruler-mm", type=float, default=200.0, metavar="L",
                      help="distance of the ruler's crosses (default 200)")
    room.add_argument("--marker", default=None, metavar="ID",
                      help="which marker's colour the single ball has, at --distance (default: the set's first)")
    room.add_argument("--moving", action="store_true", help="the single marker sweeps fast to and fro")


def show_of(args: argparse.Namespace) -> Show:
    """The show that the arguments describe. Raises SimulatorError."""
    import msgspec

    from rhot_app.errors import SimulatorError
    from rhot_app.simulator.scene.scene_description import Show

    fields: dict[str, object] = {"show": args.show}
    if args.show == "hand":
        fields["motion"] = args.motion
    elif args.show == "board":
        fields |= {"pattern": "charuco" if args.charuco else "chessboard", "square_mm": args.square_mm,
                   "size": args.board or (CHARUCO if args.charuco else BOARD), "marker_mm": args.marker_mm,
                   "legacy": args.legacy, "on_table": args.on_table}
        if args.dictionary is not None:
            fields["dictionary"] = args.dictionary
    elif args.show == "ruler":
        fields["length_mm"] = args.ruler_mm
    else:
        fields |= {"marker": args.marker, "moving": args.moving}
        if args.distance is not None:
            fields["distance_m"] = args.distance
    try:
        return msgspec.convert(fields, Show)
    except msgspec.ValidationError as exc:
        raise SimulatorError(f"this cannot be shown: {exc}") from exc
