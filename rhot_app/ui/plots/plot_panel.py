"""What every plot has: title, named axes in units, legend, pause, reset, copy as CSV; time runs left to right."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QGuiApplication, QPainter, QPen, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QMenu, QPushButton, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from rhot_app.ui.common.disposal import plot_widget
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.series import Peak, Series, peaks_above, round_top, to_csv, usual_top
from rhot_app.ui.models.words import tip

# -- Marks of values above a plot's axis -------------------------------------------------------------------------------

Array = NDArray[np.float64]

_SIZE_PX = 11
_pen, _brush = functools.cache(pg.mkPen), functools.cache(pg.mkBrush)
"""By colour. pyqtgraph draws and keeps a triangle for every pen that it has not met."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line that may leave the axis: its name, colour and values (n,)."""

    name: str
    colour: str
    values: Array


class OverflowMarks:
    """The triangles of one plot."""

    def __init__(self, plot: pg.PlotWidget, unit: str) -> None:
        self._unit = unit
        self._item = pg.ScatterPlotItem(symbol="t1", size=_SIZE_PX, pxMode=True, hoverable=True, tip=self._words)
        self._item.setZValue(10)
        plot.addItem(self._item)
        self.peaks: list[tuple[str, Peak]] = []

    def show(self, seconds: Array, lines: list[Line], top: float) -> None:
        """Mark every run of every line above `top`."""
        found = [(line, peak) for line in lines for peak in peaks_above(seconds, line.values, top)]
        self.peaks = [(line.name, peak) for line, peak in found]
        self._item.setData([{"pos": (peak.second, top), "brush": _brush(line.colour), "pen": _pen(line.colour),
                             "data": (line.name, peak.value)} for line, peak in found])

    @property
    def marks(self) -> list[tuple[float, float, str]]:
        """Each triangle's place and colour."""
        return [(point.pos().x(), point.pos().y(), point.brush().color().name()) for point in self._item.points()]

    def _words(self, x: float, y: float, data: tuple[str, float]) -> str:
        return tr("{name}: {value:.3g} {unit}, above the axis", name=data[0], value=data[1], unit=self._unit)


# -- Legend: line sample, name and newest value ------------------------------------------------------------------------

