"""Space starts and stops from everywhere, except where the space bar means something itself: a focused button."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QComboBox, QListWidget


class SpaceKeeper(QObject):
    """Event filter of the application: a focused button or list keeps its space bar."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        """Claim the key before the window's shortcut does."""
        if (event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent)
                and event.key() == Qt.Key.Key_Space
                and isinstance(watched, QAbstractButton | QComboBox | QListWidget)):
            event.accept()
            return True
        return False
