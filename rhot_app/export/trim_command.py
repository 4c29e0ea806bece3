"""``rhot trim``: a part of a recording as a recording of its own."""

from __future__ import annotations

import argparse
import math
import sys

from rhot_app.errors import RecordingError, finite, input_file
from rhot_app.export.export_command import READ_WITH_LOSSES
from rhot_app.options import add_force_argument, add_out_argument
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot trim``."""
    parser.add_argument("path", type=input_file, metavar="LOG", help="a raw log")
    parser.add_argument("--from", dest="begin", type=finite, default=0.0, metavar="S",
                        help="first moment, s since the first state, as in the replay and in exports (default 0)")
    parser.add_argument("--to", dest="end", type=finite, default=math.inf, metavar="S",
                        help="last moment (default: the end)")
    add_out_argument(parser, "the log to write", required=True, metavar="PART")
    add_force_argument(parser)
    add_examples(parser, "rhot trim wave.rhotlog --from 2.5 --to 7 --out wave-part.rhotlog",
                 "rhot trim wave.rhotlog --from 60 --out wave-rest.rhotlog")


def run(args: argparse.Namespace) -> int:
    """Trim, and say what came of it. Raises RecordingError and ExportError."""
    from rhot_app.export.plan import ExportOptions
    from rhot_app.export.process import first_states
    from rhot_app.export.trim import trim_log
    from rhot_app.progress import ProgressLine

    if not 0.0 <= args.begin < args.end:
        end = "" if math.isinf(args.end) else f" --to {args.end:g}"
        raise RecordingError(f"--from {args.begin:g}{end}: give a moment, s since the first state, and a later one.")
    first_ns = int(first_states(args.path, "csv", ExportOptions(), 1).t_master_ns[0])
    end_ns = 2**63 - 1 if math.isinf(args.end) else first_ns + round(1e9 * args.end)
    line = ProgressLine(f"trimming {args.path.name}")
    done = trim_log(args.path, args.out, first_ns + round(1e9 * args.begin), end_ns, again=args.force,
                    progress=line.report)
    line.finish()
    for loss in done.losses:
        print(f"{args.path}: {loss}; what could be read was kept.", file=sys.stderr)
    print(f"{done.path}: {done.datagrams} datagrams, {done.bookmarks} bookmarks, {len(done.videos)} videos")
    return READ_WITH_LOSSES if done.losses else 0
