"""The time calibration: offset and row time of each camera from a marker that moves up and down."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.calibration.collect import Bar, Movement
from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.errors import input_file
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.check.health import HealthFigures
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.calibration.time.offset import TimeResult
    from rhot_app.charts import Chart
    from rhot_app.progress import Progress
    from rhot_app.state import HandState


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate time``."""
    parser.add_argument("--log", type=input_file, required=True, metavar="LOG",
                        help="20 s of a hand that waves up and down, recorded by rhot engine --log or the app")
    add_rig_argument(parser, "the rig, its geometry calibrated", required=True)
    add_out_argument(parser, "write the rig with corrected times")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate time --log wave.rhotlog --rig desk.json",
                 "rhot calibrate time --log wave.rhotlog --rig desk.json --out desk.json")


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """The recording; it is read by `solve`."""
    from rhot_app.project import load_rig

    return Observed((args.log,), InForce(load_rig(args.rig), args.rig))


def solve(log: Path, now: InForce, *, progress: Progress) -> TimeResult:
    """The cameras' times from a recording. Raises CalibrationError and RecordingError."""
    from rhot_app.calibration.recorded_observations import read_observations
    from rhot_app.calibration.time.offset import calibrate_times

    progress("reading the recording", 0.0)
    return calibrate_times(read_observations(log, now.rig)[1], now.rig, progress)


def report(result: TimeResult, now: InForce) -> Report:
    """Each camera's offset and row time, and how far its rays miss the first camera's."""
    rows = []
    for camera, node in zip(result.cameras, now.rig.nodes, strict=True):
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


def charts_of(result: TimeResult) -> tuple[Chart, ...]:
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


def propose(result: TimeResult, now: InForce) -> Proposal:
    """The rig with corrected offsets; and where a node's own row time is wrong, the node with the right one, if its
    settings are known."""
    import msgspec

    from rhot_app.calibration.proposal import NodeChange, Row, proposed

    changes: list[NodeChange] = []
    rows: list[Row] = []
    nodes = []
    for node, camera in zip(now.rig.nodes, result.cameras, strict=True):
        correction_s = camera.correction_s
        if not result.row_times_agree and camera.row_time_observed and node.node_id in now.node_settings:
            said_us, found_us = 1e6 * camera.row_time_node_s, round(1e6 * camera.row_time_s, 2)
            changes.append(NodeChange(node.node_id, {"camera": {"row_time_us": said_us}},
                                      {"camera": {"row_time_us": found_us}}))
            rows.append(Row(f"{node.name}: row time", f"{said_us:.1f} µs", f"{found_us:.1f} µs"))
            correction_s = camera.with_row_time_s
        nodes.append(camera.applied(node, correction_s))
    return proposed(CALIBRATION.reason, report(result, now), now.rig,
                    msgspec.structs.replace(now.rig, nodes=tuple(nodes)), changes=tuple(changes), rows=tuple(rows))


def check(figures: HealthFigures) -> list[Finding]:
    """Whether rays of fast markers alone miss each other."""
    if not figures.late:
        return []
    _, slow, fast = figures.errors_px
    return [Finding("late_camera", Grade.FAIR, f"Rays of fast markers miss each other by {fast:.1f} px, of slow ones "
                    f"by {slow:.1f} px only.", "One camera's times are off.",
                    "Calibrate the cameras' times with a waving hand (Calibrate menu).")]


# -- the waving hand ---------------------------------------------------------------------------------------------------

_FAST_PX_S = 120.0  # a hand that crosses half the picture in two seconds
_REACH_PX = 250.0


class WaveGuide:
    """Tells whether the hand moves fast enough up and down: a delay shows as speed times time."""

    def __init__(self) -> None:
        self._speed_px_s = 0.0
        self._low, self._high = math.inf, -math.inf

    def watch(self, states: Sequence[HandState]) -> None:
        """Vertical speed and reach in the first camera."""
        import numpy as np

        if len(states) < 3:
            return
        rows = np.array([state.camera_pixels[0, :, 1] for state in states])
        t_s = 1e-9 * (np.array([state.t_master_ns for state in states]) - states[0].t_master_ns)
        if not np.isfinite(rows).any() or t_s[-1] <= 0.0:
            return
        step_s = np.maximum(np.diff(t_s), 1e-3)[:, None]
        speeds = np.abs(np.diff(rows, axis=0)) / step_s
        if np.isfinite(speeds).any():
            self._speed_px_s = float(np.nanmedian(speeds))
        self._low, self._high = min(self._low, float(np.nanmin(rows))), max(self._high, float(np.nanmax(rows)))

    def bars(self) -> tuple[Bar, ...]:
        """Speed now, and how much of the picture was used."""
        reach = max(self._high - self._low, 0.0)
        return (Bar("speed", min(self._speed_px_s / _FAST_PX_S, 1.0), "how fast the markers move up and down now"),
                Bar("reach", min(reach / _REACH_PX, 1.0), "how much of the picture's height the markers have crossed"))

    def sentence(self) -> str:
        """Faster, farther, or go on."""
        if self._speed_px_s < _FAST_PX_S:
            return "Faster: up and down."
        return "Good, go on waving." if self._high - self._low >= _REACH_PX else "Good speed: wave farther up and down."

    def shortfall(self) -> str:
        """What the verdict tells better: the work says how well the times are known."""
        return ""


CALIBRATION = Calibration(
    "time", "Time of the cameras", "When each camera sees, from a hand that waves.", "time calibration",
    Command("time", "when each camera sees, from a moving marker", add_arguments, observe),
    (Movement("Wave", "Press Record, then wave your hand up and down before the cameras for 20 seconds.", 20.0,
              WaveGuide, "Waves briskly."),), solve, report, propose, check, solver="rhot_app.calibration.time.offset")
