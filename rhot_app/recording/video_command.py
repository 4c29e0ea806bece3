"""``rhot video``: fetches the videos that the nodes recorded beside a log."""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path

from rhot_app.options import add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot video``."""
    parser.add_argument("what", choices=("collect",), help="collect: fetch the videos of a log from the nodes")
    parser.add_argument("log", type=Path, metavar="LOG", help="the log that `rhot engine --log LOG --video` wrote")
    add_rig_argument(parser, "the rig file that says where the nodes are now (default: the log's own rig)",
                     exists=False)
    add_out_argument(parser, "where the videos go (default: beside the log)", metavar="DIR")
    parser.add_argument("--keep", action="store_true", help="leave the videos on the nodes as well")
    add_examples(parser, "rhot video collect wave.rhotlog",
                 "rhot video collect wave.rhotlog --rig desk.json --out videos --keep")


def run(args: argparse.Namespace) -> int:
    """Collect; raises RecordingError, RigError, TrustError."""
    from rhot_app.errors import RecordingError
    from rhot_app.keys import load_master_keys
    from rhot_app.progress import ProgressLine
    from rhot_app.project import load_rig
    from rhot_app.recording.raw_log import LogReader
    from rhot_app.recording.video import collect_videos
    from rhot_node.errors import printable

    if args.rig is not None:
        rig = load_rig(args.rig)
    else:
        with contextlib.closing(LogReader(args.log)) as reader:
            rig = reader.rig
    if args.out is not None and not args.out.is_dir():
        raise RecordingError(f"{args.out}: there is no such folder. Make it first.")
    line = ProgressLine("videos")
    for video in collect_videos(args.log, rig, load_master_keys().own, args.out, keep=args.keep, progress=line.report):
        dropped = f", {video.info.dropped} dropped" if video.info.dropped else ""
        print(f"{video.path}: {video.info.frames} frames{dropped}. {printable(video.info.message)}".rstrip())
    return 0
