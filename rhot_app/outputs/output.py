"""The output interface: where samples leave for other programs. One file per kind; each has a thread of its own.

A sink (`Sink`) only opens, writes and closes. `Output` gives it a queue and a thread, so that one that is slow or stuck
delays nobody: when its queue is full, the oldest state is dropped.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final, Protocol, runtime_checkable

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import JointConverter, Sample
from rhot_app.outputs.spec import OutputStatus, OutputWord
from rhot_app.project import OutputSettings
from rhot_app.state import HandState
from rhot_node.threads import FOREIGN, Worker

log = logging.getLogger(__name__)

QUEUE: Final = 8  # states that may wait: 0.1 s at the rate of two cameras of 40 Hz
REOPEN_S: Final = 3.0  # between tries to open an output that failed
STUCK_S: Final = 2.0  # a write that takes longer is worth a sentence
END_S: Final = 2.0  # how long an output may take to close; it is left to itself then


class Sink(Protocol):
    """One way out. Called by one thread. Raise OutputError with a sentence on what to do; it is then closed, and
    opened again after a while."""

    def open(self) -> None:
        """Connect or listen. May take its time."""
        ...

    def write(self, sample: Sample) -> None:
        """Send one sample. May block: states are dropped meanwhile."""
        ...

    def close(self) -> None:
        """Release everything. May be called twice, and without `open`."""
        ...


@runtime_checkable
class Serving(Protocol):
    """A sink that clients connect to."""

    @property
    def clients(self) -> int | None:
        """How many are connected. Any thread may ask."""
        ...

    @property
    def url(self) -> str:
        """Where they connect; empty before `open`. Any thread may ask."""
        ...


class Output:
    """A sink with its queue and its thread. `send` never blocks and never raises."""

    def __init__(self, settings: OutputSettings, sink: Sink, converter: JointConverter) -> None:
        self.settings = settings
        self._sink = sink
        self._converter = converter
        self._queue: deque[HandState] = deque(maxlen=QUEUE)
        self._wake = threading.Event()
        self._word: OutputWord = "starting"
        self._message = ""
        self._sent = self._dropped = 0
        self._period_ns = 0 if settings.rate_hz is None else round(1e9 / settings.rate_hz)
        self._due_ns = 0
        self._since_s: tuple[str, float] | None = None  # what the sink does, and since when
        self._worker = Worker(f"serves the output {settings.spec}", self._turn, hang_s=None)

    def start(self) -> None:
        """Open the sink, in the output's thread."""
        self._worker.start()

    def send(self, state: HandState) -> None:
        """Queue one state; the oldest gives way when the queue is full. For one thread at a time."""
        if self._period_ns:
            now_ns = time.monotonic_ns()
            if now_ns < self._due_ns:
                return
            # On average the rate that was asked for, whatever that of the states.
            self._due_ns = max(self._due_ns + self._period_ns, now_ns)
        if len(self._queue) == QUEUE:
            self._dropped += 1
        self._queue.append(state)
        self._wake.set()

    def convert_by(self, converter: JointConverter) -> None:
        """Go on with the hands of another rig."""
        self._converter = converter

    def stop(self) -> None:
        """Close the sink; whatever does not end within `END_S` is left to itself."""
        self._worker.ending.set()
        self._wake.set()
        self._worker.close(END_S)
        self._word = "stopped"

    def status(self) -> OutputStatus:
        """How it goes, now."""
        message, since = self._message, self._since_s
        if since is not None and (lasts_s := time.monotonic() - since[1]) > STUCK_S:
            message = f"it has not {since[0]} for {lasts_s:.0f} s; states are dropped."
        serving = self._sink if isinstance(self._sink, Serving) else None
        return OutputStatus(self.settings.spec, self.settings.kind, self._word, message, self._sent, self._dropped,
                            None if serving is None else serving.clients, "" if serving is None else serving.url)

    def _turn(self) -> None:
        try:
            self._timed("opened", self._sink.open)
            self._word, self._message = "running", ""
            self._write_all()
        except OutputError as exc:
            self._fail(str(exc))
        except FOREIGN as exc:  # a plug-in may raise anything
            log.debug("output %s failed", self.settings.spec, exc_info=True)
            self._fail(f"it failed ({type(exc).__name__}: {exc}).")
        finally:
            with contextlib.suppress(*FOREIGN):
                self._sink.close()
        self._worker.ending.wait(REOPEN_S)
        self._queue.clear()  # nobody wants what is as old as that

    def _timed(self, what: str, work: Callable[[], None]) -> None:
        """Have the sink do something that may take too long."""
        self._since_s = what, time.monotonic()
        try:
            work()
        finally:
            self._since_s = None

    def _write_all(self) -> None:
        """Write what comes, until the end."""
        while True:
            self._wake.wait()
            self._wake.clear()
            while self._queue and not self._worker.ending.is_set():
                sample = self._converter.sample(self._queue.popleft(), self.settings.joints)
                self._timed("taken a state", functools.partial(self._sink.write, sample))
                self._sent += 1
            if self._worker.ending.is_set():
                return

    def _fail(self, message: str) -> None:
        if self._message != message:
            log.warning("rhot: output %s: %s Tracking goes on.", self.settings.spec, message)
        self._word, self._message = "failed", message
