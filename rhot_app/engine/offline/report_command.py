"""``rhot report``: what somebody needs who looks for a fault, in one zip file, without keys."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.engine.directory import default_directory

if TYPE_CHECKING:
    from rhot_app.engine.offline.report import Report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot report``."""
    parser.add_argument("log", type=Path, nargs="?", metavar="LOG",
                        help="a raw log that shows the fault, for its last minute (default: what is being recorded)")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.zip", help="zip file to write")
    parser.add_argument("--again", action="store_true", help="write over a file that exists")
    parser.add_argument("--rig", type=Path, metavar="FILE",
                        help="the rig file (default: the running engine's, or the log's)")
    parser.add_argument("--directory", type=Path, metavar="DIR",
                        help=f"directory of the engine (default {default_directory()})")


def run(args: argparse.Namespace) -> int:
    """Collect and write; raises EngineError, RecordingError, RigError."""
    from rhot_app.engine.offline.report import Report
    from rhot_app.errors import EngineError
    from rhot_app.project import load_rig
    from rhot_node.files import require_replaceable, write_atomically

    if args.out.exists() and not args.again:
        raise EngineError(f"{args.out} exists already; choose another --out, or write over it with --again.")
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