_SAMPLE_PX = 18
_LEAST_STEP = 0.85  # of a line's height, from row to row: closer, and letters touch


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
        self._first = 0  # of the rows that are shown, where not all have room
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
        """Heads, then one line per row; rows move closer together when there is little room, and the last ones wait for
        the wheel where they could not be read."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        metrics, value_width = self._small_font_metrics()
        rows = len(self.entries) + (1 if any(self._heads) else 0)
        if not self.entries:
            return
        step = min(metrics.height() + 2, max(self.height() / rows, _LEAST_STEP * metrics.height()))
        fit = int(self.height() / step) - (1 if any(self._heads) else 0)
        more = len(self.entries) - fit
        shown = slice(None) if more <= 0 else slice(min(self._first, more + 1), min(self._first, more + 1) + fit - 1)
        y = 0.0
        if any(self._heads):
            painter.setPen(QColor(self._scheme.muted))
            self._paint_values(painter, self._heads, y, step, value_width)
            y += step
        for entry, values in zip(self.entries[shown], self.values[shown], strict=True):
            self._paint_sample(painter, entry, y + step / 2)
            painter.setPen(QColor(self._scheme.text))
            painter.drawText(QRectF(_SAMPLE_PX + 6, y, self.width(), step), Qt.AlignmentFlag.AlignVCenter, entry.name)
            self._paint_values(painter, values, y, step, value_width)
            y += step
        if more > 0:
            painter.setPen(QColor(self._scheme.muted))
            place = QRectF(0.0, y, self.width(), step)
            painter.drawText(place, Qt.AlignmentFlag.AlignVCenter, tr("{more} more: scroll", more=more + 1))
        painter.end()

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802
        """The rows that have no room."""
        self._first = min(max(self._first - (1 if event.angleDelta().y() > 0 else -1), 0), len(self.entries))
        self.update()
        event.accept()

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


# -- What every plot has: axes, legend, pause, reset, copy -------------------------------------------------------------

SPAN_S = 30.0
_OLD_S = 1.5  # a figure older than this is not the present one any more
DASHES = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine, Qt.PenStyle.DashDotLine)


class PlotHead(QWidget):
    """Title and buttons; those that do not fit stand behind an arrow."""

    def __init__(self, title: QLabel, buttons: list[QPushButton]) -> None:
        super().__init__()
        self._title, self._buttons = title, buttons
        self.arrow = QToolButton()
        self.arrow.setArrowType(Qt.ArrowType.RightArrow)
        self.arrow.setAutoRaise(True)
        self.arrow.setToolTip(tr("More buttons"))
        self.arrow.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.arrow.setMenu(QMenu(self.arrow))
        self._fill_menu()
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(title, 1)
        for widget in (*buttons, self.arrow):
            layout.addWidget(widget)
        self.arrow.hide()

    def _fill_menu(self) -> None:
        menu = self.arrow.menu()
        menu.clear()
        for button in self._buttons[1:]:
            menu.addAction(button.text()).triggered.connect(button.click)

    def leave_out(self, button: QPushButton) -> None:
        """Do without one of the buttons."""
        button.hide()
        self._buttons.remove(button)
        self._fill_menu()

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        """Title, the first button and the arrow."""
        least = [self._title, self._buttons[0], self.arrow]
        return QSize(sum(widget.sizeHint().width() for widget in least),
                     max(widget.sizeHint().height() for widget in least))

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """All buttons, or the first one and the arrow."""
        super().resizeEvent(event)
        whole = sum(widget.sizeHint().width() for widget in (self._title, *self._buttons)) <= self.width()
        for button in self._buttons[1:]:
            button.setVisible(whole)
        self.arrow.setVisible(not whole)


class PlotPanel(QWidget):
    """Base of the plots. A subclass draws in `draw(seconds, rows)`; `refresh` gives it the window to show.

    While paused the window stands still; the data go on and are there again when the pause ends. `copied` confirms a
    copy with a sentence.
    """

    copied = Signal(str)

    term = ""
    title = ""
    unit = ""
    least_span = 1.0

    def __init__(self, scheme: Scheme, heads: tuple[str, ...], widest_value: str,
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setProperty("guide", "plots")
        self._scheme = scheme
        self._window: tuple[Array, Array, tuple[str, ...]] = (np.empty(0), np.empty((0, 0)), ())
        self._reset_ns = 0
        self.pause_button = self._button(tr("Pause"), tr("Stop the plot to look at it; the measurement goes on."))
        self.pause_button.setCheckable(True)
        self.reset_button = self._button(tr("Reset"), tr("Begin the plot anew and fit the axes."))
        self.copy_button = self._button(tr("Copy CSV"),
                                        tr("Copy what the plot shows to the clipboard as comma-separated text."))
        self.reset_button.clicked.connect(self.begin_anew)
        self.copy_button.clicked.connect(self.copy_csv)
        self.plot = plot_widget()
        self.legend = Legend(scheme, heads, widest_value)
        self._lay_out()
        self._style_plot()
        self.overflow = OverflowMarks(self.plot, tr(self.unit))

    def _button(self, text: str, meaning: str) -> QPushButton:
        button = QPushButton(text)
        button.setProperty("flat", True)
        button.setToolTip(meaning)
        return button

    def _lay_out(self) -> None:
        label = QLabel(tr(self.title))
        label.setProperty("title", True)
        label.setToolTip(tip(self.term))
        self.setToolTip(tip(self.term))
        self.head = PlotHead(label, [self.pause_button, self.reset_button, self.copy_button])
        body = QHBoxLayout()
        body.setSpacing(6)
        body.addWidget(self.plot, 1)
        body.addWidget(self.legend)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 2, 8, 4)
        layout.setSpacing(0)
        layout.addWidget(self.head)
        layout.addLayout(body, 1)

    def _style_plot(self) -> None:
        self.plot.setBackground(self._scheme.panel)
        self.plot.hideButtons()
        self.plot.setMinimumHeight(72)
        item = self.plot.getPlotItem()
        item.showGrid(x=True, y=True, alpha=0.25)
        item.setXRange(-SPAN_S, 0.0, padding=0.0)
        item.setMouseEnabled(x=False, y=True)
        item.getViewBox().setLimits(yMin=0.0)
        style = {"color": self._scheme.muted, "font-size": "10pt"}
        for side in ("left", "bottom"):
            axis = item.getAxis(side)
            axis.setPen(pg.mkPen(self._scheme.border))
            axis.setTextPen(pg.mkPen(self._scheme.muted))
        item.setLabel("left", tr(self.unit), **style)
        item.setLabel("bottom", tr("time before now [s]"), **style)
        for side in ("left", "bottom"):  # after the labels, which reset it; switching it off would keep an old scale
            item.getAxis(side).setSIPrefixEnableRanges(())
            item.getAxis(side).updateAutoSIPrefix()
        item.getAxis("left").setWidth(48)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.legend.set_scheme(scheme)
        self._style_plot()
        self._colour()
        self._redraw()

    @property
    def seconds(self) -> Array:
        """(n,) s, before now: the times of what the plot shows."""
        return self._window[0]

    @property
    def paused(self) -> bool:
        """Whether the plot stands still."""
        return self.pause_button.isChecked()

    def refresh(self, series: Series, now_ns: int) -> None:
        """Show the last seconds of `series`, unless paused."""
        if self.paused:
            return
        if self._reset_ns == -1:
            self._reset_ns = now_ns
        seconds, rows = series.window(now_ns, min(SPAN_S, max(0.0, (now_ns - self._reset_ns) * 1e-9)))
        self._window = (seconds, rows, series.names)
        self._redraw()

    def _redraw(self) -> None:
        seconds, rows, names = self._window
        self.draw(seconds, rows, names)

    def _colour(self) -> None:
        """Give the lines the scheme's colours."""
        raise TypeError(f"{type(self).__name__} has no colours")

    def draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        """Draw `rows` (n, columns) over `seconds` (n,)."""
        raise TypeError(f"{type(self).__name__} does not draw")

    def _fit(self, seconds: Array, lines: list[Line]) -> None:
        """Let the vertical axis begin at zero and end at a round value that the usual values stay below; mark what does
        not."""
        values = np.concatenate([line.values for line in lines]) if lines else np.empty(0)
        high = round_top(usual_top(values), self.least_span)
        self.plot.setYRange(0.0, high, padding=0.02)
        self.overflow.show(seconds, lines, high)

    def begin_anew(self) -> None:
        """Forget what was before this moment, and leave a pause."""
        self.pause_button.setChecked(False)
        self._reset_ns = -1
        self.plot.getPlotItem().setXRange(-SPAN_S, 0.0, padding=0.0)

    def csv(self) -> str:
        """What the plot shows as comma-separated text."""
        seconds, rows, names = self._window
        return to_csv(seconds, rows, names, self.unit)

    def copy_csv(self) -> None:
        """Put `csv` on the clipboard."""
        QGuiApplication.clipboard().setText(self.csv())
        count = len(self._window[0])
        if count:
            self.copied.emit(tr("Copied “{title}” to the clipboard: {n} row of comma-separated text.",
                                "Copied “{title}” to the clipboard: {n} rows of comma-separated text.", count,
                                title=tr(self.title)))
        else:
            self.copied.emit(tr("“{title}” shows nothing yet, so only the headings were copied.", title=tr(self.title)))


def newest(seconds: Array, rows: Array, column: int) -> float:
    """Last value of a column; NaN when there is none or it is old."""
    return float(rows[-1, column]) if len(rows) and seconds[-1] > -_OLD_S else float("nan")


def number(value: float, digits: int) -> str:
    """A value with a fixed number of digits, a dash when there is none."""
    return f"{value:.{digits}f}" if np.isfinite(value) else "–"
