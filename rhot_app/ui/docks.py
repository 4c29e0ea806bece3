"""The panels around the scene as docks: where they stand at first, their keys, and all of them away at once."""

from __future__ import annotations

from PySide6.QtCore import QByteArray, Qt, QTimer
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QDockWidget, QMainWindow, QScrollArea, QWidget

_AREAS = {"left": Qt.DockWidgetArea.LeftDockWidgetArea, "right": Qt.DockWidgetArea.RightDockWidgetArea,
          "bottom": Qt.DockWidgetArea.BottomDockWidgetArea}
LEFT_PX, RIGHT_PX, BOTTOM_PX = 264, 440, 220
_SHARES = {"left": (216, 260), "right": (240, 230), "bottom": (1,)}


class Docks:
    """Keys 1, 2, 3 … show and hide the panels in the order in which they were added.

    `put_away` hides all of them for a reason ("no rig", "scene alone"); they return when the last reason is gone.
    """

    def __init__(self, window: QMainWindow) -> None:
        self._window = window
        self.docks: list[QDockWidget] = []
        self._areas: list[str] = []
        self._reasons: set[str] = set()
        self._kept: QByteArray | None = None
        self._arranged = False

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
        """The standard layout; its sizes are taken once the window is laid out, by `set_sizes`."""
        for dock, area in zip(self.docks, self._areas, strict=True):
            dock.setFloating(False)
            self._window.removeDockWidget(dock)
            self._window.addDockWidget(_AREAS[area], dock)
            dock.setVisible(not self._reasons)
        self._kept = None
        self._arranged = not self._reasons
        if self._arranged:
            self.set_sizes()

    def restore(self, state: QByteArray) -> bool:
        """A layout that `state` gave before; False when it is not one of this window."""
        if not self._window.restoreState(state):
            return False
        self._arranged = True
        self._kept = state
        return True

    def state(self) -> QByteArray:
        """The layout, to be remembered: as it is, or as it will be when the panels come back."""
        return self._kept if self._reasons and self._kept is not None else self._window.saveState()

    def set_sizes(self) -> None:
        """The standard sizes; only docks that are shown take them."""
        by_area = {area: [d for d, a in zip(self.docks, self._areas, strict=True) if a == area] for area in _AREAS}
        self._window.resizeDocks([by_area["left"][0], by_area["right"][0]], [LEFT_PX, RIGHT_PX],
                                 Qt.Orientation.Horizontal)
        self._window.resizeDocks(by_area["bottom"], [BOTTOM_PX], Qt.Orientation.Vertical)
        for area in ("left", "right"):
            self._window.resizeDocks(by_area[area], list(_SHARES[area]), Qt.Orientation.Vertical)

    def put_away(self, reason: str, away: bool) -> None:
        """Hide all panels while there is any reason to, then bring back those that were shown, where they stood."""
        before = bool(self._reasons)
        (self._reasons.add if away else self._reasons.discard)(reason)
        if self._reasons and not before:
            if self._arranged and self._kept is None:
                self._kept = self._window.saveState()
            for dock in self.docks:
                dock.hide()
        elif before and not self._reasons:
            self._bring_back()
        for action in self.actions:
            action.setEnabled(not self._reasons)

    def _bring_back(self) -> None:
        if self._kept is not None:
            self._window.restoreState(self._kept)
            self._kept = None
            return
        for dock in self.docks:
            dock.show()
        self._arranged = True
        QTimer.singleShot(0, self.set_sizes)


def _scrolled(widget: QWidget) -> QScrollArea:
    frame = QScrollArea()
    frame.setWidgetResizable(True)
    frame.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    frame.setWidget(widget)
    return frame
