"""The recordings as a list: when, which rig, how long, how well tracked; open, rename, delete, undo."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from platformdirs import user_cache_path
from PySide6.QtCore import QEvent, QModelIndex, QPersistentModelIndex, QRectF, Qt, QUrl, Signal
from PySide6.QtGui import QCloseEvent, QDesktopServices, QKeySequence, QPainter, QShortcut
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from rhot_app.errors import RhotError
from rhot_app.ui.job import Job
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import DASH, bytes_text
from rhot_app.ui.panels.empty_state import EmptyState
from rhot_app.ui.recordings import recordings_folder
from rhot_app.ui.replay.library import Entry, Library
from rhot_app.ui.replay.player import time_text
from rhot_app.ui.replay.summaries import Summaries
from rhot_app.ui.replay.timeline import paint_conditions

NAME, DATE, RIG, LENGTH, SIZE, BAR = range(6)
_HEADS = ("Name", "Date", "Rig", "Length", "Size", "Condition")
_SIZE = (1080, 560)
_BAR_PX, _ROW_PX = 300, 34
_CODES = Qt.ItemDataRole.UserRole


def summaries_folder() -> Path:
    """Where the summaries of recordings are kept."""
    return user_cache_path("rhot", appauthor=False) / "recordings"


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


class LibraryWindow(QDialog):
    """`open_asked` gives a recording's path; `renamed` its path before and after."""

    open_asked = Signal(object)
    renamed = Signal(object, object)

    def __init__(self, scheme: Scheme, folder: Path | None = None, cache: Path | None = None,
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Recordings")
        self.setProperty("guide", "recording")
        self.setWindowFlag(Qt.WindowType.WindowMaximizeButtonHint)
        self.resize(*_SIZE)
        self.library = Library(folder or recordings_folder(), cache or summaries_folder())
        self.summaries = Summaries(self.library, self)
        self.entries: list[Entry] = []
        self._listing: Job | None = None
        self._filling = False
        self.empty = EmptyState("No recordings yet. Press Record, or R, while a rig is open.")
        self.table = QTableWidget(0, len(_HEADS))
        self.sentence = QLabel()
        self.sentence.setWordWrap(True)
        self._bars = BarDelegate(scheme, self)
        self.open_button = _button("Open", "Track the recording and play it (Enter).")
        self.rename_button = _button("Rename", "Call the recording something else (F2).")
        self.delete_button = _button("Delete", "Delete the recording; Undo brings it back until this page is closed "
                                     "(Delete).")
        self.undo_button = _button("Undo", "Bring back the recording that was deleted last (Ctrl+Z).")
        self.folder_button = _button("Open folder", "Show the recordings in the desktop's file manager.")
        self.close_button = _button("Close", "Close this page. What was deleted is then gone for good.")
        self._style_table()
        self._lay_out()
        self._connect()
        self._show_choice()
        self.refresh()

    # -- putting it together ---------------------------------------------------------------------------------------

    def _style_table(self) -> None:
        table = self.table
        table.setHorizontalHeaderLabels(list(_HEADS))
        table.verticalHeader().hide()
        table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        table.setShowGrid(False)
        table.setAlternatingRowColors(True)
        table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        table.setEditTriggers(QAbstractItemView.EditTrigger.EditKeyPressed)
        table.setItemDelegateForColumn(BAR, self._bars)
        table.horizontalHeader().setSectionResizeMode(NAME, QHeaderView.ResizeMode.Stretch)
        for column, width in ((DATE, 190), (RIG, 150), (LENGTH, 90), (SIZE, 90), (BAR, _BAR_PX)):
            table.setColumnWidth(column, width)

    def _lay_out(self) -> None:
        buttons = QHBoxLayout()
        for button in (self.open_button, self.rename_button, self.delete_button, self.undo_button,
                       self.folder_button):
            buttons.addWidget(button)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(12)
        layout.addWidget(self.empty)
        layout.addWidget(self.table, 1)
        layout.addWidget(self.sentence)
        layout.addLayout(buttons)

    def _connect(self) -> None:
        self.table.itemSelectionChanged.connect(self._show_choice)
        self.table.itemDoubleClicked.connect(lambda item: self.open_chosen())
        self.table.itemChanged.connect(self._rename)
        self.summaries.changed.connect(self._show_summary)
        self.open_button.clicked.connect(self.open_chosen)
        self.rename_button.clicked.connect(self._edit_name)
        self.delete_button.clicked.connect(self.delete_chosen)
        self.undo_button.clicked.connect(self.undo)
        self.folder_button.clicked.connect(self.open_folder)
        self.close_button.clicked.connect(self.close)
        for key, action in (("Return", self.open_chosen), ("Delete", self.delete_chosen), ("Ctrl+Z", self.undo)):
            shortcut = QShortcut(QKeySequence(key), self.table, context=Qt.ShortcutContext.WidgetShortcut)
            shortcut.activated.connect(action)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._bars.scheme = scheme
        self.table.viewport().update()

    # -- the list --------------------------------------------------------------------------------------------------

    def refresh(self, then: Callable[[], None] = lambda: None) -> None:
        """List the folder again, in a worker; `then` is called after."""
        if self._listing is not None:
            self._listing.cancel()

        def show(entries: Any) -> None:
            self._listing = None
            self._fill(entries)
            then()

        def fail(sentence: str) -> None:
            self._listing = None
            self.sentence.setText(sentence)

        self._listing = Job(lambda progress: self.library.entries(), show, fail, None, self).start()

    def _fill(self, entries: list[Entry]) -> None:
        chosen = self.chosen
        self._filling = True
        self.entries = entries
        self.table.setRowCount(len(entries))
        for row, entry in enumerate(entries):
            self._fill_row(row, entry)
        self._filling = False
        self.empty.setVisible(not entries)
        self.table.setVisible(bool(entries))
        self.summaries.want([entry for entry in entries if not entry.problem])
        self.choose(chosen.path if chosen is not None else None)
        self._show_choice()

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
            self.table.setItem(row, column, item)
        self._show_summary(entry.path)

    def _show_summary(self, path: Path) -> None:
        """What is known of one recording now: its length and bar, or how far the work on it is."""
        row = next((row for row, entry in enumerate(self.entries) if entry.path == path and not entry.problem), None)
        if row is None:
            return
        filling, self._filling = self._filling, True
        summary = self.summaries.of(path)
        bar = self._cell(row, BAR)
        if summary is None:
            bar.setText(self.summaries.words(path))
        else:
            self._cell(row, LENGTH).setText(time_text(round(summary.duration_s)).rpartition(".")[0])
            bar.setText("")
            bar.setData(_CODES, summary.conditions)
            bar.setToolTip(summary.note or f"{summary.states} states, {summary.bookmarks} bookmarks. Green and full: "
                           "tracking; yellow: partial; red and low: lost; empty: no state.")
        self._filling = filling

    def _cell(self, row: int, column: int) -> QTableWidgetItem:
        item = self.table.item(row, column)
        assert item is not None  # every row is filled
        return item

    @property
    def chosen(self) -> Entry | None:
        """The recording that is selected."""
        rows = self.table.selectionModel().selectedRows()
        return self.entries[rows[0].row()] if rows and rows[0].row() < len(self.entries) else None

    def choose(self, path: Path | None) -> None:
        """Select a recording; the first one when it is not there."""
        row = next((row for row, entry in enumerate(self.entries) if entry.path == path), 0)
        if self.entries:
            self.table.selectRow(row)

    def _show_choice(self) -> None:
        entry = self.chosen
        self.open_button.setEnabled(entry is not None and not entry.problem)
        self.rename_button.setEnabled(entry is not None)
        self.delete_button.setEnabled(entry is not None)
        undoable = self.library.undoable
        self.undo_button.setEnabled(bool(undoable))
        said = [f"Deleted {undoable}. Undo brings it back; it is gone for good when this page is closed."
                ] if undoable else []
        if entry is not None and entry.problem:
            said.append(entry.problem)
        self.sentence.setText("\n".join(said))

    # -- what the buttons do ---------------------------------------------------------------------------------------

    def open_chosen(self) -> None:
        """Play the recording that is selected."""
        entry = self.chosen
        if entry is not None and not entry.problem:
            self.open_asked.emit(entry.path)

    def _edit_name(self) -> None:
        rows = self.table.selectionModel().selectedRows()
        if rows:
            self.table.editItem(self._cell(rows[0].row(), NAME))

    def _rename(self, item: QTableWidgetItem) -> None:
        """A name was typed."""
        if self._filling or item.column() != NAME or item.row() >= len(self.entries):
            return
        path = self.entries[item.row()].path
        try:
            renamed = self.library.rename(path, item.text())
        except RhotError as exc:
            sentence = str(exc)
            self.refresh(lambda: self.sentence.setText(sentence))
            return
        if renamed == path:
            return
        self.renamed.emit(path, renamed)
        self.refresh(lambda: self.choose(renamed))

    def delete_chosen(self) -> None:
        """Delete the recording that is selected; it lies in the trash until the page is closed."""
        entry = self.chosen
        if entry is None:
            return
        try:
            self.library.delete(entry.path)
        except RhotError as exc:
            self.sentence.setText(str(exc))
            return
        self.refresh()

    def undo(self) -> None:
        """Bring back the recording that was deleted last."""
        try:
            path = self.library.undo()
        except RhotError as exc:
            self.sentence.setText(str(exc))
            return
        if path is not None:
            self.refresh(lambda: self.choose(path))

    def open_folder(self) -> None:
        """Show the folder in the desktop's own file manager."""
        folder = self.library.folder
        if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder))):
            self.sentence.setText(f"This desktop opens no folders. The recordings lie in {folder}.")

    def changeEvent(self, event: QEvent) -> None:  # noqa: N802
        """Back from another window: look again, a recording may have been made meanwhile."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange and self.isActiveWindow() and (
                self.table.state() != QAbstractItemView.State.EditingState):
            self.refresh()

    def reject(self) -> None:
        """Escape closes the page."""
        self.close()

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """What was deleted is gone for good now; the work on summaries ends."""
        self.summaries.close()
        self.library.empty_trash()
        super().closeEvent(event)


def _button(text: str, meaning: str) -> QPushButton:
    button = QPushButton(text)
    button.setToolTip(meaning)
    button.setAutoDefault(False)
    return button
