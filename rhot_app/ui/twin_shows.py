"""What the simulated hand does, or what stands in its place: chosen from a menu while the simulated rig runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu, QWidget

from rhot_app.ui.controller import Controller
from rhot_app.ui.job import Job
from rhot_app.ui.models.motions import shipped_motions
from rhot_app.ui.models.notice import Notice

TITLE = "Simulated hand does"
_FIRST = {"still": "Holds still", "wave": "Waves", "fast": "Moves fast", "sweep": "Moves every joint"}
"""The motions that calibrations ask for; the others stand in a menu of their own."""

_THINGS = (("board", "Shows a board", "A chessboard of 9 x 6 corners, 25 mm squares, moved about with pauses."),
           ("table", "Lays the board on the table", "The same board, lying on the table."),
           ("ruler", "Shows a ruler", "A paper ruler with two crosses, 200 mm apart."))
DISTANCES_CM = (20, 25, 30, 40, 50, 65, 80, 100)


class TwinShows(QObject):
    """The choices, ticked as the simulated rig says; without that rig `menu` gives none. What is refused is told.

    The keys are those of `Backend.show_in_twin`.
    """

    def __init__(self, controller: Controller, menu: QMenu, tell: Callable[[Notice], None]) -> None:
        super().__init__(menu)
        self._controller, self._tell = controller, tell
        self._job: Job | None = None
        self._group = QActionGroup(self)
        self._group.setExclusionPolicy(QActionGroup.ExclusionPolicy.ExclusiveOptional)
        self.actions: dict[str, QAction] = {}
        motions = {info.name: info.description for info in shipped_motions()}
        for name, text in _FIRST.items():
            self._make(f"hand:{name}", text, motions.get(name, ""))
        for key, text, meaning in _THINGS:
            self._make(key, text, meaning)
        for distance in DISTANCES_CM:
            self._make(f"marker:{0.01 * distance:g}", f"{distance} cm",
                       f"One painted ball, {distance} cm from the cameras, before the middle between them.")
        for name, meaning in motions.items():
            if name not in _FIRST:
                self._make(f"hand:{name}", name, meaning)
        self._fill(menu)
        menu.aboutToShow.connect(self._look)
        controller.rig_changed.connect(lambda: menu.menuAction().setVisible(self._simulated))
        menu.menuAction().setVisible(self._simulated)

    @property
    def _simulated(self) -> bool:
        opened = self._controller.opened
        return opened is not None and opened.simulated

    def menu(self, parent: QWidget) -> QMenu | None:
        """A menu of the choices for another window; None without the simulated rig."""
        if not self._simulated:
            return None
        menu = QMenu(TITLE, parent)
        self._fill(menu)
        menu.aboutToShow.connect(self._look)
        return menu

    def _make(self, key: str, text: str, meaning: str) -> None:
        action = QAction(text, self)
        action.setCheckable(True)
        action.setData(key)
        action.setToolTip(meaning)
        action.triggered.connect(lambda: self._ask(lambda: self._controller.backend.show_in_twin(key)))
        self._group.addAction(action)
        self.actions[key] = action

    def _fill(self, menu: QMenu) -> None:
        one_marker, others = QMenu("Shows one marker at", menu), QMenu("Another motion", menu)
        for each in (menu, one_marker, others):
            each.setToolTipsVisible(True)
        for key, action in self.actions.items():
            kind, _, name = key.partition(":")
            where = one_marker if kind == "marker" else others if kind == "hand" and name not in _FIRST else menu
            where.addAction(action)
        menu.addMenu(one_marker)
        menu.addMenu(others)

    def _look(self) -> None:
        """Another window, or a program, may have changed it."""
        self._ask(self._controller.backend.shown_in_twin)

    def _ask(self, op: Callable[[], str]) -> None:
        if self._job is not None:
            self._job.cancel()
        self._job = Job(lambda progress: op(), self._show, self._fail, parent=self).start()

    def _show(self, key: Any) -> None:
        self._job = None
        for known, action in self.actions.items():
            action.setChecked(known == key)

    def _fail(self, sentence: str) -> None:
        self._show("")
        self._tell(Notice("error", sentence))
