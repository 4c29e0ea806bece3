"""The widgets of one step: what stands at the right below the sentence, and what takes the pictures' place."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QSize, Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QGridLayout,
    QHeaderView,
    QLabel,
    QScrollArea,
    QSizePolicy,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from rhot_app.calibration.proposal import Row
from rhot_app.calibration.report import Table
from rhot_app.calibration.verdict import Finding, Verdict
from rhot_app.charts import Chart, Curve, Span, ticks
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.disposal import plot_widget
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.common.theme import CELL_PADDING_PX, app_font
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme, visible_on
from rhot_app.ui.models.proposal import ways_back
from rhot_app.ui.models.words import GRADES
from rhot_app.ui.wizards.framework.step import AcceptStep, ChartedStep, Step, StepView
from rhot_app.ui.wizards.framework.swatches import swatch


class Page(QWidget):
    """Base of all pages: hands what a person does to its `step` and shows what the step says. Holds no mathematics.

    `changed` tells the window that the person changed something, so that it asks the step anew. `centre` is a widget
    that takes the middle instead of the live pictures; None leaves the pictures there. `first_field` has the keyboard
    when the page opens. `pickable` lets the person click and drag in the pictures, see `pick`. `one_large` shows one
    picture as large as fits and the others small; a click on a small one makes it the large one. `twin_facts`: what the
    simulated rig should show here, as its menu says it, and the sizes that a person would measure.
    """

    changed = Signal()

    def __init__(self, step: Step, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.step = step
        self.centre: QWidget | None = None
        self.first_field: QWidget | None = None
        self.pickable = False
        self.one_large = False
        self.twin_facts = ""
        self.column = QVBoxLayout(self)
        self.column.setContentsMargins(0, 0, 0, 0)
        self.column.setSpacing(8)

    def entered(self) -> None:
        """The step is the current one now."""

    def show_view(self, view: StepView) -> None:
        """What the step says now; the sentence, bars, verdict and overlays are shown by the window."""

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        """A person has clicked or dragged in `picture`, which may not be the newest; px, a click has no size."""


# -- Last page of every wizard: before and after -----------------------------------------------------------------------

HEADS = ("", tr_noop("before"), tr_noop("after"))


class AcceptPage(Page):
    """`restore_asked` when the person wants the old state back; the window does it."""

    restore_asked = Signal()

    def __init__(self, step: AcceptStep, scheme: Scheme, heads: tuple[str, str, str] = HEADS) -> None:
        super().__init__(step)
        self.accept = step
        self._rows: tuple[Row, ...] | None = None
        self.table = RowTable(scheme, heads)
        self.centre = self.table
        self.restore_button = plain_button(tr("Restore the old one"), tr("Brings back what was there before."))
        self.restore_button.clicked.connect(self.restore_asked)
        self.note = QLabel()
        self.note.setWordWrap(True)
        self.note.setProperty("muted", True)
        self.column.addWidget(self.restore_button)
        self.column.addWidget(self.note)
        self.column.addStretch(1)
        policy = self.restore_button.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.restore_button.setSizePolicy(policy)

    def show_view(self, view: StepView) -> None:
        """The rows of the proposal, and the way back while there is one."""
        proposal = self.accept.proposal
        rows = proposal.rows if proposal is not None else ()
        if rows != self._rows:
            self._rows = rows
            self.table.show_records(rows)
        self.note.setText(tr("Nothing was saved so far. {ways_back}", ways_back=ways_back(self.accept.changes))
                          if proposal is not None else "")
        self.note.setVisible(self.accept.state == "proposed")
        self.restore_button.setVisible(self.accept.restorable)


def shrinkable(part: QWidget, least_px: int = 96) -> None:
    """A list or table of a page that takes the room that is left, and scrolls in it, before the page does."""
    part.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
    part.setMinimumHeight(least_px)


class _WrappedCell(QStyledItemDelegate):
    """Qt measures a wrapped text without the style sheet's padding, and cuts off the line too many."""

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex) -> QSize:  # noqa: N802
        """As high as the text is in the width that is left."""
        left = QStyleOptionViewItem(option)
        left.rect = option.rect.adjusted(0, 0, -2 * CELL_PADDING_PX, 0)
        return super().sizeHint(left, index)


class RowTable(RecordTable[Row]):
    """Rows of before and after; what changes is bold."""

    def __init__(self, scheme: Scheme, heads: tuple[str, str, str] = HEADS) -> None:
        def roles(cell: int, row: Row) -> Mapping[int, Any]:
            found: dict[int, Any] = {
                Qt.ItemDataRole.FontRole: app_font(13.0, bold=cell == 2 and row.changed),
                Qt.ItemDataRole.ForegroundRole: QColor(scheme.text if cell else scheme.muted)}
            if row.swatches is not None and cell:
                found[Qt.ItemDataRole.DecorationRole] = swatch(row.swatches[cell - 1], scheme)
            return found

        texts = (attrgetter("what"), attrgetter("before"), attrgetter("after"))
        super().__init__([Column(tr(head), text, roles=partial(roles, cell))
                          for cell, (head, text) in enumerate(zip(heads, texts, strict=True))], selectable=False)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.setShowGrid(False)
        self.setItemDelegate(_WrappedCell(self))
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)


