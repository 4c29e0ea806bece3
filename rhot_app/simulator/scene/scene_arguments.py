"""Command line arguments that choose the simulated scene and what stands before its cameras."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.board.standard_board import BOARD, CHARUCO, SQUARE_MM
from rhot_app.errors import count, not_negative, positive_number

if TYPE_CHECKING:
    from rhot_app.simulator.scene.scene import Scene
    from rhot_app.simulator.scene.scene_description import Show

SECONDS_MAX = 86_400.0
"""s: of a simulation."""

_SETTING_OPTIONS = {"distance_m": "distance", "lamp.brightness": "lamp", "lamp.kelvin": "kelvin",
                    "lamp.mains_hz": "mains", "worn_paint": "worn", "uneven_paint": "uneven", "glove_rgb": "glove"}
"""The options that choose fields of the twin's settings."""

_OPTION_OF = {"tone": "--tone", "length_mm": "--ruler-mm", "square_mm": "--square-mm", "marker_mm": "--marker-mm",
              "distance_m": "--distance"}


def add_scene_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments that choose the scene; shared by every command that simulates."""
    parser.add_argument("--motion", default="grasp", metavar="M",
                        help="name of a motion (still, rest, wave, brisk, grasp, pinch, point, spread, tap, fast, "
                             "sweep, cross, roam, mouse), a motion file (.json), or a recording (Qualisys .tsv, Leap "
                             "Motion .csv); default grasp")
    parser.add_argument("--seed", type=count, default=1, metavar="N", help="seed of all that is random (default 1)")
    parser.add_argument("--preset", default=None, choices=("wide", "fast"),
                        help="camera preset: wide (62.2 degrees, 40 fps) or fast (26.5 degrees, 120 fps)")
    parser.add_argument("--distance", type=positive_number, default=None, metavar="M",
                        help="distance of the hand from the cameras in metres (default 0.6)")
    parser.add_argument("--background", default=None, choices=("cloth", "clutter", "skin"),
                        help="what stands behind the hand: cloth (default), clutter, or skin, clutter with things of "
                        "skin's colours")
    parser.add_argument("--markers", "--marker-set", default=None, metavar="SET",
                        help="which markers the hand wears: rhot6 (default), rhot8, rich, nails6, or a marker file "
                             "(.json)")
    parser.add_argument("--back", action="store_const", const="back", default=None,
                        help="the back of the hand faces the cameras (default: the palm does)")
    parser.add_argument("--worn", type=not_negative, default=None, metavar="P",
                        help="share 0..0.9 of the paint that has come off, in pieces of 2 mm (default 0)")
    parser.add_argument("--uneven", type=not_negative, default=None, metavar="P",
                        help="share 0..0.9 by which the paint's brightness varies over the patch (default 0)")
    parser.add_argument("--glove", default=None, metavar="R,G,B",
                        help="a glove of this colour, 0..255 each, instead of skin (default: none)")
    parser.add_argument("--lamp", type=not_negative, default=None, metavar="F",
                        help="brightness of the lamp, a factor on its light (default 1)")
    parser.add_argument("--kelvin", type=positive_number, default=None, metavar="K",
                        help="colour temperature of the lamp; 6500, the default, is neutral, 3000 a warm bulb")
    parser.add_argument("--mains", type=not_negative, default=None, metavar="HZ",
                        help="let the lamp flicker with mains of 50 or 60 Hz (default: steady)")


def scene_of(args: argparse.Namespace) -> Scene:
    """The scene that the arguments describe. Raises RigError, SimulatorError."""
    import msgspec

    from rhot_app.errors import SimulatorError
    from rhot_app.simulator.scene.scene import TwinSettings, make_scene, twin_defaults

    if args.seed < 0:
        raise SimulatorError(f"--seed is 0 or more, not {args.seed}.")
    chosen = {"preset": args.preset, "distance_m": args.distance, "background": args.background,
              "markers": args.markers, "facing": args.back, "worn_paint": args.worn, "uneven_paint": args.uneven,
              "glove_rgb": None if args.glove is None else _numbers(args.glove)}
    lamp = {"brightness": args.lamp, "kelvin": args.kelvin, "mains_hz": args.mains}
    merged = _with(msgspec.to_builtins(twin_defaults()), chosen)
    merged["lamp"] = _with(merged["lamp"], lamp)
    try:
        return make_scene(msgspec.convert(merged, TwinSettings), args.seed)
    except msgspec.ValidationError as exc:
        raise SimulatorError(_setting_objection(str(exc), args)) from exc


def _numbers(text: str) -> list[int | str]:
    """Whole numbers that commas part; anything else stays text, for the settings to object to."""
    return [int(part) if part.strip().isdigit() else part for part in text.split(",")]


def _setting_objection(problem: str, args: argparse.Namespace) -> str:
    """What msgspec says of a field, said of the option that chose it."""
    for path, option in _SETTING_OPTIONS.items():
        if f"`$.{path}" in problem:
            what = problem.split(" - at ")[0].replace("Expected `float`", "expected a number")
            if path == "glove_rgb":
                what = "three whole numbers from 0 to 255 with commas between them make a colour"
            return f"--{option} {getattr(args, option)}: {what}."
    return f"the scene cannot be: {problem}"


def _with(fields: dict[str, Any], chosen: dict[str, Any]) -> dict[str, Any]:
    """The fields, changed where something was chosen."""
    return fields | {key: value for key, value in chosen.items() if value is not None}


def add_show_arguments(parser: argparse.ArgumentParser) -> None:
    """What is shown, besides the hand's ``--motion``."""
    parser.add_argument("--cube", action="store_true",
                        help="the hand holds a cube with fiducial tags, which the rig then tracks")
    room = parser.add_argument_group("instead of a hand")
    room.add_argument("--show", default="hand", choices=("hand", "board", "ruler", "marker", "empty"),
                      help="what stands before the cameras (default hand)")
    room.add_argument("--bare", action="store_true", help="the hand wears no markers: skin, nails and a forearm")
    room.add_argument("--tone", type=positive_number, default=None, metavar="T",
                      help="skin tone of a bare hand, 1 (light) to 10 on the Monk scale (default: drawn from the seed)")
    room.add_argument("--sleeve", action="store_true", help="the arm of a bare hand wears a sleeve")
    room.add_argument("--board", default=None, metavar="COLSxROWS",
                      help=f"inner corners of a chessboard (default {BOARD}), squares of a ChArUco board (default "
                      f"{CHARUCO})")
    room.add_argument("--square-mm", type=positive_number, default=SQUARE_MM, metavar="S",
                      help=f"side of its squares (default {SQUARE_MM:g})")
    room.add_argument("--charuco", action="store_true", help="a ChArUco board (DICT_4X4_50) instead of a chessboard")
    room.add_argument("--marker-mm", type=positive_number, default=None, metavar="S",
                      help="side of the ChArUco board's markers (default 3/4 of a square)")
    room.add_argument("--dictionary", default=None, metavar="NAME", help="family of the ChArUco board's markers")
    room.add_argument("--legacy-pattern", "--legacy", dest="legacy", action="store_true",
                      help="ChArUco layout of OpenCV before 4.6")
    room.add_argument("--on-table", action="store_true", help="the board lies on the table below")
    room.add_argument("--ruler-mm", type=positive_number, default=200.0, metavar="L",
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
    elif args.show == "empty":
        pass
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
