"""The menus of the simulated rig: what its hand shows, which of its cameras are covered, and its scene as a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QFileDialog, QMenu, QWidget

from rhot_app.simulator.scene.shipped_motions import shipped_motions
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.menu import Menu, literal
from rhot_app.ui.common.parts import ask_where_to_save
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.notice import Notice

TITLE = tr_noop("Simulated hand does")
FIRST = {"still": tr_noop("Holds still"), "wave": tr_noop("Waves"), "brisk": tr_noop("Waves briskly"),
         "sweep": tr_noop("Moves every joint"), "roam": tr_noop("Moves and turns")}
"""The motions that calibrations ask for; the others stand in a menu of their own."""

THINGS = (("held:wave", tr_noop("Holds a tagged cube"),
           tr_noop("The hand waves with a cube of 40 mm that has a tag on each face. Rig, Add a tracked object offers "
                   "its file.")),
          ("bare:grasp", tr_noop("Takes its markers off"), tr_noop("A bare hand that opens and closes.")),
          ("bare:still", tr_noop("Holds a bare hand still"),
           tr_noop("A bare hand that does not move. Calibrate, Tracker chooses what follows it.")),
          ("empty", tr_noop("Leaves the pictures"),
           tr_noop("The background alone: Calibrate, Background and skin begins with it.")),
          ("board", tr_noop("Shows a board"),
           tr_noop("A chessboard of 9 x 6 corners, 25 mm squares, moved about with pauses.")),
          ("table", tr_noop("Lays the board on the table"), tr_noop("The same board, lying on the table.")),
          ("ruler", tr_noop("Shows a ruler"), tr_noop("A paper ruler with two crosses, 200 mm apart.")))
_SCENES = tr_noop("Scenes (*.json);;All files (*)")
DISTANCES_CM = (20, 25, 30, 40, 50, 65, 80, 100)


class TwinShows(QObject):
    """The choices, ticked as the simulated rig says; without that rig `menu` gives none. What is refused is told.

    The keys are those of `Backend.show_in_twin`.
    """

    def __init__(self, controller: Controller, menu: Menu, tell: Callable[[Notice], None]) -> None:
        super().__init__(menu)
        self._controller, self._tell = controller, tell
        self._job: Job | None = None
        self._group = QActionGroup(self)
        self._group.setExclusionPolicy(QActionGroup.ExclusionPolicy.ExclusiveOptional)
        self.actions: dict[str, QAction] = {}
        motions = {info.name: info.description for info in shipped_motions()}
        for name, text in FIRST.items():
            self._make(f"hand:{name}", tr(text), tr(motions.get(name, "")))
        for key, text, meaning in THINGS:
            self._make(key, tr(text), tr(meaning))
        for distance in DISTANCES_CM:
            self._make(f"marker:{0.01 * distance:g}", f"{distance} cm",
                       tr("One painted ball, {distance} cm from the cameras, before the middle between them.",
                          distance=distance))
        for name, meaning in motions.items():
            if name not in FIRST:
                self._make(f"hand:{name}", tr(name), tr(meaning))
        self._fill(menu)
        menu.aboutToShow.connect(self._look)
        controller.rig_changed.connect(lambda: menu.menuAction().setVisible(self._simulated))
        menu.menuAction().setVisible(self._simulated)

    @property
    def _simulated(self) -> bool:
        opened = self._controller.opened
        return opened is not None and opened.simulated

    def menu(self, parent: QWidget) -> Menu | None:
        """A menu of the choices for another window; None without the simulated rig."""
        if not self._simulated:
            return None
        menu = Menu(tr(TITLE), parent)
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

    def _fill(self, menu: Menu) -> None:
        one_marker, others = Menu(tr("Shows one marker at"), menu), Menu(tr("Another motion"), menu)
        for key, action in self.actions.items():
            kind, _, name = key.partition(":")
            where = one_marker if kind == "marker" else others if kind == "hand" and name not in FIRST else menu
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


# -- Menu: cover the lenses of the simulated cameras -------------------------------------------------------------------

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
        self._caps = [self._menu.addAction(literal(name)) for name in names]
        for cap, name in zip(self._caps, names, strict=True):
            cap.setData(name)
            cap.setCheckable(True)
            cap.setToolTip(tr("A cap on the lens of the camera {name}: it sees nothing until it is taken off.",
                              name=name))
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


# -- Menu: the scene as a file -----------------------------------------------------------------------------------------

class SceneFiles(QObject):
    """`opening` starts the simulated rig on a scene file; `saving`, which needs that rig, writes one."""

    def __init__(self, controller: Controller, opening: QAction, saving: QAction, tell: Callable[[Notice], None],
                 window: QWidget) -> None:
        super().__init__(window)
        self._controller, self._saving, self._tell = controller, saving, tell
        self._window = window
        self._path = Path.home() / "scene.json"  # of the last scene
        self._job: Job | None = None
        opening.triggered.connect(self._open)
        saving.triggered.connect(self._save)
        controller.rig_changed.connect(self._follow)
        self._follow()

    def _follow(self) -> None:
        opened = self._controller.opened
        self._saving.setEnabled(opened is not None and opened.simulated)

    def _open(self) -> None:
        name, _ = QFileDialog.getOpenFileName(self._window, tr("Open a scene"), str(self._path.parent), tr(_SCENES))
        if name:
            self._path = Path(name)
            tracker = self._controller.twin_choice.tracker
            self._controller.open_twin(TwinChoice(None, None, None, tracker, self._path))

    def _save(self) -> None:
        path = ask_where_to_save(self._window, tr("Save the scene"), self._path, tr(_SCENES))
        if path is not None and self._job is None:
            self._path = path
            self._job = Job(lambda progress: self._controller.backend.save_scene(path), lambda _: self._saved(path),
                            self._fail, parent=self).start()

    def _saved(self, path: Path) -> None:
        self._job = None
        self._tell(Notice("info", tr("The scene was saved to {path}.", path=path)))

    def _fail(self, sentence: str) -> None:
        self._job = None
        self._tell(Notice("error", sentence))
