"""``rhot simulate``: render a moving hand before both cameras to disk, with the truth beside it."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.simulator.scene.scene_arguments import add_show_arguments, show_of

if TYPE_CHECKING:
    from rhot_app.simulator.nodes.film import Progress
    from rhot_app.simulator.nodes.shot import Shot
    from rhot_app.simulator.scene.scene import Scene

MOST_PICTURES = 999
POINT_SIGMA_PX = 0.12
SECONDS_MAX = 86_400.0

_OPTION_OF = {"distance_m": "distance", "lamp.brightness": "lamp", "lamp.kelvin": "kelvin", "lamp.mains_hz": "mains",
              "worn_paint": "worn", "uneven_paint": "uneven", "glove_rgb": "glove"}
"""The options that choose fields of the twin's settings."""


def add_scene_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments that choose the scene; shared by every command that simulates."""
    parser.add_argument("--motion", default="grasp", metavar="M",
                        help="name of a motion (still, rest, wave, grasp, pinch, point, spread, tap, fast, sweep, "
                             "cross), a motion file (.json), or a recording (Qualisys .tsv, Leap Motion .csv); "
                             "default grasp")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of all that is random (default 1)")
    parser.add_argument("--preset", default=None, choices=("wide", "fast"),
                        help="camera preset: wide (62.2 degrees, 40 fps) or fast (26.5 degrees, 120 fps)")
    parser.add_argument("--distance", type=float, default=None, metavar="M",
                        help="distance of the hand from the cameras in metres (default 0.6)")
    parser.add_argument("--background", default=None, choices=("cloth", "clutter", "skin"),
                        help="what stands behind the hand: cloth (default), clutter, or skin, clutter with things of "
                        "skin's colours")
    parser.add_argument("--markers", "--marker-set", default=None, metavar="SET",
                        help="which markers the hand wears: rhot6 (default), rhot8, rich, nails6, or a marker file "
                             "(.json)")
    parser.add_argument("--back", action="store_const", const="back", default=None,
                        help="the back of the hand faces the cameras (default: the palm does)")
    parser.add_argument("--worn", type=float, default=None, metavar="P",
                        help="share 0..0.9 of the paint that has come off, in pieces of 2 mm (default 0)")
    parser.add_argument("--uneven", type=float, default=None, metavar="P",
                        help="share 0..0.9 by which the paint's brightness varies over the patch (default 0)")
    parser.add_argument("--glove", default=None, metavar="R,G,B",
                        help="a glove of this colour, 0..255 each, instead of skin (default: none)")
    parser.add_argument("--lamp", type=float, default=None, metavar="F",
                        help="brightness of the lamp, a factor on its light (default 1)")
    parser.add_argument("--kelvin", type=float, default=None, metavar="K",
                        help="colour temperature of the lamp; 6500, the default, is neutral, 3000 a warm bulb")
    parser.add_argument("--mains", type=float, default=None, metavar="HZ",
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
        raise SimulatorError(_objection(str(exc), args)) from exc


def _numbers(text: str) -> list[int | str]:
    """Whole numbers that commas part; anything else stays text, for the settings to object to."""
    return [int(part) if part.strip().isdigit() else part for part in text.split(",")]


def _objection(problem: str, args: argparse.Namespace) -> str:
    """What msgspec says of a field, said of the option that chose it."""
    for path, option in _OPTION_OF.items():
        if f"`$.{path}" in problem:
            what = problem.split(" - at ")[0].replace("Expected `float`", "expected a number")
            if path == "glove_rgb":
                what = "three whole numbers from 0 to 255 with commas between them make a colour"
            return f"--{option} {getattr(args, option)}: {what}."
    return f"the scene cannot be: {problem}"


def _with(fields: dict[str, Any], chosen: dict[str, Any]) -> dict[str, Any]:
    """The fields, changed where something was chosen."""
    return fields | {key: value for key, value in chosen.items() if value is not None}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot simulate``."""
    add_scene_arguments(parser)
    add_show_arguments(parser)
    parser.add_argument("--seconds", type=float, default=10.0, metavar="S", help="length of the recording (default 10)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR",
                        help="new folder for the frames (DIR/left, DIR/right), truth.npz and shot.json; to play it to "
                             "two nodes on this machine, their settings (left.json, right.json) and rig.json")
    parser.add_argument("--pictures", type=int, default=None, metavar="N",
                        help="N pictures per camera (DIR/left/000.png ...) instead of a recording: of a board, one at "
                             "each place where it is held still")
    parser.add_argument("--points", type=float, nargs="?", const=POINT_SIGMA_PX, default=None, metavar="PX",
                        help="no pictures: a raw log (DIR/points.log) of every marker's position in both, with a noise "
                             f"of PX (default {POINT_SIGMA_PX:g}); nothing hides anything, and no cube's tags")
    parser.add_argument("--depth-table", default=None, metavar="CM,CM,...",
                        help="no pictures: a table (DIR/table.csv) of disparities of a marker held at these distances")
    parser.add_argument("--hide", action="append", default=[], metavar="ID",
                        help="leave a marker unpainted; repeatable")
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output")


