"""``rhot report``: what somebody needs who looks for a fault, in one zip file, without keys."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.engine.directory import default_directory
from rhot_app.options import add_directory_argument, add_force_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.engine.offline.report import Report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot report``."""
    parser.add_argument("log", type=Path, nargs="?", metavar="LOG",
                        help="a raw log that shows the fault, for its last minute (default: what is being recorded)")
    add_out_argument(parser, "zip file to write", required=True, metavar="FILE.zip")
    add_force_argument(parser)
    add_rig_argument(parser, "the rig file (default: the running engine's, or the log's)", exists=False)
    add_directory_argument(parser, f"directory of the engine (default {default_directory()})")
    add_examples(parser, "rhot report --out fault.zip", "rhot report wave.rhotlog --out fault.zip --force")


def run(args: argparse.Namespace) -> int:
    """Collect and write; raises EngineError, RecordingError, RigError."""
    from rhot_app.engine.offline.report import Report
    from rhot_app.errors import EngineError, refuse_existing
    from rhot_app.project import load_rig
    from rhot_node.files import require_replaceable, write_atomically

    refuse_existing(args.out, EngineError, force=args.force)
    try:
        require_replaceable(args.out)
        report = Report()
        report.add_versions()
        recorded = report.add_engine(args.directory)
        if args.rig is not None:
            report.add_rig(load_rig(args.rig))
        log = args.log or recorded
        if log is not None:
            report.add_log(log)
        write_atomically(args.out, report.to_zip())
    except OSError as exc:
        raise EngineError(f"{args.out}: cannot be written ({exc.strerror}); choose another --out.") from exc
    _tell(args.out, report)
    return 0


def _tell(path: Path, report: Report) -> None:
    for note in report.notes:
        print(f"not in it: {note}")
    print(f"{path}: {', '.join(report.names)}. It holds no keys, codes or pictures; look into it before you send it.")
