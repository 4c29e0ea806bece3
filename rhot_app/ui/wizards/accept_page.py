"""The last page of every wizard: figures before and after side by side, and the way back."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QLabel, QPushButton, QTableWidget, QTableWidgetItem

from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.theme import app_font
from rhot_app.ui.wizards.colour_list import swatch
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.proposal import Row
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.page import Page

HEADS = ("", "before", "after")


class AcceptPage(Page):
    """`restore_asked` when the person wants the old state back; the window does it."""

    restore_asked = Signal()

    def __init__(self, step: AcceptStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._accept = step
        self._rows: tuple[Row, ...] | None = None
        self.table = RowTable(scheme)
        self.centre = self.table
        self.restore_button = QPushButton("Restore the old one")
        self.restore_button.setAutoDefault(False)
        self.restore_button.setToolTip("Brings back what was there before, in the engine and in the file. The new "
                                       "calibration is kept among the earlier ones.")
        self.restore_button.clicked.connect(self.restore_asked)
        note = QLabel("Nothing was saved so far. What is there now is kept, and can be brought back at any time with "
                      "Calibrate, Bring back an earlier calibration.")
        note.setWordWrap(True)
        note.setProperty("muted", True)
        self.column.addWidget(note)
        self.column.addWidget(self.restore_button)
        self.column.addStretch(1)
        self._note = note

    def show_view(self, view: StepView) -> None:
        """The rows of the proposal, and the way back while there is one."""
        proposal = self._accept.proposal
        rows = proposal.rows if proposal is not None else ()
        if rows != self._rows:
            self._rows = rows
            self.table.show_rows(rows)
        self._note.setVisible(self._accept.state == "proposed")
        self.restore_button.setVisible(self._accept.restorable)


class RowTable(QTableWidget):
    """Rows of before and after; what changes is bold."""

    def __init__(self, scheme: Scheme, heads: tuple[str, str, str] = HEADS) -> None:
        super().__init__(0, len(heads))
        self._scheme = scheme
        self.setHorizontalHeaderLabels(list(heads))
        self.verticalHeader().setVisible(False)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setShowGrid(False)
        self.setWordWrap(True)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.horizontalHeader().setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        self.horizontalHeader().setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)

    def show_rows(self, rows: tuple[Row, ...]) -> None:
        """Show these instead of the last ones."""
        self.setRowCount(len(rows))
        for r, row in enumerate(rows):
            for c, text in enumerate((row.what, row.before, row.after)):
                item = QTableWidgetItem(text)
                item.setFont(app_font(13.0, bold=c == 2 and row.changed))
                item.setForeground(QColor(self._scheme.muted if c == 0 else self._scheme.text))
                if row.swatches is not None and c:
                    item.setIcon(swatch(row.swatches[c - 1], self._scheme))
                self.setItem(r, c, item)
