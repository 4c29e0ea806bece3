"""Bars of progress: what is covered, and what is still missing. A full bar has a tick too, not only another colour."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter
from PySide6.QtWidgets import QSizePolicy, QWidget

from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.shapes import paint_shape
from rhot_app.ui.theme import app_font
from rhot_app.ui.wizards.models.step import Bar

_ROW_PX = 26
_MOST_PX = 152  # of all rows together: the part of the window that is kept for them
_BAR_PX = 12
_TICK_PX = 16


class BarsView(QWidget):
    """The bars of a step, one below the other."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self.bars: tuple[Bar, ...] = ()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:  # noqa: N802
        """Room for all bars."""
        return QSize(260, self.row_px * max(len(self.bars), 1))

    @property
    def row_px(self) -> int:
        """Height of one bar's row: less where there are many."""
        return min(_ROW_PX, _MOST_PX // max(len(self.bars), 1))

    def show_bars(self, bars: tuple[Bar, ...]) -> None:
        """Other bars, or fuller ones."""
        if bars == self.bars:
            return
        if len(bars) != len(self.bars):
            self.updateGeometry()
        self.bars = bars
        self.setToolTip("\n".join(f"{bar.name}: {bar.meaning}" for bar in bars if bar.meaning))
        self.setAccessibleName(", ".join(f"{bar.name} {100 * min(bar.fraction, 1.0):.0f} %" for bar in bars))
        self.update()

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Name, bar, tick."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(app_font())
        metrics = QFontMetricsF(painter.font())
        room = max((metrics.horizontalAdvance(bar.name) for bar in self.bars), default=0.0) + 12
        for row, bar in enumerate(self.bars):
            box = QRectF(0, row * self.row_px, self.width(), self.row_px)
            painter.setPen(QColor(self._scheme.text))
            painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, bar.name)
            track = QRectF(room, box.center().y() - _BAR_PX / 2, self.width() - room - _TICK_PX - 8, _BAR_PX)
            colour = QColor(self._scheme.good if bar.full else self._scheme.accent)
            painter.setPen(QColor(self._scheme.border))
            painter.setBrush(QColor(self._scheme.panel))
            painter.drawRoundedRect(track, 4, 4)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(colour)
            filled = QRectF(track)
            filled.setWidth(track.width() * min(max(bar.fraction, 0.0), 1.0))
            painter.drawRoundedRect(filled, 4, 4)
            if bar.full:
                tick = QRectF(self.width() - _TICK_PX, box.center().y() - _TICK_PX / 2, _TICK_PX, _TICK_PX)
                paint_shape(painter, "tick", tick, colour)
        painter.end()