class FigureTable(RecordTable[tuple[str, ...]]):
    """The first `columns` of a report's table, by default all; what its figures are of stands first."""

    def __init__(self, columns: int | None = None) -> None:
        super().__init__((), selectable=False)
        self._count = columns
        self._shown: Table | None = None
        self.setShowGrid(False)
        self.fill_width()

    def show_table(self, table: Table | None) -> None:
        """Show it instead of the last one; the same object is not filled in again."""
        if table is not self._shown:
            self._shown = table
            heads, texts = (table.heads, table.texts) if table is not None else ((), [])
            self.show_records(texts, figure_columns(heads[:self._count]))


def figure_columns(heads: Sequence[str]) -> list[Column[tuple[str, ...]]]:
    """Columns of a row of texts: names at the left, numbers at the right."""
    def alignment(cell: int, row: tuple[str, ...]) -> Mapping[int, Any]:
        side = Qt.AlignmentFlag.AlignRight if row[cell][:1] in "-–0123456789" else Qt.AlignmentFlag.AlignLeft
        return {Qt.ItemDataRole.TextAlignmentRole: side | Qt.AlignmentFlag.AlignVCenter}

    return [Column(tr(head), itemgetter(cell), roles=partial(alignment, cell)) for cell, head in enumerate(heads)]


# -- Charts of a result in the middle of a wizard, one below the other -------------------------------------------------

_DOT_PX = 7
_FAINT_PX = 3
_WIDTH_PX = 2.0
_TEXT_PT = 11.0
_LEGEND_COLUMNS = 4
_ROOM, _LEGEND_ROOM = 0.05, 0.14  # of the height of what is shown: below and above it, and for a row of the legend
_BAND_ALPHA, _OWN_ALPHA = 40, 90


class ChartView(QWidget):
    """Shows some `Chart`s; a chart that is the same object as before is not drawn again."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(8, 8, 8, 8)
        self._column.setSpacing(8)
        self._shown: tuple[Chart, ...] = ()
        self.plots: list[pg.PlotWidget] = []

    def show_charts(self, charts: tuple[Chart, ...]) -> None:
        """Show these instead of the last ones."""
        if len(charts) == len(self._shown) and all(a is b for a, b in zip(charts, self._shown, strict=True)):
            return
        self._shown = charts
        for plot in self.plots:
            self._column.removeWidget(plot)
            plot.deleteLater()
        self.plots = [self._draw(chart) for chart in charts]
        for plot in self.plots:
            self._column.addWidget(plot, 1)

    def _draw(self, chart: Chart) -> pg.PlotWidget:
        scheme = self._scheme
        plot = plot_widget(background=scheme.panel)
        plot.setTitle(chart.title, color=scheme.text, size=f"{_TEXT_PT + 1}pt")
        plot.showGrid(x=True, y=True, alpha=0.15)
        for side, label in (("bottom", chart.x_label), ("left", chart.y_label)):
            axis = plot.getAxis(side)
            axis.setLabel(label, color=scheme.muted)
            axis.enableAutoSIPrefix(False)
            axis.setTickFont(app_font(_TEXT_PT))
            axis.setPen(scheme.border)
            axis.setTextPen(scheme.muted)
        plot.setLogMode(x=chart.log_x, y=chart.log_y)
        named = sum(bool(curve.name) for curve in chart.curves)
        columns = min(max(named, 1), _LEGEND_COLUMNS)
        plot.addLegend(offset=(-10, 1), labelTextColor=scheme.text, brush=pg.mkBrush(scheme.panel), colCount=columns)
        tones = iter((scheme.accent, scheme.caution, scheme.good, scheme.bad, scheme.muted) * 4)
        for curve in chart.curves:
            tone = QColor(visible_on(curve.colour, scheme.panel) if curve.colour else next(tones))
            self._add(plot, chart, curve, tone)
        for side, log, span in zip(("bottom", "left"), (chart.log_x, chart.log_y), chart.reach(), strict=True):
            if log:
                plot.getAxis(side).setTicks([[(float(np.log10(value)), f"{value:g}")
                                              for value in ticks(span, log=True)]])
        if chart.names:
            plot.getAxis("bottom").setTicks([list(enumerate(chart.names))])
        if chart.x_span is not None:
            plot.setXRange(*_shown(chart.x_span, log=chart.log_x), padding=0.0)
        low, high = _shown(chart.reach()[1], log=chart.log_y)
        below = 0.0 if chart.y_span is not None else _ROOM
        above = _ROOM + _LEGEND_ROOM * math.ceil(named / columns)
        plot.setYRange(low - below * (high - low), high + above * (high - low), padding=0.0)
        return plot

    def _add(self, plot: pg.PlotWidget, chart: Chart, curve: Curve, tone: QColor) -> None:
        if curve.style == "band":
            self._add_band(plot, curve, tone)
        elif curve.style in ("dots", "faint dots"):
            size = _DOT_PX if curve.style == "dots" else _FAINT_PX
            plot.plot(curve.x, curve.y, pen=None, symbol="o", symbolSize=size, symbolBrush=tone, symbolPen=None,
                      name=curve.name or None)
        elif curve.style == "bars":
            low, _ = _shown(chart.reach()[1], log=chart.log_y)
            heights = np.log10(curve.y) if chart.log_y else curve.y
            foot = low if chart.log_y else 0.0
            bars = pg.BarGraphItem(x=curve.x, y0=foot, y1=heights, width=curve.width, brush=tone, pen=None)
            plot.addItem(bars)
            if curve.name:
                plot.getPlotItem().legend.addItem(bars, curve.name)
        elif curve.style == "whiskers":
            high = curve.y if curve.high is None else curve.high
            plot.plot(np.repeat(curve.x, 2), np.stack([curve.y, high], axis=1).ravel(), connect="pairs",
                      pen=pg.mkPen(tone, width=_WIDTH_PX), name=curve.name or None)
        else:
            style = Qt.PenStyle.DashLine if curve.style == "dashes" else Qt.PenStyle.SolidLine
            plot.plot(curve.x, curve.y, pen=pg.mkPen(tone, width=_WIDTH_PX, style=style), name=curve.name or None)

    def _add_band(self, plot: pg.PlotWidget, curve: Curve, tone: QColor) -> None:
        edge = pg.mkPen(tone, width=1.0)
        low = plot.plot(curve.x, curve.y, pen=edge, name=curve.name or None)
        high = plot.plot(curve.x, curve.high if curve.high is not None else curve.y, pen=edge)
        fill = QColor(tone)
        fill.setAlpha(_OWN_ALPHA if curve.colour else _BAND_ALPHA)
        plot.addItem(pg.FillBetweenItem(low, high, brush=fill))


def _shown(span: Span, *, log: bool) -> Span:
    """The span in the plot's own units."""
    return (float(np.log10(span[0])), float(np.log10(span[1]))) if log else span


