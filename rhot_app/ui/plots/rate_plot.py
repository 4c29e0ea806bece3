"""Rates of states and nodes as lines, lost datagrams per second as bars at the foot."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from rhot_app.ui.backend.live import LOST
from rhot_app.ui.models.palette import STAGE_COLOURS, Scheme
from rhot_app.ui.plots.legend import LegendEntry
from rhot_app.ui.plots.overflow import Line
from rhot_app.ui.plots.plot_panel import DASHES, PlotPanel, newest, number

Array = NDArray[np.float64]

class RatePlot(PlotPanel):
    """Columns: states, one per node, and last the losses per second."""

    term = "rate"
    title = "Rate and losses"
    unit = "per second"
    least_span = 50.0

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, ("",), "000.0", parent)
        self._names: tuple[str, ...] = ()
        self._curves: list[pg.PlotDataItem] = []
        self._bars = pg.BarGraphItem(x=[], height=[], width=0.1)
        self.plot.addItem(self._bars)
        self._make_curves(("states", LOST))

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
            entries.append(LegendEntry(name, colour, dash))
        entries.append(LegendEntry("lost /s", self._scheme.bad, Qt.PenStyle.SolidLine, band=True))
        self._bars.setOpts(brush=self._scheme.bad, pen=pg.mkPen(self._scheme.bad))
        self.legend.set_entries(entries)

    def _draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
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
