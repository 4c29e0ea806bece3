"""One-shot work away from the window's thread: `Job(op, done, failed, progress)`. Workers never touch widgets."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, ClassVar

from PySide6.QtCore import QObject, Qt, Signal

from rhot_app.errors import RhotError
from rhot_node.errors import NodeError


class CancelledError(RhotError):
    """The job was cancelled by the person at the screen."""


class Progress:
    """What `op` is given: where to report to, and whether it should stop."""

    def __init__(self, report: Callable[[str, float], None]) -> None:
        self._report = report
        self._cancelled = threading.Event()

    def report(self, text: str, fraction: float) -> None:
        """Say what is being done and how much is done, 0..1; raises CancelledError once it was cancelled."""
        if self._cancelled.is_set():
            raise CancelledError("Cancelled.")
        self._report(text, fraction)

    @property
    def cancelled(self) -> bool:
        """Whether the work should stop."""
        return self._cancelled.is_set()

    def cancel(self) -> None:
        """Ask the work to stop."""
        self._cancelled.set()


class Job(QObject):
    """Runs `op(progress)` in a thread of its own; `done(result)` or `failed(sentence)` follow in the window's thread.

    Exactly one of the two is called, except after `cancel`: then neither is. An error that is not one of ours is
    shown as a sentence too, with its kind, and is raised in the worker's thread for the log.
    """

    _reported = Signal(str, float)
    _finished = Signal(object)
    _broke = Signal(str)
    _stopped = Signal()
    _under_way: ClassVar[set[Job]] = set()  # a job lives until its last word has been heard

    def __init__(self, op: Callable[[Progress], Any], done: Callable[[Any], None], failed: Callable[[str], None],
                 progress: Callable[[str, float], None] | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._op, self._done, self._failed, self._show = op, done, failed, progress
        self.progress = Progress(self._reported.emit)
        queued = Qt.ConnectionType.QueuedConnection
        self._finished.connect(self._on_done, queued)
        self._broke.connect(self._on_failed, queued)
        self._reported.connect(self._on_progress, queued)
        self._stopped.connect(self._on_stopped, queued)
        self._thread = threading.Thread(target=self._run, name="job", daemon=True)

    def start(self) -> Job:
        """Begin; returns itself."""
        Job._under_way.add(self)
        self._thread.start()
        return self

    def cancel(self) -> None:
        """Ask `op` to stop; neither `done` nor `failed` will be called."""
        self.progress.cancel()

    def wait(self, timeout_s: float) -> bool:
        """Wait for the thread's end, at most `timeout_s`; whether it has ended."""
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    @property
    def running(self) -> bool:
        """Whether `op` still runs."""
        return self._thread.is_alive()

    def _run(self) -> None:
        try:
            result = self._op(self.progress)
        except CancelledError:
            return
        except (RhotError, NodeError, OSError) as exc:
            self._broke.emit(str(exc))
        except Exception as exc:
            self._broke.emit(f"The program made a mistake ({type(exc).__name__}: {exc}). Please report it.")
            raise
        else:
            self._finished.emit(result)
        finally:
            self._stopped.emit()

    def _on_stopped(self) -> None:
        Job._under_way.discard(self)

    def _on_done(self, result: Any) -> None:
        if not self.progress.cancelled:
            self._done(result)

    def _on_failed(self, sentence: str) -> None:
        if not self.progress.cancelled:
            self._failed(sentence)

    def _on_progress(self, text: str, fraction: float) -> None:
        if self._show is not None and not self.progress.cancelled:
            self._show(text, fraction)
