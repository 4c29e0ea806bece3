"""``rhot recover``: the sound records of a damaged log, written to a clean one."""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path

from rhot_app.errors import RecordingError
from rhot_app.options import add_out_argument, add_rig_argument
from rhot_app.project import load_rig
from rhot_app.recording.raw_log import END, LogReader, encode_header
from rhot_node.files import replacing
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot recover``."""
    parser.add_argument("path", type=Path, metavar="LOG", help="the damaged log")
    add_out_argument(parser, "the log to write; a new file", required=True, metavar="CLEAN")
    add_rig_argument(parser, "the rig that it was recorded with, where the header cannot be read", exists=False)
    add_examples(parser, "rhot recover damaged.rhotlog --out clean.rhotlog",
                 "rhot recover damaged.rhotlog --rig desk.json --out clean.rhotlog")


def run(args: argparse.Namespace) -> int:
    """Write every sound record, also those of kinds that this version does not know. Raises RecordingError."""
    if args.out.exists():
        raise RecordingError(f"{args.out}: exists already; a log is never written over. Choose another name.")
    rig = None if args.rig is None else load_rig(args.rig)
    with contextlib.closing(LogReader(args.path, rig)) as reader:
        try:
            with replacing(args.out) as file:
                file.write(encode_header(reader.rig, reader.about, marks_end=True))
                count = 0
                for data in reader.sound_records():
                    file.write(data)
                    count += 1
                file.write(END)
        except OSError as exc:
            raise RecordingError(f"{args.out}: cannot be written ({exc.strerror}). Nothing was left of it; choose "
                                 "another --out.") from exc
    losses = reader.losses
    end = f" Of {args.path} {losses.end}." if losses.end else ""
    print(f"{args.out}: {count} record{'' if count == 1 else 's'}.{end}")
    return 0
