"""The recordings as a list: when, which rig, how long, how well tracked; open, rename, delete, undo, their videos."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
from platformdirs import user_cache_path
from PySide6.QtCore import QEvent, QSize, Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QKeySequence, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from rhot_app.errors import RhotError
from rhot_app.keys import load_master_keys
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader
from rhot_app.recording.video import Collected, collect_videos
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.common.job import Job, Progress
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.tool_window import ToolWindow
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import Remaining
from rhot_app.ui.panels.empty_state import EmptyState
from rhot_app.ui.replay.library import Entry, Library
from rhot_app.ui.replay.library_table import RecordingTable
from rhot_app.ui.replay.summaries import Summaries
from rhot_app.ui.replay.work_strip import WorkStrip

_SIZE = QSize(1080, 560)


def summaries_folder() -> Path:
    """Where the summaries of recordings are kept."""
    return user_cache_path("rhot", appauthor=False) / "recordings"


class LibraryWindow(ToolWindow):
    """`open_asked` gives a recording's path; `renamed` its path before and after. `folder` holds the
    recordings; `rig`: the one that is open."""

    open_asked = Signal(object)
    renamed = Signal(object, object)

    def __init__(self, scheme: Scheme, folder: Path, cache: Path | None = None,
                 parent: QWidget | None = None, rig: Callable[[], Rig | None] = lambda: None,
                 make_solver: Callable[[], Solver] = Solver) -> None:
        super().__init__(tr("Recordings"), "recording", parent, _SIZE, tr("The recordings"))
        self.library = Library(folder, cache or summaries_folder())
        self.summaries = Summaries(self.library, make_solver(), self)
        self._listing: Job | None = None
        self._collecting: Job | None = None
        self._rig = rig
        self.empty = EmptyState(tr("No recordings yet. Press Record, or R, while a rig is open."))
        self.table = RecordingTable(scheme)
        self.sentence = Sentence(2)
        self.open_button = plain_button(tr("Open"), tr("Track the recording and play it (Enter)."))
        self.rename_button = plain_button(tr("Rename"), tr("Call the recording something else (F2)."))
        self.delete_button = plain_button(tr("Delete"), tr("Delete the recording; Undo brings it back until this page "
                                                           "is closed (Delete)."))
        self.undo_button = plain_button(tr("Undo"), tr("Bring back the recording that was deleted last (Ctrl+Z)."))
        self.video_button = plain_button(tr("Collect video"), tr("Fetch the frames that the cameras recorded beside "
                                                                 "the recording; they come to lie beside it."))
        self.strip = WorkStrip()
        self.folder_button = plain_button(tr("Open folder"), tr("Show the recordings in the desktop's file manager."))
        self.close_button = plain_button(tr("Close"), tr("Close this page. What was deleted is then gone for good."))
        self._lay_out()
        self._connect()
        self._show_choice()
        self.refresh()

    # -- putting it together ---------------------------------------------------------------------------------------

    def _lay_out(self) -> None:
        buttons = QHBoxLayout()
        for button in (self.open_button, self.rename_button, self.delete_button, self.undo_button,
                       self.video_button, self.folder_button):
            buttons.addWidget(button)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(12)
        layout.addWidget(self.empty)
        layout.addWidget(self.table, 1)
        layout.addWidget(self.strip)
        layout.addWidget(self.sentence)
        layout.addLayout(buttons)

    def _connect(self) -> None:
        self.table.chosen_changed.connect(self._show_choice)
        self.table.doubleClicked.connect(lambda index: self.open_chosen())
        self.table.named.connect(self._rename)
        self.summaries.changed.connect(self._show_summary)
        self.open_button.clicked.connect(self.open_chosen)
        self.rename_button.clicked.connect(self.table.edit_name)
        self.delete_button.clicked.connect(self.delete_chosen)
        self.undo_button.clicked.connect(self.undo)
        self.video_button.clicked.connect(self.collect_video)
        self.strip.cancel_asked.connect(self._stop_collecting)
        self.folder_button.clicked.connect(self.open_folder)
        self.close_button.clicked.connect(self.close)
        self.tools.bind({})
        for key, action in (("Return", self.open_chosen), ("F2", self.table.edit_name),
                            ("Delete", self.delete_chosen), ("Ctrl+Z", self.undo)):
            shortcut = QShortcut(QKeySequence(key), self.table, context=Qt.ShortcutContext.WidgetShortcut)
            shortcut.activated.connect(action)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self.table.set_scheme(scheme)

    # -- the list --------------------------------------------------------------------------------------------------

    def refresh(self, then: Callable[[], None] = lambda: None) -> None:
        """List the folder again, in a worker; `then` is called after."""
        if self._listing is not None:
            self._listing.cancel()

        def show(entries: Any) -> None:
            self._listing = None
            self._fill(entries)
            then()

        def fail(sentence: str) -> None:
            self._listing = None
            self.sentence.setText(sentence)

        self._listing = Job(lambda progress: self.library.entries(), show, fail, None, self).start()

    @property
    def listing(self) -> bool:
        """Whether the folder is being listed."""
        return self._listing is not None

    def _fill(self, entries: list[Entry]) -> None:
        chosen = self.table.chosen_entry
        self.table.show_entries(entries)
        for entry in entries:
            self._show_summary(entry.path)
        self.empty.setVisible(not entries)
        self.table.setVisible(bool(entries))
        self.summaries.want([entry for entry in entries if not entry.problem])
        self.table.choose(chosen.path if chosen is not None else None)
        self._show_choice()

    def _show_summary(self, path: Path) -> None:
        self.table.show_summary(path, self.summaries.of(path), self.summaries.words(path))

    def _show_choice(self) -> None:
        entry = self.table.chosen_entry
        self.open_button.setEnabled(entry is not None and not entry.problem)
        self.rename_button.setEnabled(entry is not None)
        self.delete_button.setEnabled(entry is not None)
        self.video_button.setEnabled(entry is not None and entry.video and self._collecting is None)
        undoable = self.library.undoable
        self.undo_button.setEnabled(bool(undoable))
        said = [tr("Deleted {name}. Undo brings it back; it is gone for good when this page is closed.",
                   name=undoable)] if undoable else []
        if entry is not None and entry.problem:
            said.append(entry.problem)
        elif entry is not None and entry.continues:
            said.append(tr("{stem} continues {continues}: the engine had stopped and was started again.",
                           stem=entry.path.stem, continues=entry.continues))
        self.sentence.setText("\n".join(said))

    # -- what the buttons do ---------------------------------------------------------------------------------------

    def open_chosen(self) -> None:
        """Play the recording that is selected."""
        entry = self.table.chosen_entry
        if entry is not None and not entry.problem:
            self.open_asked.emit(entry.path)

    def _rename(self, path: Path, name: str) -> None:
        """A name was typed."""
        try:
            renamed = self.library.rename(path, name)
        except RhotError as exc:
            sentence = str(exc)
            self.refresh(lambda: self.sentence.setText(sentence))
            return
        if renamed == path:
            return
        self.renamed.emit(path, renamed)
        self.refresh(lambda: self.table.choose(renamed))

    def delete_chosen(self) -> None:
        """Delete the recording that is selected; it lies in the trash until the page is closed."""
        entry = self.table.chosen_entry
        if entry is None:
            return
        try:
            self.library.delete(entry.path)
        except RhotError as exc:
            self.sentence.setText(str(exc))
            return
        self.refresh()

    def undo(self) -> None:
        """Bring back the recording that was deleted last."""
        try:
            path = self.library.undo()
        except RhotError as exc:
            self.sentence.setText(str(exc))
            return
        if path is not None:
            self.refresh(lambda: self.table.choose(path))

    def collect_video(self) -> None:
        """Fetch the videos of the recording that is selected, in a worker."""
        entry, rig = self.table.chosen_entry, self._rig()
        if entry is None or self._collecting is not None:
            return
        path, remaining = entry.path, Remaining(time.monotonic())

        def end(sentence: str) -> None:
            self._collecting = None
            self.strip.show_work("", 0.0, "")
            self._show_choice()
            self.sentence.setText(sentence)

        def done(videos: list[Collected]) -> None:
            dropped = sum(video.info.dropped for video in videos)
            end(tr("Collected {names}.", names=", ".join(video.path.name for video in videos))
                + (tr(" The cameras' computers were too slow for {dropped} frames.", dropped=dropped) if dropped
                   else ""))

        def show(text: str, fraction: float) -> None:
            now_s = time.monotonic()
            remaining.report(fraction, now_s)
            self.strip.show_work(text, fraction, remaining.text(now_s))
        self._collecting = Job(lambda progress: _collect(path, rig, progress), done, end, show, self).start()
        self.strip.show_work(tr("Asking the nodes …"), 0.0, "")
        self._show_choice()

    def _stop_collecting(self) -> None:
        """What has come stays, and is gone on with the next time."""
        if self._collecting is not None:
            self._collecting.cancel()
            self._collecting = None
            self.strip.show_work("", 0.0, "")
            self._show_choice()

    def open_folder(self) -> None:
        """Show the folder in the desktop's own file manager."""
        folder = self.library.folder
        if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder))):
            self.sentence.setText(tr("This desktop opens no folders. The recordings lie in {folder}.", folder=folder))

    def changeEvent(self, event: QEvent) -> None:  # noqa: N802
        """Back from another window: look again, a recording may have been made meanwhile."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange and self.isActiveWindow() and (
                not self.table.editing):
            self.refresh()

    def stop(self) -> None:
        """Work on summaries and videos; what was deleted is gone for good now."""
        self.summaries.close()
        self._stop_collecting()
        self.library.empty_trash()


def _collect(log: Path, rig: Rig | None, progress: Progress) -> list[Collected]:
    """Fetch a log's videos from its own nodes, each where the open `rig` has it if it is one of its nodes."""
    with contextlib.closing(LogReader(log)) as reader:
        recorded = reader.rig
    now = {} if rig is None else {node.node_id: node for node in rig.nodes}
    nodes = tuple(msgspec.structs.replace(now.get(node.node_id, node), name=node.name) for node in recorded.nodes)
    return collect_videos(log, msgspec.structs.replace(recorded, nodes=nodes), load_master_keys().own,
                          progress=progress.report)
