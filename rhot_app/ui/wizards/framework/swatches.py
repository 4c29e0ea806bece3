"""Patches of colour as icons."""

from __future__ import annotations

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap

from rhot_app.ui.models.palette import Scheme

Rgb = tuple[int, int, int]

CHIP = QSize(28, 18)
ARROW_PX = 14


def swatch(rgb: Rgb | None, scheme: Scheme) -> QIcon:
    """A patch of the colour; an empty frame for none."""
    return _patches([rgb], scheme)


def change_of(before: Rgb | None, after: Rgb | None, scheme: Scheme) -> QIcon:
    """The colour before, an arrow, and the colour after it."""
    return _patches([before, after], scheme)


def _patches(colours: list[Rgb | None], scheme: Scheme) -> QIcon:
    step = CHIP.width() + ARROW_PX
    pixmap = QPixmap(QSize(step * len(colours) - ARROW_PX, CHIP.height()))
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    for k, rgb in enumerate(colours):
        painter.setPen(QColor(scheme.border))
        painter.setBrush(QColor(*rgb) if rgb is not None else Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(k * step, 0, CHIP.width() - 1, CHIP.height() - 1, 3, 3)
        if k:
            painter.setPen(QColor(scheme.muted))
            painter.drawText(QRect(k * step - ARROW_PX, 0, ARROW_PX, CHIP.height()), Qt.AlignmentFlag.AlignCenter,
                             "›")
    painter.end()
    icon = QIcon()
    for mode in (QIcon.Mode.Normal, QIcon.Mode.Selected):
        icon.addPixmap(pixmap, mode)
    return icon