def run(args: argparse.Namespace) -> int:
    """Render; Ctrl-C leaves nothing half-written."""
    from rhot_app.progress import ProgressLine
    from rhot_app.simulator.nodes.shot import make_shot

    _check(args)
    if args.depth_table is not None:
        return _write_depth_table(args)
    began = time.monotonic()
    shot = make_shot(scene_of(args), show_of(args), args.seconds, frozenset(args.hide))
    line = ProgressLine(f"simulating {shot.scene_object.name}" if args.pictures else
                        f"simulating {args.seconds:g} s of {shot.scene_object.name}")
    _write(shot, args, line)
    line.finish()
    frames = {name: args.pictures or len(shot.scene.frame_times_ns(k, args.seconds))
              for k, name in enumerate(shot.scene.names)}
    if args.json:
        print(json.dumps({"out": str(args.out.absolute()), "motion": shot.scene_object.name, "seconds": args.seconds,
                          "seed": args.seed, "preset": shot.scene.settings.preset,
                          "distance_m": shot.scene.settings.distance_m, "frames": frames,
                          "elapsed_s": round(time.monotonic() - began, 3)}))
    else:
        what = "pictures" if args.pictures else "frames"
        print(f"{args.out}: " + ", ".join(f"{count} {what} of {name}" for name, count in frames.items()))
    return 0


def _check(args: argparse.Namespace) -> None:
    from rhot_app.errors import SimulatorError

    if not 0.0 < args.seconds <= SECONDS_MAX:
        raise SimulatorError(f"--seconds is a number above 0 and up to {SECONDS_MAX:.0f}, not {args.seconds:g}.")
    if args.pictures is not None and args.points is not None:
        raise SimulatorError("--pictures and --points exclude each other: points are seen without pictures.")
    if args.pictures is not None and not 1 <= args.pictures <= MOST_PICTURES:
        raise SimulatorError(f"--pictures is a number from 1 to {MOST_PICTURES}, not {args.pictures}.")
    if args.points is not None and not args.points >= 0.0:
        raise SimulatorError(f"--points is a noise of 0 px or more, not {args.points:g}.")


def _write_depth_table(args: argparse.Namespace) -> int:
    from rhot_app.errors import SimulatorError
    from rhot_app.simulator.truth.points import TABLE_NAME, PointNoise, write_distances

    try:
        distances = [0.01 * float(text) for text in args.depth_table.split(",")]
    except ValueError as exc:
        raise SimulatorError(f"--depth-table takes distances in cm, as 20,40,60, not {args.depth_table!r}.") from exc
    sigma_px = POINT_SIGMA_PX if args.points is None else args.points
    write_distances(scene_of(args), distances, args.out.absolute(), PointNoise(sigma_px))
    table = args.out.absolute() / TABLE_NAME
    print(json.dumps({"out": str(args.out.absolute()), "table": str(table)}) if args.json
          else f"{table}: {len(distances)} distances")
    return 0


def _write(shot: Shot, args: argparse.Namespace, progress: Progress) -> None:
    """Pictures, points or recordings, whatever was asked for."""
    folder = args.out.absolute()
    if args.pictures is not None:
        from rhot_app.simulator.pictures import take_pictures

        take_pictures(shot, folder, args.pictures, progress)
    elif args.points is not None:
        from rhot_app.simulator.truth.points import PointNoise, write_points

        write_points(shot, folder, PointNoise(args.points), progress)
    else:
        from rhot_app.simulator.nodes.film import film

        film(shot, folder, progress)
