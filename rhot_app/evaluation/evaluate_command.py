"""``rhot evaluate``: the whole system against the truth it never saw."""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

from rhot_app.simulator.simulate_command import add_scene_arguments, scene_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot evaluate``."""
    add_scene_arguments(parser)
    parser.add_argument("--seconds", type=float, default=20.0, metavar="S",
                        help="length of the run; its first second is not judged (default 20)")
    parser.add_argument("--loss", type=float, default=0.0, metavar="P",
                        help="probability 0..1 that a datagram of observations is lost (default 0)")
    parser.add_argument("--detector", default="fast", choices=("fast", "reference"),
                        help="the nodes' detector: fast, or reference, the thesis's pipeline")
    parser.add_argument("--frames", type=Path, metavar="DIR",
                        help="play this folder of `rhot simulate` instead of rendering; the scene is what it says")
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output")


def run(args: argparse.Namespace) -> int:
    """Render (or take) the frames, play them, compare, print."""
    from rhot_app.errors import SimulatorError
    from rhot_app.evaluation.report import SETTLE_S, details, table
    from rhot_app.evaluation.runner import evaluate, evaluate_frames

    if args.seconds <= SETTLE_S and args.frames is None:
        raise SimulatorError(f"a run of {args.seconds:g} s is too short: the first {SETTLE_S:g} s are not judged.")
    if not 0.0 <= args.loss < 1.0:
        raise SimulatorError(f"--loss is a probability from 0 to below 1, not {args.loss:g}.")
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        options = {"loss": args.loss, "detector": args.detector}
        if args.frames is not None:
            figures = evaluate_frames(args.frames.absolute(), Path(work), **options)
        else:
            figures = evaluate(scene_of(args), args.motion, args.seconds, Path(work), **options)
    if args.json:
        print(json.dumps(figures))
    else:
        print(table([(figures["motion"], figures)]), details(figures), sep="\n\n")
    return 0
