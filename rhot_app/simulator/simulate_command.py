"""``rhot simulate``: render a moving hand before both cameras to disk, with the truth beside it."""

from __future__ import annotations

import argparse
import json
import time
from typing import TYPE_CHECKING

from rhot_app.errors import not_negative, positive_count
from rhot_app.options import add_json_argument, add_out_argument, add_seconds_argument
from rhot_app.simulator.scene.scene_arguments import (
    SECONDS_MAX,
    add_scene_arguments,
    add_show_argument,
    fields_of,
    scene_of,
)
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.simulator.film.film import Progress
    from rhot_app.simulator.film.shot import Shot

SECONDS = 10.0
MOST_PICTURES = 999
POINT_SIGMA_PX = 0.12


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot simulate``."""
    add_scene_arguments(parser)
    add_show_argument(parser)
    add_seconds_argument(parser, f"length of the recording (default {SECONDS:g})", None)
    add_out_argument(parser, "new folder for the frames (DIR/left, DIR/right), truth.npz and shot.json; to play it to "
                     "two nodes on this machine, their settings (left.json, right.json) and rig.json. A name "
                     "that ends in .json: write the scene alone, for --scene", required=True, metavar="DIR")
    parser.add_argument("--pictures", type=positive_count, default=None, metavar="N",
                        help="N pictures per camera (DIR/left/000.png ...) instead of a recording: of a board, one at "
                             "each place where it is held still")
    parser.add_argument("--points", type=not_negative, nargs="?", const=POINT_SIGMA_PX, default=None, metavar="PX",
                        help="no pictures: a raw log (DIR/points.log) of every marker's position in both, with a noise "
                             f"of PX (default {POINT_SIGMA_PX:g}); only --hide hides anything, and no cube's tags")
    parser.add_argument("--depth-table", default=None, metavar="CM,CM,...",
                        help="no pictures: a table (DIR/table.csv) of disparities of a marker held at these distances")
    parser.add_argument("--hide", action="append", default=[], metavar="ID",
                        help="leave a marker of the hand unpainted; repeatable")
    add_json_argument(parser)
    add_examples(parser, "rhot simulate --motion pinch --seconds 5 --out pinch",
                 "rhot simulate --show board --set show.pattern=charuco --pictures 20 --out board")


def run(args: argparse.Namespace) -> int:
    """Render; Ctrl-C leaves nothing half-written."""
    from rhot_app.progress import ProgressLine
    from rhot_app.simulator.film.shot import make_shot

    if args.out.suffix == ".json":
        return _write_scene(args)
    args.seconds = SECONDS if args.seconds is None else args.seconds
    _check(args)
    announce_compilation()
    if args.depth_table is not None:
        return _write_depth_table(args)
    began = time.monotonic()
    fields = fields_of(args)
    shot = make_shot(fields.scene(), fields.shown(), args.seconds, frozenset(args.hide))
    line = ProgressLine(f"simulating {shot.scene_object.name}" if args.pictures else
                        f"simulating {args.seconds:g} s of {shot.scene_object.name}")
    _write(shot, args, line)
    line.finish()
    frames = {name: args.pictures or len(shot.scene.frame_times_ns(k, args.seconds))
              for k, name in enumerate(shot.scene.names)}
    if args.json:
        print(json.dumps({"out": str(args.out.absolute()), "motion": shot.scene_object.name, "seconds": args.seconds,
                          "seed": shot.scene.seed, "preset": shot.scene.settings.preset,
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
    if args.depth_table is not None and (args.hide or args.pictures is not None):
        raise SimulatorError(f"--depth-table and --{'hide' if args.hide else 'pictures'} exclude each other: the table "
                             "is of a single marker, without pictures.")
    if args.pictures is not None and args.points is not None:
        raise SimulatorError("--pictures and --points exclude each other: points are seen without pictures.")
    if args.pictures is not None and not 1 <= args.pictures <= MOST_PICTURES:
        raise SimulatorError(f"--pictures is a number from 1 to {MOST_PICTURES}, not {args.pictures}.")
    if args.points is not None and not args.points >= 0.0:
        raise SimulatorError(f"--points is a noise of 0 px or more, not {args.points:g}.")


def _write_scene(args: argparse.Namespace) -> int:
    from rhot_app.errors import SimulatorError
    from rhot_app.simulator.scene.scene_file import write_scene

    for name in ("seconds", "pictures", "points", "depth_table", "hide"):
        if getattr(args, name) not in (None, []):
            raise SimulatorError(f"--out {args.out} writes the scene alone, without pictures: leave out "
                                 f"--{name.replace('_', '-')}, or name a folder.")
    if args.out.exists():
        raise SimulatorError(f"{args.out} exists already; choose another name or remove it.")
    write_scene(args.out, fields_of(args))
    print(json.dumps({"out": str(args.out.absolute())}) if args.json else f"{args.out}: the scene")
    return 0


def _write_depth_table(args: argparse.Namespace) -> int:
    from rhot_app.errors import SimulatorError
    from rhot_app.simulator.film.points import TABLE_NAME, PointNoise, write_distances

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
        from rhot_app.simulator.film.pictures import take_pictures

        take_pictures(shot, folder, args.pictures, progress)
    elif args.points is not None:
        from rhot_app.simulator.film.points import PointNoise, write_points

        write_points(shot, folder, PointNoise(args.points), progress)
    else:
        from rhot_app.simulator.film.film import film

        film(shot, folder, progress)
