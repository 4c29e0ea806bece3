"""``rhot calibrate time``: offset and row time of each camera from a recorded, moving marker."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import show
from rhot_app.calibration.registry import TIME
from rhot_app.errors import input_file
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.time.offset import TimeReport
    from rhot_app.project import Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate time``."""
    parser.add_argument("--log", type=input_file, required=True, metavar="LOG",
                        help="20 s of a hand that waves up and down, recorded by rhot engine --log or the app")
    add_rig_argument(parser, "the rig, its geometry calibrated", required=True)
    add_out_argument(parser, "write the rig with corrected times")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate time --log wave.rhotlog --rig desk.json",
                 "rhot calibrate time --log wave.rhotlog --rig desk.json --out desk.json")


def run(args: argparse.Namespace) -> int:
    """Solve and report; the rig is written only with ``--out``."""
    from rhot_app.calibration.recorded_observations import read_observations
    from rhot_app.calibration.time.offset import calibrate_times
    from rhot_app.progress import ProgressLine
    from rhot_app.project import load_rig
    from rhot_app.rig_history import accept

    rig, table = read_observations(args.log, load_rig(args.rig))
    line = ProgressLine("cameras' times")
    report = calibrate_times(table, rig, line.report)
    line.finish()
    written = ""
    if args.out is not None and report.verdict.acceptable:
        accept(args.out, report.apply(rig), TIME.reason)
        written = str(args.out)
    return show(_fields(report, rig), _lines(report), report.verdict, as_json=args.json, written=written)


def _fields(report: TimeReport, rig: Rig) -> dict[str, Any]:
    return {"row_times_agree": report.row_times_agree, "cameras": [{
        "name": camera.name, "reference": camera.reference,
        "time_offset_ms": 1e3 * (node.time_offset_s + camera.correction_s), "correction_ms": 1e3 * camera.correction_s,
        "sd_ms": 1e3 * camera.sd_s, "time_offset_with_row_time_ms": 1e3 * (node.time_offset_s + camera.with_row_time_s),
        "row_time_us": 1e6 * camera.row_time_s, "row_time_sd_us": 1e6 * camera.row_time_sd_s,
        "row_time_observed": camera.row_time_observed, "row_time_node_us": 1e6 * camera.row_time_node_s,
        "speed_px_s": camera.speed_px_s, "samples": camera.samples}
        for camera, node in zip(report.cameras, rig.nodes, strict=True)]}


def _lines(report: TimeReport) -> list[str]:
    lines = ["", "camera          correction ms      row time µs  node says µs  px/s across  samples"]
    for camera in report.cameras:
        correction = ("reference" if camera.reference else
                      f"{1e3 * camera.correction_s:+.3f} ± {1e3 * camera.sd_s:.3f}")
        row = f"{1e6 * camera.row_time_s:.1f} ± {1e6 * camera.row_time_sd_s:.1f}" if camera.row_time_observed else "?"
        lines.append(f"{camera.name:<14}{correction:>17}{row:>17}{1e6 * camera.row_time_node_s:14.1f}"
                     f"{camera.speed_px_s:13.0f}{camera.samples:9d}")
    return lines
