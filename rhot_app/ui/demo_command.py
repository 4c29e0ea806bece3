"""``rhot demo``: the app on the simulated rig, tracking at once."""

from __future__ import annotations

import argparse
from pathlib import Path

from rhot_app.errors import SimulatorError
from rhot_app.options import add_scene_argument, add_seed_argument, add_tracker_argument
from rhot_app.simulator.scene.shipped_motions import shipped_motions
from rhot_app.ui.app import add_window_arguments, open_window
from rhot_app.ui.backend.contract import TwinChoice
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot demo``."""
    names = ", ".join(info.name for info in shipped_motions())
    parser.add_argument("--motion", metavar="M",
                        help=f"what the hand does: {names}, or a motion file (default {TwinChoice().motion})")
    add_scene_argument(parser)
    add_seed_argument(parser, "noise, clocks and cloth", default=None)
    add_tracker_argument(parser, f"what makes a hand of the markers (default {TwinChoice().tracker})",
                         TwinChoice().tracker)
    add_window_arguments(parser)
    add_examples(parser, "rhot demo", "rhot demo --scene lamp.json --tracker estimator")


def run(args: argparse.Namespace) -> int:
    """Open the window; raises SimulatorError for a motion that there is not, or a scene that cannot be."""
    names = [info.name for info in shipped_motions()]
    motion = args.motion
    if motion not in (None, *names):
        if not Path(motion).exists():
            raise SimulatorError(f"There is no motion {motion!r}; there are {', '.join(names)}, and motion files.")
        motion = str(Path(motion).absolute())
    return open_window(args, rig=None, twin=_choice(args, motion))


def _choice(args: argparse.Namespace, motion: str | None) -> TwinChoice:
    """What is given beside a scene file wins over it; without one, what is not given is as in the window."""
    if args.scene is None:
        usual = TwinChoice()
        return TwinChoice(motion or usual.motion, usual.seed if args.seed is None else args.seed, tracker=args.tracker)
    from rhot_app.simulator.scene.scene_file import read_scene

    fields = read_scene(args.scene)
    if motion is not None:
        fields.set("show.motion", motion, f"--motion {motion}")
    fields.require()
    return TwinChoice(motion, args.seed, None, args.tracker, args.scene.absolute())
