"""Jitter of each marker over time, mm, in the markers' own colours with a dash pattern each."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtWidgets import QWidget

from rhot_app.project import Rig
from rhot_app.ui.models.palette import Scheme, hex_of, visible_on
from rhot_app.ui.models.rows import short_name
from rhot_app.ui.plots.legend import LegendEntry
from rhot_app.ui.plots.overflow import Line
from rhot_app.ui.plots.plot_panel import DASHES, PlotPanel, newest, number

Array = NDArray[np.float64]


class JitterPlot(PlotPanel):
    """One line per marker."""

    term = "jitter"
    title = "Jitter per marker"
    unit = "mm rms"
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
            entries.append(LegendEntry(short_name(marker.id), colour, dash))
        self.legend.set_entries(entries)

    def _draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        if rows.shape[1] != len(self._curves):
            rows = np.full((len(seconds), len(self._curves)), np.nan)
        for k, curve in enumerate(self._curves):
            curve.setData(seconds, rows[:, k])
        self.legend.set_values([(number(newest(seconds, rows, k), 2),) for k in range(len(self._curves))])
        self._fit(seconds, [Line(entry.name, entry.colour, rows[:, k]) for k, entry in enumerate(self.legend.entries)])
