"""The recordings as a list: when, which rig, how long, how well tracked; open, rename, delete, undo."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path
from PySide6.QtCore import QEvent, Qt, QUrl, Signal
from PySide6.QtGui import QCloseEvent, QDesktopServices, QKeySequence, QShortcut
from PySide6.QtWidgets import QDialog, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from rhot_app.errors import RhotError
from rhot_app.ui.job import Job
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.empty_state import EmptyState
from rhot_app.ui.recordings import recordings_folder
from rhot_app.ui.replay.library import Entry, Library
from rhot_app.ui.replay.library_table import RecordingTable
from rhot_app.ui.replay.summaries import Summaries

_SIZE = (1080, 560)


def summaries_folder() -> Path:
    """Where the summaries of recordings are kept."""
    return user_cache_path("rhot", appauthor=False) / "recordings"


class LibraryWindow(QDialog):
    """`open_asked` gives a recording's path; `renamed` its path before and after."""

    open_asked = Signal(object)
    renamed = Signal(object, object)

    def __init__(self, scheme: Scheme, folder: Path | None = None, cache: Path | None = None,
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Recordings")
        self.setProperty("guide", "recording")
        self.setWindowFlag(Qt.WindowType.WindowMaximizeButtonHint)
        self.resize(*_SIZE)
        self.library = Library(folder or recordings_folder(), cache or summaries_folder())
        self.summaries = Summaries(self.library, self)
        self._listing: Job | None = None
        self.empty = EmptyState("No recordings yet. Press Record, or R, while a rig is open.")
        self.table = RecordingTable(scheme)
        self.sentence = QLabel()
        self.sentence.setWordWrap(True)
        self.open_button = _button("Open", "Track the recording and play it (Enter).")
        self.rename_button = _button("Rename", "Call the recording something else (F2).")
        self.delete_button = _button("Delete", "Delete the recording; Undo brings it back until this page is closed "
                                     "(Delete).")
        self.undo_button = _button("Undo", "Bring back the recording that was deleted last (Ctrl+Z).")
        self.folder_button = _button("Open folder", "Show the recordings in the desktop's file manager.")
        self.close_button = _button("Close", "Close this page. What was deleted is then gone for good.")
        self._lay_out()
        self._connect()
        self._show_choice()
        self.refresh()

    # -- putting it together ---------------------------------------------------------------------------------------

    def _lay_out(self) -> None:
        buttons = QHBoxLayout()
        for button in (self.open_button, self.rename_button, self.delete_button, self.undo_button,
                       self.folder_button):
            buttons.addWidget(button)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(12)
        layout.addWidget(self.empty)
        layout.addWidget(self.table, 1)
        layout.addWidget(self.sentence)
        layout.addLayout(buttons)

    def _connect(self) -> None:
        self.table.itemSelectionChanged.connect(self._show_choice)
        self.table.itemDoubleClicked.connect(lambda item: self.open_chosen())
        self.table.named.connect(self._rename)
        self.summaries.changed.connect(self._show_summary)
        self.open_button.clicked.connect(self.open_chosen)
        self.rename_button.clicked.connect(self.table.edit_name)
        self.delete_button.clicked.connect(self.delete_chosen)
        self.undo_button.clicked.connect(self.undo)
        self.folder_button.clicked.connect(self.open_folder)
        self.close_button.clicked.connect(self.close)
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

    def _fill(self, entries: list[Entry]) -> None:
        chosen = self.table.chosen
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
        entry = self.table.chosen
        self.open_button.setEnabled(entry is not None and not entry.problem)
        self.rename_button.setEnabled(entry is not None)
        self.delete_button.setEnabled(entry is not None)
        undoable = self.library.undoable
        self.undo_button.setEnabled(bool(undoable))
        said = [f"Deleted {undoable}. Undo brings it back; it is gone for good when this page is closed."
                ] if undoable else []
        if entry is not None and entry.problem:
            said.append(entry.problem)
        self.sentence.setText("\n".join(said))

    # -- what the buttons do ---------------------------------------------------------------------------------------

    def open_chosen(self) -> None:
        """Play the recording that is selected."""
        entry = self.table.chosen
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
        entry = self.table.chosen
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

    def open_folder(self) -> None:
        """Show the folder in the desktop's own file manager."""
        folder = self.library.folder
        if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder))):
            self.sentence.setText(f"This desktop opens no folders. The recordings lie in {folder}.")

    def changeEvent(self, event: QEvent) -> None:  # noqa: N802
        """Back from another window: look again, a recording may have been made meanwhile."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange and self.isActiveWindow() and (
                not self.table.editing):
            self.refresh()

    def reject(self) -> None:
        """Escape closes the page."""
        self.close()

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """What was deleted is gone for good now; the work on summaries ends."""
        self.summaries.close()
        self.library.empty_trash()
        super().closeEvent(event)


def _button(text: str, meaning: str) -> QPushButton:
    button = QPushButton(text)
    button.setToolTip(meaning)
    button.setAutoDefault(False)
    return button
