"""The threads of a process, all of them started and watched here: one that fails is named and goes on, one that hangs
is named. `complaints` says what is wrong with any of them now."""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from typing import Any, Final, TypeVar

T = TypeVar("T")

FOREIGN: Final = (Exception, SystemExit)
"""What somebody else's program may raise: one that calls exit() must not end the thread that called it."""

ANSWER_S: Final = 3.0
"""How long another program may take to answer, to be connected to, or to end. Chosen."""

HANG_S: Final = 2.0
"""A turn that takes longer hangs."""

PAUSE_S: Final = 0.5
"""Between a failure and the next turn."""

LASTING_S: Final = 3.0
"""A failure is said for so long after the last one."""

log = logging.getLogger(__name__)

_watches: weakref.WeakSet[Watch] = weakref.WeakSet()
_lock = threading.Lock()


def complaints() -> list[str]:
    """A sentence about everything that hangs or has just failed in this process."""
    with _lock:
        watches = list(_watches)
    now_s = time.monotonic()
    return sorted(text for watch in watches if (text := watch.complaint(now_s)))


class Watch:
    """Notices when what goes on `within` it hangs or fails. `what` it does is worded to follow "the part that"."""

    def __init__(self, what: str, hang_s: float | None = HANG_S) -> None:
        """`hang_s` None: it may take as long as it likes."""
        self.what = what
        self.failure = ""
        """Why it failed last; empty before it has."""
        self._hang_s = hang_s
        self._since_s: float | None = None  # begin of the turn that goes on
        self._failed_s = 0.0
        with _lock:
            _watches.add(self)

    @contextlib.contextmanager
    def timed(self) -> Iterator[None]:
        """One turn. What it raises is the caller's affair."""
        self._since_s = time.monotonic()
        try:
            yield
        finally:
            self._since_s = None

    @contextlib.contextmanager
    def within(self) -> Iterator[None]:
        """One turn. What it raises is noted, written to the log and raised again."""
        with self.timed():
            try:
                yield
            except FOREIGN as exc:
                self.failure, self._failed_s = f"{type(exc).__name__}: {exc}", time.monotonic()
                log.exception("the part that %s failed", self.what)
                raise

    def hangs_s(self, now_s: float) -> float:
        """For how long the turn that goes on has lasted, when that is too long; else 0."""
        since_s = self._since_s
        lasts_s = 0.0 if since_s is None else now_s - since_s
        return lasts_s if self._hang_s is not None and lasts_s > self._hang_s else 0.0

    def complaint(self, now_s: float) -> str:
        """What is wrong now, as a sentence; empty when nothing is."""
        hangs_s = self.hangs_s(now_s)
        if hangs_s:
            return f"The part that {self.what} has not come round for {hangs_s:.0f} s."
        if self.failure and now_s - self._failed_s < LASTING_S:
            return f"The part that {self.what} failed ({self.failure})."
        return ""

    def dismiss(self) -> None:
        """It is no longer used: nothing is said of it any more."""
        with _lock:
            _watches.discard(self)


class Worker:
    """A thread that takes turns until `close`. A turn that fails does not end it: the next comes `PAUSE_S` later."""

    def __init__(self, what: str, turn: Callable[[], object], *, wait: Callable[[], object] = lambda: None,
                 begin: Callable[[], object] = lambda: None, end: Callable[[], object] = lambda: None,
                 hang_s: float | None = HANG_S) -> None:
        """`what` it does: see `Watch`. `wait` comes before each turn and may take as long as it likes. `begin` and
        `end` come before and after all turns, in the thread."""
        self.ending = threading.Event()
        self._watch = Watch(what, hang_s)
        self._turn, self._wait, self._begin, self._end = turn, wait, begin, end
        self._thread = threading.Thread(target=self._run, name=what, daemon=True)

    def start(self) -> None:
        """Take turns from now on."""
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether the thread goes on."""
        return self._thread.is_alive()

    def close(self, timeout_s: float | None = None) -> None:
        """Have the thread end after its turn, and wait for that. May be called twice, before `start`, and by itself."""
        self.ending.set()
        self._watch.dismiss()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(timeout_s)

    def _run(self) -> None:
        self._guarded(self._begin)
        while not self.ending.is_set():
            self._wait()
            if not self.ending.is_set() and not self._guarded(self._turn):
                self.ending.wait(PAUSE_S)
        self._guarded(self._end)

    def _guarded(self, turn: Callable[[], object]) -> bool:
        try:
            with self._watch.within():
                turn()
        except FOREIGN:
            return False
        return True


class OneShotThread:
    """A thread for one piece of work. `failure` says why it failed."""

    def __init__(self, what: str, work: Callable[[], object], *, hang_s: float | None = None) -> None:
        """`what` it does: see `Watch`. Begins at once."""
        self._watch = Watch(what, hang_s)
        self._work = work
        self._thread = threading.Thread(target=self._run, name=what, daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether it goes on."""
        return self._thread.is_alive()

    @property
    def failure(self) -> str:
        """Why it failed; empty when it did not."""
        return self._watch.failure

    def join(self, timeout_s: float | None = None) -> None:
        """Wait for its end."""
        if self._thread is not threading.current_thread():
            self._thread.join(timeout_s)

    def _run(self) -> None:
        with contextlib.suppress(*FOREIGN), self._watch.within():
            self._work()


class TimedCalls:
    """Calls somebody else's functions in a thread of its own, always the same, and waits for each only so long."""

    def __init__(self, what: str) -> None:
        """`what` the functions do: see `Watch`."""
        self._what = what
        self._calls: queue.SimpleQueue[Callable[[], Any] | None] = queue.SimpleQueue()
        self._results: queue.SimpleQueue[tuple[Any, BaseException | None]] = queue.SimpleQueue()
        self._hangs = False
        self._watch = Watch(what)
        self._thread = threading.Thread(target=self._run, name=what, daemon=True)
        self._thread.start()

    def call(self, function: Callable[[], T], within_s: float) -> T:
        """What `function` returns or raises. Raises TimeoutError when it does not return in time; the thread is then
        left to itself, and every later call raises it at once."""
        if not self._hangs:
            self._calls.put(function)
            try:
                result, raised = self._results.get(timeout=within_s)
            except queue.Empty:
                self._hangs = True
                self._watch.dismiss()  # from now on the caller says so
            else:
                if raised is not None:
                    raise raised
                return result
        raise TimeoutError(f"no answer within {within_s:g} s")

    def close(self) -> None:
        """Have the thread end, now or when it comes back."""
        self._watch.dismiss()
        self._calls.put(None)

    def _run(self) -> None:
        while (function := self._calls.get()) is not None:
            try:
                with self._watch.timed():
                    self._results.put((function(), None))
            except BaseException as exc:
                self._results.put((None, exc))
            if self._hangs:
                return
