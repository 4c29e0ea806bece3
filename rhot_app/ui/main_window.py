"""The window: menus, toolbar, docks, scene, sentences at the bottom. A timer pulls from the controller and shows."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QAction, QCloseEvent
from PySide6.QtWidgets import (
    QApplication,
    QMainWindow,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from rhot_app.calibration.registry import calibrations, find_calibration
from rhot_app.errors import RhotError
from rhot_app.sources.cameras.camera_set import camera_set_of, change_observed
from rhot_app.ui.actions import Actions, MainMenuBar, MainToolBar
from rhot_app.ui.appearance import Appearance, DisplayPrediction
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.guide import page_of
from rhot_app.ui.common.keys import ActionKeys, bind_space
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.common.shapes import show_overflow
from rhot_app.ui.common.theme import scheme_named
from rhot_app.ui.dialogs.dialogs import Dialogs
from rhot_app.ui.dialogs.next_steps import NEXT_STEPS, NextSteps
from rhot_app.ui.dialogs.recordings import SHOW_FOLDER, Recordings
from rhot_app.ui.language import tr_noop
from rhot_app.ui.models.next_steps import NETWORKS, TRACKER
from rhot_app.ui.models.notice import Notice, TransientNotices
from rhot_app.ui.panels.advice_bar import AdviceBar, toolbar_of
from rhot_app.ui.replay.windows import ReplayWindows
from rhot_app.ui.scene.page import ScenePage
from rhot_app.ui.screen import BOTTOM_PX, Docks, Screen
from rhot_app.ui.simulated_rig_menus import LensCaps, SceneFiles, TwinShows
from rhot_app.ui.status_words import RigFileWatch, label_of, look_of, notices_of
from rhot_app.ui.tracked_objects import TrackedObjects
from rhot_app.ui.welcome import WelcomePage
from rhot_app.ui.wizards.framework.definition import OPEN_WIZARD
from rhot_app.ui.wizards.launcher import Launcher

TICK_MS = 16
BEHIND_S = 0.5
"""Between drawings of the screen behind a wizard: the pictures in front are what the person looks at."""

_SIZE = (1280, 800)


class MainWindow(QMainWindow):
    """`controller` does, this shows. `tick` is one turn of the timer, so that tests can turn by hand."""

    def __init__(self, controller: Controller, settings: Settings,
                 make_solver: Callable[[], Solver] = Solver) -> None:
        """`make_solver` makes what runs the long work of wizards and replays."""
        super().__init__()
        self.controller = controller
        self.settings = settings
        self._buttons_shown: tuple[bool, bool] | None = None
        self._next_behind = 0.0
        self._plots_hidden = False  # before the steps took their place
        self._offered = ""  # the rig whose steps were shown by themselves
        self.passing = TransientNotices()
        self.dialogs = Dialogs(self)
        self.recordings = Recordings(controller, settings, self.tell)
        self.rig_watch = RigFileWatch(controller)
        self.wizards = Launcher(controller.backend.command_client, controller.backend.client,
                                lambda: self.appearance.scheme, settings, self, make_solver)
        self.replays = ReplayWindows(settings, lambda: self.appearance.scheme, self, lambda: controller.rig,
                                     make_solver)
        self.setObjectName("main window")
        self.setWindowTitle("RHOT")
        scheme = scheme_named(settings.scheme)
        self.screen_parts = Screen(scheme)
        self.advice = AdviceBar(scheme)
        self.actions_ = Actions(self)
        prediction = DisplayPrediction(controller)
        self.screen_parts.shown = prediction.shown
        self.appearance = Appearance(settings, self.actions_, self.screen_parts, self.advice, prediction, self)
        self.welcome = WelcomePage(settings.motion)
        self.pages = QStackedWidget()
        self.pages.addWidget(self.welcome)
        self.scene_page = ScenePage(self.screen_parts.scene, self.actions_.scene_bar())
        self.pages.addWidget(self.scene_page)
        self.setCentralWidget(self.pages)
        self.lens_caps = LensCaps(controller, self.actions_.caps, self.tell)
        self.twin_shows = TwinShows(controller, self.actions_.shows, self.tell)
        self.scene_files = SceneFiles(controller, self.actions_.open_scene, self.actions_.save_scene, self.tell, self)
        self.wizards.twin_menu = self.twin_shows.menu
        self.tracked_objects = TrackedObjects(controller, self.actions_.add_object, self.actions_.objects, self.tell,
                                              self.rig_watch.look_soon, self)
        self.next_steps = NextSteps(scheme, lambda: controller.rig, self._in_force, settings)
        self.docks = Docks(self)
        self._add_docks()
        self.menus = MainMenuBar(self.actions_, self.docks.actions, self)
        self.keys = ActionKeys([*self.actions_.all(), *self.docks.actions], settings, self.menus.actions())
        self.toolbar = MainToolBar(self.actions_, self.menus, scheme, self)
        self.addToolBar(Qt.ToolBarArea.TopToolBarArea, self.toolbar)
        self.addToolBar(Qt.ToolBarArea.BottomToolBarArea, toolbar_of(self.advice, self))
        self._connect_actions()
        self._restore()
        self._show_rig()
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self.tick)
        self._timer.start(TICK_MS)

    # -- putting it together ---------------------------------------------------------------------------------------

    def _add_docks(self) -> None:
        parts = self.screen_parts
        self.docks.add(tr_noop("Nodes"), parts.nodes, "left", scroll=True)
        self.docks.add(tr_noop("Markers"), parts.markers, "left", scroll=True)
        self.docks.add(tr_noop("Cameras"), parts.cameras, "right")
        self.docks.add(tr_noop("Hand"), parts.hand_and_objects, "right")
        below = QWidget()
        column = QVBoxLayout(below)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(parts.plots)
        column.addWidget(self.next_steps)
        self.next_steps.hide()
        self.docks.add(tr_noop("Plots"), below, "bottom", title=False)

    def _connect_actions(self) -> None:
        a, c = self.actions_, self.controller
        self.addActions(self.keys.actions)
        a.start.triggered.connect(c.start_or_stop)
        bind_space(self, c.start_or_stop)
        a.record.triggered.connect(lambda: self.recordings.begin_or_end(video=a.video.isChecked()))
        a.bookmark.triggered.connect(lambda: self.recordings.ask_for_bookmark(self))
        a.twin.triggered.connect(lambda: self.open_twin(TwinChoice(motion=self.welcome.motion)))
        a.open.triggered.connect(self.choose_rig)
        a.nodes.triggered.connect(self.connect_nodes)
        a.own_cameras.triggered.connect(self.choose_cameras)
        a.export.triggered.connect(lambda: self.dialogs.export_recording(self.settings))
        a.open_recording.triggered.connect(self.replays.choose)
        a.recordings.triggered.connect(self.replays.list)
        a.films.triggered.connect(self.replays.track_films)
        a.outputs.triggered.connect(lambda: self.dialogs.show_outputs(
            c, lambda: self.appearance.scheme, [a.save_rig, a.guide], self.rig_watch.look_soon))
        a.mouse.triggered.connect(lambda: self.dialogs.show_mouse(c, self.appearance.scheme))
        a.save_rig.triggered.connect(lambda: self.rig_watch.save(self.tell))
        a.close_rig.triggered.connect(c.close_rig)
        a.settings.triggered.connect(lambda: self.dialogs.show_settings(self.settings, self.keys))
        a.quit.triggered.connect(self.close)
        for action, page in ((a.cameras, "cameras"), (a.markers, "markers"), (a.hand, "hand")):
            action.triggered.connect(lambda checked=False, page=page: self.show_rig_file(page))
        a.tracker.triggered.connect(lambda: self.dialogs.choose_tracker(c, self.rig_watch.look_soon))
        a.networks.triggered.connect(lambda: self.dialogs.show_networks())
        self._connect_wizards()
        a.files.triggered.connect(lambda: self.open_guide("calibration"))
        a.frame.triggered.connect(self.screen_parts.scene.frame_hand)
        a.layers.triggered.connect(lambda: self.dialogs.show_layers(c, self.appearance.scheme))
        a.home.triggered.connect(self.screen_parts.scene.reset_view)
        a.alone.toggled.connect(lambda on: self.docks.put_away("scene alone", on))
        a.reset.triggered.connect(self.reset_settings)
        a.guide.triggered.connect(lambda: self.open_guide(page_of(QApplication.focusWidget())))
        a.keys.triggered.connect(lambda: self.open_guide("keys"))
        a.about.triggered.connect(self.dialogs.show_about)
        w = self.welcome
        w.twin_asked.connect(self.open_twin)
        w.file_asked.connect(self.choose_rig)
        w.last_asked.connect(lambda: self.open_rig(Path(self.settings.last_rig)))
        w.nodes_asked.connect(self.connect_nodes)
        w.cameras_asked.connect(self.choose_cameras)
        w.cancel_asked.connect(c.cancel)
        self.screen_parts.scene.start_button.clicked.connect(c.start)
        self.advice.acted.connect(self._act)
        for plot in self.screen_parts.all_plots:
            plot.copied.connect(lambda sentence: self.tell(Notice("info", sentence)))
        c.rig_changed.connect(self._show_rig)
        c.rig_changed.connect(self._offer_steps)
        c.busy_changed.connect(self._show_busy)
        c.failed.connect(self._show_failure)
        self.appearance.scheme_changed.connect(self._recolour_buttons)
        self.appearance.scheme_changed.connect(lambda: self.dialogs.set_scheme(self.appearance.scheme))
        self.appearance.scheme_changed.connect(lambda: self.next_steps.set_scheme(self.appearance.scheme))
        self.appearance.scheme_changed.connect(lambda: self.replays.set_scheme(self.appearance.scheme))
        self.docks.docks[2].visibilityChanged.connect(c.set_preview)

    def _connect_wizards(self) -> None:
        for action, wizard in zip(self.actions_.wizards, calibrations(), strict=True):
            action.triggered.connect(lambda checked=False, wizard=wizard: self.wizards.open(wizard))
        self.actions_.earlier.triggered.connect(self.wizards.open_versions)
        self.actions_.fit.triggered.connect(self.wizards.open_fit)
        self.menus.calibrate.aboutToShow.connect(self._show_ages)
        self.actions_.next_steps.triggered.connect(self.show_next_steps)
        self.next_steps.asked.connect(self._do_step)
        self.next_steps.closed.connect(lambda: self._place_steps(False))
        self.wizards.rig_used.connect(self.rig_watch.look_soon)
        self.wizards.failed.connect(self._show_failure)

    def _in_force(self) -> Collection[str]:
        opened = self.controller.opened
        return self.wizards.in_force("" if opened is None else opened.rig_path).keys()

    def _show_ages(self) -> None:
        """When each calibration was made, each time the menu opens."""
        opened = self.controller.opened
        self.wizards.show_ages(self.actions_.wizards, opened.rig_path if opened is not None else "")

    def _restore(self) -> None:
        """Layout and switches as they were left."""
        self.appearance.restore()
        self.resize(QSize(*_SIZE).boundedTo(self.screen().availableSize()))
        layout = self.settings.layout()
        if layout is None or not (self.restoreGeometry(layout[0]) and self.docks.restore(layout[1])):
            self.docks.arrange()

    # -- what the actions do ---------------------------------------------------------------------------------------

    def open_as_chosen(self) -> None:
        """What the settings say of the start: a rig, or the first page."""
        if self.settings.start == "twin":
            self.open_twin(TwinChoice(motion=self.welcome.motion))
        elif self.settings.start == "last" and Path(self.settings.last_rig).is_file():
            self.open_rig(Path(self.settings.last_rig))

    def open_twin(self, choice: TwinChoice) -> None:
        """Start the simulated rig and the tracking."""
        if choice.motion is not None and self.welcome.motion_box.findData(choice.motion) >= 0:
            self.settings.motion = choice.motion
        self.controller.open_twin(choice)

    def choose_rig(self) -> None:
        """Ask for a rig file and open it."""
        path = self.dialogs.choose_rig(self.settings.last_rig)
        if path is not None:
            self.open_rig(path)

    def open_rig(self, path: Path) -> None:
        """Open a rig file."""
        self.controller.open_rig(path)

    def connect_nodes(self) -> None:
        """Ask two nodes and open the rig file written for them."""
        path = self.dialogs.connect_nodes(self.appearance.scheme)
        if path is not None:
            self.open_rig(path)

    def choose_cameras(self) -> None:
        """Choose cameras of this computer and open them."""
        prepared = self.dialogs.choose_cameras(self.appearance.scheme)
        if prepared is not None:
            self.open_rig(prepared.rig_path)
            for remark in prepared.remarks:
                self.tell(Notice("info", remark))

    def show_next_steps(self) -> None:
        """What the rig still needs, as a list with ticks, in the place of the plots."""
        if self.controller.opened is not None:
            self.next_steps.begin()
            self._place_steps(True)

    def _place_steps(self, on: bool) -> None:
        """Steps or plots in their panel, which is hidden again when the steps go if it was."""
        if on == (not self.next_steps.isHidden()):
            return
        dock = self.docks.docks[4]
        if on:
            self.actions_.alone.setChecked(False)
            self._plots_hidden = dock.isHidden()
        going, coming = (self.screen_parts.plots, self.next_steps)[::1 if on else -1]
        going.hide()  # first: the window would grow to hold both
        coming.show()
        dock.setHidden(not on and self._plots_hidden)
        if not on:
            self.resizeDocks([dock], [BOTTOM_PX], Qt.Orientation.Vertical)

    def _do_step(self, action: str) -> None:
        """Open what a step asks for."""
        wizard = find_calibration(action)
        if wizard is not None:
            self.wizards.open(wizard)
        elif action == TRACKER:
            self._change_observed()
        elif action == NETWORKS:
            self.dialogs.show_networks()
        else:
            self.choose_cameras()

    def _change_observed(self) -> None:
        """Cameras of this computer are opened again with what they are to observe; for others the tracker is asked."""
        opened = self.controller.opened
        path = Path(opened.rig_path) if opened is not None and opened.rig_path else None
        if path is None or camera_set_of(path) is None:
            self.dialogs.choose_tracker(self.controller, self.rig_watch.look_soon)
            return
        try:
            change_observed(path, bare=self.next_steps.answers.wear != "paint")
        except (RhotError, OSError) as exc:
            self.tell(Notice("error", str(exc)))
            return
        self.open_rig(path)

    def show_rig_file(self, page: str) -> None:
        """What the rig file says, to read."""
        if self.controller.rig is not None:
            self.dialogs.show_rig(self.controller.rig, page)

    def open_guide(self, page: str) -> None:
        """A page of the guide beside the window."""
        self.dialogs.open_guide(page)

    @property
    def guide_page(self) -> str:
        """The page of the guide that is open, "" for none."""
        return self.dialogs.guide_page

    def tell(self, notice: Notice) -> None:
        """Show a sentence first for a while: something was done, or could not be done."""
        self.passing.show(notice, self.controller.clock())

    def _act(self, key: str) -> None:
        """The button of a sentence."""
        wizard = find_calibration(key.removeprefix(OPEN_WIZARD)) if key.startswith(OPEN_WIZARD) else None
        if wizard is not None:
            self.wizards.open(wizard)
        elif key == SHOW_FOLDER:
            self.recordings.show_folder()
        else:
            self.controller.press(key)

    def reset_settings(self) -> None:
        """As on the first start: layout, switches, last rig, folders, keys."""
        self.settings.reset()
        self.keys.restore()
        self.actions_.alone.setChecked(False)
        self.appearance.set_scheme(self.settings.scheme)
        self._restore()
        self._show_rig()

    # -- showing ---------------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Pull and show."""
        self.controller.step()
        now = self.controller.clock()
        self.recordings.step()
        self.rig_watch.step(now)
        if self.wizards.wizard is None or now >= self._next_behind:
            self._next_behind = now + BEHIND_S
            self.screen_parts.refresh(self.controller.live, now)
        self._show_buttons()
        self._show_rig_name()
        status = self.controller.live.status
        rate = status.state_rate_hz if status is not None and not self.controller.engine_gone else None
        self.toolbar.badge.show_look(look_of(self.controller), rate)
        self.toolbar.show_source(*label_of(self.controller))
        self.advice.show_notices(self.passing.among(notices_of(self.controller), now))

    def _recolour_buttons(self) -> None:
        self._buttons_shown = None
        self._show_buttons()

    def _show_buttons(self) -> None:
        c, a = self.controller, self.actions_
        shown = (c.running, c.recording)
        if shown != self._buttons_shown:
            self._buttons_shown = shown
            self.toolbar.set_scheme(a, self.appearance.scheme, running=c.running, recording=c.recording)
            show_overflow(self.scene_page.bar, self.appearance.scheme.text)
        usable = c.opened is not None and not c.engine_gone
        self.screen_parts.scene.offer_start(usable and not c.running)
        for action in (a.start, a.record):
            if action.isEnabled() != usable:
                action.setEnabled(usable)

    def _show_rig(self) -> None:
        rig, opened = self.controller.rig, self.controller.opened
        if rig is None:
            self._place_steps(False)
        self.screen_parts.show_rig(rig)
        self.dialogs.follow_rig(self.controller)
        self.pages.setCurrentIndex(0 if rig is None else 1)
        self.docks.put_away("no rig", rig is None)
        self._show_rig_name()
        for action in self._rig_actions():
            action.setEnabled(rig is not None)
        if opened is not None and opened.rig_path and not opened.simulated:
            self.settings.last_rig = opened.rig_path
        last = Path(self.settings.last_rig)
        self.welcome.show_last(last.name if self.settings.last_rig and last.exists() else "")

    def _offer_steps(self) -> None:
        """Show the steps once for cameras of this computer, unless somebody has had enough of them."""
        opened = self.controller.opened
        path = opened.rig_path if opened is not None and opened.begin else ""
        if path and path != self._offered and self.settings.flag(NEXT_STEPS):
            self.show_next_steps()
        self._offered = path

    def _show_rig_name(self) -> None:
        opened, edited = self.controller.opened, self.rig_watch.edited
        self.toolbar.show_rig(opened.rig.name if opened is not None else "",
                              opened.rig_path if opened is not None else "", edited=edited)
        self.actions_.save_rig.setEnabled(edited and not self.controller.engine_gone)

    def _rig_actions(self) -> list[QAction]:
        a = self.actions_
        return [a.next_steps, *a.wizards, a.earlier, a.fit, a.tracker, a.outputs, a.add_object, a.close_rig,
                a.properties.menuAction(), a.frame, a.home, a.names, a.clouds, a.now, a.layers]

    def _show_busy(self) -> None:
        if self.controller.opened is None:
            self.welcome.show_busy(self.controller.busy)

    def _show_failure(self, sentence: str) -> None:
        self.tell(Notice("error", sentence))

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """Remember the layout; `app.run` ends the processes once the window is gone."""
        self._timer.stop()
        self.actions_.alone.setChecked(False)
        self.settings.set_layout(self.saveGeometry(), self.docks.state())
        self.settings.sync()
        self.dialogs.close()
        self.wizards.close()
        self.replays.close()
        event.accept()
