"""One-shot work away from the window's thread: `Job(op, done, failed, progress)`. Workers never touch widgets."""

from __future__ import annotations

import contextlib
import functools
import itertools
import logging
import threading
import time
from collections.abc import Callable
from typing import Any, ClassVar

from PySide6.QtCore import QObject, Qt, QThreadPool, Signal

from rhot_app.errors import RhotError
from rhot_app.ui.language import tr
from rhot_node.errors import NodeError

log = logging.getLogger(__name__)

THREADS = 6


class CancelledError(RhotError):
    """The job was cancelled by the person at the screen."""


@functools.cache
def workers() -> QThreadPool:
    """The app's own threads, made at the first call, before the window gives way (`app.give_way`): on Linux each thread
    has a niceness of its own and hands it down, and the engine that a job starts must not be as nice as the window."""
    pool = QThreadPool()
    pool.setMaxThreadCount(THREADS)
    pool.setExpiryTimeout(-1)
    together = threading.Barrier(THREADS + 1)
    for _ in range(THREADS):
        pool.start(together.wait)
    together.wait()
    return pool


def end_jobs(timeout_s: float) -> list[str]:
    """Cancel everything under way and wait for it, at most `timeout_s` in all; what has not ended, by its work's name.
    None of it calls `done` or `failed` any more."""
    jobs = Job.under_way()
    for job in jobs:
        job.cancel()
    end_s = time.monotonic() + timeout_s
    return [job.name for job in jobs if not job.wait(max(0.0, end_s - time.monotonic()))]


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


class _Post(QObject):
    """Brings what workers say to the window's thread. It outlives every job, so no worker speaks to what is deleted."""

    said = Signal(int, str, object)

    def __init__(self) -> None:
        super().__init__()
        self.said.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def _deliver(self, number: int, event: str, value: Any) -> None:
        job = Job._jobs.get(number)
        if job is not None:
            job._hear(event, value)


class Job:
    """Runs `op(progress)` in a worker's thread; `done(result)` or `failed(sentence)` follow in the window's thread.

    Exactly one of the two is called, except after `cancel` or the end of `parent`, which cancels: then neither is. An
    error that is not one of ours is shown as a sentence too, with its kind, and logged whole.
    """

    _jobs: ClassVar[dict[int, Job]] = {}  # until its end has come to the window's thread
    _numbers = itertools.count()

    def __init__(self, op: Callable[[Progress], Any], done: Callable[[Any], None], failed: Callable[[str], None],
                 progress: Callable[[str, float], None] | None = None, parent: QObject | None = None) -> None:
        self._op, self._done, self._failed, self._show = op, done, failed, progress
        self._number = next(Job._numbers)
        self._guard = None if parent is None else QObject(parent)  # is deleted with the parent
        self._ended = threading.Event()
        self.name = getattr(op, "__qualname__", repr(op))
        self.progress = Progress(lambda text, fraction: self._say("progress", (text, fraction)))

    @classmethod
    def under_way(cls) -> list[Job]:
        """What has not ended yet, or was not heard of yet."""
        return list(cls._jobs.values())

    def start(self) -> Job:
        """Begin; returns itself."""
        _post()  # made in the window's thread
        Job._jobs[self._number] = self
        if self._guard is not None:
            self._guard.destroyed.connect(functools.partial(_abandon, self._number))
        workers().start(self._run)
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
        event, value = "cancelled", None
        try:
            if not self.progress.cancelled:  # it may have waited for a free thread
                event, value = "done", self._op(self.progress)
        except CancelledError:
            pass
        except (RhotError, NodeError, OSError) as exc:
            event, value = "failed", str(exc)
        except BaseException as exc:  # also what asks a program to end: it would end a thread of the pool, unheard
            log.exception("a job failed")
            event, value = "failed", tr("The program made a mistake ({name}: {exc}). Please report it.",
                                        name=type(exc).__name__, exc=exc)
        finally:
            self._ended.set()
            self._say(event, value)

    def _say(self, event: str, value: object) -> None:
        with contextlib.suppress(RuntimeError):  # Qt itself has ended
            _post().said.emit(self._number, event, value)

    def _hear(self, event: str, value: Any) -> None:
        """In the window's thread."""
        if event != "progress":
            Job._jobs.pop(self._number, None)
            if self._guard is not None:
                self._guard.deleteLater()
        if self.progress.cancelled or event == "cancelled":
            return
        if event == "done":
            self._done(value)
        elif event == "failed":
            self._failed(value)
        elif self._show is not None:
            self._show(*value)


@functools.cache
def _post() -> _Post:
    return _Post()


def _abandon(number: int, _deleted: QObject | None = None) -> None:
    """The owner has ended: its callbacks are kept no longer, and `op` is asked to stop. The job stays under way until
    its end has come, so that `end_jobs` waits for it."""
    job = Job._jobs.get(number)
    if job is not None:
        job.cancel()
        job._guard = None  # was deleted with the owner
        job._done = job._failed = job._show = _nothing


def _nothing(*_: object) -> None:
    """Instead of what belonged to a window that is gone."""
