"""``rhot calibrate``: hands each calibration to its own command."""

from __future__ import annotations

import argparse
import importlib
import sys
from types import ModuleType

from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

KINDS: dict[str, str] = {
    "bones": "the hand's bones and where the markers sit, from a minute of free movement or a ruler",
    "filters": "the filters' settings, from a hand held still and one that moves fast",
    "intrinsics": "focal length, centre and distortion of one camera's lens, from pictures of a board",
    "stereo": "how two or more cameras stand to each other, from pictures of a board that they took together",
    "time": "when each camera sees, from a moving marker",
    "colours": "the markers' colours, from boxes on their paint in pictures",
    "alignment": "where another tracker's world is in the rig, from two streams of one motion",
    "depth": "distance from disparity, without a board, from a table of measured distances",
}
"""Name of each calibration, and what it is for."""

ALIASES = {"lens": "intrinsics", "together": "stereo", "tracker": "alignment"}
"""Other words for a calibration, and its name."""

FILES: dict[str, str] = {
    "import": "read lenses and poses from a file of OpenCV, ROS, Kalibr, anipose or caliscope",
    "export": "write a rig's lenses and poses as a file of one of these",
}
"""What is done with calibrations of other programs."""

_ELSEWHERE = {"alignment": "rhot_app.objects.alignment.alignment_command",
              "import": "rhot_app.calibration.commands.import_files",
              "export": "rhot_app.calibration.commands.export_files"}
"""Modules that do not stand in `commands` under their name."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One subcommand per calibration."""
    kinds = parser.add_subparsers(dest="kind", metavar="KIND", title="kinds")
    for kind, summary in KINDS.items():
        room = kinds.add_parser(kind, help=summary, description=f"Calibrate {summary}.",
                                aliases=[word for word, meant in ALIASES.items() if meant == kind])
        _module(kind).add_arguments(room)
    for kind, summary in FILES.items():
        room = kinds.add_parser(kind, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        _module(kind).add_arguments(room)
    add_examples(parser, "rhot calibrate intrinsics --images 'left*.jpg' --out left.json",
                 "rhot calibrate stereo --left 'left*.jpg' --right 'right*.jpg' --out desk.json")


def run(args: argparse.Namespace) -> int:
    """Run the chosen calibration; exit code 2 when its result may not be used. Without one, list all."""
    if args.kind is None:
        rows = "\n".join(f"  {kind:12s}{summary}" for kind, summary in (KINDS | FILES).items())
        print(f"rhot calibrate KIND, one of:\n{rows}\n`rhot calibrate KIND --help` has its options.", file=sys.stderr)
        return 2
    if args.kind in KINDS or args.kind in ALIASES:
        announce_compilation()
    return int(_module(ALIASES.get(args.kind, args.kind)).run(args))


def _module(kind: str) -> ModuleType:
    return importlib.import_module(_ELSEWHERE.get(kind, f"rhot_app.calibration.commands.{kind}"))
