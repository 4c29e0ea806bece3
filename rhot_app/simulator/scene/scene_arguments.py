"""Command line arguments that choose the simulated scene and what stands before its cameras."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rhot_app.errors import positive_number
from rhot_app.options import add_scene_argument, add_seed_argument

if TYPE_CHECKING:
    from rhot_app.simulator.scene.scene import Scene
    from rhot_app.simulator.scene.scene_description import Show
    from rhot_app.simulator.scene.scene_file import SceneFields

SECONDS_MAX = 86_400.0
"""s: of a simulation."""

MOTION = "grasp"
SHOWS = ("hand", "bare-hand", "board", "ruler", "marker", "empty")
HANDS = ("hand", "bare_hand")


def add_scene_arguments(parser: argparse.ArgumentParser, *, motion: bool = True) -> None:
    """Arguments that choose the scene; shared by every command that simulates. `motion`: of one hand."""
    parser.set_defaults(motion=None, show=None)
    if motion:
        parser.add_argument("--motion", metavar="M",
                            help="name of a motion (still, rest, wave, brisk, grasp, pinch, point, spread, tap, fast, "
                                 "sweep, cross, roam, mouse), a motion file (.json), or a recording (Qualisys .tsv, "
                                 f"Leap Motion .csv); default {MOTION}")
    add_seed_argument(parser, "all that is random", default=None)
    add_scene_argument(parser)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE",
                        help="one field of the scene, as lamp.kelvin=3000, background=clutter, facing=back or "
                             "show.on_table=true; repeatable (docs/twin.md lists them)")
    parser.add_argument("--preset", default=None, choices=("wide", "fast"),
                        help="camera preset: wide (62.2 degrees, 40 fps) or fast (26.5 degrees, 120 fps)")
    parser.add_argument("--distance", type=positive_number, default=None, metavar="M",
                        help="distance of the hand from the cameras in metres (default 0.6)")
    parser.add_argument("--markers", "--marker-set", default=None, metavar="SET",
                        help="which markers the hand wears: rhot6 (default), rhot8, rich, nails6, or a marker file "
                             "(.json)")


def add_show_argument(parser: argparse.ArgumentParser) -> None:
    """What is shown, besides the hand's ``--motion``."""
    parser.add_argument("--show", choices=SHOWS,
                        help="what stands before the cameras: a hand with markers (default), a bare-hand, a board, a "
                             "ruler, one marker, or nothing; --set show.NAME=VALUE says how")


def fields_of(args: argparse.Namespace) -> SceneFields:
    """The scene that the arguments describe: those of the file, then of `--set`, then of the other options. Raises
    RigError, SimulatorError."""
    from rhot_app.errors import SimulatorError
    from rhot_app.simulator.scene.scene_file import SceneFields, read_scene, value_of

    fields = SceneFields() if args.scene is None else read_scene(args.scene)
    show = None if args.show is None else args.show.replace("-", "_")
    if show not in (None, fields.show.get("show", "hand")):
        fields.show.clear()  # what the file says of another thing does not matter
    if show is not None:
        fields.set("show.show", show, f"--show {args.show}")
    for text in args.set:
        name, equals, value = text.partition("=")
        if not equals or not all(name.strip().split(".")):
            raise SimulatorError(f"--set {text}: write NAME=VALUE, as in --set lamp.kelvin=3000.")
        fields.set(name.strip(), value_of(value.strip()), f"--set {text}", value.strip())
    for name in ("preset", "markers", "seed"):
        if getattr(args, name) is not None:
            fields.set(name, getattr(args, name), f"--{name} {getattr(args, name)}")
    shown = fields.show.get("show", "hand")
    if args.distance is not None:
        fields.set("distance_m", args.distance, f"--distance {args.distance:g}")
        if shown == "marker":
            fields.set("show.distance_m", args.distance, f"--distance {args.distance:g}")
    if args.motion is not None:
        if shown not in HANDS:
            raise SimulatorError(f"--motion is of a hand, and a {shown} is shown: leave out one of them.")
        fields.set("show.motion", args.motion, f"--motion {args.motion}")
    return fields


def scene_of(args: argparse.Namespace) -> Scene:
    """The scene that the arguments describe. Raises RigError, SimulatorError."""
    return fields_of(args).scene()


def show_of(args: argparse.Namespace) -> Show:
    """The show that the arguments describe. Raises RigError, SimulatorError."""
    return fields_of(args).shown()
