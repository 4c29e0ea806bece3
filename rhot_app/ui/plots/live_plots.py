"""The live plots: jitter of each marker, latency by stage, rates and losses."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPen
from PySide6.QtWidgets import QWidget

from rhot_app.charts import hex_of
from rhot_app.latency import STACKED
from rhot_app.project import Rig
from rhot_app.ui.backend.live import LATENCY_COLUMNS, LOST
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.meters import BUDGET_S
from rhot_app.ui.models.palette import STAGE_COLOURS, Scheme, visible_on
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.models.words import STAGES, tip
from rhot_app.ui.plots.plot_panel import DASHES, LegendEntry, Line, PlotPanel, newest, number

Array = NDArray[np.float64]


class JitterPlot(PlotPanel):
    """One line per marker."""

    term = "jitter"
    title = tr_noop("Jitter per marker")
    unit = tr_noop("mm rms")
    least_span = 0.5

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, ("",), "00.00", parent)
        self._rig: Rig | None = None
        self._curves: list[pg.PlotDataItem] = []

    def _colour(self) -> None:
        self.show_rig(self._rig)

    def show_rig(self, rig: Rig | None) -> None:
        """Lines for another marker set."""
        self._rig = rig
        for curve in self._curves:
            self.plot.removeItem(curve)
        self._curves, entries = [], []
        for k, marker in enumerate(rig.markers.markers if rig is not None else ()):
            colour = visible_on(hex_of(marker.display_rgb), self._scheme.panel)
            dash = DASHES[k % len(DASHES)]
            self._curves.append(self.plot.plot(pen=pg.mkPen(colour, width=2, style=dash), connect="finite"))
            entries.append(LegendEntry(marker_name(marker.id), colour, dash))
        self.legend.set_entries(entries)

    def draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        """Columns: one per marker, in the order of the marker set."""
        if rows.shape[1] != len(self._curves):
            rows = np.full((len(seconds), len(self._curves)), np.nan)
        for k, curve in enumerate(self._curves):
            curve.setData(seconds, rows[:, k])
        self.legend.set_values([(number(newest(seconds, rows, k), 2),) for k in range(len(self._curves))])
        self._fit(seconds, [Line(entry.name, entry.colour, rows[:, k]) for k, entry in enumerate(self.legend.entries)])


# -- Latency by stage --------------------------------------------------------------------------------------------------

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
    """One of `bands` per stage from the bottom up in the order of the way."""

    term = "latency"
    title = tr_noop("Latency by stage")
    unit = "ms"
    least_span = 15.0

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, ("p50 —", "p99 ┄"), "00.00", parent)
        self._edges = [pg.PlotCurveItem(connect="finite") for _ in range(len(STACKED) + 1)]
        self.bands = [pg.FillBetweenItem(lower, upper) for lower, upper in zip(self._edges, self._edges[1:],
                                                                                strict=False)]
        self._whole = (pg.PlotDataItem(connect="finite"), pg.PlotDataItem(connect="finite"))
        self._budget = pg.InfiniteLine(1e3 * BUDGET_S, angle=0)
        for item in (*self._edges, *self.bands, *self._whole, self._budget):
            self.plot.addItem(item)
        self.legend.setToolTip("\n".join([f"{tr(STAGES[stage])}: {tip(stage)}" for stage in STACKED] + [tip("budget")]))
        self._colour()

    def _colour(self) -> None:
        for edge in self._edges:
            edge.setPen(None)
        for band, colour in zip(self.bands, STAGE_COLOURS, strict=False):
            fill = QColor(colour)
            fill.setAlpha(170)
            band.setBrush(fill)
        self._whole[0].setPen(pg.mkPen(self._scheme.text, width=2))
        self._whole[1].setPen(pg.mkPen(self._scheme.text, width=2, style=Qt.PenStyle.DashLine))
        self._budget.setPen(_dotted(self._scheme.accent))
        self.legend.set_entries([
            LegendEntry(tr("budget"), self._scheme.accent, Qt.PenStyle.DotLine),
            LegendEntry(tr("all"), self._scheme.text),
            *(LegendEntry(tr(STAGES[stage]), colour, band=True)
              for stage, colour in reversed(list(zip(STACKED, STAGE_COLOURS, strict=False))))])

    def draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        """Columns: the medians of the stages and of all, then their 99th percentiles."""
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
        self._fit(seconds, [Line(tr("p50 of all"), self._scheme.text, p50[:, -1]),
                            Line(tr("p99 of all"), self._scheme.text, p99[:, -1])])


# -- Rates and lost datagrams ------------------------------------------------------------------------------------------

class RatePlot(PlotPanel):
    """States and datagrams per second, and what is lost of them."""

    term = "rate"
    title = tr_noop("Rate and losses")
    unit = tr_noop("per second")
    least_span = 50.0

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, ("",), "000.0", parent)
        self._names: tuple[str, ...] = ()
        self._curves: list[pg.PlotDataItem] = []
        self._bars = pg.BarGraphItem(x=[], height=[], width=0.1)
        self.plot.addItem(self._bars)
        self._make_curves((tr_noop("states"), LOST))

    def _colour(self) -> None:
        self._make_curves(self._names)

    def _make_curves(self, names: tuple[str, ...]) -> None:
        for curve in self._curves:
            self.plot.removeItem(curve)
        self._names, self._curves, entries = names, [], []
        for k, name in enumerate(names[:-1]):
            colour = self._scheme.text if k == 0 else STAGE_COLOURS[(k - 1) % len(STAGE_COLOURS)]
            dash = DASHES[k % len(DASHES)]
            self._curves.append(self.plot.plot(pen=pg.mkPen(colour, width=2, style=dash), connect="finite"))
            entries.append(LegendEntry(name if k else tr(name), colour, dash))
        entries.append(LegendEntry(tr("lost /s"), self._scheme.bad, Qt.PenStyle.SolidLine, band=True))
        self._bars.setOpts(brush=self._scheme.bad, pen=pg.mkPen(self._scheme.bad))
        self.legend.set_entries(entries)

    def draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        """Columns: states, one per node, and last the losses per second."""
        if names != self._names and names:
            self._make_curves(names)
        if rows.shape[1] != len(self._names):
            return
        for k, curve in enumerate(self._curves):
            curve.setData(seconds, rows[:, k])
        lost = rows[:, -1]
        some = np.isfinite(lost) & (lost > 0)
        self._bars.setOpts(x=seconds[some], height=lost[some], width=0.1)
        self.legend.set_values([(number(newest(seconds, rows, k), 1),) for k in range(len(self._names))])
        self._fit(seconds, [Line(entry.name, entry.colour, rows[:, k]) for k, entry in enumerate(self.legend.entries)])
