"""The page of the separability: the room's hues as a chart, and which colour is taken for which as a table."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLabel,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from rhot_app.calibration.colour_verdict import OVERLAP
from rhot_app.calibration.colours import ColourReport
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.theme import app_font
from rhot_app.ui.wizards.chart_view import ChartView
from rhot_app.ui.wizards.models.colour_result import ApartStep, matrix_cells
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.page import Page

_ROW_PX = 28
_LEAST = 0.005  # less is shown as nothing


class ApartPage(Page):
    """Nothing to enter: what the person can do about it stands in the verdict."""

    def __init__(self, step: ApartStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._apart = step
        self._shown: ColourReport | None = None
        self._scheme = scheme
        self.charts = ChartView(scheme)
        self.table = QTableWidget()
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.table.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.table.setAccessibleName("Which colour is taken for which")
        caption = QLabel("How much of each column's colour is taken for the marker of the row, in %, over all lamps "
                         "that may come; of a marker's own colour by the lamp where that is least")
        caption.setWordWrap(True)
        self.centre = QWidget()
        column = QVBoxLayout(self.centre)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.charts, 1)
        column.addWidget(caption)
        column.addWidget(self.table)
        note = QLabel("The blue line shows which hues the room has, and how much of each. Where it rises inside a "
                      "marker's band, the room has things of that marker's colour.")
        note.setWordWrap(True)
        note.setProperty("muted", True)
        self.column.addWidget(note)
        self.column.addStretch(1)

    def show_view(self, view: StepView) -> None:
        """The newest report."""
        report = self._apart.report
        if report is not self._shown:
            self._shown = report
            self.charts.show_charts(self._apart.charts)
            if report is not None:
                self._fill(*matrix_cells(report))

    def _fill(self, heads: tuple[str, ...], rows: list[tuple[str, list[float]]]) -> None:
        self.table.setColumnCount(len(heads))
        self.table.setRowCount(len(rows))
        self.table.setHorizontalHeaderLabels(list(heads))
        self.table.setVerticalHeaderLabels([name for name, _ in rows])
        for r, (name, shares) in enumerate(rows):
            for c, share in enumerate(shares):
                self.table.setItem(r, c, self._cell(share, own=heads[c] == name))
            self.table.setRowHeight(r, _ROW_PX)
        header = self.table.horizontalHeader().sizeHint().height()
        self.table.setFixedHeight(header + _ROW_PX * len(rows) + 4)

    def _cell(self, share: float, *, own: bool) -> QTableWidgetItem:
        item = QTableWidgetItem(f"{100 * share:.0f}" if own or share >= _LEAST else "–")
        item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)
        bad = not own and share >= OVERLAP
        item.setFont(app_font(bold=own or bad))
        tone = self._scheme.bad if bad else self._scheme.good if own else self._scheme.muted
        item.setForeground(QColor(tone))
        return item
