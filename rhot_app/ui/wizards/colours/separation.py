"""The third page: how far the colours can be told apart, and what is proposed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from rhot_app.calibration.colour.colours import ColourResult
from rhot_app.calibration.colour.verdict import OVERLAP
from rhot_app.calibration.registry import Calibration, InForce
from rhot_app.calibration.verdict import Finding, with_findings
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.common.theme import app_font
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.wizards.colours.bounds import BoundsStep, observations
from rhot_app.ui.wizards.colours.masks import MaskMaker, drift_of
from rhot_app.ui.wizards.framework.page import ChartView, Page
from rhot_app.ui.wizards.framework.step import Done, Pictures, SolveStep, StepView
from rhot_node.markers import ChromaModel


class SeparationStep(SolveStep):
    """The verdict on the colours with the bounds that a person has left them, and on the light since then."""

    watches = True
    advice = tr_noop("Read what may be mistaken for a marker, then go on.")

    def __init__(self, calibration: Calibration, now: InForce, bounds: BoundsStep) -> None:
        super().__init__(calibration, now, self._judging, tr("Trying the new bounds …"), tr("Tell them apart"),
                         tr("Go back and pick a colour."))
        self.cameras = bounds.cameras
        self._bounds = bounds
        self._learnt: ColourResult | None = None
        self._given: Mapping[str, ChromaModel] = {}
        self._maker = MaskMaker()

    def _judging(self) -> tuple[Any, ...] | Done | None:
        """Untouched bounds were judged as they were learnt."""
        if self._learnt is None:
            return None
        return observations(self._bounds.picks, dict(self._given)) if self._given else Done(self._learnt)

    def enter(self) -> None:
        """Other bounds, another judgement."""
        if self._learnt is not self._bounds.result or self._given != self._bounds.given:
            self._learnt, self._given = self._bounds.result, dict(self._bounds.given)
            self.begin()

    def observe(self, pictures: Pictures) -> tuple[Finding, ...] | None:
        """How the light stands to the one of the samples; None before they are learnt."""
        result = self.result
        return None if result is None else drift_of(self._maker.look(pictures, result.markers))

    def accept_observation(self, seen: tuple[Finding, ...]) -> None:
        """What is said of the light."""
        if self.report is not None:
            self.report = replace(self.report, verdict=with_findings(self.result.verdict, seen))

    def view(self) -> StepView:
        """The verdict, with what to do about it."""
        if self.result is None:
            return super().view()
        apart = self.result.separability.sentences
        return replace(super().view(), hint="; ".join(apart[:3]) + "." if apart else tr("No two colours overlap."))


_ROW_PX = 28
_LEAST = 0.005  # less is shown as nothing

ColourShares = tuple[str, int, list[float]]
"""A marker, its number, and how much of each colour is taken for it, 0..1."""


class SeparationPage(Page):
    """Nothing to enter: what the person can do about it stands in the verdict."""

    def __init__(self, step: SeparationStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._apart = step
        self._shown: ColourResult | None = None
        self._scheme = scheme
        self.charts = ChartView(scheme)
        self.table: RecordTable[ColourShares] = RecordTable((), selectable=False)
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.table.fill_width()
        self.table.setAccessibleName(tr("Which colour is taken for which"))
        self.table.setWordWrap(False)
        self.table.setStyleSheet("QHeaderView::section { padding: 4px 0 } QTableView::item { padding: 0 }")
        caption = QLabel(tr("The table: how much of each column's colour is taken for the marker of the row, in %, "
                            "over all lamps that may come; of a marker's own colour by the lamp where that is least."))
        caption.setWordWrap(True)
        self.centre = QWidget()
        column = QVBoxLayout(self.centre)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.charts, 1)
        column.addWidget(self.table)
        note = QLabel(tr("The chart: the blue line shows which hues the room has, and how much of each. Where it rises "
                         "inside a marker's band, the room has things of that marker's colour."))
        note.setWordWrap(True)
        note.setProperty("muted", True)
        self.column.addWidget(caption)
        self.column.addWidget(note)
        self.column.addStretch(1)

    def show_view(self, view: StepView) -> None:
        """The newest result."""
        result = self._apart.result
        if result is not self._shown:
            self._shown = result
            self.charts.show_charts(self._apart.charts)
            if result is not None:
                self._fill(result)

    def _fill(self, result: ColourResult) -> None:
        names = result.names
        columns = [Column[ColourShares]("", lambda row: marker_name(row[0]))]
        for number, head in enumerate((*names, *result.separability.others)):
            columns.append(Column(marker_name(head), partial(self._text, number), roles=partial(self._roles, number)))
        self.table.show_records([(name, number, shares) for number, (name, shares) in
                                 enumerate(zip(names, result.separability.matrix.tolist(), strict=True))], columns)
        header = self.table.horizontalHeader().sizeHint().height()
        self.table.setFixedHeight(header + _ROW_PX * len(names) + 4)

    @staticmethod
    def _text(column: int, row: ColourShares) -> str:
        _, own, shares = row
        return f"{100 * shares[column]:.0f}" if own == column or shares[column] >= _LEAST else "–"

    def _roles(self, column: int, row: ColourShares) -> Mapping[int, Any]:
        own = row[1] == column
        bad = not own and row[2][column] >= OVERLAP
        tone = self._scheme.bad if bad else self._scheme.good if own else self._scheme.muted
        return {Qt.ItemDataRole.TextAlignmentRole: Qt.AlignmentFlag.AlignCenter,
                Qt.ItemDataRole.FontRole: app_font(bold=own or bad), Qt.ItemDataRole.ForegroundRole: QColor(tone)}
