"""The column beside a plot: line sample, name and newest value, so that colour is never the only key."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from rhot_app.ui.models.palette import Scheme

_SAMPLE_PX = 18


@dataclass(frozen=True, slots=True)
class LegendEntry:
    """One row. `band` draws a filled square instead of a line; `dash` is a pen's style."""

    name: str
    colour: str
    dash: Qt.PenStyle = Qt.PenStyle.SolidLine
    band: bool = False


class Legend(QWidget):
    """Rows of samples, names and values under optional column heads, painted in one go."""

    def __init__(self, scheme: Scheme, heads: tuple[str, ...], widest_value: str,
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self._heads = heads
        self._widest = widest_value
        self.entries: list[LegendEntry] = []
        self.values: list[tuple[str, ...]] = []
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.update()

    def set_entries(self, entries: list[LegendEntry]) -> None:
        """Other rows."""
        if entries != self.entries:
            self.entries = entries
            self.values = [("",) * len(self._heads)] * len(entries)
            self.updateGeometry()
            self.update()

    def set_values(self, values: list[tuple[str, ...]]) -> None:
        """The newest values, one text per head and row."""
        if values != self.values:
            self.values = values
            self.update()

    def _small_font_metrics(self) -> tuple[QFontMetricsF, float]:
        metrics = QFontMetricsF(self.font())
        return metrics, metrics.horizontalAdvance(self._widest) + 8

    def sizeHint(self) -> QSize:  # noqa: N802
        """Room for the longest name and every value."""
        metrics, value = self._small_font_metrics()
        name = max((metrics.horizontalAdvance(entry.name) for entry in self.entries), default=40.0)
        return QSize(round(_SAMPLE_PX + 6 + name + 4 + value * len(self._heads) + 4), 60)

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Heads, then one line per row; rows move closer together when there is little room."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        metrics, value_width = self._small_font_metrics()
        rows = len(self.entries) + (1 if any(self._heads) else 0)
        if not self.entries:
            return
        step = min(metrics.height() + 2, self.height() / rows)
        y = 0.0
        if any(self._heads):
            painter.setPen(QColor(self._scheme.muted))
            self._paint_values(painter, self._heads, y, step, value_width)
            y += step
        for entry, values in zip(self.entries, self.values, strict=True):
            self._paint_sample(painter, entry, y + step / 2)
            painter.setPen(QColor(self._scheme.text))
            painter.drawText(QRectF(_SAMPLE_PX + 6, y, self.width(), step), Qt.AlignmentFlag.AlignVCenter, entry.name)
            self._paint_values(painter, values, y, step, value_width)
            y += step
        painter.end()

    def _paint_values(self, painter: QPainter, values: tuple[str, ...], y: float, step: float, width: float) -> None:
        left = self.width() - width * len(values) - 4
        for k, value in enumerate(values):
            painter.drawText(QRectF(left + k * width, y, width, step),
                             Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, value)

    def _paint_sample(self, painter: QPainter, entry: LegendEntry, y: float) -> None:
        colour = QColor(entry.colour)
        if entry.band:
            painter.fillRect(QRectF(3, y - 5, _SAMPLE_PX - 6, 10), colour)
        else:
            painter.setPen(QPen(colour, 2.5, entry.dash, Qt.PenCapStyle.FlatCap))
            painter.drawLine(0, round(y), _SAMPLE_PX, round(y))
