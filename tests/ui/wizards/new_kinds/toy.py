"""A toy calibration: all of it is this file."""

from __future__ import annotations

import argparse
from pathlib import Path

import msgspec

from rhot_app.calibration.collect import Measurements
from rhot_app.calibration.proposal import proposed
from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.project import load_rig

ENOUGH = 3


def brightness(pictures):
    """The mean grey level of what all cameras show."""
    return float(sum(picture.mean() for picture in pictures.values()) / len(pictures))


def add_arguments(parser):
    parser.add_argument("--level", type=float, nargs="+", required=True)
    parser.add_argument("--rig", type=Path, required=True)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--json", action="store_true")


def observe(args: argparse.Namespace, progress):
    return Observed((tuple(args.level),), InForce(load_rig(args.rig), args.rig))


def solve(levels, now, *, progress):
    progress("averaging", 1.0)
    return sum(levels) / len(levels)


def report(level, now):
    return Report(judge(f"grey level {level:.0f}", []), (Figure("grey level", level, decimals=0, key="level"),))


def propose(level, now):
    return proposed(TOY.reason, report(level, now), now.rig, msgspec.structs.replace(now.rig, name=f"grey {level:.0f}"))


def check(figures):
    dark = [one.camera for one in figures.qualities if one.quality < 0.1]
    return [Finding("dark", Grade.FAIR, f"{dark[0]} is dark.", "", "Measure the grey again.")] if dark else []


TOY = Calibration(
    "toy", "Toy", "How bright the pictures are.", "toy calibration",
    Command("toy", "how bright pictures are", add_arguments, observe),
    (Measurements("Take pictures", "Press Space.", brightness, ENOUGH),), solve, report, propose, check)
