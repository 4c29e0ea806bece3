"""The filter wizard: hold still, move fast, look at what filters would do, use them (RHOT 7.3)."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFormLayout,
    QHeaderView,
    QLabel,
    QTableWidget,
    QTableWidgetItem,
)

from rhot_app.calibration.registry import FILTERS
from rhot_app.ui.backend.contract import Asker
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.movement_page import MovementPage, Movements
from rhot_app.ui.wizards.framework.page import AcceptPage, ChartPage, shrinkable
from rhot_app.ui.wizards.models.movement import MovementStep
from rhot_app.ui.wizards.models.step import AcceptStep, StepView
from rhot_app.ui.wizards.steps.filter_steps import (
    FAST_S,
    STILL_S,
    FastGuide,
    LiveMeters,
    StillGuide,
    TuneStep,
    propose,
)


def make_wizard(context: WizardContext) -> Definition:
    """Hold still, move fast, look at the charts, use it."""
    movements, meters = Movements(context), LiveMeters()

    def page(title: str, sentence: str, seconds: float, guide: type[StillGuide] | type[FastGuide]) -> MeterPage:
        return movements.page_of(lambda step, connect, states: MeterPage(step, connect, states, meters),
                                 title, sentence, seconds, lambda: guide(meters))

    still = page("Hold still", "Rest the hand before both cameras, then press Record.", STILL_S, StillGuide)
    fast = page("Move fast", "Press Record, then wave the hand briskly, 20 cm wide.", FAST_S, FastGuide)
    still.twin_facts, fast.twin_facts = "Holds still.", "Waves briskly."
    tune = TuneStep(lambda: (still.movement.log, fast.movement.log), context.rig)
    accept = AcceptStep(lambda: propose(tune.report, context.rig, context.rig_path, per_marker=tune.per_marker),
                        "Record both movements first.")
    return Definition(FILTERS.title, (still, fast, TunePage(tune, context.scheme), AcceptPage(accept, context.scheme)),
                      solver="rhot_app.calibration.filters.tuning", put_back=movements.end)


# -- the pages of the filter wizard ------------------------------------------------------------------------------------

_HEADS = ("", "raw", "filtered", "lag")
_ROW_PX = 26
_STAGES = (("position", "after depth (positions)"), ("pixel", "before depth (pixels)"))


class MeterPage(MovementPage):
    """A recorded movement with jitter and lag of every marker, live."""

    def __init__(self, step: MovementStep, connect: Callable[[], Asker], states: StateFeed, meters: LiveMeters) -> None:
        super().__init__(step, connect, states)
        self._feed = states
        self._meters = meters
        self.table = QTableWidget(0, len(_HEADS))
        self.table.setHorizontalHeaderLabels(list(_HEADS))
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.table.verticalHeader().setVisible(False)
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.table.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.table.setShowGrid(False)
        self.table.setToolTip("Of the last two seconds: jitter without filters and, at rest, with those in force, mm "
                              "rms; and how far the filters lag behind, ms, while a marker moves.")
        caption = QLabel("Jitter, mm, and lag, ms, of now")
        caption.setProperty("muted", True)
        self.column.insertWidget(self.column.count() - 1, caption)
        self.column.insertWidget(self.column.count() - 1, self.table, 4)
        shrinkable(self.table)

    def show_view(self, view: StepView) -> None:
        """The newest figures."""
        super().show_view(view)
        self._meters.watch(self._feed.recent())
        rows = self._meters.rows()
        self.table.setRowCount(len(rows))
        for r, row in enumerate(rows):
            for c, text in enumerate(row):
                item = QTableWidgetItem(text)
                if c:
                    item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                self.table.setItem(r, c, item)


class TunePage(ChartPage):
    """What is allowed, and the charts of one filter."""

    def __init__(self, step: TuneStep, scheme: Scheme) -> None:
        super().__init__(step, scheme)
        self._tune = step
        self.jitter = _box(1e3 * step.targets.jitter_m, 0.05, " mm", "How much a marker may jitter at rest, rms.")
        self.lag = _box(1e3 * step.targets.lag_s, 0.1, " ms", "How far a fast marker may lag behind.")
        self.stage = QComboBox()
        for value, text in _STAGES:
            self.stage.addItem(text, value)
        self.stage.setToolTip("There are two filters: one smooths the pixels before distances are computed, the other "
                              "the positions after it.")
        self.own = QCheckBox("each marker its own settings")
        self.own.setToolTip("Otherwise all markers get the settings that serve the worst of them.")
        form = QFormLayout()
        form.setSpacing(8)
        form.addRow("Jitter", self.jitter)
        form.addRow("Lag", self.lag)
        form.addRow("Charts", self.stage)
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
        self._tune.per_marker = on


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
