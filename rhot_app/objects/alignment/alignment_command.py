"""``rhot calibrate alignment``: another tracker's world in the rig, from two recorded streams of one motion."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import require_folder, show
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.objects.alignment.motion_stream import MotionStream
    from rhot_app.objects.alignment.report import AlignmentReport


LONGEST_SEARCH_S = 60.0
"""s: clocks that differ by more have no common time: correct one of them first."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate alignment``."""
    parser.add_argument("--foreign", type=input_file, required=True, metavar="CSV",
                        help="the other tracker's poses, t,x,y,z,qw,qx,qy,qz in s and m, with that header")
    parser.add_argument("--rig-points", type=input_file, required=True, metavar="CSV",
                        help="positions of a fingertip or tag on that tracker, t,x,y,z in s and m, rig frame")
    parser.add_argument("--search", type=positive_number, default=1.0, metavar="S",
                        help="search the time offset within this, either way (default: 1 s)")
    add_out_argument(parser, "write the alignment")
    parser.add_argument("--check", type=input_file, metavar="FILE",
                        help="solve nothing: say whether the streams still agree with this alignment, or it is stale")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate alignment --foreign tracker.csv --rig-points tip.csv --out alignment.json",
                 "rhot calibrate alignment --foreign tracker.csv --rig-points tip.csv --check alignment.json")


def run(args: argparse.Namespace) -> int:
    """Solve and report; a file is written only with ``--out``."""
    from rhot_app.objects.alignment.alignment_file import save_alignment, to_alignment
    from rhot_app.objects.alignment.motion_stream import read_stream
    from rhot_app.objects.alignment.report import calibrate_alignment
    from rhot_app.objects.stream import HEADER
    from rhot_app.progress import ProgressLine

    require_folder(args.out)
    if not 0.0 < args.search <= LONGEST_SEARCH_S:
        raise CalibrationError(f"--search {args.search:g}: give a time from 0 to {LONGEST_SEARCH_S:g} s.")
    if args.check is not None and args.out is not None:
        raise CalibrationError("--check writes nothing; leave --out away, or leave --check away to align anew.")
    foreign, rig = read_stream(args.foreign, HEADER), read_stream(args.rig_points, HEADER[:4])
    if args.check is not None:
        return _check(args.check, foreign, rig, as_json=args.json)
    line = ProgressLine("alignment")
    report = calibrate_alignment(foreign, rig, args.search, line.report)
    line.finish()
    written = ""
    if args.out is not None and report.verdict.acceptable:
        save_alignment(args.out, to_alignment(report))
        written = str(args.out)
    return show(_fields(report), _lines(report), report.verdict, as_json=args.json, written=written)


def _check(path: Path, foreign: MotionStream, rig: MotionStream, *, as_json: bool) -> int:
    """Print whether the alignment is stale; 2 when it is. Raises CalibrationError without a file or overlap."""
    from rhot_app.objects.alignment.alignment_file import load_alignment
    from rhot_app.objects.alignment.drift import DriftMonitor

    test = DriftMonitor.test_streams(load_alignment(path), foreign, rig)
    if test is None:
        raise CalibrationError(f"{path}: the streams have too little in common by this alignment's time offset to test "
                               "it. Record both at once for 20 s, with times of one clock.")
    holds = f"The alignment holds: within 10 s it is off by {1e3 * test.distance_m:.1f} mm, which chance explains."
    if as_json:
        print(json.dumps({"stale": test.stale, "distance_mm": 1e3 * test.distance_m, "offset_ms": 1e3 * test.offset_s,
                          "statistic": test.statistic, "limit": test.limit, "sentence": test.sentence or holds}))
    elif not test.stale:
        print(holds)
    if test.stale:
        print(f"rhot: {test.sentence}", file=sys.stderr)
    return 2 if test.stale else 0


def _fields(report: AlignmentReport) -> dict[str, Any]:
    from rhot_app.estimation.se3 import quaternion_from_rotation

    fit, coverage = report.fit, report.coverage
    return {
        "rig_from_foreign": {"rotation_wxyz": quaternion_from_rotation(fit.rig_from_foreign[:3, :3]).tolist(),
                             "translation_m": fit.rig_from_foreign[:3, 3].tolist()},
        "point_in_tracker_mm": (1e3 * fit.tracker_from_body[:3, 3]).tolist(), "time_offset_ms": 1e3 * fit.offset_s,
        "sd": {"position_mm": 1e3 * report.place_sd_m, "rotation_deg": math.degrees(report.rotation_sd_rad),
               "point_mm": 1e3 * report.point_sd_m, "time_offset_ms": 1e3 * report.offset_sd_s},
        "rms_mm": 1e3 * fit.rms_m, "inlier_ratio": fit.inlier_ratio, "samples": len(fit.errors),
        "coverage": {"rotation_deg": [math.degrees(turn) for turn in coverage.turn],
                     "spread_mm": (1e3 * coverage.spread_m).tolist(), "speed_mm_s": 1e3 * coverage.speed_m_s}}


def _lines(report: AlignmentReport) -> list[str]:
    fit, coverage = report.fit, report.coverage
    place, point = 1e3 * fit.rig_from_foreign[:3, 3], 1e3 * fit.tracker_from_body[:3, 3]
    turns = ", ".join(f"{math.degrees(turn):.0f}" for turn in coverage.turn)
    spreads = ", ".join(f"{1e3 * spread:.0f}" for spread in coverage.spread_m)
    return ["", f"origin of the other world   {place[0]:.2f}, {place[1]:.2f}, {place[2]:.2f} mm in the rig",
            f"point on the tracker        {point[0]:.2f}, {point[1]:.2f}, {point[2]:.2f} ± "
            f"{1e3 * report.point_sd_m:.2f} mm in its frame",
            f"time offset                 {1e3 * fit.offset_s:+.2f} ± {1e3 * report.offset_sd_s:.2f} ms, added to its "
            "times",
            f"motion                      {spreads} mm along three axes, turns of {turns} degrees, "
            f"{1e3 * coverage.speed_m_s:.0f} mm/s"]
