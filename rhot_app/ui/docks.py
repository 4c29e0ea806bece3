"""The panels around the scene as docks: where they stand at first, their keys, and all of them away at once."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QDockWidget, QMainWindow, QScrollArea, QWidget

_AREAS = {"left": Qt.DockWidgetArea.LeftDockWidgetArea, "right": Qt.DockWidgetArea.RightDockWidgetArea,
          "bottom": Qt.DockWidgetArea.BottomDockWidgetArea}
LEFT_PX, RIGHT_PX, BOTTOM_PX = 216, 336, 220
_SHARES = {"left": (190, 290), "right": (270, 200), "bottom": (1,)}


class Docks:
    """Keys 1, 2, 3 … show and hide the panels in the order in which they were added.

    `put_away` hides all of them for a reason ("no rig", "scene alone"); they return when the last reason is gone.
    """

    def __init__(self, window: QMainWindow) -> None:
        self._window = window
        self.docks: list[QDockWidget] = []
        self._areas: list[str] = []
        self._reasons: set[str] = set()
        self._put_away: list[QDockWidget] = []

    def add(self, name: str, widget: QWidget, area: str, *, scroll: bool = False, title: bool = True) -> QDockWidget:
        """Put `widget` into a dock; without a title it can only be moved from the View menu."""
        dock = QDockWidget(name, self._window)
        dock.setObjectName(f"dock {name}")
        dock.setWidget(_scrolled(widget) if scroll else widget)
        if not title:
            dock.setTitleBarWidget(QWidget())
        self.docks.append(dock)
        self._areas.append(area)
        key = str(len(self.docks))
        action = dock.toggleViewAction()
        action.setShortcut(QKeySequence(key))
        action.setToolTip(f"Show or hide the panel ({key}).")
        self._window.addDockWidget(_AREAS[area], dock)
        return dock

    @property
    def actions(self) -> list[QAction]:
        """The switches of the panels, in order."""
        return [dock.toggleViewAction() for dock in self.docks]

    def arrange(self) -> None:
        """The standard layout."""
        for dock, area in zip(self.docks, self._areas, strict=True):
            dock.setFloating(False)
            self._window.removeDockWidget(dock)
            self._window.addDockWidget(_AREAS[area], dock)
            dock.setVisible(not self._reasons)
        self._put_away = list(self.docks) if self._reasons else []
        self.set_sizes()

    def set_sizes(self) -> None:
        """The standard sizes; only docks that are shown take them."""
        by_area = {area: [d for d, a in zip(self.docks, self._areas, strict=True) if a == area] for area in _AREAS}
        self._window.resizeDocks([by_area["left"][0], by_area["right"][0]], [LEFT_PX, RIGHT_PX],
                                 Qt.Orientation.Horizontal)
        self._window.resizeDocks(by_area["bottom"], [BOTTOM_PX], Qt.Orientation.Vertical)
        for area in ("left", "right"):
            self._window.resizeDocks(by_area[area], list(_SHARES[area]), Qt.Orientation.Vertical)

    def put_away(self, reason: str, away: bool) -> None:
        """Hide all panels while there is any reason to, then bring back those that were shown."""
        before = bool(self._reasons)
        (self._reasons.add if away else self._reasons.discard)(reason)
        if self._reasons and not before:
            self._put_away = [dock for dock in self.docks if not dock.isHidden()]
            for dock in self._put_away:
                dock.hide()
        elif before and not self._reasons:
            for dock in self._put_away:
                dock.show()
            self._put_away = []
        for action in self.actions:
            action.setEnabled(not self._reasons)


def _scrolled(widget: QWidget) -> QScrollArea:
    frame = QScrollArea()
    frame.setWidgetResizable(True)
    frame.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    frame.setWidget(widget)
    return frame
