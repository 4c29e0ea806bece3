"""``rhot calibrate``: every calibration by one frame: read, solve, report, propose, write."""

from __future__ import annotations

import argparse
import importlib
import sys
from dataclasses import replace
from types import ModuleType

from rhot_app.calibration.commands.arguments import require_folder, show
from rhot_app.calibration.registry import Calibration, calibrations
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

FILES = {"import": "read lenses and poses from a file of OpenCV, ROS, Kalibr, anipose or caliscope",
         "export": "write a rig's lenses and poses as a file of one of these"}
"""What is done with calibrations of other programs, each by a module of its name."""

_READING = 0.5  # of the progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One subcommand per calibration."""
    kinds = parser.add_subparsers(dest="kind", metavar="KIND", title="kinds")
    for one in calibrations():
        if one.command is not None:
            one.command.add_arguments(kinds.add_parser(
                one.command.word, help=one.command.summary, description=f"Calibrate {one.command.summary}.",
                aliases=list(one.command.aliases)))
    for word, summary in FILES.items():
        _module(word).add_arguments(kinds.add_parser(word, help=summary,
                                                     description=f"{summary[0].upper()}{summary[1:]}."))
    add_examples(parser, "rhot calibrate intrinsics --images 'left*.jpg' --out left.json",
                 "rhot calibrate stereo --left 'left*.jpg' --right 'right*.jpg' --out desk.json")


def run(args: argparse.Namespace) -> int:
    """Run the chosen calibration; exit code 2 when its result may not be used. Without one, list all."""
    if args.kind is None:
        words = {one.command.word: one.command.summary for one in calibrations() if one.command is not None}
        rows = "\n".join(f"  {word:12s}{summary}" for word, summary in (words | FILES).items())
        print(f"rhot calibrate KIND, one of:\n{rows}\n`rhot calibrate KIND --help` has its options.", file=sys.stderr)
        return 2
    if args.kind in FILES:
        return int(_module(args.kind).run(args))
    announce_compilation()
    return calibrate(next(one for one in calibrations() if one.command is not None
                          and args.kind in (one.command.word, *one.command.aliases)), args)


def calibrate(calibration: Calibration, args: argparse.Namespace) -> int:
    """Solve what the arguments name and report; a file is written only with ``--out``, and a verdict that allows it."""
    from rhot_app.calibration.verdict import with_findings
    from rhot_app.progress import ProgressLine, within

    command = calibration.command
    assert command is not None and calibration.solve is not None
    assert calibration.report is not None and calibration.propose is not None
    require_folder(args.out)
    code = None if command.instead is None else command.instead(args)
    if code is not None:
        return code
    line = ProgressLine(command.word)
    observed = command.observe(args, within(line.report, 0.0, _READING))
    now = observed.now
    result = calibration.solve(*observed.observations, now, progress=within(line.report, _READING, 1.0))
    line.finish()
    report = calibration.report(result, now)
    proposal = None if now is None else calibration.propose(result, now)
    if proposal is not None:
        report = replace(report, verdict=proposal.verdict)
    written = ""
    if report.verdict.acceptable and command.write is not None:
        written = command.write(args, result, now)
    elif proposal is not None:
        written = proposal.save(args.out)
    return show(replace(report, verdict=with_findings(report.verdict, observed.findings),
                        notes=(*report.notes, *observed.notes), fields={**report.fields, **observed.fields}),
                as_json=args.json, written=written)


def _module(word: str) -> ModuleType:
    return importlib.import_module(f"rhot_app.calibration.commands.{word}_files")
