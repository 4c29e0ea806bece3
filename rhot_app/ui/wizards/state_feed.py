"""The hand's states of the last seconds, for wizards that calibrate by a moving hand or marker. A thread, no Qt."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from rhot_app.errors import RhotError
from rhot_app.tracking.state import HandState
from rhot_app.ui.backend.contract import Listener

KEPT_S = 4.0
_PERIOD_S = 0.02
_AGAIN_S = 0.5


class StateFeed:
    """`start` may be called again; `stop` ends it for good. Everything else from any thread."""

    def __init__(self, listen: Callable[[], Listener]) -> None:
        """`listen` makes the client, in the feed's own thread."""
        self._listen = listen
        self._states: deque[tuple[float, HandState]] = deque()
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to listen, unless it does already."""
        if self._thread is None and not self._ending.is_set():
            self._thread = threading.Thread(target=self._run, name="states for a wizard", daemon=True)
            self._thread.start()

    def stop(self, timeout_s: float = 2.0) -> None:
        """End the thread."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(timeout_s)

    def recent(self, seconds: float = KEPT_S) -> list[HandState]:
        """The states that came within the last seconds, oldest first."""
        since = time.monotonic() - seconds
        with self._lock:
            return [state for came, state in self._states if came >= since]

    def add(self, state: HandState) -> None:
        """Take a state in, as if it had been heard now."""
        now = time.monotonic()
        with self._lock:
            self._states.append((now, state))
            while now - self._states[0][0] > KEPT_S:
                self._states.popleft()

    def _run(self) -> None:
        client: Listener | None = None
        while not self._ending.wait(_PERIOD_S):
            try:
                client = client or self._listen()
                for message in client.poll():
                    if isinstance(message, HandState):
                        self.add(message)
            except RhotError:  # an engine of another version, or none: what is shown stays empty until there is one
                self._ending.wait(_AGAIN_S)
        if client is not None:
            client.close()
