"""``rhot export``: a raw log through the tracker into a file that other programs read."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from rhot_app.errors import input_file, positive_number
from rhot_app.options import add_force_argument, add_out_argument, add_rig_argument, add_tracker_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.export.plan import ExportOptions

READ_WITH_LOSSES = 3
"""Exit code: the file is there, but not all of the log could be read."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot export``."""
    parser.add_argument("path", type=input_file, metavar="LOG",
                        help="a raw log written by rhot engine --log or the app")
    add_out_argument(parser, "file to write (default: named as the log, beside it)")
    add_export_arguments(parser, "default: by the ending of --out")
    add_force_argument(parser)
    add_examples(parser, "rhot export wave.rhotlog --out wave.csv",
                 "rhot export wave.rhotlog --out wave.trc --rate 100 --smooth --tracker estimator")


def add_export_arguments(parser: argparse.ArgumentParser, without_format: str) -> None:
    """What ``rhot export`` and ``rhot batch`` have in common; `without_format` says what holds without --format."""
    parser.add_argument("--format", default=None, metavar="F",
                        help=f"format, such as csv; docs/export.md lists them ({without_format})")
    add_rig_argument(parser, "track with this rig instead of the one the log was recorded with")
    add_tracker_argument(parser, "track with this tracker instead of the one that the rig asks for")
    parser.add_argument("--rate", type=positive_number, default=None, metavar="HZ",
                        help="states at equal intervals (default: each at its own time; trc, c3d and bvh: the cameras' "
                             "rate)")
    parser.add_argument("--frame", choices=("rig", "wrist"), default="rig",
                        help="positions in the rig frame, or relative to the wrist along the palm's axes (default rig)")
    parser.add_argument("--units", choices=("mm", "m"), default=None,
                        help="unit of length (default: what the format's readers expect)")
    parser.add_argument("--hand", choices=("hand", "other_hand"), default="hand",
                        help="which of a rig's two hands a bvh file gets (default hand)")
    parser.add_argument("--fill", type=positive_number, default=None, metavar="S",
                        help="fill gaps of up to so many seconds by interpolation; what is filled is marked (default: "
                             "gaps stay)")
    parser.add_argument("--smooth", action="store_true",
                        help="let every state use what came after it as well (estimator)")


def run(args: argparse.Namespace) -> int:
    """Export, and say what came of it."""
    from rhot_app.export.export import export_log, format_of
    from rhot_app.export.formats import all_formats
    from rhot_app.progress import ProgressLine
    from rhot_node.compiled import announce_compilation

    name = format_of(args.format, args.out)
    out = args.out or args.path.with_suffix(all_formats()[name].endings[0])
    announce_compilation()
    line = ProgressLine(f"exporting {args.path.name}")
    done = export_log(args.path, out, format_name=name, rig=args.rig, options=options_of(args), again=args.force,
                      progress=line.report)
    line.finish()
    for note in done.notes:
        print(f"note: {note}.", file=sys.stderr)
    for loss in done.losses:
        print(f"{args.path}: {loss.removesuffix('.')}; what could be read was exported.", file=sys.stderr)
    print(f"{done.path}: {done.states} states")
    return READ_WITH_LOSSES if done.losses else 0


def options_of(args: argparse.Namespace) -> ExportOptions:
    """The options that the arguments say."""
    from rhot_app.export.plan import ExportOptions

    return ExportOptions(tracker=args.tracker, rate_hz=args.rate, frame=args.frame, units=args.units, hand=args.hand,
                         smooth=args.smooth, fill_s=args.fill)
