"""The long work of a step: runs it in the solver's process, tells how far it is, cancels it."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

from PySide6.QtCore import QObject, Signal

from rhot_app.errors import CalibrationError
from rhot_app.ui.backend.feed import LiveFeed, Picture
from rhot_app.ui.backend.reader import Reader
from rhot_app.ui.backend.solver import Solver, StoppedError
from rhot_app.ui.common.job import CancelledError, Job, Progress
from rhot_app.ui.models.words import Remaining
from rhot_app.ui.wizards.models.step import Step, Task

CANCELLED = "Stopped. Go on with Begin again, or go back."


class Work(QObject):
    """One task at a time. `changed` after every report and at the end; the step is told the outcome before."""

    changed = Signal()

    def __init__(self, solver: Solver, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.solver = solver
        self.task: Task | None = None
        self.text = ""
        self.halted = False  # cancelled or failed: not to begin again by itself
        self._step: Step | None = None
        self._job: Job | None = None
        self._remaining = Remaining(0.0)

    @property
    def running(self) -> bool:
        """Whether something is being computed."""
        return self._job is not None

    @property
    def fraction(self) -> float:
        """How much is done, 0..1."""
        return self._remaining.fraction

    @property
    def remaining(self) -> str:
        """Remaining time in words."""
        return self._remaining.text(time.monotonic())

    def offer(self, step: Step) -> None:
        """Begin the step's task if it has one and nothing is under way."""
        if self._job is not None or self.halted:
            return
        task = step.task()
        if task is not None:
            self._start(step, task)

    def again(self, step: Step) -> None:
        """Begin although it was cancelled or failed before."""
        self.halted = False
        self.offer(step)

    def cancel(self) -> None:
        """End what is under way; the step is told so."""
        job, self._job = self._job, None
        if job is not None:
            job.cancel()
            self.solver.stop()
            self.halted = True
            if self._step is not None:
                self._step.take_failure(CANCELLED)
            self.changed.emit()

    def leave(self) -> None:
        """Another step: what is under way is of no use any more."""
        self.cancel()
        self.halted = False

    def close(self) -> None:
        """End everything, the process included."""
        self.cancel()
        self.solver.stop()

    def _start(self, step: Step, task: Task) -> None:
        self._step, self.task, self.text = step, task, task.title
        self._remaining = Remaining(time.monotonic())
        self._job = Job(lambda progress: self._compute(task, progress), self._on_done, self._on_failed, self._on_report,
                        self).start()
        self.changed.emit()

    def _compute(self, task: Task, progress: Progress) -> Any:
        try:
            return self.solver.run(task.function, task.arguments, progress.report, task.options)
        except StoppedError as exc:
            if progress.cancelled:
                raise CancelledError("Cancelled.") from exc
            raise CalibrationError("The work was stopped.") from exc

    def _on_report(self, text: str, fraction: float) -> None:
        self.text = text
        self._remaining.report(fraction, time.monotonic())
        self.changed.emit()

    def _on_done(self, result: Any) -> None:
        self._job = None
        if self._step is not None:
            self._step.take_result(result)
        self.changed.emit()

    def _on_failed(self, sentence: str) -> None:
        self._job = None
        self.halted = True
        if self._step is not None:
            self._step.take_failure(sentence)
        self.changed.emit()


# -- Thread that has a step look at the newest pictures (no Qt) --------------------------------------------------------

log = logging.getLogger(__name__)

_IDLE_S = 0.01


class PictureWorker(Reader):
    """Looks for one step at a time; `found` gives each finding once. Every look has a new picture of every camera: who
    judges whether something moved must not see the same picture twice."""

    def __init__(self, feed: LiveFeed) -> None:
        super().__init__()
        self._feed = feed
        self._lock = threading.Lock()
        self._step: Step | None = None
        self._found: tuple[Step, Any] | None = None
        self._looked_at: dict[str, Picture] = {}

    def watch(self, step: Step | None) -> None:
        """Look for `step` from now on; None rests. What was found for another step is forgotten."""
        with self._lock:
            self._step = step if step is not None and step.watches else None
            self._found = None
            self._looked_at = {}

    def found(self, step: Step) -> Any:
        """What was found for `step` since the last call; None for nothing new."""
        with self._lock:
            found, self._found = self._found, None
        return found[1] if found is not None and found[0] is step else None

    def look(self) -> bool:
        """One look, if there is anything new to see; whether there was."""
        with self._lock:
            step, last = self._step, self._looked_at
        if step is None:
            return False
        pictures = self._feed.together(step.cameras or self._feed.cameras)
        if not pictures or any(picture is last.get(name) for name, picture in pictures.items()):
            return False
        try:
            seen = step.observe(pictures)
        except Exception:  # one strange picture must not end the live view; the log has the whole story
            log.exception("a picture could not be looked at")
            seen = None
        with self._lock:
            if self._step is step:
                self._looked_at = pictures
                self._found = (step, seen) if seen is not None else self._found
        return True

    def _run(self) -> None:
        while not self._ending.is_set():
            if not self.look():
                self._ending.wait(_IDLE_S)
