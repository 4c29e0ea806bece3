"""Deletes windows so that nothing of them stays.

Qt keeps for good what a style sheet says of a part that was never polished, because it was never shown, and of the line
in a box of numbers or choices, up to a kB each (QStyleSheetStyle hears of the end only of a part that has a style). A
part that is polished, and a line with a sheet of its own, are forgotten when they are deleted.
"""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg
from PySide6.QtWidgets import QLineEdit, QWidget


def dispose(window: QWidget) -> None:
    """Delete a window that is closed, once its events are done."""
    release_style(window)
    window.deleteLater()


def release_style(widget: QWidget) -> None:
    """Have Qt forget about the style of a widget and its parts when they are deleted; none of them is in sight."""
    for part in (widget, *widget.findChildren(QWidget)):
        part.ensurePolished()
        if isinstance(part, QLineEdit) and not part.styleSheet():
            part.setStyleSheet("border: none")


def plot_widget(**options: Any) -> pg.PlotWidget:
    """A plot without menus. pyqtgraph makes the fields of its menus all the same, and shows them to nobody."""
    plot = pg.PlotWidget(enableMenu=False, **options)
    for fields in vars(plot.getPlotItem().ctrl).values():
        if isinstance(fields, QWidget):
            release_style(fields)
    return plot
