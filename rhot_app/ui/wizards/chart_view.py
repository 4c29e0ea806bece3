"""Charts of a result in the middle of a wizard, one below the other."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QVBoxLayout, QWidget

from rhot_app.ui.models.palette import Scheme, visible_on
from rhot_app.ui.theme import app_font
from rhot_app.ui.wizards.models.chart import Chart, Curve

_DOT_PX = 7
_FAINT_PX = 3
_WIDTH_PX = 2.0
_TEXT_PT = 11.0
_LEGEND_ROWS, _LEGEND_COLUMNS = 5, 4
_LEGEND_ROOM = 0.35  # of the chart's height, above what a large legend would cover
_BAND_ALPHA, _OWN_ALPHA = 40, 90
_FEW_DECADES = 2.5


class ChartView(QWidget):
    """Shows some `Chart`s; a chart that is the same object as before is not drawn again."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(8, 8, 8, 8)
        self._column.setSpacing(8)
        self._shown: tuple[Chart, ...] = ()
        self.plots: list[pg.PlotWidget] = []

    def show_charts(self, charts: tuple[Chart, ...]) -> None:
        """Show these instead of the last ones."""
        if len(charts) == len(self._shown) and all(a is b for a, b in zip(charts, self._shown, strict=True)):
            return
        self._shown = charts
        for plot in self.plots:
            self._column.removeWidget(plot)
            plot.deleteLater()
        self.plots = [self._draw(chart) for chart in charts]
        for plot in self.plots:
            self._column.addWidget(plot, 1)

    def _draw(self, chart: Chart) -> pg.PlotWidget:
        scheme = self._scheme
        plot = pg.PlotWidget(background=scheme.panel)
        plot.setMenuEnabled(False)
        plot.setTitle(chart.title, color=scheme.text, size=f"{_TEXT_PT + 1}pt")
        plot.showGrid(x=True, y=True, alpha=0.15)
        for side, label in (("bottom", chart.x_label), ("left", chart.y_label)):
            axis = plot.getAxis(side)
            axis.setLabel(label, color=scheme.muted)
            axis.enableAutoSIPrefix(False)
            axis.setTickFont(app_font(_TEXT_PT))
            axis.setPen(scheme.border)
            axis.setTextPen(scheme.muted)
        plot.setLogMode(x=chart.log_x, y=chart.log_y)
        columns = _LEGEND_COLUMNS if len(chart.curves) > _LEGEND_ROWS else 1
        plot.addLegend(offset=(-10, 1), labelTextColor=scheme.text, brush=pg.mkBrush(scheme.panel), colCount=columns)
        tones = iter((scheme.accent, scheme.caution, scheme.good, scheme.bad, scheme.muted) * 4)
        for curve in chart.curves:
            self._add(plot, curve, QColor(visible_on(curve.colour, scheme.panel) if curve.colour else next(tones)))
        for side, logarithmic in (("bottom", chart.log_x), ("left", chart.log_y)):
            if logarithmic:
                plot.getAxis(side).setTicks([_log_ticks(chart, side)])
        if columns > 1:
            low, high = _reach(chart)
            plot.setYRange(low, high + _LEGEND_ROOM * (high - low))
        return plot

    def _add(self, plot: pg.PlotWidget, curve: Curve, tone: QColor) -> None:
        if curve.style == "band":
            self._add_band(plot, curve, tone)
        elif curve.style in ("dots", "faint dots"):
            size = _DOT_PX if curve.style == "dots" else _FAINT_PX
            plot.plot(curve.x, curve.y, pen=None, symbol="o", symbolSize=size, symbolBrush=tone, symbolPen=None,
                      name=curve.name)
        else:
            style = Qt.PenStyle.DashLine if curve.style == "dashes" else Qt.PenStyle.SolidLine
            plot.plot(curve.x, curve.y, pen=pg.mkPen(tone, width=_WIDTH_PX, style=style), name=curve.name)

    def _add_band(self, plot: pg.PlotWidget, curve: Curve, tone: QColor) -> None:
        edge = pg.mkPen(tone, width=1.0)
        low = plot.plot(curve.x, curve.y, pen=edge, name=curve.name or None)
        high = plot.plot(curve.x, curve.high if curve.high is not None else curve.y, pen=edge)
        fill = QColor(tone)
        fill.setAlpha(_OWN_ALPHA if curve.colour else _BAND_ALPHA)
        plot.addItem(pg.FillBetweenItem(low, high, brush=fill))


def _reach(chart: Chart) -> tuple[float, float]:
    """Lowest and highest y of all curves, in the axis's own units."""
    values = np.concatenate([np.asarray(part, dtype=np.float64) for curve in chart.curves
                             for part in (curve.y, curve.high) if part is not None])
    values = np.log10(values) if chart.log_y else values
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)


def _log_ticks(chart: Chart, side: str) -> list[tuple[float, str]]:
    """1, 2, 5, 10, ...; powers of ten alone where there are many of them."""
    values = np.concatenate([curve.x if side == "bottom" else curve.y for curve in chart.curves])
    low, high = np.log10(values[values > 0.0].min()), np.log10(values[values > 0.0].max())
    steps = (1.0, 2.0, 5.0) if high - low < _FEW_DECADES else (1.0,)
    ticks = [step * 10.0**decade for decade in range(int(np.floor(low)), int(np.ceil(high)) + 1) for step in steps]
    return [(float(np.log10(tick)), f"{tick:g}") for tick in ticks]
