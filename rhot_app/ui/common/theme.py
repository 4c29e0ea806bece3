"""Fusion style in the app's own colours: palette, style sheet, fonts with tabular figures."""

from __future__ import annotations

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


def style_sheet(s: Scheme) -> str:
    """The few rules that the palette cannot say."""
    return f"""
    QToolTip {{ background: {s.raised}; color: {s.text}; border: 1px solid {s.border}; padding: 4px 8px; }}
    QMainWindow::separator {{ background: {s.window}; width: 6px; height: 6px; }}
    QMainWindow::separator:hover {{ background: {s.accent}; }}
    #advicebar {{ border-top: 1px solid {s.border}; border-bottom: none; padding: 1px 0 0 0; }}
    QToolBar {{ background: {s.panel}; border: none; border-bottom: 1px solid {s.border}; padding: 4px 8px;
        spacing: 4px; }}
    QToolBar #qt_toolbar_ext_button, #qt_menubar_ext_button {{ padding: 0; border: none; }}
    #controls {{ border: none; padding: 0; }}
    QMenuBar {{ background: transparent; border: none; }}
    QMenuBar::item {{ background: transparent; padding: 6px 12px; border: 1px solid transparent; border-radius: 6px; }}
    QMenuBar::item:selected {{ background: {s.raised}; }}
    QMenuBar::item:pressed {{ background: {s.raised}; border-color: {s.border}; }}
    QToolBar QToolButton {{ padding: 6px 12px; border: 1px solid transparent; border-radius: 6px; }}
    QToolBar QToolButton:hover {{ background: {s.raised}; }}
    QToolBar QToolButton:pressed, QToolBar QToolButton:checked {{ background: {s.raised}; border-color: {s.border}; }}
    QToolBar QToolButton:focus {{ border-color: {s.accent}; }}
    QToolBar QToolButton::menu-indicator {{ subcontrol-position: right center; subcontrol-origin: padding;
        right: 4px; }}
    QToolButton[popupMode="2"] {{ padding-right: 20px; }}
    QDockWidget {{ color: {s.muted}; font-weight: 600; }}
    QDockWidget::title {{ background: {s.panel}; padding: 6px 8px; }}
    QDockWidget > QWidget, QWidget[panel="true"] {{ background: {s.panel}; }}
    QMenu {{ background: {s.raised}; border: 1px solid {s.border}; padding: 4px; }}
    QMenu::item {{ padding: 5px 24px; border-radius: 4px; }}
    QMenu::item:selected {{ background: {s.accent}; color: {s.on_accent}; }}
    QMenu::separator {{ height: 1px; background: {s.border}; margin: 4px 8px; }}
    QPushButton {{ background: {s.raised}; border: 1px solid {s.border}; border-radius: 6px; padding: 6px 16px; }}
    QPushButton:hover {{ border-color: {s.accent}; }}
    QPushButton:focus {{ border-color: {s.accent}; }}
    QPushButton:default, QPushButton[primary="true"] {{ background: {s.accent}; color: {s.on_accent};
        border-color: {s.accent}; }}
    QPushButton:disabled {{ color: {s.muted}; border-color: {s.border}; background: {s.panel}; }}
    QPushButton[flat="true"] {{ background: transparent; border: 1px solid transparent; padding: 2px 6px; }}
    QPushButton[flat="true"]:hover, QPushButton[flat="true"]:focus {{ border-color: {s.accent}; }}
    QPushButton[flat="true"]:checked {{ background: {s.raised}; border-color: {s.border}; color: {s.accent}; }}
    #advice QPushButton {{ padding: 1px 12px; }}
    #steps QPushButton {{ padding: 3px 12px; }}
    #advice QToolButton {{ padding: 1px 20px 1px 8px; border: 1px solid {s.border}; border-radius: 6px; }}
    QLabel[muted="true"] {{ color: {s.muted}; }}
    QLabel[title="true"] {{ font-weight: 600; }}
    QFrame[card="true"] {{ background: {s.raised}; border: 1px solid {s.border}; border-radius: 8px; }}
    QScrollArea {{ border: none; background: {s.panel}; }}
    QScrollArea[clear="true"], QScrollArea[clear="true"] > QWidget > QWidget {{ background: transparent; }}
    QScrollBar {{ background: {s.panel}; border: none; }}
    QScrollBar:vertical {{ width: 12px; }}
    QScrollBar:horizontal {{ height: 12px; }}
    QScrollBar::handle {{ background: {s.border}; border-radius: 4px; margin: 2px; }}
    QScrollBar::handle:vertical {{ min-height: 24px; }}
    QScrollBar::handle:horizontal {{ min-width: 24px; }}
    QScrollBar::handle:hover {{ background: {s.muted}; }}
    QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
    QTableView {{ background: {s.panel}; border: none; gridline-color: {s.border}; }}
    QHeaderView::section {{ background: {s.panel}; color: {s.muted}; border: none; padding: 4px 10px; }}
    QTableView::item {{ padding: 0 {CELL_PADDING_PX}px; }}
    QStatusBar {{ background: {s.panel}; border-top: 1px solid {s.border}; }}
    QLineEdit, QComboBox {{ background: {s.panel}; border: 1px solid {s.border}; border-radius: 4px;
        padding: 4px 8px; min-height: 20px; }}
    QLineEdit:focus, QComboBox:focus {{ border-color: {s.accent}; }}
    QComboBox {{ combobox-popup: 0; }}
    QComboBox QAbstractItemView {{ background: {s.raised}; color: {s.text}; border: 1px solid {s.border};
        selection-background-color: {s.accent}; selection-color: {s.on_accent}; outline: none; }}
    QComboBox QAbstractItemView::item {{ min-height: 26px; padding: 0 6px; }}
    SceneBar {{ padding: 2px 4px; }}
    SceneBar QToolButton {{ padding: 3px 10px; }}
    SceneBar QToolButton[popupMode="1"] {{ padding-right: 26px; }}
    SceneBar QToolButton::menu-button {{ border: none; width: 18px; }}
    QRadioButton::indicator {{ width: 12px; height: 12px; border: 2px solid {s.muted}; border-radius: 8px; }}
    QRadioButton::indicator:disabled {{ border-color: {s.border}; }}
    QRadioButton::indicator:checked {{ border-color: {s.accent}; background: qradialgradient(cx: 0.5, cy: 0.5,
        radius: 0.5, fx: 0.5, fy: 0.5, stop: 0 {s.accent}, stop: 0.6 {s.accent}, stop: 0.7 {s.panel}); }}
    QCheckBox::indicator, QListView::indicator {{ width: 12px; height: 12px; border: 2px solid {s.muted};
        border-radius: 3px; background: {s.panel}; }}
    QCheckBox::indicator:checked, QListView::indicator:checked {{ border-color: {s.text};
        image: url("{resource_path('icons', 'checked.svg').as_posix()}"); }}
    QCheckBox::indicator:disabled {{ border-color: {s.border}; }}
    QProgressBar {{ border: 1px solid {s.border}; border-radius: 4px; background: {s.panel}; height: 8px; }}
    QProgressBar::chunk {{ background: {s.accent}; border-radius: 3px; }}
    """
