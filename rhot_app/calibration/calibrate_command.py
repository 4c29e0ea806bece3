"""``rhot calibrate``: hands each calibration to its own command."""

from __future__ import annotations

import argparse
import importlib
import sys
from types import ModuleType

from rhot_app.calibration.registry import COMMANDS, Command
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

FILES = (
    Command("import", "read lenses and poses from a file of OpenCV, ROS, Kalibr, anipose or caliscope",
            module="rhot_app.calibration.commands.import_files"),
    Command("export", "write a rig's lenses and poses as a file of one of these",
            module="rhot_app.calibration.commands.export_files"))
"""What is done with calibrations of other programs."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One subcommand per calibration."""
    kinds = parser.add_subparsers(dest="kind", metavar="KIND", title="kinds")
    for command in COMMANDS:
        room = kinds.add_parser(command.word, help=command.summary, description=f"Calibrate {command.summary}.",
                                aliases=list(command.aliases))
        _module(command).add_arguments(room)
    for command in FILES:
        summary = f"{command.summary[0].upper()}{command.summary[1:]}."
        _module(command).add_arguments(kinds.add_parser(command.word, help=command.summary, description=summary))
    add_examples(parser, "rhot calibrate intrinsics --images 'left*.jpg' --out left.json",
                 "rhot calibrate stereo --left 'left*.jpg' --right 'right*.jpg' --out desk.json")


def run(args: argparse.Namespace) -> int:
    """Run the chosen calibration; exit code 2 when its result may not be used. Without one, list all."""
    if args.kind is None:
        rows = "\n".join(f"  {command.word:12s}{command.summary}" for command in (*COMMANDS, *FILES))
        print(f"rhot calibrate KIND, one of:\n{rows}\n`rhot calibrate KIND --help` has its options.", file=sys.stderr)
        return 2
    command = next(one for one in (*COMMANDS, *FILES) if args.kind in (one.word, *one.aliases))
    if command in COMMANDS:
        announce_compilation()
    return int(_module(command).run(args))


def _module(command: Command) -> ModuleType:
    return importlib.import_module(command.imported)
