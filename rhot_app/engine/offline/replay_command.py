"""``rhot replay``: a raw log through the live door, summed up or served to clients like a running engine."""

from __future__ import annotations

import argparse
import json
import logging
import sys
import time
from typing import TYPE_CHECKING

from rhot_app.engine.command import add_serving_arguments, asked_outputs, print_addresses
from rhot_app.errors import RecordingError, input_file
from rhot_app.options import add_json_argument, add_rig_argument, add_tracker_argument
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.engine.core import MakeTracker
    from rhot_app.engine.serve import Serving
    from rhot_app.project import Rig
    from rhot_app.sources.replay import LogReplay

LAST_WORDS_S = 0.5
"""Clients of a replay that is over get the last states, and the status that says so, within this time."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot replay``."""
    parser.add_argument("path", type=input_file, metavar="LOG",
                        help="a raw log written by rhot engine --log or the app")
    add_rig_argument(parser, "track with this rig instead of the one the log was recorded with")
    add_tracker_argument(parser, "track with this tracker instead of the one that the rig asks for")
    parser.add_argument("--speed", type=_speed, default=1.0, metavar="N",
                        help="times real time, or max for as fast as possible (default 1)")
    parser.add_argument("--smooth", action="store_true",
                        help="let every state use what comes after it as well (estimator); the whole log is "
                             "tracked before the replay begins")
    add_json_argument(parser, "serve nothing: replay at once and print a summary as one JSON object")
    parser.add_argument("--keep", action="store_true",
                        help="go on serving after the log's end: an app can look at the last state, or replay again")
    add_serving_arguments(parser)
    add_examples(parser, "rhot replay wave.rhotlog --web", "rhot replay wave.rhotlog --speed max --smooth --json")


def run(args: argparse.Namespace) -> int:
    """Replay; with clients to serve, until the log's end, SIGTERM, SIGINT or the command ``quit``."""
    from rhot_app.engine.offline.replay_summary import SmoothedReplay, summarise
    from rhot_app.engine.serve import serving
    from rhot_app.progress import ProgressLine
    from rhot_app.project import load_rig, with_tracker
    from rhot_app.recording.raw_log import LogReader
    from rhot_app.sources.replay import LogReplay
    from rhot_app.tracking.scene import make_tracker
    from rhot_app.tracking.smoothing import NOT_SMOOTHED
    from rhot_node.terminal import log_to_stderr

    log_to_stderr(logging.INFO if args.verbose else logging.WARNING)
    reader = LogReader(args.path)
    rig = load_rig(args.rig) if args.rig is not None else reader.rig
    if args.tracker is not None:
        rig = with_tracker(rig, args.tracker)
    if args.smooth and not rig.tracker.smooths:
        raise RecordingError(NOT_SMOOTHED)
    announce_compilation()
    if args.json:
        print(json.dumps(summarise(reader, rig, make_tracker(rig, smooth=args.smooth))))
        return 0
    reader.close()
    trackers: MakeTracker = make_tracker
    if args.smooth:
        line = ProgressLine(f"smoothing {args.path.name}")
        trackers = SmoothedReplay(args.path, rig, line.report).for_rig
        line.finish()
    rig_path = None if args.rig is None else args.rig.absolute()
    replays: list[LogReplay] = []  # another one whenever a client changes to other nodes

    def replay(rig: Rig) -> LogReplay:
        replays.append(LogReplay(args.path, rig, args.speed))
        return replays[-1]

    outputs = asked_outputs(args)
    with serving(rig, rig_path, replay, args.directory, outputs=outputs, rig_outputs=False,
                 trackers=trackers) as serve:
        print(f"replaying {args.path} for clients (the app, or EngineClient). Ctrl+C ends it. For a summary: --json",
          file=sys.stderr, flush=True)
        print_addresses(serve)
        serve.engine.start()
        serve.server.run(until=lambda: replays[-1].over)
        if not serve.server.ending:
            _conclude(replays[-1], serve, args.keep)
    return 0


def _conclude(replay: LogReplay, serve: Serving, keep: bool) -> None:
    """Say what came of the replay, and serve on; raises RecordingError when nothing of it could be read."""
    if replay.failure:
        raise RecordingError(replay.failure)
    print(f"the log is over: {serve.states.count} states in {replay.played_s:.1f} s."
          + (" It is kept for clients, who can replay it again; Ctrl+C ends it." if keep else ""), flush=True)
    last_s = time.monotonic() + LAST_WORDS_S
    serve.server.run(until=lambda: not keep and time.monotonic() > last_s)


def _speed(text: str) -> float | None:
    """Times real time; None for max."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError as exc:
        raise argparse.ArgumentTypeError(f"{text} is neither a number nor max") from exc
    if not 0.001 <= speed <= 1000.0:
        raise argparse.ArgumentTypeError(f"{text} is not between 0.001 and 1000; say max for as fast as possible")
    return speed
