"""The filter wizard without its widgets: the work, its charts, and what it proposes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rhot_app.calibration.filters.judgement import FilterTargets
from rhot_app.progress import Progress
from rhot_app.project import Rig
from rhot_app.ui.models.palette import hex_of
from rhot_app.ui.wizards.models.chart import Chart, Curve
from rhot_app.ui.wizards.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.wizards.models.rig_rows import rig_rows
from rhot_app.ui.wizards.models.solve import SolveStep
from rhot_app.ui.wizards.models.step import Task

if TYPE_CHECKING:
    from rhot_app.calibration.filters.tuning import FilterCurves, FilterReport

REASON = "filter tuning"
STILL_S, FAST_S = 10.0, 15.0

FilterStage = Literal["pixel", "position"]
_UNITS: dict[FilterStage, str] = {"pixel": "px/s", "position": "m/s"}


def solve_logs(still: Path, fast: Path, rig: Rig, targets: FilterTargets, *, progress: Progress) -> FilterReport:
    """What ``rhot calibrate filters`` does with two logs."""
    from rhot_app.calibration.filters.tuning import tune_filters
    from rhot_app.recording.observation_table import read_instants

    progress("reading the recordings", 0.0)
    resting, moving = (read_instants(log, rig)[1] for log in (still, fast))
    return tune_filters(resting, moving, rig, targets, progress)


class TuneStep(SolveStep):
    """The proposal for what is allowed: `targets`; `stage` says which filter's charts are shown."""

    def __init__(self, logs: Callable[[], tuple[Path | None, Path | None]], rig: Rig) -> None:
        """`logs` gives the recordings of the hand held still and moved fast."""
        self.targets = FilterTargets()
        self.per_marker = False
        self.stage: FilterStage = "position"
        self._rig = rig
        self._logs = logs
        super().__init__(self._work, lambda report: report.verdict, self._charts)

    def _work(self) -> Task | None:
        still, fast = self._logs()
        if still is None or fast is None:
            return None
        return Task("Trying filters …", solve_logs, (still, fast, self._rig, self.targets))

    def _charts(self, report: Any) -> tuple[Chart, ...]:
        return charts_of(report, self._rig, self.stage)

    def set_targets(self, jitter_mm: float, lag_ms: float) -> None:
        """Other figures to keep to: another proposal."""
        self.targets = FilterTargets(1e-3 * jitter_mm, 1e-3 * lag_ms)
        self.enter()

    def choose_stage(self, stage: FilterStage) -> None:
        """The charts of the filter before depth, or of the one after it."""
        self.stage = stage
        if self.report is not None:
            self.charts = self._charts(self.report)


def charts_of(report: FilterReport, rig: Rig, stage: FilterStage) -> tuple[Chart, ...]:
    """The thesis's two steps: jitter over min cutoff, lag over beta, with what is allowed and what is chosen."""
    curves: FilterCurves = getattr(report, stage)
    targets, half = report.targets, 0.5 if stage == "pixel" else 1.0
    jitter, lag = 1e3 * curves.still_jitter_m, 1e3 * curves.lag_s
    return (Chart("Held still: jitter with beta 0", "min cutoff, Hz", "jitter, mm", (
                *_by_marker(report, rig, curves.min_cutoffs_hz, jitter),
                *_marks(curves.min_cutoffs_hz, jitter, 1e3 * targets.jitter_m, curves.chosen.min_cutoff_hz)),
                log_x=True),
            Chart("Moved fast: lag with that min cutoff", f"beta, Hz per {_UNITS[stage]}", "lag, ms", (
                *_by_marker(report, rig, curves.betas, lag),
                *_marks(curves.betas, lag, 1e3 * half * targets.lag_s, curves.chosen.beta)), log_x=True))


def _by_marker(report: FilterReport, rig: Rig, x: np.ndarray, y: np.ndarray) -> list[Curve]:
    """One curve for each marker that has figures, in its own colour."""
    colours = {marker.id: hex_of(marker.display_rgb) for marker in rig.markers.markers}
    return [Curve(marker.marker_id, x, y[:, m], colour=colours[marker.marker_id])
            for m, marker in enumerate(report.markers) if np.isfinite(y[:, m]).all()]


def _marks(x: np.ndarray, y: np.ndarray, allowed: float, chosen: float) -> tuple[Curve, Curve]:
    top = max(float(np.nanmax(y, initial=0.0)), 1.2 * allowed)
    return (Curve("allowed", x[[0, -1]], np.full(2, allowed), "dashes"),
            Curve("chosen", np.full(2, chosen), np.array([0.0, top]), "dashes"))


def propose(report: FilterReport | None, rig: Rig, path: Path | None, *, per_marker: bool) -> Proposal | None:
    """The rig with the proposed filters, and what they do to every marker."""
    if report is None:
        return None
    after = report.apply(rig, per_marker=per_marker)
    rows = list(rig_rows(rig, after))
    for one in report.markers:
        if one.known:
            rows.append(Row(f"{one.marker_id}: jitter at rest", _figure(1e3 * one.jitter_now_m, 2, "mm"),
                            _figure(1e3 * one.jitter_m, 2, "mm")))
            rows.append(Row(f"{one.marker_id}: lag", _figure(1e3 * one.lag_now_s, 1, "ms"),
                            _figure(1e3 * one.lag_s, 1, "ms")))
    return Proposal(REASON, report.verdict, tuple(rows), (RigChange(rig, after, path, REASON),))


def _figure(value: float, decimals: int, unit: str) -> str:
    return f"{value:.{decimals}f} {unit}" if np.isfinite(value) else "–"
