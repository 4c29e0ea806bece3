"""The list of all markers in the colour wizard: ticked when enough was seen, colours before and now, name, pictures."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QRect, QSize, Qt, Signal
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from rhot_app.ui.common.shapes import shape_pixmap
from rhot_app.ui.models.palette import Scheme

Rgb = tuple[int, int, int]

_CHIP = QSize(28, 18)
_ARROW_PX = 14
_TICK_PX = 28
_STATE_PX = 16
_ROW_PX = 26


@dataclass(frozen=True, slots=True)
class PaintRow:
    """One line: `state` is the name of a shape ("tick": all done, "cross": wrong), `rgb` None for a colour that is not
    known. `before`: the rig's colour, shown beside it."""

    name: str
    rgb: Rgb | None
    state: str
    text: str
    before: Rgb | None = None


class PaintList(QTableWidget):
    """`chosen` with a name when the person chooses another line."""

    chosen = Signal(str)

    def __init__(self, scheme: Scheme, heads: tuple[str, str]) -> None:
        super().__init__(0, 3)
        self._scheme = scheme
        self._rows: tuple[PaintRow, ...] = ()
        self._filling = False
        self.setHorizontalHeaderLabels(["", *heads])
        self.horizontalHeader().setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self.horizontalHeader().setSectionResizeMode(2, QHeaderView.ResizeMode.ResizeToContents)
        self.horizontalHeader().setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self.setColumnWidth(0, _TICK_PX)
        self.verticalHeader().setVisible(False)
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setShowGrid(False)
        self.setIconSize(QSize(2 * _CHIP.width() + _ARROW_PX, _CHIP.height()))
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.itemSelectionChanged.connect(self._select)

    def show_rows(self, rows: tuple[PaintRow, ...], chosen: str) -> None:
        """Show these, with one of them chosen."""
        self._filling = True
        if rows != self._rows:
            self._rows = rows
            self.setRowCount(len(rows))
            for r, row in enumerate(rows):
                self._fill(r, row)
        names = [row.name for row in rows]
        if chosen in names and self.currentRow() != names.index(chosen):
            self.selectRow(names.index(chosen))
        self._filling = False

    def _fill(self, r: int, row: PaintRow) -> None:
        tone = self._scheme.tone({"tick": "good", "cross": "bad"}.get(row.state, "neutral"))
        state = QTableWidgetItem(_state_icon(row.state, tone, self._scheme.on_accent, self.devicePixelRatioF()), "")
        chip = swatch(row.rgb, self._scheme) if row.before is None else change_of(row.before, row.rgb, self._scheme)
        name = QTableWidgetItem(chip, row.name)
        for c, item in enumerate((state, name, QTableWidgetItem(row.text))):
            self.setItem(r, c, item)

    def _select(self) -> None:
        if not self._filling and 0 <= self.currentRow() < len(self._rows):
            self.chosen.emit(self._rows[self.currentRow()].name)


def _state_icon(shape: str, tone: str, selected: str, ratio: float) -> QIcon:
    """The shape in its tone; in one that can be seen on the line that is chosen."""
    icon = QIcon()
    for mode, colour in ((QIcon.Mode.Normal, tone), (QIcon.Mode.Selected, selected)):
        icon.addPixmap(shape_pixmap(shape, colour, _STATE_PX, ratio), mode)
    return icon


def swatch(rgb: Rgb | None, scheme: Scheme) -> QIcon:
    """A patch of the colour; an empty frame for none."""
    return _patches([rgb], scheme)


def change_of(before: Rgb | None, after: Rgb | None, scheme: Scheme) -> QIcon:
    """The colour before, an arrow, and the colour after it."""
    return _patches([before, after], scheme)


def _patches(colours: list[Rgb | None], scheme: Scheme) -> QIcon:
    step = _CHIP.width() + _ARROW_PX
    pixmap = QPixmap(QSize(step * len(colours) - _ARROW_PX, _CHIP.height()))
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    for k, rgb in enumerate(colours):
        painter.setPen(QColor(scheme.border))
        painter.setBrush(QColor(*rgb) if rgb is not None else Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(k * step, 0, _CHIP.width() - 1, _CHIP.height() - 1, 3, 3)
        if k:
            painter.setPen(QColor(scheme.muted))
            painter.drawText(QRect(k * step - _ARROW_PX, 0, _ARROW_PX, _CHIP.height()), Qt.AlignmentFlag.AlignCenter,
                             "›")
    painter.end()
    icon = QIcon()
    for mode in (QIcon.Mode.Normal, QIcon.Mode.Selected):
        icon.addPixmap(pixmap, mode)
    return icon
