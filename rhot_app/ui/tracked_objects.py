"""The Rig menu's entries for tracked objects: add an object file to the rig, take an object out of it.

Both change the engine's rig and save it, so that what stood in the file is kept and can be brought back.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
from PySide6.QtCore import QObject
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFileDialog, QMenu, QWidget

from rhot_app.project import Rig, parse_rig, with_object
from rhot_app.ui.backend.contract import CommandClient
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.menu import literal
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.notice import Notice
from rhot_node.files import resource_path

TITLE = tr_noop("Add a tracked object")


def choose_object(parent: QWidget, start: Path) -> Path | None:
    """An object file; None when the person thought better of it."""
    name, _ = QFileDialog.getOpenFileName(parent, tr(TITLE), str(start), tr("Object files (*.json);;All files (*)"))
    return Path(name) if name else None


class TrackedObjects(QObject):
    """`add` asks for a file; `menu` lists the rig's objects, and choosing one takes it out. What was done is told."""

    def __init__(self, controller: Controller, add: QAction, menu: QMenu, tell: Callable[[Notice], None],
                 changed: Callable[[], None], window: QWidget) -> None:
        """`changed` is called when the engine has another rig."""
        super().__init__(window)
        self._controller, self._menu, self._tell, self._changed = controller, menu, tell, changed
        self._window = window
        self.choose: Callable[[], Path | None] = lambda: choose_object(window, self._start())
        add.triggered.connect(self._add)
        controller.rig_changed.connect(self._follow)
        self._follow()

    def _start(self) -> Path:
        """Where the dialog begins: beside the rig, or where the examples are."""
        opened = self._controller.opened
        own = opened is not None and opened.rig_path and not opened.simulated
        return Path(opened.rig_path).parent if own and opened is not None else resource_path("objects")

    def _follow(self) -> None:
        """An entry for each object of the rig that is open now."""
        rig = self._controller.rig
        names = [] if rig is None else [model.name for model in rig.models]
        self._menu.clear()
        for name in names:
            entry = self._menu.addAction(literal(name))
            entry.setToolTip(tr("Take {name} out of the rig; its file stays.", name=name))
            entry.triggered.connect(lambda checked=False, name=name: self.remove(name))
        self._menu.menuAction().setEnabled(bool(names))

    def _add(self) -> None:
        path = self.choose()
        if path is not None:
            self.add(path)

    def add(self, path: Path) -> None:
        """Add the object of a file to the engine's rig."""
        self._change(lambda rig: with_object(rig, path),
                     lambda rig: tr("{name} is tracked from now on, and stands in the rig.", name=rig.models[-1].name))

    def remove(self, name: str) -> None:
        """Take an object out of the engine's rig."""
        def without(rig: Rig) -> Rig:
            kept = tuple(one for one in rig.objects if one.model is None or one.model.name != name)
            return msgspec.structs.replace(rig, objects=kept)
        self._change(without, lambda rig: tr("{name} is not tracked any more.", name=name))

    def _change(self, change: Callable[[Rig], Rig], words: Callable[[Rig], str]) -> None:
        def work(client: CommandClient) -> Rig:
            answer = client.command("rig")
            rig = change(parse_rig(msgspec.json.encode(answer["document"]), "the engine's rig"))
            client.command("set_rig", document=msgspec.to_builtins(rig))
            if answer.get("path"):
                client.command("save_rig")
            return rig

        def done(rig: Any) -> None:
            self._changed()
            self._tell(Notice("info",
                              tr("{words} Calibrate, Bring back an earlier calibration undoes it.", words=words(rig))))
        self._controller.link.work(work, done, lambda sentence: self._tell(Notice("error", sentence)))
