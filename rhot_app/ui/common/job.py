"""One-shot work away from the window's thread: `Job(op, done, failed, progress)`. Workers never touch widgets."""

from __future__ import annotations

import contextlib
import functools
import logging
import queue
import threading
from collections.abc import Callable
from typing import Any, ClassVar

from PySide6.QtCore import QObject, Qt, Signal, SignalInstance

from rhot_app.errors import RhotError
from rhot_app.ui.language import tr
from rhot_node.errors import NodeError

log = logging.getLogger(__name__)


class CancelledError(RhotError):
    """The job was cancelled by the person at the screen."""


class Workers:
    """A few threads that wait for work. Made before the window gives way (`app.give_way`): on Linux each thread
    has a niceness of its own and hands it down, and the engine that a job starts must not be as nice as the window."""

    def __init__(self, count: int = 6) -> None:
        self._waiting: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        for number in range(count):
            threading.Thread(target=self._run, name=f"worker {number}", daemon=True).start()

    def submit(self, work: Callable[[], None]) -> None:
        """Have the next free thread do `work`."""
        self._waiting.put(work)

    def _run(self) -> None:
        while True:
            try:
                self._waiting.get()()
            except Exception:
                log.exception("a job failed")


@functools.cache
def workers() -> Workers:
    """The app's own threads, made at the first call."""
    return Workers()


class Progress:
    """What `op` is given: where to report to, and whether it should stop."""

    def __init__(self, report: Callable[[str, float], None]) -> None:
        self._report = report
        self._cancelled = threading.Event()

    def report(self, text: str, fraction: float) -> None:
        """Say what is being done and how much is done, 0..1; raises CancelledError once it was cancelled."""
        if self._cancelled.is_set():
            raise CancelledError(tr("Cancelled."))
        self._report(text, fraction)

    @property
    def cancelled(self) -> bool:
        """Whether the work should stop."""
        return self._cancelled.is_set()

    def cancel(self) -> None:
        """Ask the work to stop."""
        self._cancelled.set()


class Job(QObject):
    """Runs `op(progress)` in a worker's thread; `done(result)` or `failed(sentence)` follow in the window's thread.

    Exactly one of the two is called, except after `cancel`: then neither is. An error that is not one of ours is
    shown as a sentence too, with its kind, and logged whole.
    """

    _reported = Signal(str, float)
    _finished = Signal(object)
    _broke = Signal(str)
    _stopped = Signal()
    _under_way: ClassVar[dict[int, Job]] = {}  # a job lives until its last word has been heard, or its parent ends

    def __init__(self, op: Callable[[Progress], Any], done: Callable[[Any], None], failed: Callable[[str], None],
                 progress: Callable[[str, float], None] | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._op, self._done, self._failed, self._show = op, done, failed, progress
        self.progress = Progress(lambda text, fraction: _emit(self._reported, text, fraction))
        queued = Qt.ConnectionType.QueuedConnection
        self._finished.connect(self._on_done, queued)
        self._broke.connect(self._on_failed, queued)
        self._reported.connect(self._on_progress, queued)
        self._stopped.connect(self._on_stopped, queued)
        self.destroyed.connect(functools.partial(_forget, id(self)))
        self._ended = threading.Event()

    def start(self) -> Job:
        """Begin; returns itself."""
        Job._under_way[id(self)] = self
        workers().submit(self._run)
        return self

    def cancel(self) -> None:
        """Ask `op` to stop; neither `done` nor `failed` will be called."""
        self.progress.cancel()

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end of `op`, at most `timeout_s`; whether it has ended."""
        return self._ended.wait(timeout_s)

    @property
    def running(self) -> bool:
        """Whether `op` has not ended yet."""
        return not self._ended.is_set()

    def _run(self) -> None:
        try:
            result = self._op(self.progress)
        except CancelledError:
            return
        except (RhotError, NodeError, OSError) as exc:
            _emit(self._broke, str(exc))
        except Exception as exc:
            _emit(self._broke,
                  tr("The program made a mistake ({name}: {exc}). Please report it.", name=type(exc).__name__, exc=exc))
            raise
        else:
            _emit(self._finished, result)
        finally:
            self._ended.set()
            _emit(self._stopped)

    def _on_stopped(self) -> None:
        _forget(id(self))
        self.deleteLater()  # or its parent would keep every job that it ever had

    def _on_done(self, result: Any) -> None:
        if not self.progress.cancelled:
            self._done(result)

    def _on_failed(self, sentence: str) -> None:
        if not self.progress.cancelled:
            self._failed(sentence)

    def _on_progress(self, text: str, fraction: float) -> None:
        if self._show is not None and not self.progress.cancelled:
            self._show(text, fraction)


def _forget(number: int, _deleted: QObject | None = None) -> None:
    Job._under_way.pop(number, None)


def _emit(signal: SignalInstance, *values: object) -> None:
    """Tell the window's thread, unless the window is gone and Qt has deleted the job with it."""
    with contextlib.suppress(RuntimeError):
        signal.emit(*values)
