"""The filter wizard without its widgets: the work, its charts, and what it proposes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rhot_app.calibration.filters.meters import BRISK_M_S, MOVING_M_S, FilterMeter, FilterTargets, MeterReading
from rhot_app.calibration.registry import FILTERS
from rhot_app.charts import Chart, Curve
from rhot_app.progress import Progress
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.models.palette import hex_of
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.models.rows import rig_rows
from rhot_app.ui.wizards.models.step import Bar, SolveStep, Task

if TYPE_CHECKING:
    from rhot_app.calibration.filters.tuning import FilterCurves, FilterReport


STILL_S, FAST_S = 10.0, 15.0

FilterStage = Literal["pixel", "position"]
_UNITS: dict[FilterStage, str] = {"pixel": "px/s", "position": "m/s"}


def solve_logs(still: Path, fast: Path, rig: Rig, targets: FilterTargets, *, progress: Progress) -> FilterReport:
    """What ``rhot calibrate filters`` does with two logs."""
    from rhot_app.calibration.filters.tuning import tune_filters
    from rhot_app.calibration.recorded_observations import read_instants

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
        super().__init__(self._work, lambda report: report.choice(per_marker=self.per_marker).verdict, self._charts)

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
    after, choice = report.apply(rig, per_marker=per_marker), report.choice(per_marker=per_marker)
    rows = list(rig_rows(rig, after))
    for one in choice.markers:
        if one.known:
            rows.append(Row(f"{one.marker_id}: jitter at rest", _figure(1e3 * one.jitter_now_m, 2, "mm"),
                            _figure(1e3 * one.jitter_m, 2, "mm")))
            rows.append(Row(f"{one.marker_id}: lag", _figure(1e3 * one.lag_now_s, 1, "ms"),
                            _figure(1e3 * one.lag_s, 1, "ms")))
    return Proposal(FILTERS.reason, choice.verdict, tuple(rows), (RigChange(rig, after, path, FILTERS.reason),))


def _figure(value: float, decimals: int, unit: str) -> str:
    return f"{value:.{decimals}f} {unit}" if np.isfinite(value) else "–"


# -- Jitter and lag of every marker ------------------------------------------------------------------------------------

_READ_S = 0.25
_MOST = 0.7  # of the time: a hand may take a moment to come to rest, or to get going


class LiveMeters:
    """Takes each state once; `reading` is of the last two seconds, None before there are any."""

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        self.reading: MeterReading | None = None
        self._meter: FilterMeter | None = None
        self._last = -1
        self._due_s = 0.0

    def watch(self, states: Sequence[HandState]) -> None:
        """Take what is new in the states of the last seconds."""
        for state in states:
            if self._meter is None or state.marker_ids != self.names:
                self.names, self._meter = state.marker_ids, FilterMeter(len(state.marker_ids))
            if state.t_master_ns > self._last:
                self._last = state.t_master_ns
                self._meter.add(state.t_master_ns, state.marker_raw_positions, state.marker_positions)
        now = time.monotonic()
        if self._meter is not None and states and now >= self._due_s:
            self._due_s = now + _READ_S
            self.reading = self._meter.read()

    @property
    def speed_m_s(self) -> float:
        """Of the fastest marker; NaN when none is seen."""
        speeds = self.reading.speed_m_s if self.reading is not None else np.full(1, np.nan)
        seen = speeds[speeds > 0.0]
        return float(seen.max()) if len(seen) else float("nan")

    def rows(self) -> tuple[tuple[str, str, str, str], ...]:
        """Per marker: name, jitter without and with filters in mm, lag in ms; dashes for what cannot be told."""
        if self.reading is None:
            return ()
        one = self.reading
        return tuple((name, _text(1e3 * raw, 2), _text(1e3 * filtered, 2), _text(1e3 * lag, 1)) for name, raw, filtered,
                     lag in zip(self.names, one.raw_jitter_m, one.jitter_m, one.lag_s, strict=True))


class _Tally:
    """In which share of the readings something was so."""

    def __init__(self) -> None:
        self._last: MeterReading | None = None
        self._all = self._so = 0

    def add(self, reading: MeterReading | None, so: bool) -> None:
        """Take a reading once."""
        if reading is not None and reading is not self._last:
            self._last = reading
            self._all += 1
            self._so += so

    @property
    def share(self) -> float:
        """0..1, as it was for most of the time: 1 is enough."""
        return min(self._so / (_MOST * self._all), 1.0) if self._all else 0.0


class _Visibility:
    """Which markers both cameras have seen since the recording began."""

    def __init__(self, meters: LiveMeters) -> None:
        self._meters = meters
        self._seen = np.zeros(0, bool)

    def look(self) -> None:
        """Take the newest reading."""
        reading = self._meters.reading
        if reading is not None:
            seen = np.isfinite(reading.raw_jitter_m)
            self._seen = seen | self._seen if len(self._seen) == len(seen) else seen

    def bar(self) -> Bar:
        """How many of them."""
        return Bar("markers", float(self._seen.mean()) if len(self._seen) else 0.0,
                   "markers that both cameras have seen so far")

    def shortfall(self) -> str:
        """Those that were not seen."""
        names = [name for name, seen in zip(self._meters.names, self._seen, strict=False) if not seen]
        return f"Both cameras have not seen {', '.join(names)}." if names else ""


class StillGuide:
    """Rest the hand."""

    def __init__(self, meters: LiveMeters) -> None:
        self._meters = meters
        self._still, self._visibility = _Tally(), _Visibility(meters)

    def watch(self, states: Sequence[HandState]) -> None:
        """See what is new."""
        self._meters.watch(states)
        self._still.add(self._meters.reading, self._meters.speed_m_s <= MOVING_M_S)
        self._visibility.look()

    def bars(self) -> tuple[Bar, ...]:
        """How much of the time the hand was at rest, and the markers in sight."""
        return Bar("still", self._still.share, "of the time at rest that is needed"), self._visibility.bar()

    def sentence(self) -> str:
        """Rest it, or go on so."""
        speed = self._meters.speed_m_s
        return "It moves: rest the hand on something." if speed > MOVING_M_S else "Good, hold still."

    def shortfall(self) -> str:
        """That it moved, or what was not seen."""
        return self._visibility.shortfall() if self._still.share >= 1.0 else "The hand moved: rest it on something."


class FastGuide:
    """Wave the hand briskly."""

    def __init__(self, meters: LiveMeters) -> None:
        self._meters = meters
        self._fast, self._visibility = _Tally(), _Visibility(meters)

    def watch(self, states: Sequence[HandState]) -> None:
        """See what is new."""
        self._meters.watch(states)
        self._fast.add(self._meters.reading, self._share >= 1.0)
        self._visibility.look()

    @property
    def _share(self) -> float:
        speed = self._meters.speed_m_s
        return min(speed / BRISK_M_S, 1.0) if speed == speed else 0.0

    def bars(self) -> tuple[Bar, ...]:
        """The speed, how much of the time it was enough, and the markers in sight."""
        return (Bar("speed", self._share, f"of {BRISK_M_S:.1f} m/s, the fastest marker of the last two seconds"),
                Bar("fast", self._fast.share, "of the time at that speed that is needed"), self._visibility.bar())

    def sentence(self) -> str:
        """Faster, or go on so."""
        return "Good, go on." if self._share >= 1.0 else "Faster, 20 cm wide."

    def shortfall(self) -> str:
        """That it was slow, or what was not seen."""
        return self._visibility.shortfall() if self._fast.share >= 1.0 else "The hand was too slow."


def _text(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if np.isfinite(value) else "–"
