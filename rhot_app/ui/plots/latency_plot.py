"""Latency by stage: stacked medians as bands, p50 and p99 of the whole way as lines, and the budget."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPen
from PySide6.QtWidgets import QWidget

from rhot_app.ui.backend.live import LATENCY_COLUMNS
from rhot_app.ui.models.glossary import tip
from rhot_app.ui.models.latency import BUDGET_S, STACKED
from rhot_app.ui.models.palette import STAGE_COLOURS, Scheme
from rhot_app.ui.models.words import STAGES
from rhot_app.ui.plots.legend import LegendEntry
from rhot_app.ui.plots.overflow import Line
from rhot_app.ui.plots.plot_panel import PlotPanel, newest, number

Array = NDArray[np.float64]



def _in_a_row(known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """`known` (n,) without single values between gaps: they have no width, and a fill would pair the wrong edges."""
    padded = np.concatenate([[False], known, [False]])
    return known & (padded[:-2] | padded[2:])


def _dotted(colour: str) -> QPen:
    """Round dots: Qt's own dotted line looks dashed at this width."""
    pen = pg.mkPen(colour, width=3)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    pen.setDashPattern([0.01, 2.5])
    return pen


class LatencyPlot(PlotPanel):
    """One band per stage from the bottom up in the order of the way."""

    term = "latency"
    title = "Latency by stage"
    unit = "ms"
    least_span = 15.0

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, ("p50 —", "p99 ┄"), "00.00", parent)
        self._edges = [pg.PlotCurveItem(connect="finite") for _ in range(len(STACKED) + 1)]
        self._bands = [pg.FillBetweenItem(lower, upper) for lower, upper in zip(self._edges, self._edges[1:],
                                                                                strict=False)]
        self._whole = (pg.PlotDataItem(connect="finite"), pg.PlotDataItem(connect="finite"))
        self._budget = pg.InfiniteLine(1e3 * BUDGET_S, angle=0)
        for item in (*self._edges, *self._bands, *self._whole, self._budget):
            self.plot.addItem(item)
        self.legend.setToolTip("\n".join([f"{STAGES[stage]}: {tip(stage)}" for stage in STACKED] + [tip("budget")]))
        self._colour()

    def _colour(self) -> None:
        for edge in self._edges:
            edge.setPen(None)
        for band, colour in zip(self._bands, STAGE_COLOURS, strict=False):
            fill = QColor(colour)
            fill.setAlpha(170)
            band.setBrush(fill)
        self._whole[0].setPen(pg.mkPen(self._scheme.text, width=2))
        self._whole[1].setPen(pg.mkPen(self._scheme.text, width=2, style=Qt.PenStyle.DashLine))
        self._budget.setPen(_dotted(self._scheme.accent))
        self.legend.set_entries([
            LegendEntry("budget", self._scheme.accent, Qt.PenStyle.DotLine),
            LegendEntry("all", self._scheme.text),
            *(LegendEntry(STAGES[stage], colour, band=True)
              for stage, colour in reversed(list(zip(STACKED, STAGE_COLOURS, strict=False))))])

    def _draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        stages = len(STACKED)
        if rows.shape[1] != len(LATENCY_COLUMNS):
            rows = np.full((len(seconds), len(LATENCY_COLUMNS)), np.nan)
        p50, p99 = rows[:, :stages + 1], rows[:, stages + 1:]
        medians = np.where(np.isfinite(p50[:, :stages]), p50[:, :stages], 0.0)
        heights = np.concatenate([np.zeros((len(seconds), 1)), np.cumsum(np.maximum(medians, 0.0), axis=1)], axis=1)
        heights[~_in_a_row(np.isfinite(p50[:, -1]))] = np.nan
        for k, edge in enumerate(self._edges):
            edge.setData(seconds, heights[:, k])
        self._whole[0].setData(seconds, p50[:, -1])
        self._whole[1].setData(seconds, p99[:, -1])
        order = [stages, *reversed(range(stages))]
        self.legend.set_values([("", number(1e3 * BUDGET_S, 1)),
                                *((number(newest(seconds, p50, k), 2), number(newest(seconds, p99, k), 2))
                                  for k in order)])
        self._fit(seconds, [Line("p50 of all", self._scheme.text, p50[:, -1]),
                            Line("p99 of all", self._scheme.text, p99[:, -1])])
