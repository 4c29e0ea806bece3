"""The filter wizard: hold still, move fast, look at what filters would do, use them (RHOT 7.3)."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtWidgets import QCheckBox, QComboBox, QDoubleSpinBox, QFormLayout, QLabel

from rhot_app.calibration.collect import Bar, Movement
from rhot_app.calibration.filters.meters import BRISK_M_S, MOVING_M_S, FilterMeter, FilterTargets, MeterReading
from rhot_app.calibration.filters.tuning import FilterResult
from rhot_app.calibration.kinds.filters import FilterStage, report
from rhot_app.calibration.report import Report
from rhot_app.state import HandState
from rhot_app.ui.backend.contract import Connect
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.movement import MovementPage, Movements, MovementStep
from rhot_app.ui.wizards.framework.page import ChartPage, shrinkable
from rhot_app.ui.wizards.framework.step import SolveStep, StepView

STILL_S, FAST_S = 10.0, 15.0


def make_wizard(context: WizardContext) -> Definition:
    """Hold still, move fast, look at the charts, use it."""
    movements, meters = Movements(context), LiveMeters()

    def page(movement: Movement) -> MeterPage:
        return movements.page_of(lambda step, connect, states: MeterPage(step, connect, states, meters), movement)

    still = page(Movement(tr("Hold still"), tr("Rest the hand before both cameras, then press Record."), STILL_S,
                          lambda: StillGuide(meters), tr("Holds still.")))
    fast = page(Movement(tr("Move fast"), tr("Press Record, then wave the hand briskly, 20 cm wide."), FAST_S,
                         lambda: FastGuide(meters), tr("Waves briskly.")))
    tune = TuneStep(context, lambda: (still.movement.log, fast.movement.log))
    return Definition((still, fast, TunePage(tune, context.scheme),
                       accept_result(context, tune, tr("Record both movements first."))), put_back=movements.end)


# -- steps -------------------------------------------------------------------------------------------------------------

class TuneStep(SolveStep):
    """The proposal for what is allowed: `targets`; `stage` says which filter's charts are shown."""

    def __init__(self, context: WizardContext, logs: Callable[[], tuple[Path | None, Path | None]]) -> None:
        """`logs` gives the recordings of the hand held still and moved fast."""
        super().__init__(context.calibration, context.now, self._recorded, tr("Trying filters …"))
        self.targets = FilterTargets()
        self.per_marker = False
        self.stage: FilterStage = "position"
        self._logs = logs

    def _recorded(self) -> tuple[Any, ...] | None:
        still, fast = self._logs()
        return None if still is None or fast is None else (still, fast, self.targets, False)

    def describe(self, result: FilterResult) -> Report:
        """With the charts of one filter."""
        return report(result, self._now, self.stage)

    def set_targets(self, jitter_mm: float, lag_ms: float) -> None:
        """Other figures to keep to: another proposal."""
        self.targets = FilterTargets(1e-3 * jitter_mm, 1e-3 * lag_ms)
        self.enter()

    def choose_stage(self, stage: FilterStage) -> None:
        """The charts of the filter before depth, or of the one after it."""
        self.stage = stage
        self.report_again()

    def set_per_marker(self, on: bool) -> None:
        """Settings for each marker, or the same for all."""
        self.per_marker = on
        if self.result is not None:
            self.take_result(self.result)

    def take_result(self, result: FilterResult) -> None:
        """As it was asked for."""
        super().take_result(replace(result, per_marker=self.per_marker))


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
        figures = zip(self.names, one.raw_jitter_m, one.jitter_m, one.lag_s, strict=True)
        return tuple((marker_name(name), _text(1e3 * raw, 2), _text(1e3 * filtered, 2), _text(1e3 * lag, 1))
                     for name, raw, filtered, lag in figures)


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
        return Bar(tr("markers"), float(self._seen.mean()) if len(self._seen) else 0.0,
                   tr("markers that both cameras have seen so far"))

    def shortfall(self) -> str:
        """Those that were not seen."""
        names = [name for name, seen in zip(self._meters.names, self._seen, strict=False) if not seen]
        return tr("Both cameras have not seen {names}.", names=", ".join(map(marker_name, names))) if names else ""


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
        return Bar(tr("still"), self._still.share, tr("of the time at rest that is needed")), self._visibility.bar()

    def sentence(self) -> str:
        """Rest it, or go on so."""
        speed = self._meters.speed_m_s
        return tr("It moves: rest the hand on something.") if speed > MOVING_M_S else tr("Good, hold still.")

    def shortfall(self) -> str:
        """That it moved, or what was not seen."""
        return self._visibility.shortfall() if self._still.share >= 1.0 else tr("The hand moved: rest it on something.")


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
        return (Bar(tr("speed"), self._share,
                    tr("of {brisk_m_s:.1f} m/s, the fastest marker of the last two seconds", brisk_m_s=BRISK_M_S)),
                Bar(tr("fast"), self._fast.share, tr("of the time at that speed that is needed")),
                self._visibility.bar())

    def sentence(self) -> str:
        """Faster, or go on so."""
        return tr("Good, go on.") if self._share >= 1.0 else tr("Faster, 20 cm wide.")

    def shortfall(self) -> str:
        """That it was slow, or what was not seen."""
        return self._visibility.shortfall() if self._fast.share >= 1.0 else tr("The hand was too slow.")


