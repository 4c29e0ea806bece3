"""Fusion style in the app's own colours: palette, style sheet, fonts with tabular figures."""

from __future__ import annotations

from dataclasses import asdict
from string import Template

import pyqtgraph as pg
from PySide6.QtGui import QColor, QFont, QPalette, QPixmapCache
from PySide6.QtWidgets import QApplication

from rhot_app.ui.models.palette import SCHEMES, Scheme
from rhot_node.files import resource_path

GRID_PX = 8
TEXT_PT = 11.0
CELL_PADDING_PX = 6
PIXMAPS_KB = 2048
"""Of parts that the style has drawn. It keeps them by the widget's palette, so those of closed windows serve nobody."""


def app_font(size_pt: float = TEXT_PT, *, bold: bool = False) -> QFont:
    """The system's font at `size_pt` with figures of equal width, so that numbers do not dance."""
    font = QFont(QApplication.font())
    font.setPointSizeF(size_pt)
    font.setBold(bold)
    font.setFeature(QFont.Tag("tnum"), 1)
    return font


def scheme_named(name: str) -> Scheme:
    """The scheme of that name; the dark one when there is none."""
    return SCHEMES.get(name, SCHEMES["dark"])


def apply_theme(app: QApplication, scheme: Scheme) -> None:
    """Style, palette, fonts and style sheet of the whole app."""
    app.setStyle("Fusion")
    QPixmapCache.setCacheLimit(PIXMAPS_KB)
    app.setFont(app_font())
    app.setPalette(palette_of(scheme))
    app.setStyleSheet(style_sheet(scheme))
    pg.setConfigOptions(background=scheme.panel, foreground=scheme.muted, antialias=True)


def palette_of(scheme: Scheme) -> QPalette:
    """Qt's palette of a scheme."""
    palette = QPalette()
    roles = {
        QPalette.ColorRole.Window: scheme.window, QPalette.ColorRole.WindowText: scheme.text,
        QPalette.ColorRole.Base: scheme.panel, QPalette.ColorRole.AlternateBase: scheme.raised,
        QPalette.ColorRole.Text: scheme.text, QPalette.ColorRole.PlaceholderText: scheme.muted,
        QPalette.ColorRole.Button: scheme.raised, QPalette.ColorRole.ButtonText: scheme.text,
        QPalette.ColorRole.Highlight: scheme.accent, QPalette.ColorRole.HighlightedText: scheme.on_accent,
        QPalette.ColorRole.ToolTipBase: scheme.raised, QPalette.ColorRole.ToolTipText: scheme.text,
        QPalette.ColorRole.Link: scheme.accent, QPalette.ColorRole.Light: scheme.raised,
        QPalette.ColorRole.Mid: scheme.border, QPalette.ColorRole.Dark: scheme.border,
    }
    for role, colour in roles.items():
        palette.setColor(role, QColor(colour))
    for role in (QPalette.ColorRole.Text, QPalette.ColorRole.ButtonText, QPalette.ColorRole.WindowText):
        faded = QColor(scheme.muted)
        faded.setAlpha(140)
        palette.setColor(QPalette.ColorGroup.Disabled, role, faded)
    return palette


def style_sheet(scheme: Scheme) -> str:
    """The rules of ``resources/app.qss`` in the colours of a scheme."""
    rules = Template(resource_path("app.qss").read_text(encoding="utf-8"))
    return rules.substitute(asdict(scheme), cell_padding=CELL_PADDING_PX,
                            checked=resource_path("icons", "checked.svg").as_posix())
