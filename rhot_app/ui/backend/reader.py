"""Threads that read from engine or sockets for as long as a window stands. No Qt.

They are not the pool's (`ui/common/job.py`): a reader that waits would keep one of its few threads from every job.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Sequence
from typing import Any, Self

log = logging.getLogger(__name__)

END_S = 4.0


class Reader:
    """A subclass has `_run`, which returns soon once `_ending` is set. A mistake in it ends it and is logged."""

    def __init__(self, runs: Sequence[tuple[Any, ...]] = ((),)) -> None:
        """`runs`: the arguments of `_run` for each thread."""
        self._runs = runs
        self._ending = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self) -> Self:
        """Begin, unless it has begun or was stopped; returns itself."""
        if not self._threads and not self._ending.is_set():
            self._threads = [threading.Thread(target=self._guarded, args=one, name=type(self).__name__, daemon=True)
                             for one in self._runs]
            for thread in self._threads:
                thread.start()
        return self

    def stop(self, timeout_s: float = END_S) -> bool:
        """End for good: wait for what is under way, at most `timeout_s` in all. Whether every thread has ended."""
        self._ending.set()
        end_s = time.monotonic() + timeout_s
        for thread in self._threads:
            thread.join(max(0.0, end_s - time.monotonic()))
        return not any(thread.is_alive() for thread in self._threads)

    def _run(self, *args: Any) -> None:
        raise NotImplementedError

    def _guarded(self, *args: Any) -> None:
        try:
            self._run(*args)
        except Exception:
            log.exception("%s: the thread ended", type(self).__name__)