# -- The page of a result: its charts in the middle --------------------------------------------------------------------

class ChartPage(Page):
    """Shows the charts of its step."""

    def __init__(self, step: ChartedStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._charted = step
        self.charts = ChartView(scheme)
        self.centre = self.charts
        self.column.addStretch(1)

    def show_view(self, view: StepView) -> None:
        """The newest charts."""
        self.charts.show_charts(self._charted.charts)


# -- A calibration's verdict with its findings -------------------------------------------------------------------------

_SENTENCE_PT = 14.0


class VerdictView(QScrollArea):
    """Empty until a verdict is there."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self.verdict: Verdict | None = None
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def show_verdict(self, verdict: Verdict | None) -> None:
        """Another verdict, or none."""
        if verdict == self.verdict:
            return
        self.verdict = verdict
        body = QWidget()
        body.setProperty("panel", True)
        column = QVBoxLayout(body)
        column.setContentsMargins(0, 0, 8, 0)
        if verdict is not None:
            column.addLayout(self._rows(verdict))
        column.addStretch(1)
        self.setWidget(body)

    def _rows(self, verdict: Verdict) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(6)
        grid.setColumnStretch(1, 1)
        look = GRADES[verdict.grade]
        self._add_row(grid, look.shape, look.tone, _label(_escaped(verdict.sentence), size=_SENTENCE_PT, bold=True), 24)
        for finding in verdict.findings:
            look = GRADES[finding.grade]
            self._add_row(grid, look.shape, look.tone, _label(_finding_text(finding)), 16)
        self.setAccessibleName(tr("Verdict: {word}. {sentence}", word=GRADES[verdict.grade].word,
                                  sentence=verdict.sentence))
        return grid

    def _add_row(self, grid: QGridLayout, shape: str, tone: str, label: QLabel, size: int) -> None:
        mark = ShapeMark(size)
        mark.set_shape(shape, self._scheme.tone(tone))
        row = grid.rowCount()
        grid.addWidget(mark, row, 0, Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignHCenter)
        grid.addWidget(label, row, 1)


def _finding_text(finding: Finding) -> str:
    remedy = f"<b>{_escaped(finding.remedy)}</b>" if finding.remedy else ""
    return " ".join(part for part in (_escaped(finding.figure), _escaped(finding.cause), remedy) if part)


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


def _label(text: str, *, size: float | None = None, bold: bool = False) -> QLabel:
    label = QLabel(text)
    label.setWordWrap(True)
    label.setTextFormat(Qt.TextFormat.RichText)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    if size is not None:
        label.setFont(app_font(size, bold=bold))
    return label
