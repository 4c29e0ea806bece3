"""``rhot engine``: the engine as a process of its own, with or without a screen nearby.

What tracks is imported when it runs, so that ``--help`` is there at once.
"""

from __future__ import annotations

import argparse
import functools
import json
import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.engine.directory import default_directory, open_directory
from rhot_app.errors import EngineError, RigError
from rhot_app.options import add_directory_argument, add_json_argument, add_rig_argument
from rhot_app.outputs.spec import HELP, WEB_PORT, parse_output, web_settings
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.engine.serve import Serving
    from rhot_app.project import OutputSettings, Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot engine``."""
    add_rig_argument(parser, "the rig file (rhot-rig, JSON)", required=True)
    parser.add_argument("--record", "--log", type=Path, dest="log", metavar="FILE",
                        help="write the raw log of all datagrams to this new file")
    parser.add_argument("--video", action="store_true",
                        help="have every node record its frames, too, as long as --record writes; `rhot video "
                             "collect` fetches them")
    parser.add_argument("--unchecked", action="store_true",
                        help="serve also a rig that `rhot check` refuses, to calibrate it")
    parser.add_argument("--start", action="store_true", help="tell the nodes to stream at once")
    parser.add_argument("--resume", action="store_true",
                        help="continue what the engine in this directory did before it crashed: its rig, outputs and "
                             "tracking, and its recording in a new part beside it")
    parser.add_argument("--end-unused", action="store_true",
                        help="end when for half a minute nothing was recorded and no client was connected; the app "
                             "starts its engine so")
    add_serving_arguments(parser)
    add_json_argument(parser, "print one JSON object on standard output when ready: pid, directory, rig")
    add_examples(parser, "rhot engine --rig desk.json --start --record wave.rhotlog",
                 "rhot engine --rig desk.json --start --output osc:127.0.0.1:9000 --web")


def _require_acceptable(rig: Rig, path: Path) -> None:
    """Raises RigError when `rhot check` refuses the rig."""
    from rhot_app.calibration.check.checks import check_rig
    from rhot_app.calibration.verdict import Grade
    verdict = check_rig(rig).verdict
    if not verdict.acceptable:
        wrong = " ".join(finding.sentence for finding in verdict.findings if finding.grade is Grade.POOR)
        raise RigError(f"{path}: cannot be tracked with. {wrong} `rhot check` says more; --unchecked starts all the "
                       "same, to calibrate the rig.")


def add_serving_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of every command that serves states to clients."""
    add_directory_argument(parser, f"private directory of the engine's sockets (default {default_directory()})")
    parser.add_argument("--output", action="append", default=[], dest="outputs", metavar="SPEC",
                        help="send every state to other programs, see below; may be given more than once")
    parser.add_argument("--web", nargs="?", const="", metavar="[HOST:]PORT",
                        help=f"show the hand in browsers, on this computer's port {WEB_PORT} unless told otherwise; "
                             "the address with its secret is printed")
    parser.add_argument("--verbose", action="store_true", help="log what happens on standard error")
    parser.epilog = HELP


def asked_outputs(args: argparse.Namespace) -> tuple[OutputSettings, ...]:
    """The outputs of the command line. Raises OutputError."""
    return (*map(parse_output, args.outputs), *(() if args.web is None else (web_settings(args.web),)))


def print_addresses(serve: Serving) -> None:
    """Say on standard error where clients of the outputs connect."""
    for output in serve.engine.status().outputs:
        if output.url:
            what = "the web view" if output.kind == "web" else f"output {output.spec}"
            print(f"rhot: {what} is at {output.url}", file=sys.stderr, flush=True)


def run(args: argparse.Namespace) -> int:
    """Run the engine until SIGTERM, SIGINT or the command ``quit``."""
    from rhot_app.engine.activity import read_activity
    from rhot_app.engine.advice import calibration_advice, listening_advice
    from rhot_app.engine.serve import serving
    from rhot_app.keys import load_master_keys
    from rhot_app.project import load_rig
    from rhot_app.sources.links import UdpNodes
    from rhot_node.terminal import log_to_stderr

    if args.video and args.log is None:
        raise EngineError("--video needs --log FILE: the videos belong to a recording.")
    log_to_stderr(logging.INFO if args.verbose else logging.WARNING)
    before = read_activity(open_directory(args.directory)) if args.resume else None
    rig = load_rig(args.rig) if before is None else before.rig
    rig_path = args.rig.absolute() if before is None or not before.rig_path else Path(before.rig_path)
    outputs = dict.fromkeys((*asked_outputs(args), *(() if before is None else before.outputs)))
    start = args.start or (before is not None and before.running)
    if not args.unchecked:
        _require_acceptable(rig, args.rig)
    own = load_master_keys().own
    source = functools.partial(UdpNodes, own=own)
    with serving(rig, rig_path, source, args.directory, own, outputs, end_unused=args.end_unused) as serve:
        if before is not None and before.log_path:
            serve.engine.record_on(Path(before.log_path), video=before.video)
        elif args.log is not None:
            serve.engine.record(args.log.absolute(), video=args.video)
        if start:
            serve.engine.start()
        if args.json:
            urls = {output.spec: output.url for output in serve.engine.status().outputs if output.url}
            print(json.dumps({"pid": os.getpid(), "directory": str(serve.directory.path), "rig": rig.name}
                             | ({"outputs": urls} if urls else {})), flush=True)
        else:
            told = "nodes are told to stream" if start else "nodes stream once a client says start"
            print(f"rhot: the engine of {rig.name} serves clients in {serve.directory.path}; {told}. Ctrl+C ends it.",
                  file=sys.stderr, flush=True)
        for advice in (*calibration_advice(rig), *listening_advice(rig)):
            print(f"rhot: {advice.text}", file=sys.stderr, flush=True)
        print_addresses(serve)
        serve.server.run()
    return 0