def _text(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if np.isfinite(value) else "–"


# -- the pages of the filter wizard ------------------------------------------------------------------------------------

_HEADS = ("", tr_noop("raw"), tr_noop("filtered"), tr_noop("lag"))
_ROW_PX = 26
_STAGES = (("position", tr_noop("after depth (positions)")), ("pixel", tr_noop("before depth (pixels)")))


class MeterPage(MovementPage):
    """A recorded movement with jitter and lag of every marker, live."""

    def __init__(self, step: MovementStep, connect: Connect, states: StateFeed, meters: LiveMeters) -> None:
        super().__init__(step, connect, states)
        self._feed = states
        self._meters = meters
        self.table: RecordTable[tuple[str, ...]] = RecordTable(
            [Column(tr(head), itemgetter(cell), number=cell > 0) for cell, head in enumerate(_HEADS)], selectable=False)
        self.table.fill_width()
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.table.setShowGrid(False)
        self.table.setToolTip(tr("Of the last two seconds: jitter without filters and, at rest, with those in force, "
                                 "mm rms; and how far the filters lag behind, ms, while a marker moves."))
        caption = QLabel(tr("Jitter, mm, and lag, ms, of now"))
        caption.setProperty("muted", True)
        self.column.insertWidget(self.column.count() - 1, caption)
        self.column.insertWidget(self.column.count() - 1, self.table, 4)
        shrinkable(self.table)

    def show_view(self, view: StepView) -> None:
        """The newest figures."""
        super().show_view(view)
        self._meters.watch(self._feed.recent())
        self.table.show_records(self._meters.rows())


class TunePage(ChartPage):
    """What is allowed, and the charts of one filter."""

    def __init__(self, step: TuneStep, scheme: Scheme) -> None:
        super().__init__(step, scheme)
        self._tune = step
        self.jitter = _box(1e3 * step.targets.jitter_m, 0.05, " mm", tr("How much a marker may jitter at rest, rms."))
        self.lag = _box(1e3 * step.targets.lag_s, 0.1, " ms", tr("How far a fast marker may lag behind."))
        self.stage = QComboBox()
        for value, text in _STAGES:
            self.stage.addItem(tr(text), value)
        self.stage.setToolTip(tr("There are two filters: one smooths the pixels before distances are computed, the "
                                 "other the positions after it."))
        self.own = QCheckBox(tr("each marker its own settings"))
        self.own.setToolTip(tr("Otherwise all markers get the settings that serve the worst of them."))
        form = QFormLayout()
        form.setSpacing(8)
        form.addRow(tr("Jitter"), self.jitter)
        form.addRow(tr("Lag"), self.lag)
        form.addRow(tr("Charts"), self.stage)
        form.addRow(self.own)
        self.column.insertLayout(0, form)
        self.jitter.valueChanged.connect(self._allow)
        self.lag.valueChanged.connect(self._allow)
        self.stage.currentIndexChanged.connect(self._choose)
        self.own.toggled.connect(self._each)

    def _allow(self) -> None:
        self._tune.set_targets(self.jitter.value(), self.lag.value())
        self.changed.emit()

    def _choose(self) -> None:
        self._tune.choose_stage(self.stage.currentData())
        self.changed.emit()

    def _each(self, on: bool) -> None:
        self._tune.set_per_marker(on)
        self.changed.emit()


def _box(value: float, step: float, suffix: str, meaning: str) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setRange(0.05, 50.0)
    box.setDecimals(2)
    box.setSingleStep(step)
    box.setSuffix(suffix)
    box.setValue(value)
    box.setKeyboardTracking(False)
    box.setToolTip(meaning)
    return box
