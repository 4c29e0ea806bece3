"""The long work of a step: runs it in the solver's process, tells how far it is, cancels it."""

from __future__ import annotations

import time
from typing import Any

from PySide6.QtCore import QObject, Signal

from rhot_app.errors import CalibrationError
from rhot_app.ui.backend.solver import Solver, StoppedError
from rhot_app.ui.common.job import CancelledError, Job, Progress
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.words import Remaining
from rhot_app.ui.wizards.framework.step import Step, Task

CANCELLED = tr_noop("Stopped. Go on with Begin again, or go back.")


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
                self._step.take_failure(tr(CANCELLED))
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
        self._step, self.task, self.text = step, task, tr(task.title)
        self._remaining = Remaining(time.monotonic())
        self._job = Job(lambda progress: self._compute(task, progress), self._on_done, self._on_failed, self._on_report,
                        self).start()
        self.changed.emit()

    def _compute(self, task: Task, progress: Progress) -> Any:
        try:
            return self.solver.run(task.function, task.arguments, progress.report)
        except StoppedError as exc:
            if progress.cancelled:
                raise CancelledError(tr("Cancelled.")) from exc
            raise CalibrationError(tr("The work was stopped.")) from exc

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
