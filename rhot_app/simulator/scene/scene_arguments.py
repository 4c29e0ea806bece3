"""Command line arguments that choose what stands before the simulated cameras."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rhot_app.calibration.board.standard_board import BOARD, CHARUCO, SQUARE_MM

if TYPE_CHECKING:
    from rhot_app.simulator.scene.scene_description import Show

_OPTION_OF = {"tone": "--tone", "length_mm": "--ruler-mm", "square_mm": "--square-mm", "marker_mm": "--marker-mm",
              "distance_m": "--distance"}


def add_show_arguments(parser: argparse.ArgumentParser) -> None:
    """What is shown, besides the hand's ``--motion``."""
    parser.add_argument("--cube", action="store_true",
                        help="the hand holds a cube with fiducial tags, which the rig then tracks")
    room = parser.add_argument_group("instead of a hand")
    room.add_argument("--show", default="hand", choices=("hand", "board", "ruler", "marker"),
                      help="what stands before the cameras (default hand)")
    room.add_argument("--bare", action="store_true", help="the hand wears no markers: skin, nails and a forearm")
    room.add_argument("--tone", type=float, default=None, metavar="T",
                      help="skin tone of a bare hand, 1 (light) to 10 on the Monk scale (default: drawn from the seed)")
    room.add_argument("--sleeve", action="store_true", help="the arm of a bare hand wears a sleeve")
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

    if args.show != "hand" and (args.bare or args.cube):
        raise SimulatorError(f"--{'bare' if args.bare else 'cube'} is of a hand: leave out --show {args.show}, or it.")
    if args.bare and args.cube:
        raise SimulatorError("a bare hand holds no cube: leave out --bare or --cube.")
    if not args.bare and (args.tone is not None or args.sleeve):
        raise SimulatorError(f"--{'sleeve' if args.sleeve else 'tone'} is of a bare hand: give --bare, too.")
    fields: dict[str, object] = {"show": args.show}
    if args.show == "hand" and args.bare:
        fields |= {"show": "bare_hand", "motion": args.motion, "tone": args.tone, "sleeve": args.sleeve}
    elif args.show == "hand":
        fields |= {"motion": args.motion, "cube": args.cube}
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
        raise SimulatorError(_objection(str(exc))) from exc


def _objection(problem: str) -> str:
    """What msgspec says of a field, said of the option that chose it."""
    what, _, place = problem.partition(" - at ")
    option = _OPTION_OF.get(place.strip("`").removeprefix("$."))
    what = what.replace("Expected `float`", "expected a number")
    return f"this cannot be shown: {problem}" if option is None else f"{option}: {what}."
