"""The time wizard without its widgets: the work, its charts, and what it proposes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from rhot_app.calibration.registry import TIME
from rhot_app.charts import Chart, Curve
from rhot_app.progress import Progress
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.models.proposal import Change, NodeChange, Proposal, RigChange, Row
from rhot_app.ui.models.rows import rig_rows
from rhot_app.ui.wizards.models.step import Bar

if TYPE_CHECKING:
    from rhot_app.calibration.time.offset import TimeReport

SECONDS = 20.0

_FAST_PX_S = 120.0  # a hand that crosses half the picture in two seconds
_REACH_PX = 250.0


def solve_log(log: Path, rig: Rig, *, progress: Progress) -> TimeReport:
    """What ``rhot calibrate time`` does with a log."""
    from rhot_app.calibration.recorded_observations import read_observations
    from rhot_app.calibration.time.offset import calibrate_times

    progress("reading the recording", 0.0)
    _, table = read_observations(log, rig)
    return calibrate_times(table, rig, progress)


class WaveGuide:
    """Tells whether the hand moves fast enough up and down: a delay shows as speed times time."""

    def __init__(self) -> None:
        self._speed_px_s = 0.0
        self._low, self._high = np.inf, -np.inf

    def watch(self, states: Sequence[HandState]) -> None:
        """Vertical speed and reach in the first camera."""
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
        reach = max(self._high - self._low, 0.0) if np.isfinite(self._high - self._low) else 0.0
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


def charts_of(report: TimeReport) -> tuple[Chart, ...]:
    """For each camera but the first: misses over speed as they were and are (a delay is the slope), and the search."""
    charts = []
    for index, plot in report.plots.items():
        name, reference = report.cameras[index].name, report.cameras[0].name
        charts.append(Chart(
            f"{name}: how far its rays miss those of {reference}; a delay is a slope", "speed across the line, px/s",
            "miss, px", (Curve("before", plot.speed_px_s, plot.before_px, "faint dots"),
                         Curve("corrected", plot.speed_px_s, plot.after_px, "faint dots"))))
        charts.append(Chart(f"{name}: offsets tried", "offset, ms", "rms miss, px",
                            (Curve("rms", 1e3 * plot.offsets_s, plot.rms_px),)))
    return tuple(charts[:4])


def propose(report: TimeReport | None, rig: Rig, path: Path | None,
            node_settings: Mapping[int, dict[str, Any]]) -> Proposal | None:
    """The rig with corrected offsets; and where a node's own row time is wrong, the node's with the right one."""
    if report is None:
        return None
    changes: list[Change] = []
    rows: list[Row] = []
    nodes = []
    for node, camera in zip(rig.nodes, report.cameras, strict=True):
        correction_s = camera.correction_s
        if not report.row_times_agree and camera.row_time_observed and node.node_id in node_settings:
            said_us, found_us = 1e6 * camera.row_time_node_s, round(1e6 * camera.row_time_s, 2)
            changes.append(NodeChange(node.node_id, {"camera": {"row_time_us": said_us}},
                                      {"camera": {"row_time_us": found_us}}))
            rows.append(Row(f"{node.name}: row time", f"{said_us:.1f} µs", f"{found_us:.1f} µs"))
            correction_s = camera.with_row_time_s
        nodes.append(camera.applied(node, correction_s))
    after = msgspec.structs.replace(rig, nodes=tuple(nodes))
    return Proposal(TIME.reason, report.verdict, (*rig_rows(rig, after), *rows),
                    (*changes, RigChange(rig, after, path, TIME.reason)))
