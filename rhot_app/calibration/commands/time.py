"""``rhot calibrate time``: offset and row time of each camera from a recorded, moving marker."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import show
from rhot_app.calibration.registry import TIME
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.errors import input_file
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.calibration.time.offset import TimeReport
    from rhot_app.charts import Chart
    from rhot_app.progress import Progress
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

    rig, table = read_observations(args.log, load_rig(args.rig))
    line = ProgressLine("cameras' times")
    result = calibrate_times(table, rig, line.report)
    line.finish()
    return show(report(result, rig), as_json=args.json, written=propose(result, rig, {}).save(args.out))


def solve_log(log: Path, rig: Rig, *, progress: Progress) -> TimeReport:
    """The cameras' times from a recording. Raises CalibrationError."""
    from rhot_app.calibration.recorded_observations import read_observations
    from rhot_app.calibration.time.offset import calibrate_times

    progress("reading the recording", 0.0)
    return calibrate_times(read_observations(log, rig)[1], rig, progress)


def report(result: TimeReport, rig: Rig) -> Report:
    """Each camera's offset and row time, and how far its rays miss the first camera's."""
    rows = []
    for camera, node in zip(result.cameras, rig.nodes, strict=True):
        offset_ms, correction_ms, sd_ms = 1e3 * node.time_offset_s, 1e3 * camera.correction_s, 1e3 * camera.sd_s
        row_us, row_sd_us = 1e6 * camera.row_time_s, 1e6 * camera.row_time_sd_s
        rows.append((
            Figure("camera", camera.name, key="name"), Figure("", camera.reference, key="reference"),
            Figure("correction", "reference" if camera.reference else correction_ms, "ms", sd_ms),
            Figure("", correction_ms, sd=sd_ms, key="correction_ms", sd_key="sd_ms"),
            Figure("", offset_ms + correction_ms, key="time_offset_ms"),
            Figure("", offset_ms + 1e3 * camera.with_row_time_s, key="time_offset_with_row_time_ms"),
            Figure("row time", row_us if camera.row_time_observed else None, "µs", row_sd_us),
            Figure("", row_us, sd=row_sd_us, key="row_time_us", sd_key="row_time_sd_us"),
            Figure("", camera.row_time_observed, key="row_time_observed"),
            Figure("node says", 1e6 * camera.row_time_node_s, "µs", decimals=1, key="row_time_node_us"),
            Figure("across the lines", camera.speed_px_s, "px/s", decimals=0, key="speed_px_s"),
            Figure("samples", camera.samples, decimals=0, key="samples")))
    return Report(result.verdict, tables=(Table("cameras", tuple(rows)),),
                  fields={"row_times_agree": result.row_times_agree}, charts=charts_of(result))


def charts_of(result: TimeReport) -> tuple[Chart, ...]:
    """For each camera but the first: misses over speed as they were and are (a delay is the slope), and the search."""
    from rhot_app.charts import Chart, Curve

    charts = []
    for index, plot in result.plots.items():
        name, reference = result.cameras[index].name, result.cameras[0].name
        charts.append(Chart(
            f"{name}: how far its rays miss those of {reference}; a delay is a slope", "speed across the line, px/s",
            "miss, px", (Curve("before", plot.speed_px_s, plot.before_px, "faint dots"),
                         Curve("corrected", plot.speed_px_s, plot.after_px, "faint dots"))))
        charts.append(Chart(f"{name}: offsets tried", "offset, ms", "rms miss, px",
                            (Curve("rms", 1e3 * plot.offsets_s, plot.rms_px),)))
    return tuple(charts[:4])


def propose(result: TimeReport, rig: Rig, node_settings: Mapping[int, dict[str, Any]]) -> Proposal:
    """The rig with corrected offsets; and where a node's own row time is wrong, the node with the right one, if its
    settings are known."""
    import msgspec

    from rhot_app.calibration.proposal import NodeChange, Row, proposed

    changes: list[NodeChange] = []
    rows: list[Row] = []
    nodes = []
    for node, camera in zip(rig.nodes, result.cameras, strict=True):
        correction_s = camera.correction_s
        if not result.row_times_agree and camera.row_time_observed and node.node_id in node_settings:
            said_us, found_us = 1e6 * camera.row_time_node_s, round(1e6 * camera.row_time_s, 2)
            changes.append(NodeChange(node.node_id, {"camera": {"row_time_us": said_us}},
                                      {"camera": {"row_time_us": found_us}}))
            rows.append(Row(f"{node.name}: row time", f"{said_us:.1f} µs", f"{found_us:.1f} µs"))
            correction_s = camera.with_row_time_s
        nodes.append(camera.applied(node, correction_s))
    return proposed(TIME.reason, report(result, rig), rig, msgspec.structs.replace(rig, nodes=tuple(nodes)),
                    changes=tuple(changes), rows=tuple(rows))
