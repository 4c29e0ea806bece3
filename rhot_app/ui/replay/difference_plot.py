"""How far the fingertips of two runs are apart over time, mm, with the median and the 95th percentile of them all."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtWidgets import QWidget

from rhot_app.hand.skeleton import FINGERS
from rhot_app.ui.models.palette import STAGE_COLOURS, Scheme, visible_on
from rhot_app.ui.plots.legend import LegendEntry
from rhot_app.ui.plots.overflow import Line
from rhot_app.ui.plots.plot_panel import DASHES, PlotPanel, newest, number
from rhot_app.ui.replay.comparison import Comparison

Array = NDArray[np.float64]


class DifferencePlot(PlotPanel):
    """One line per finger."""

    term = "fingertip difference"
    title = "Fingertip difference"
    unit = "mm"
    least_span = 1.0

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, ("now", "p50", "p95"), "000.0", parent)
        self._whole: list[tuple[str, str]] = [("–", "–")] * len(FINGERS)
        self._curves: list[pg.PlotDataItem] = []
        self._colour()

    def show_comparison(self, comparison: Comparison) -> None:
        """Another pair of runs."""
        median, p95 = comparison.percentiles_mm(50.0, 95.0)
        self._whole = [(number(low, 1), number(high, 1)) for low, high in zip(median, p95, strict=True)]

    def _colour(self) -> None:
        for curve in self._curves:
            self.plot.removeItem(curve)
        self._curves, entries = [], []
        for k, finger in enumerate(FINGERS):
            colour = visible_on(STAGE_COLOURS[k], self._scheme.panel)
            dash = DASHES[k % len(DASHES)]
            self._curves.append(self.plot.plot(pen=pg.mkPen(colour, width=2, style=dash), connect="finite"))
            entries.append(LegendEntry(finger, colour, dash))
        self.legend.set_entries(entries)

    def _draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        if rows.shape[1] != len(self._curves):
            rows = np.full((len(seconds), len(self._curves)), np.nan)
        for k, curve in enumerate(self._curves):
            curve.setData(seconds, rows[:, k])
        self.legend.set_values([(number(newest(seconds, rows, k), 1), *whole) for k, whole in enumerate(self._whole)])
        self._fit(seconds, [Line(entry.name, entry.colour, rows[:, k]) for k, entry in enumerate(self.legend.entries)])
