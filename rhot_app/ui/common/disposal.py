"""Deletes windows so that nothing of them stays.

Qt keeps for good what a style sheet says of a part that was never polished, because it was never shown, and of one that
has its style from another part: the line in a box of numbers or choices, a viewport. That is up to a kB for each.
QStyleSheetStyle hears of the end only of parts that are polished and have a sheet of their own, or could have one.
"""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget


def dispose(window: QWidget) -> None:
    """Delete a window that is closed, once its events are done."""
    release_style(window)
    window.deleteLater()


def release_style(widget: QWidget) -> None:
    """Have Qt forget about the style of a widget and its parts when they are deleted; none of them is in sight."""
    for part in (widget, *widget.findChildren(QWidget)):
        part.ensurePolished()
        if not part.testAttribute(Qt.WidgetAttribute.WA_StyleSheet):
            part.setStyleSheet("border: none")


def plot_widget(**options: Any) -> pg.PlotWidget:
    """A plot without menus. pyqtgraph makes the fields of its menus all the same, and shows them to nobody."""
    plot = pg.PlotWidget(enableMenu=False, **options)
    for fields in vars(plot.getPlotItem().ctrl).values():
        if isinstance(fields, QWidget):
            release_style(fields)
    return plot
