"""Asks for a few words about a moment and has a worker write them into the recording; removes a bookmark likewise."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from rhot_app.recording.bookmarks import Bookmark, append_bookmark
from rhot_app.ui.bookmark_dialog import BookmarkDialog
from rhot_app.ui.job import Job
from rhot_app.ui.replay.session import Replay


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
            self.dialog.deleteLater()
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
