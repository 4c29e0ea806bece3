"""The table of recordings: a row each, its name to be typed over, its condition as a bar."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import DASH, bytes_text
from rhot_app.ui.replay.library import Entry, Summary
from rhot_app.ui.replay.session import time_text
from rhot_app.ui.replay.timeline import paint_conditions

NAME, DATE, RIG, LENGTH, SIZE, BAR = range(6)
_HEADS = ("Name", "Date", "Rig", "Length", "Size", "Condition")
_WIDTHS_PX = {DATE: 190, RIG: 150, LENGTH: 90, SIZE: 90, BAR: 300}
_ROW_PX = 34
_CODES = Qt.ItemDataRole.UserRole


class BarDelegate(QStyledItemDelegate):
    """Paints a condition bar where an item has codes."""

    def __init__(self, scheme: Scheme, parent: QWidget) -> None:
        super().__init__(parent)
        self.scheme = scheme

    def paint(self, painter: QPainter, option: QStyleOptionViewItem,
              index: QModelIndex | QPersistentModelIndex) -> None:
        """The bar, or the item's text while there is none."""
        super().paint(painter, option, index)
        codes = index.data(_CODES)
        if codes is not None:
            box = QRectF(option.rect).adjusted(6, 8, -6, -8)
            paint_conditions(painter, box, np.asarray(codes, np.int8), self.scheme)


class RecordingTable(QTableWidget):
    """`named` gives a recording's path and the name that was typed."""

    named = Signal(object, str)

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(0, len(_HEADS), parent)
        self.entries: list[Entry] = []
        self._filling = False
        self._bars = BarDelegate(scheme, self)
        self.setHorizontalHeaderLabels(list(_HEADS))
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setShowGrid(False)
        self.setAlternatingRowColors(True)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setItemDelegateForColumn(BAR, self._bars)
        self.horizontalHeader().setSectionResizeMode(NAME, QHeaderView.ResizeMode.Stretch)
        for column, width in _WIDTHS_PX.items():
            self.setColumnWidth(column, width)
        self.itemChanged.connect(self._take_name)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._bars.scheme = scheme
        self.viewport().update()

    def show_entries(self, entries: list[Entry]) -> None:
        """Other recordings; nothing is known of how well they were tracked."""
        self._filling = True
        self.entries = entries
        self.setRowCount(len(entries))
        for row, entry in enumerate(entries):
            self._fill_row(row, entry)
        self._filling = False

    def _fill_row(self, row: int, entry: Entry) -> None:
        texts = {NAME: entry.path.stem, DATE: f"{entry.created:%d %b %Y, %H:%M}", RIG: entry.rig_name or DASH,
                 LENGTH: "", SIZE: bytes_text(entry.size), BAR: "cannot be read" if entry.problem else ""}
        for column, text in texts.items():
            item = QTableWidgetItem(text)
            flags = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
            item.setFlags(flags | Qt.ItemFlag.ItemIsEditable if column == NAME else flags)
            item.setToolTip(entry.problem or str(entry.path))
            if column in (LENGTH, SIZE):
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.setItem(row, column, item)

    def show_summary(self, path: Path, summary: Summary | None, words: str) -> None:
        """A recording's length and bar; `words` while there is no summary."""
        row = next((row for row, entry in enumerate(self.entries) if entry.path == path and not entry.problem), None)
        if row is None:
            return
        self._filling = True
        bar = self._cell(row, BAR)
        if summary is None:
            bar.setText(words)
        else:
            self._cell(row, LENGTH).setText(time_text(round(summary.duration_s)).rpartition(".")[0])
            bar.setText("")
            bar.setData(_CODES, summary.conditions)
            bar.setToolTip(summary.note or f"{summary.states} states, {summary.bookmarks} bookmarks. Green and full: "
                           "tracking; yellow: partial; red and low: lost; empty: no state.")
        self._filling = False

    def _cell(self, row: int, column: int) -> QTableWidgetItem:
        item = self.item(row, column)
        assert item is not None  # every row is filled
        return item

    @property
    def chosen(self) -> Entry | None:
        """The recording that is selected."""
        rows = self.selectionModel().selectedRows()
        return self.entries[rows[0].row()] if rows and rows[0].row() < len(self.entries) else None

    def choose(self, path: Path | None) -> None:
        """Select a recording; the first one when it is not there."""
        if self.entries:
            self.selectRow(next((row for row, entry in enumerate(self.entries) if entry.path == path), 0))

    @property
    def editing(self) -> bool:
        """Whether a name is being typed."""
        return self.state() == QAbstractItemView.State.EditingState

    def edit_name(self) -> None:
        """Have the name of the selected recording typed over."""
        rows = self.selectionModel().selectedRows()
        if rows:
            self.editItem(self._cell(rows[0].row(), NAME))

    def _take_name(self, item: QTableWidgetItem) -> None:
        if not self._filling and item.column() == NAME and item.row() < len(self.entries):
            self.named.emit(self.entries[item.row()].path, item.text())
