"""Triangles at the upper edge of a plot: here a line leaves the axis, and the tooltip says how far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray

from rhot_app.ui.models.axis_range import Peak, peaks_above

Array = NDArray[np.float64]

_SIZE_PX = 11


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
        self._item.setData([{"pos": (peak.second, top), "brush": line.colour, "pen": line.colour,
                             "data": (line.name, peak.value)} for line, peak in found])

    def _words(self, x: float, y: float, data: tuple[str, float]) -> str:
        return f"{data[0]}: {data[1]:.3g} {self._unit}, above the axis"
