"""The replay window's toolbar: the REPLAY badge with the file's name, runs, bookmarks, and the state's word."""

from __future__ import annotations

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QLabel, QMenu, QSizePolicy, QToolBar, QToolButton, QWidget

from rhot_app.recording.bookmarks import Bookmark, append_bookmark
from rhot_app.ui.common.disposal import dispose
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.shapes import show_overflow
from rhot_app.ui.dialogs.recordings import BookmarkDialog
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.state_badge import StateBadge
from rhot_app.ui.replay.session import Replay

_NAME_PX = 240


class ReplayToolBar(QToolBar):
    """`bookmark_chosen` gives a position, s."""

    bookmark_chosen = Signal(float)

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(tr("Replay"), parent)
        self.setObjectName("replay toolbar")
        self.setMovable(False)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
        self.word = QLabel(tr("REPLAY"))
        self.name = QLabel("")
        self.open = self._action(tr("Open …"), tr("Open a recording (Ctrl+O)."))
        self.again = self._action(tr("Track again …"), tr("Track the recording with another tracker, rig or hand."))
        self.compare = self._action(tr("Compare …"), tr("Track it in another way too, and show both hands together."))
        self.alone = self._action(tr("End comparison"), tr("Show one run alone again."))
        self.export = self._action(tr("Export …"), tr("Write these states as a file for other programs (Ctrl+E)."))
        self.trim = self._action(tr("Trim …"), tr("Save the repeated range as a recording of its own."))
        self.pictures = self._action(tr("Pictures"), tr("What the cameras saw, with the hand drawn over it (P)."))
        self.pictures.setCheckable(True)
        self.remove = self._action(tr("Remove the bookmark here"),
                                   tr("Remove the bookmark at which the recording stands."))
        self.menu = QMenu(tr("Bookmarks"), self)
        self.menu.menuAction().setToolTip(tr("Moments that were marked, while recording or here; choose one to go "
                                             "there."))
        self.badge = StateBadge(scheme)
        self.addWidget(self.word)
        self.addWidget(self.name)
        self.addSeparator()
        self.controls = QToolBar(self)  # what does not fit stands behind its arrow, and the state stays in sight
        self.controls.setObjectName("controls")
        self.controls.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.controls.addActions([self.open, self.again, self.compare, self.alone, self.export, self.trim,
                                  self.pictures, self.menu.menuAction()])
        button = self.controls.widgetForAction(self.menu.menuAction())
        assert isinstance(button, QToolButton)
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.addWidget(self.controls)
        margins = self.controls.layout()
        assert margins is not None
        margins.setContentsMargins(0, 0, 0, 0)  # it took those of a toolbar that stands alone
        self.addWidget(self.badge)
        self.set_scheme(scheme)
        self.show_replay(None)

    def _action(self, text: str, meaning: str) -> QAction:
        action = QAction(text, self)
        action.setToolTip(meaning)
        return action

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self.word.setStyleSheet(f"background: {scheme.accent}; color: {scheme.on_accent}; border-radius: 6px; "
                                "padding: 4px 10px; font-weight: 700;")
        self.badge.set_scheme(scheme)
        show_overflow(self.controls, scheme.text)

    def show_replay(self, replay: Replay | None) -> None:
        """Another recording, another run, or other bookmarks."""
        name = replay.path.name if replay is not None else tr("no recording")
        self.name.setText(f" {self.fontMetrics().elidedText(name, Qt.TextElideMode.ElideMiddle, _NAME_PX)}  ")
        self.name.setToolTip(str(replay.path) if replay is not None else "")
        for action in (self.again, self.compare, self.export, self.trim, self.pictures):
            action.setEnabled(replay is not None)
        self.alone.setVisible(replay is not None and replay.second is not None)
        self.menu.menuAction().setEnabled(replay is not None)
        self.menu.clear()
        for mark in replay.bookmarks if replay is not None else ():
            assert replay is not None
            position = replay.seconds_of(mark.t_master_ns)
            entry = self.menu.addAction(replay.bookmark_text(mark))
            entry.triggered.connect(lambda checked=False, position=position: self.bookmark_chosen.emit(position))
        if replay is not None and not replay.bookmarks:
            self.menu.addAction(tr("No bookmarks yet: B sets one.")).setEnabled(False)
        self.menu.addSeparator()
        self.menu.addAction(self.remove)


# -- Bookmarks of a recording ------------------------------------------------------------------------------------------

class BookmarkWriter(QObject):
    """`written` after the recording has another bookmark, or one less; `failed` says why it has not."""

    written = Signal()
    failed = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._window = parent
        self.dialog: BookmarkDialog | None = None
        self._writing: Job | None = None
        self._waiting: list[tuple[Replay, Bookmark]] = []

    def ask(self, replay: Replay) -> None:
        """Ask about the moment that is shown now; the recording may play on."""
        if self.dialog is not None:
            return
        at_ns = replay.position_ns
        self.dialog = BookmarkDialog(lambda text: self._write(replay, Bookmark(at_ns, text)), self._window)
        self.dialog.finished.connect(self._forget_dialog)

    def remove(self, replay: Replay, bookmark: Bookmark) -> None:
        """Remove a bookmark."""
        self._write(replay, Bookmark(bookmark.t_master_ns, ""))

    def _forget_dialog(self) -> None:
        if self.dialog is not None:
            dispose(self.dialog)
            self.dialog = None

    def _write(self, replay: Replay, bookmark: Bookmark) -> None:
        """One after the other: a worker reads the whole log to find its end."""
        self._waiting.append((replay, bookmark))
        if self._writing is None:
            self._next()

    def _next(self) -> None:
        self._writing = None
        if self._waiting:
            replay, bookmark = self._waiting.pop(0)
            self._writing = Job(lambda progress: append_bookmark(replay.path, bookmark),
                                lambda _: self._done(replay, bookmark), self._fail, None, self).start()

    def _done(self, replay: Replay, bookmark: Bookmark) -> None:
        replay.add_bookmark(bookmark)
        self.written.emit()
        self._next()

    def _fail(self, sentence: str) -> None:
        self.failed.emit(sentence)
        self._next()
