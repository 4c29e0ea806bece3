"""``rhot recover``: a damaged log's sound records as a clean log."""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot recover``."""
    parser.add_argument("path", type=Path, metavar="LOG", help="the damaged log")
    parser.add_argument("--out", type=Path, required=True, metavar="CLEAN", help="the log to write; a new file")
    parser.add_argument("--rig", type=Path, metavar="FILE",
                        help="the rig that it was recorded with, where the header cannot be read")


def run(args: argparse.Namespace) -> int:
    """Write every sound record, also those of kinds that this version does not know. Raises RecordingError."""
    from rhot_app.errors import RecordingError
    from rhot_app.project import load_rig
    from rhot_app.recording.raw_log import LogReader, encode_header
    from rhot_node.files import replacing

    if args.out.exists():
        raise RecordingError(f"{args.out}: exists already; a log is never written over. Choose another name.")
    rig = None if args.rig is None else load_rig(args.rig)
    with contextlib.closing(LogReader(args.path, rig)) as reader:
        try:
            with replacing(args.out) as file:
                file.write(encode_header(reader.rig, reader.about))
                count = 0
                for data in reader.sound_records():
                    file.write(data)
                    count += 1
        except OSError as exc:
            raise RecordingError(f"{args.out}: cannot be written ({exc.strerror}). Nothing was left of it; choose "
                                 "another --out.") from exc
    losses = reader.losses
    torn = f" A torn record of {losses.torn_bytes} bytes at the end was left out." if losses.torn_bytes else ""
    print(f"{args.out}: {count} record{'' if count == 1 else 's'}.{torn}")
    return 0
