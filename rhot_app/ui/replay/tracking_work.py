"""Tracks a recording in a process of its own while the window goes on: progress, remaining time, cancel."""

from __future__ import annotations

import itertools
import time
from pathlib import Path

from platformdirs import user_cache_path
from PySide6.QtCore import QObject, Signal

from rhot_app.ui.job import CancelledError, Job, Progress
from rhot_app.ui.replay.comparison import Comparison
from rhot_app.ui.replay.run import Run, Tracked, new_run_path, track_log
from rhot_app.ui.replay.session import Choice
from rhot_app.ui.wizards.models.remaining import Remaining
from rhot_app.ui.wizards.solver import Solver, StoppedError

_COUNT = itertools.count()

_NICENESS = 10  # somebody waits for it, but window and engine come first


def states_folder() -> Path:
    """Where the states of open recordings lie: a disk, because a folder in memory would hold 300 MB for ten minutes."""
    return user_cache_path("rhot", appauthor=False) / "states"


class TrackingWork(QObject):
    """One recording at a time. `done` gives the log's path, the `Run`, its `Choice` and the `Comparison` that was asked
    for or None; `failed` a sentence; `changed` after every report and at the end."""

    done = Signal(object, object, object, object)
    failed = Signal(str)
    changed = Signal()

    def __init__(self, folder: Path | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.solver = Solver(_NICENESS)
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

    def start(self, log: Path, choice: Choice, other: Tracked | None = None) -> None:
        """Track `log`; what was under way is given up. `other`: the run that stays, to be compared with."""
        self.cancel()
        self.text = "Reading the recording …"
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

    def _track(self, log: Path, choice: Choice, progress: Progress) -> Run:
        rig = choice.rig_for(log)
        out = new_run_path(self._folder, next(_COUNT))
        try:
            tracked: Tracked = self.solver.run(track_log, (log, rig, out, choice.smooth), progress.report)
            run = Run(tracked, out)
        except StoppedError as exc:
            out.unlink(missing_ok=True)
            raise CancelledError("Cancelled.") from exc
        except BaseException:
            out.unlink(missing_ok=True)
            raise
        if progress.cancelled:
            run.close()
            raise CancelledError("Cancelled.")
        return run

    @staticmethod
    def _compared(run: Run, choice: Choice, other: Tracked | None) -> tuple[Run, Comparison | None]:
        """Here and not in the window's thread, because long runs take a tenth of a second."""
        if other is None:
            return run, None
        return run, Comparison(other, run.tracked) if choice.beside else Comparison(run.tracked, other)

    def _report(self, text: str, fraction: float) -> None:
        self.text = text
        self._remaining.report(fraction, time.monotonic())
        self.changed.emit()

    def _finish(self, log: Path, choice: Choice, run: Run, comparison: Comparison | None) -> None:
        self._job = None
        self.changed.emit()
        self.done.emit(log, run, choice, comparison)

    def _fail(self, sentence: str) -> None:
        self._job = None
        self.changed.emit()
        self.failed.emit(sentence)
