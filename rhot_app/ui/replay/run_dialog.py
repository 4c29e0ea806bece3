"""How a recording is tracked again: which tracker, rig and hand; in place of the run that is shown, or beside it."""

from __future__ import annotations

import itertools
import time
from pathlib import Path

from platformdirs import user_cache_path
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.ui.backend.solver import Solver, StoppedError
from rhot_app.ui.common.job import CancelledError, Job, Progress
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.words import Remaining
from rhot_app.ui.replay.run import Run, Tracked, new_run_path, track_log
from rhot_app.ui.replay.session import Comparison, TrackerChoice

_TRACKERS = ((tr_noop("as the rig says"), ""), (tr_noop("classic"), "classic"), (tr_noop("estimator"), "estimator"))
_WIDTH_PX = 480


class FileChoice(QWidget):
    """A file, or what the recording has itself."""

    changed = Signal()

    def __init__(self, title: str, own: str, without: str = tr_noop("As recorded"),
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._title, self._own = title, own
        self.path: Path | None = None
        self.label = QLabel(own)
        self.choose_button, self.forget_button = QPushButton(tr("Choose …")), QPushButton(tr(without))
        for button in (self.choose_button, self.forget_button):
            button.setAutoDefault(False)
        self.choose_button.clicked.connect(self.choose)
        self.forget_button.clicked.connect(lambda: self.show_path(None))
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.label, 1)
        row.addWidget(self.forget_button)
        row.addWidget(self.choose_button)
        self.show_path(None)

    def choose(self) -> None:
        """Ask for a file."""
        name, _ = QFileDialog.getOpenFileName(self, self._title, str(self.path.parent if self.path else Path.home()),
                                              tr("JSON files (*.json);;All files (*)"))
        if name:
            self.show_path(Path(name))

    def show_path(self, path: Path | None) -> None:
        """Take a file; None for the recording's own."""
        self.path = path
        self.label.setText(path.name if path is not None else self._own)
        self.label.setToolTip(str(path or ""))
        self.forget_button.setVisible(path is not None)
        self.changed.emit()


class RunDialog(QDialog):
    """`chosen` gives the `TrackerChoice`. `beside`: it will be compared with the run that is shown."""

    chosen = Signal(object)

    def __init__(self, *, beside: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._beside = beside
        self.setWindowTitle(tr("Compare with another run") if beside else tr("Track again"))
        self.setProperty("guide", "recording")
        self.setMinimumWidth(_WIDTH_PX)
        words = QLabel(tr("The recording is tracked once more, and both hands are shown together.") if beside
                       else tr("The recording is tracked once more; the moment that is shown stays."))
        words.setWordWrap(True)
        self.tracker_box = QComboBox()
        for text, kind in _TRACKERS:
            self.tracker_box.addItem(tr(text), kind)
        self.rig_choice = FileChoice(tr("Track with a rig file"), tr("as recorded"))
        self.hand_choice = FileChoice(tr("Track with a hand file"), tr("the rig's hand"))
        self.smooth_box = QCheckBox(tr("Smooth"))
        self.smooth_box.setToolTip(tr("Every state uses what came after it as well. Only the estimator can."))
        self.start_button, close = QPushButton(tr("Track")), QPushButton(tr("Cancel"))
        self.start_button.setDefault(True)
        self.start_button.clicked.connect(self._choose)
        close.clicked.connect(self.reject)
        form, buttons = QGridLayout(), QHBoxLayout()
        form.setColumnStretch(1, 1)
        form.setVerticalSpacing(8)
        for row, (name, part) in enumerate(((tr("Tracker"), self.tracker_box), (tr("Rig"), self.rig_choice),
                                            (tr("Hand"), self.hand_choice), ("", self.smooth_box))):
            form.addWidget(QLabel(name), row, 0)
            form.addWidget(part, row, 1)
        buttons.addStretch(1)
        buttons.addWidget(close)
        buttons.addWidget(self.start_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addWidget(words)
        layout.addLayout(form)
        layout.addLayout(buttons)

    def _choose(self) -> None:
        self.chosen.emit(TrackerChoice(self.tracker_box.currentData(), self.rig_choice.path, self.hand_choice.path,
                                       self._beside, self.smooth_box.isChecked()))
        self.accept()


# -- Tracking of a recording in its own process ------------------------------------------------------------------------

_COUNT = itertools.count()


def states_folder() -> Path:
    """Where the states of open recordings lie: a disk, because a folder in memory would hold 300 MB for ten minutes."""
    return user_cache_path("rhot", appauthor=False) / "states"


class TrackingWork(QObject):
    """One recording at a time. `done` gives the log's path, the `Run`, its `TrackerChoice` and the `Comparison` that
    was asked for or None; `failed` a sentence; `changed` after every report and at the end."""

    done = Signal(object, object, object, object)
    failed = Signal(str)
    changed = Signal()

    def __init__(self, solver: Solver, folder: Path | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.solver = solver
        self.text = ""
        self._folder = folder or states_folder()
        self._job: Job | None = None
        self._remaining = Remaining(0.0)

    @property
    def running(self) -> bool:
        """Whether a recording is being tracked."""
        return self._job is not None

    @property
    def fraction(self) -> float:
        """How much is done, 0..1."""
        return self._remaining.fraction

    @property
    def remaining(self) -> str:
        """Remaining time in words."""
        return self._remaining.text(time.monotonic())

    def start(self, log: Path, choice: TrackerChoice, other: Tracked | None = None) -> None:
        """Track `log`; what was under way is given up. `other`: the run that stays, to be compared with."""
        self.cancel()
        self.text = tr("Reading the recording …")
        self._remaining = Remaining(time.monotonic())
        self._job = Job(lambda progress: self._compared(self._track(log, choice, progress), choice, other),
                        lambda found: self._finish(log, choice, *found), self._fail, self._report, self).start()
        self.changed.emit()

    def cancel(self) -> None:
        """Give up what is under way, if anything is; nothing of it is left."""
        job, self._job = self._job, None
        if job is not None:
            job.cancel()
            self.solver.stop()
            self.changed.emit()

    def close(self) -> None:
        """End everything, the process included."""
        self.cancel()
        self.solver.stop()

    def _track(self, log: Path, choice: TrackerChoice, progress: Progress) -> Run:
        rig = choice.rig_for(log)
        out = new_run_path(self._folder, next(_COUNT))
        try:
            tracked: Tracked = self.solver.run(track_log, (log, rig, out, choice.smooth), progress.report)
            run = Run(tracked, out)
        except StoppedError as exc:
            out.unlink(missing_ok=True)
            raise CancelledError(tr("Cancelled.")) from exc
        except BaseException:
            out.unlink(missing_ok=True)
            raise
        if progress.cancelled:
            run.close()
            raise CancelledError(tr("Cancelled."))
        return run

    @staticmethod
    def _compared(run: Run, choice: TrackerChoice, other: Tracked | None) -> tuple[Run, Comparison | None]:
        """Here and not in the window's thread, because long runs take a tenth of a second."""
        if other is None:
            return run, None
        return run, Comparison(other, run.tracked) if choice.beside else Comparison(run.tracked, other)

    def _report(self, text: str, fraction: float) -> None:
        self.text = text
        self._remaining.report(fraction, time.monotonic())
        self.changed.emit()

    def _finish(self, log: Path, choice: TrackerChoice, run: Run, comparison: Comparison | None) -> None:
        self._job = None
        self.changed.emit()
        self.done.emit(log, run, choice, comparison)

    def _fail(self, sentence: str) -> None:
        self._job = None
        self.changed.emit()
        self.failed.emit(sentence)
