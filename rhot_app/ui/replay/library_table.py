"""The table of recordings: a row each, its name to be typed over, its condition as a bar."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.language import date_text, tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import DASH, bytes_text
from rhot_app.ui.replay.library import Entry, Summary
from rhot_app.ui.replay.session import time_text
from rhot_app.ui.replay.timeline import paint_conditions

NAME, DATE, RIG, LENGTH, SIZE, BAR = range(6)
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


@dataclass
class Line:
    """A recording, what is known of how well it was tracked, and words while nothing is."""

    entry: Entry
    summary: Summary | None = None
    words: str = ""

    @property
    def length(self) -> str:
        """Minutes and seconds, once they are known."""
        return "" if self.summary is None else time_text(round(self.summary.duration_s)).rpartition(".")[0]

    @property
    def condition(self) -> str:
        """What stands in the bar's place."""
        if self.entry.problem:
            return tr("cannot be read")
        return self.words if self.summary is None else ""

    def roles(self) -> dict[int, Any]:
        """The tooltip of every cell but the bar's."""
        return {Qt.ItemDataRole.ToolTipRole: self.entry.problem or str(self.entry.path)}

    def bar(self) -> dict[int, Any]:
        """The bar's codes and its tooltip."""
        if self.summary is None or self.entry.problem:
            return self.roles()
        found = self.summary
        said = found.note or (tr("{states} states, {bookmarks} bookmarks. Green and full: tracking; yellow: partial; "
                                 "red and low: lost; empty: no state.", states=found.states, bookmarks=found.bookmarks))
        return {_CODES: found.conditions, Qt.ItemDataRole.ToolTipRole: said}


class RecordingTable(RecordTable[Line]):
    """`named` gives a recording's path and the name that was typed."""

    named = Signal(object, str)

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__((
            Column(tr("Name"), lambda line: line.entry.path.stem, roles=Line.roles,
                   write=lambda line, name: self.named.emit(line.entry.path, name)),
            Column(tr("Date"), lambda line: date_text(line.entry.created), roles=Line.roles),
            Column(tr("Rig"), lambda line: line.entry.rig_name or DASH, roles=Line.roles),
            Column(tr("Length"), lambda line: line.length, number=True, roles=Line.roles),
            Column(tr("Size"), lambda line: bytes_text(line.entry.size), number=True, roles=Line.roles),
            Column(tr("Condition"), lambda line: line.condition, roles=Line.bar)), parent)
        self._bars = BarDelegate(scheme, self)
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setShowGrid(False)
        self.setAlternatingRowColors(True)
        self.setItemDelegateForColumn(BAR, self._bars)
        self.horizontalHeader().setDefaultAlignment(Qt.AlignmentFlag.AlignCenter)
        self.horizontalHeader().setSectionResizeMode(NAME, QHeaderView.ResizeMode.Stretch)
        for column, width in _WIDTHS_PX.items():
            self.setColumnWidth(column, width)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._bars.scheme = scheme
        self.viewport().update()

    @property
    def entries(self) -> list[Entry]:
        """The recordings shown."""
        return [line.entry for line in self.records]

    def show_entries(self, entries: list[Entry]) -> None:
        """Other recordings; nothing is known of how well they were tracked."""
        self.show_records([Line(entry) for entry in entries])

    def show_summary(self, path: Path, summary: Summary | None, words: str) -> None:
        """A recording's length and bar; `words` while there is no summary."""
        for line in self.records:
            if line.entry.path == path:
                line.summary, line.words = summary, words
        self.records_model.refresh(LENGTH)  # a name may be being typed

    @property
    def chosen_entry(self) -> Entry | None:
        """The recording that is selected."""
        return None if self.chosen is None else self.chosen.entry

    def choose(self, path: Path | None) -> None:
        """Select a recording; the first one when it is not there."""
        if self.records:
            self.selectRow(next((row for row, entry in enumerate(self.entries) if entry.path == path), 0))

    @property
    def editing(self) -> bool:
        """Whether a name is being typed."""
        return self.state() == QAbstractItemView.State.EditingState

    def edit_name(self) -> None:
        """Have the name of the selected recording typed over."""
        if self.chosen_rows:
            self.edit(self.records_model.index(self.chosen_rows[0], NAME))
