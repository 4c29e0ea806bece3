"""The space bar of a window with one action that people give while they look elsewhere."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QAbstractButton, QApplication, QComboBox, QPushButton, QToolButton, QWidget


def bind_space(window: QWidget, action: Callable[[], object]) -> None:
    """Space calls `action`, or presses the button that the Tab key has reached; it never opens a menu or a list.

    Alt+Down does that. A mouse that presses a button or chooses from a list leaves the focus, so that Space does not
    press it again.
    """
    for part in (*window.findChildren(QAbstractButton), *window.findChildren(QComboBox)):
        if part.focusPolicy() & Qt.FocusPolicy.ClickFocus:
            part.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    QShortcut(QKeySequence(Qt.Key.Key_Space), window).activated.connect(lambda: _press_or(action))
    QShortcut(QKeySequence("Alt+Down"), window).activated.connect(_open_list)


def _press_or(action: Callable[[], object]) -> None:
    focus = QApplication.focusWidget()
    if isinstance(focus, QAbstractButton) and not _has_menu(focus):
        focus.click()
    else:
        action()


def _open_list() -> None:
    focus = QApplication.focusWidget()
    if isinstance(focus, QComboBox):
        focus.showPopup()
    elif isinstance(focus, QPushButton | QToolButton) and _has_menu(focus):
        focus.showMenu()


def _has_menu(button: QAbstractButton) -> bool:
    if isinstance(button, QToolButton) and button.defaultAction() is not None:
        return button.menu() is not None or button.defaultAction().menu() is not None
    return isinstance(button, QPushButton | QToolButton) and button.menu() is not None
