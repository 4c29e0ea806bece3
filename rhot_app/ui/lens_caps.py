"""The menu that covers the simulated cameras' lenses, to see what is left of a hand that one camera sees, or none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu

from rhot_app.ui.controller import Controller
from rhot_app.ui.job import Job
from rhot_app.ui.models.notice import Notice


class LensCaps(QObject):
    """An entry per camera of the simulated rig, ticked while the camera is covered; without that rig there is no menu.
    What the twin refuses is told, and the ticks say what is so."""

    def __init__(self, controller: Controller, menu: QMenu, tell: Callable[[Notice], None]) -> None:
        super().__init__(menu)
        self._controller, self._menu, self._tell = controller, menu, tell
        self._caps: list[QAction] = []
        self._job: Job | None = None
        controller.rig_changed.connect(self._follow)
        menu.aboutToShow.connect(self._look)
        self._follow()

    def _follow(self) -> None:
        """Entries for the rig that is open now."""
        opened = self._controller.opened
        names = [node.name for node in opened.rig.nodes] if opened is not None and opened.simulated else []
        self._menu.menuAction().setVisible(bool(names))
        if names == [cap.data() for cap in self._caps]:
            return
        self._menu.clear()
        self._caps = [self._menu.addAction(name) for name in names]
        for cap, name in zip(self._caps, names, strict=True):
            cap.setData(name)
            cap.setCheckable(True)
            cap.setToolTip(f"A cap on the lens of the camera {name}: it sees nothing until it is taken off.")
            cap.triggered.connect(self._cover)

    def _look(self) -> None:
        """Another window, or a program, may have covered a camera."""
        self._ask(self._controller.backend.covered_cameras)

    def _cover(self) -> None:
        wanted = tuple(str(cap.data()) for cap in self._caps if cap.isChecked())
        self._ask(lambda: self._controller.backend.cover_cameras(wanted))

    def _ask(self, op: Callable[[], tuple[str, ...]]) -> None:
        if self._job is not None:
            self._job.cancel()
        self._job = Job(lambda progress: op(), self._show, self._fail, parent=self).start()

    def _show(self, covered: Any) -> None:
        self._job = None
        for cap in self._caps:
            cap.setChecked(cap.data() in covered)

    def _fail(self, sentence: str) -> None:
        self._show(())
        self._tell(Notice("error", sentence))
