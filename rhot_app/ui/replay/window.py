"""The replay's window: the scene and the plots of a recording at any moment of it. A timer plays and shows."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QMainWindow,
    QVBoxLayout,
    QWidget,
)

from rhot_app.engine.observer import condition_of
from rhot_app.engine.status import Level
from rhot_app.export.trim import Trimmed, trim_log
from rhot_app.recording.bookmarks import Bookmark
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.common.disposal import dispose
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import ask_where_to_save
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.common.tool_window import AS_MAIN, WindowTools
from rhot_app.ui.dialogs.export_dialog import ExportDialog
from rhot_app.ui.dialogs.recordings import LOG_FILTER, newest_recording
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.notice import Notice, TransientNotices
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import Look, condition_look
from rhot_app.ui.panels.advice_bar import AdviceBar
from rhot_app.ui.replay.run import Run
from rhot_app.ui.replay.run_dialog import RunDialog, TrackingWork
from rhot_app.ui.replay.screen import ReplayScreen
from rhot_app.ui.replay.session import Comparison, Replay, TrackerChoice
from rhot_app.ui.replay.toolbar import BookmarkWriter, ReplayToolBar
from rhot_app.ui.replay.work_strip import WorkStrip

TICK_MS = 16
_AT_BOOKMARK_S = 0.02  # a bookmark is where it was set, to a state or two

_NO_STATE = Look(tr_noop("NO STATE"), "cross", "bad", tr_noop("The recording has no state at this moment."))


class ReplayWindow(QMainWindow):
    """`open` tracks a recording and shows it. `tick` is one turn of the timer, so that tests can turn by hand."""

    closed = Signal()

    def __init__(self, settings: Settings, scheme: Scheme, states: Path | None = None,
                 parent: QWidget | None = None, make_solver: Callable[[], Solver] = Solver,
                 clock: Callable[[], float] = time.monotonic) -> None:
        """`states`: the folder for the states of open recordings; `make_solver`: what tracks them; `clock`: seconds."""
        super().__init__(parent)
        self._clock = clock
        self.setObjectName("replay window")
        self.tools = WindowTools(self, tr("RHOT replay"), "recording", tr("Replay"))
        self.resize(AS_MAIN)
        self.replay: Replay | None = None
        self.work = TrackingWork(make_solver(), states, self)
        self._settings = settings
        self.dialog: RunDialog | None = None
        self.exporting: ExportDialog | None = None
        self.trimming: Job | None = None
        self.bookmarks = BookmarkWriter(self)
        self.passing = TransientNotices()
        self.toolbar = ReplayToolBar(scheme, self)
        self.strip = WorkStrip()
        self.parts = ReplayScreen(settings, scheme)
        self.advice = AdviceBar(scheme)
        self.toolbar.pictures.setChecked(settings.flag("films"))
        self._lay_out()
        self._connect()
        self._show_run()
        self.work.solver.prepare("rhot_app.ui.replay.run")
        self.tools.start(self.tick, TICK_MS, {
            "Left": lambda: self.step(-1), "Right": lambda: self.step(1), "Home": lambda: self.seek(0.0),
            "End": self.go_to_end, "B": self.ask_for_bookmark, "[": lambda: self._loop("begin"),
            "]": lambda: self._loop("end"), "F": self.parts.scene.frame_hand, "Ctrl+O": self.choose,
            "Ctrl+E": self.export, "P": self.toolbar.pictures.trigger}, self.toggle)

    # -- putting it together ---------------------------------------------------------------------------------------

    def _lay_out(self) -> None:
        page = QWidget()
        layout = QVBoxLayout(page)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addWidget(self.strip)
        layout.addWidget(self.parts, 1)
        layout.addWidget(self.advice)
        self.setCentralWidget(page)
        self.addToolBar(Qt.ToolBarArea.TopToolBarArea, self.toolbar)

    def _connect(self) -> None:
        bar, row = self.toolbar, self.parts.transport
        bar.open.triggered.connect(self.choose)
        bar.again.triggered.connect(lambda: self.ask_for_run(beside=False))
        bar.compare.triggered.connect(lambda: self.ask_for_run(beside=True))
        bar.alone.triggered.connect(self.stop_comparing)
        bar.export.triggered.connect(self.export)
        bar.trim.triggered.connect(self.ask_for_trim)
        bar.pictures.triggered.connect(self.show_pictures)
        bar.remove.triggered.connect(self.remove_bookmark)
        bar.bookmark_chosen.connect(self.seek)
        self.strip.cancel_asked.connect(self.work.cancel)
        self.work.changed.connect(self._show_work)
        self.work.done.connect(self._take_run)
        self.work.failed.connect(lambda sentence: self.tell("error", sentence))
        self.bookmarks.written.connect(self._show_bookmarks)
        self.bookmarks.failed.connect(lambda sentence: self.tell("error", sentence))
        self.parts.timeline.sought.connect(self.seek)
        row.play_asked.connect(self.toggle)
        row.step_asked.connect(self.step)
        row.first_asked.connect(lambda: self.seek(0.0))
        row.last_asked.connect(self.go_to_end)
        row.speed_chosen.connect(self.set_speed)
        row.loop_begin_asked.connect(lambda: self._loop("begin"))
        row.loop_end_asked.connect(lambda: self._loop("end"))
        row.loop_clear_asked.connect(lambda: self._loop("clear"))
        row.bookmark_asked.connect(self.ask_for_bookmark)
        for plot in self.parts.plots:
            plot.copied.connect(lambda sentence: self.tell("info", sentence))

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        for part in (self.toolbar, self.parts, self.advice):
            part.set_scheme(scheme)

    # -- opening and tracking --------------------------------------------------------------------------------------

    def choose(self) -> None:
        """Ask for a recording and open it."""
        folder = self.replay.path.parent if self.replay is not None else self._settings.recordings_folder
        start = newest_recording(folder) or folder
        name, _ = QFileDialog.getOpenFileName(self, tr("Open a recording"), str(start), tr(LOG_FILTER))
        if name:
            self.open(Path(name))

    def open(self, path: Path) -> None:
        """Track a recording as it was recorded, and show it."""
        self.work.start(path, TrackerChoice())

    def follow(self, before: Path, after: Path) -> None:
        """The file of the recording has another name now."""
        if self.replay is not None and self.replay.path == before:
            self.replay.path = after
            self._show_name()

    def _show_name(self) -> None:
        self.toolbar.show_replay(self.replay)
        self.setWindowTitle(tr("{name} – RHOT replay", name=self.replay.path.name) if self.replay is not None
                            else tr("RHOT replay"))

    def ask_for_run(self, *, beside: bool) -> None:
        """Ask how to track it again."""
        if self.replay is None:
            return
        self.dialog = RunDialog(beside=beside, parent=self)
        self.dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        replay = self.replay
        stays = replay.run if beside else replay.second
        other = stays.tracked if stays is not None else None
        self.dialog.chosen.connect(lambda choice: self.work.start(replay.path, choice, other))
        self.dialog.open()

    def stop_comparing(self) -> None:
        """One run alone again."""
        if self.replay is not None:
            self.replay.compare(None)
            self._show_run()

    def _take_run(self, path: Path, run: Run, choice: TrackerChoice, comparison: Comparison | None) -> None:
        if choice.beside and self.replay is not None and self.replay.path == path:
            self.replay.compare(run, choice, comparison)
        elif self.replay is not None and self.replay.path == path:
            self.replay.use(run, choice, comparison)
        else:
            if self.replay is not None:
                self.replay.close()
            self.replay = Replay(path, run, choice)
            self.passing.clear()
            self.parts.show_recording()
        self._show_run()

    def _show_work(self) -> None:
        self.strip.show_work(self.work.text if self.work.running else "", self.work.fraction, self.work.remaining)

    def _show_run(self) -> None:
        """Another recording, or other runs of it."""
        self.parts.show_run(self.replay)
        self._show_name()

    # -- pictures, a part, a file -----------------------------------------------------------------------------------

    def show_pictures(self, wanted: bool) -> None:
        """Show the cameras' pictures beside the scene, or not."""
        self._settings.set_flag("films", wanted)
        self.parts.show_films(wanted)
        if wanted and self.replay is not None and not self.parts.films.films:
            self.tell("info", tr("No video of this recording is on this computer. Rig, Recordings, Collect video "
                                 "fetches what the nodes recorded."))

    def export(self) -> None:
        """Ask what to write of the states that are shown."""
        if self.replay is None or self.exporting is not None:
            return
        replay = self.replay
        rig = None if replay.choice == TrackerChoice() else replay.run.rig
        self.exporting = ExportDialog(replay.path, replay.path.parent, self, rig=rig, smooth=replay.choice.smooth,
                                      out_folder=self._settings.exports_folder)
        self.exporting.finished.connect(self._forget_export)
        self.exporting.open()

    def _forget_export(self) -> None:
        if self.exporting is not None:
            dispose(self.exporting)
            self.exporting = None

    def ask_for_trim(self) -> None:
        """Ask where to save the repeated range."""
        if self.replay is None:
            return
        loop = self.replay.player.loop
        if loop is None:
            self.tell("info", tr("Choose the part first: [ and ] set where the repeated range begins and ends."))
            return
        log = self.replay.path
        out = ask_where_to_save(self, tr("Save the repeated range as"), log.with_stem(f"{log.stem}-part"),
                                tr(LOG_FILTER))
        if out is not None:
            self.trim(out, *loop)

    def trim(self, out: Path, begin_s: float, end_s: float) -> None:
        """Save a range of positions as a recording of its own, in a worker; what stands there is written over."""
        if self.replay is None or self.trimming is not None:
            return
        log, first_ns = self.replay.path, int(self.replay.run.tracked.times_ns[0])
        begin_ns, end_ns = (first_ns + round(1e9 * s) for s in (begin_s, end_s))
        self.tell("info", tr("Saving {name} …", name=out.name))
        self.trimming = Job(lambda progress: trim_log(log, out, begin_ns, end_ns, again=True, progress=progress.report),
                            self._show_trimmed, self._trim_failed, None, self).start()

    def _show_trimmed(self, done: Trimmed) -> None:
        self.trimming = None
        films = tr(" and {n} video", " and {n} videos", len(done.videos)) if done.videos else ""
        self.tell("info", tr("Saved {path}{films}. Open it with Ctrl+O.", path=done.path, films=films))

    def _trim_failed(self, sentence: str) -> None:
        self.trimming = None
        self.tell("error", sentence)

    # -- moving about ----------------------------------------------------------------------------------------------

    def toggle(self) -> None:
        """Play or pause."""
        if self.replay is not None:
            self.replay.player.toggle(self._clock())

    def step(self, count: int) -> None:
        """So many states on, or back when negative."""
        if self.replay is not None:
            self.replay.player.step(count)

    def seek(self, position_s: float) -> None:
        """Go to a moment."""
        if self.replay is not None:
            self.replay.player.seek(position_s)

    def go_to_end(self) -> None:
        """The last state."""
        if self.replay is not None:
            self.seek(self.replay.player.duration_s)

    def set_speed(self, speed: float) -> None:
        """Times real time."""
        if self.replay is not None:
            self.replay.player.set_speed(speed, self._clock())

    def _loop(self, what: str) -> None:
        if self.replay is not None:
            player = self.replay.player
            {"begin": player.begin_loop, "end": player.end_loop, "clear": player.clear_loop}[what]()
            self.parts.look_again()

    # -- bookmarks -------------------------------------------------------------------------------------------------

    def ask_for_bookmark(self) -> None:
        """Ask for a few words about the moment that is shown now."""
        if self.replay is not None:
            self.bookmarks.ask(self.replay)

    def remove_bookmark(self) -> None:
        """Remove the bookmark at which the recording stands."""
        mark = self._bookmark_here()
        if self.replay is not None and mark is not None:
            self.bookmarks.remove(self.replay, mark)

    def _bookmark_here(self) -> Bookmark | None:
        replay = self.replay
        return None if replay is None else replay.bookmark_near(replay.player.position_s, _AT_BOOKMARK_S)

    def _show_bookmarks(self) -> None:
        self._show_name()
        self.parts.look_again()

    # -- every tick ------------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Play on, and show what is due."""
        now = self._clock()
        self.advice.show_notices(self.passing.among(lasting_notices(self.replay, working=self.work.running), now))
        if self.replay is None:
            return
        self.replay.player.advance(now)
        if self.parts.films.failure:
            self.tell("error", self.parts.films.failure)
        if self.parts.refresh(self.replay, now):
            self.toolbar.remove.setEnabled(self._bookmark_here() is not None)
        state = self.parts.state
        look = condition_look(condition_of(state).value) if state is not None else _NO_STATE
        self.toolbar.badge.show_look(look, self.replay.rate_hz)

    def tell(self, level: Level, sentence: str) -> None:
        """Show a sentence for a while."""
        self.passing.show(Notice(level, sentence), self._clock())

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """Free the states and end the process that tracks."""
        self.tools.timer.stop()
        self.work.close()
        if self.trimming is not None:
            self.trimming.cancel()
        if self.exporting is not None:
            self.exporting.close()
        if self.replay is not None:
            self.replay.close()
            self.replay = None
        super().closeEvent(event)
        self.closed.emit()


def lasting_notices(replay: Replay | None, *, working: bool) -> list[Notice]:
    """What is said of a recording as long as it is open."""
    if replay is None:
        return [Notice("info", tr("One moment. Cancel leaves nothing behind.") if working
                       else tr("Open a recording (Ctrl+O). F1 opens the guide."))]
    said = [Notice("warning", replay.run.tracked.note, subject="equipment")] if replay.run.tracked.note else []
    if replay.second is not None:
        said.append(Notice("info", tr("Solid: {first}. Blue and translucent: {second}.", first=replay.choice.text,
                                      second=replay.second_choice.text)))
    return said or [Notice("info", tr("Tracked {text}. Space plays, the arrow keys go from state to state.",
                                      text=replay.choice.text))]
