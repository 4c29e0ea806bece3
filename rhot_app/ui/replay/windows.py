"""What the main window knows of recordings: a window that replays, a page that lists, a dialog that tracks films."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from rhot_app.project import Rig
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.common.disposal import dispose
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.dialogs.recordings import LOG_FILTER, newest_recording
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.replay.films_dialog import FilmsDialog
from rhot_app.ui.replay.library_window import LibraryWindow
from rhot_app.ui.replay.window import ReplayWindow


class ReplayWindows:
    """`scheme` gives the colours of the moment, `rig` the rig that is open. What is open stays beside `parent` and ends
    with it."""

    def __init__(self, settings: Settings, scheme: Callable[[], Scheme], parent: QWidget,
                 rig: Callable[[], Rig | None] = lambda: None, make_solver: Callable[[], Solver] = Solver) -> None:
        self._settings, self._scheme, self._parent = settings, scheme, parent
        self._rig, self._make_solver = rig, make_solver
        self.window: ReplayWindow | None = None
        self.library: LibraryWindow | None = None
        self.films: FilmsDialog | None = None

    def choose(self) -> None:
        """Ask for a recording and replay it."""
        folder = self._settings.recordings_folder
        start = newest_recording(folder) or folder
        name, _ = QFileDialog.getOpenFileName(self._parent, tr("Open a recording"), str(start), tr(LOG_FILTER))
        if name:
            self.open(Path(name))

    def open(self, path: Path) -> None:
        """Replay a recording, in the window that replays already if there is one."""
        if self.window is None:
            self.window = ReplayWindow(self._settings, self._scheme(), make_solver=self._make_solver)
            self.window.closed.connect(self._forget_window)
        _bring_forward(self.window)
        self.window.open(path)

    def list(self) -> None:
        """The page with all recordings."""
        if self.library is None:
            self.library = LibraryWindow(self._scheme(), self._settings.recordings_folder, parent=self._parent,
                                         rig=self._rig, make_solver=self._make_solver)
            self.library.open_asked.connect(self.open)
            self.library.renamed.connect(self._follow)
            self.library.finished.connect(self._forget_library)
        else:
            self.library.refresh()
        _bring_forward(self.library)

    def track_films(self) -> None:
        """Ask for films of a hand, track them and replay what was found."""
        if self.films is None:
            self.films = FilmsDialog(self._make_solver, self._parent)
            self.films.tracked.connect(self.open)
            self.films.finished.connect(self._forget_films)
        _bring_forward(self.films)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        for part in (self.window, self.library):
            if part is not None:
                part.set_scheme(scheme)

    def close(self) -> None:
        """Close both."""
        for part in (self.window, self.library, self.films):
            if part is not None:
                part.close()

    def _follow(self, before: Path, after: Path) -> None:
        """A recording that is open was renamed."""
        if self.window is not None:
            self.window.follow(before, after)

    def _forget_window(self) -> None:
        if self.window is not None:
            dispose(self.window)
            self.window = None

    def _forget_films(self) -> None:
        if self.films is not None:
            dispose(self.films)
            self.films = None

    def _forget_library(self) -> None:
        if self.library is not None:
            dispose(self.library)
            self.library = None


def _bring_forward(window: QWidget) -> None:
    window.show()
    window.raise_()
    window.activateWindow()
