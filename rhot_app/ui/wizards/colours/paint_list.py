"""The list of all markers in the colour wizard: ticked when enough was seen, colours before and now, name, pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QHeaderView

from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.common.shapes import shape_pixmap
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.wizards.framework.swatches import ARROW_PX, CHIP, Rgb, change_of, swatch

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


class PaintList(RecordTable[PaintRow]):
    """`picked` with a name when the person chooses another line."""

    picked = Signal(str)

    def __init__(self, scheme: Scheme, heads: tuple[str, str]) -> None:
        super().__init__((Column("", lambda row: "", roles=self._state),
                          Column(tr(heads[0]), lambda row: marker_name(row.name), roles=self._patch),
                          Column(tr(heads[1]), attrgetter("text"), roles=lambda row: {
                              Qt.ItemDataRole.ToolTipRole: row.text})))
        self._scheme = scheme
        self._filling = False
        self.horizontalHeader().setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        self.horizontalHeader().setStretchLastSection(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setColumnWidth(0, _TICK_PX)
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setShowGrid(False)
        self.setIconSize(QSize(2 * CHIP.width() + ARROW_PX, CHIP.height()))
        self.chosen_changed.connect(self._select)

    def show_rows(self, rows: tuple[PaintRow, ...], chosen: str) -> None:
        """Show these, with one of them chosen."""
        self._filling = True
        if list(rows) != self.records:
            self.show_records(rows)
        names = [row.name for row in rows]
        if chosen in names and self.chosen_rows != [names.index(chosen)]:
            self.selectRow(names.index(chosen))
        self._filling = False

    def _state(self, row: PaintRow) -> Mapping[int, QIcon]:
        tone = self._scheme.tone({"tick": "good", "cross": "bad"}.get(row.state, "neutral"))
        return {Qt.ItemDataRole.DecorationRole: _state_icon(row.state, tone, self._scheme.on_accent,
                                                            self.devicePixelRatioF())}

    def _patch(self, row: PaintRow) -> Mapping[int, QIcon]:
        return {Qt.ItemDataRole.DecorationRole: swatch(row.rgb, self._scheme) if row.before is None else
                change_of(row.before, row.rgb, self._scheme)}

    def _select(self) -> None:
        if not self._filling and self.chosen is not None:
            self.picked.emit(self.chosen.name)


def _state_icon(shape: str, tone: str, selected: str, ratio: float) -> QIcon:
    """The shape in its tone; in one that can be seen on the line that is chosen."""
    icon = QIcon()
    for mode, colour in ((QIcon.Mode.Normal, tone), (QIcon.Mode.Selected, selected)):
        icon.addPixmap(shape_pixmap(shape, colour, _STATE_PX, ratio), mode)
    return icon
