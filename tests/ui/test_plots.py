"""The plots as a person uses them: paused, begun anew, copied, read."""

from __future__ import annotations

import numpy as np
import pytest
from pyqtgraph import InfLineLabel, TextItem
from PySide6.QtGui import QGuiApplication

from rhot_app.ui.backend.live import LATENCY_COLUMNS


def test_a_plot_pauses_resets_and_copies(tracking):
    plot = tracking.window.screen_parts.jitter
    tracking.until(lambda: tracking.let_pass(0.1) or len(plot.csv().splitlines()) > 12)
    tracking.click(plot.pause_button)
    standing, rate = plot.csv(), tracking.window.screen_parts.rate
    drawn = rate.csv()
    tracking.until(lambda: tracking.let_pass(0.1) or rate.csv() != drawn)
    assert plot.csv() == standing
    tracking.click(plot.copy_button)
    lines = QGuiApplication.clipboard().text().splitlines()
    names = ("thumb", "index", "middle", "ring", "little", "wrist")
    assert lines[0] == ",".join(["time [s]", *(f"{name} [mm rms]" for name in names)])
    tracking.until(lambda: tracking.said("Copied", "Jitter per marker"))
    assert lines == standing.splitlines() and float(lines[-1].split(",")[1]) > 0.1
    tracking.click(plot.reset_button)
    assert not plot.paused
    tracking.until(lambda: tracking.let_pass(0.1) or 1 < len(plot.csv().splitlines()) < len(lines))


def test_every_plot_has_names_units_and_values(tracking):
    parts = tracking.window.screen_parts
    tracking.until(lambda: all(any(value[0] not in ("", "–") for value in plot.legend.values)
                               for plot in (parts.jitter, parts.latency, parts.rate)))
    for plot in (parts.jitter, parts.latency, parts.rate):
        item = plot.plot.getPlotItem()
        assert item.getAxis("left").labelText == plot.unit and "[s]" in item.getAxis("bottom").labelText
    assert [entry.name for entry in parts.rate.legend.entries] == ["states", "left", "right", "lost /s"]
    assert parts.latency.legend.entries[-1].name == "detect"


def test_a_spike_of_jitter_is_a_triangle_at_the_edge(tracking):
    plot = tracking.window.screen_parts.jitter
    seconds = np.linspace(-10.0, 0.0, 100)
    rows = np.full((100, 6), 0.5)
    rows[40:46, 2] = 9.0
    plot.pause_button.setChecked(True)
    plot.draw(seconds, rows, ())
    top = plot.plot.viewRange()[1][1]
    assert top < 1.5 and [(name, peak.value) for name, peak in plot.overflow.peaks] == [("middle", 9.0)]
    ((_, height, colour),) = plot.overflow.marks
    assert height <= top and colour == plot.legend.entries[2].colour


def test_the_budget_is_named_beside_the_plot_and_not_over_its_lines(tracking):
    plot = tracking.window.screen_parts.latency
    assert plot.legend.entries[0].name == "budget"
    assert not any(isinstance(item, TextItem | InfLineLabel) for item in plot.plot.scene().items())
    tracking.until(lambda: plot.legend.values[0] == ("", "11.1"))


def test_a_gap_stays_a_gap_in_the_bands(tracking):
    plot = tracking.window.screen_parts.latency
    plot.pause_button.setChecked(True)
    seconds = np.linspace(-10.0, 0.0, 101)
    rows = np.full((101, len(LATENCY_COLUMNS)), 2.0)
    rows[30:40] = rows[41:50] = np.nan
    plot.draw(seconds, rows, LATENCY_COLUMNS)
    for band in plot.bands:
        widths = sorted(polygon.boundingRect().width() for polygon in band.path().toSubpathPolygons())
        assert widths == pytest.approx([2.9, 5.0])
        assert all(polygon.boundingRect().right() < -7.05 or polygon.boundingRect().left() > -5.05
                   for polygon in band.path().toSubpathPolygons())


def test_small_values_keep_their_unit(tracking):
    """The axis says millimetres, so it must not turn to micrometres by itself when values are small."""
    axis = tracking.window.screen_parts.jitter.plot.getPlotItem().getAxis("left")
    axis.setRange(0.0, 0.001)
    tracking.window.appearance.set_scheme("dark")
    assert axis.autoSIPrefixScale == 1.0
