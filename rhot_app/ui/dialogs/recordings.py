"""Recordings as the person at the screen makes them: a new file each, and a word about it when it is finished."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QInputDialog, QWidget

from rhot_app.engine.status import Level
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.disposal import dispose
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.notice import Notice
from rhot_app.ui.models.rows import bytes_text

# -- Bookmarks of a recording ------------------------------------------------------------------------------------------

NO_WORDS = "bookmark"
"""What a bookmark says when nothing was typed: hands full of paint type nothing."""


class BookmarkDialog(QInputDialog):
    """Asks once; `taken` hears the words. Nothing waits for it."""

    def __init__(self, taken: Callable[[str], None], parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Bookmark"))
        self.setLabelText(tr("What happens here?"))
        self.textValueSelected.connect(lambda text: taken(text.strip() or NO_WORDS))
        self.open()


# -- Recordings and their files ----------------------------------------------------------------------------------------

LOG_SUFFIX = ".rhotlog"
LOG_FILTER = tr_noop("Recordings (*.rhotlog);;All files (*)")
SHOW_FOLDER = "show the recording's folder"


def newest_recording(folder: Path) -> Path | None:
    """The recording in a folder that was written last; None when there is none."""
    written = []
    for path in folder.glob(f"*{LOG_SUFFIX}"):
        with contextlib.suppress(OSError):  # it may just have been removed
            written.append((path.stat().st_mtime_ns, path))
    return max(written)[1] if written else None


class Recordings:
    """`tell` takes the sentences that are to be shown for a while."""

    def __init__(self, controller: Controller, settings: Settings, tell: Callable[[Notice], None]) -> None:
        self._controller = controller
        self._settings = settings
        self._tell = tell
        self._log_path = ""
        self._finished = Path()
        self._video = False  # whether what is recorded has video
        self.dialog: BookmarkDialog | None = None

    def begin_or_end(self, *, video: bool = False) -> None:
        """Begin a log in the folder of recordings, named by date and time; or end the one that is being written.

        `video`: the nodes record their frames, too.
        """
        if self._controller.recording:
            self._controller.stop_recording()
            return
        self._video = video
        folder = self._settings.recordings_folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as exc:
            self._say("error", tr("{folder}: cannot be made ({strerror}), so nothing is recorded.", folder=folder,
                                  strerror=exc.strerror))
            return
        self._controller.record(folder / f"{datetime.now():%Y-%m-%d_%H-%M-%S}{LOG_SUFFIX}", video=video)

    def ask_for_bookmark(self, window: QWidget) -> None:
        """Ask for a few words about this moment, and have the engine write them into the log."""
        if not self._controller.recording:
            self._say("info", tr("Nothing is being recorded, so there is nothing to put a bookmark into. R records."))
            return
        if self.dialog is not None:
            return
        at_ns = round(1e9 * self._controller.clock())
        self.dialog = BookmarkDialog(lambda text: self._set_bookmark(text, at_ns), window)
        self.dialog.finished.connect(self._forget_dialog)

    def _set_bookmark(self, text: str, at_ns: int) -> None:
        self._controller.link.work(lambda client: client.command("bookmark", text=text, t_master_ns=at_ns),
                                   lambda answer: self._say("info", tr("Bookmark “{text}” is set.", text=text)))

    def _forget_dialog(self) -> None:
        if self.dialog is not None:
            dispose(self.dialog)
            self.dialog = None

    def step(self) -> None:
        """Watch the engine's log; whoever ended it, and however, the person hears where the file is."""
        status = self._controller.live.status
        if status is None or status.log_path == self._log_path:
            return
        finished, self._log_path = self._log_path, status.log_path
        if finished and not status.log_path:  # else it continues in a new part, as the status says
            self._confirm(Path(finished))

    def _confirm(self, path: Path) -> None:
        self._finished = path
        try:
            size = bytes_text(path.stat().st_size)
        except OSError as exc:
            self._say("error",
                      tr("{path}: the recording cannot be found ({strerror}).", path=path, strerror=exc.strerror))
            return
        video = tr(" The cameras keep its videos until Rig, Recordings collects them.") if self._video else ""
        self._tell(Notice("info", tr("Recorded {size} to {path}.{video}", size=size, path=path, video=video),
                          tr("Show in folder"), SHOW_FOLDER))

    def show_folder(self) -> None:
        """Open the folder of the last recording in the desktop's own file manager."""
        folder = self._finished.parent
        if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder))):
            self._say("info", tr("This desktop opens no folders. The recording lies in {folder}.", folder=folder))

    def _say(self, level: Level, sentence: str) -> None:
        self._tell(Notice(level, sentence))
