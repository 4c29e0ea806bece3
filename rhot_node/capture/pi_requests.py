"""The completed requests of a Pi camera: the newest waits for the reader, older ones go back to the camera at once.

picamera2's own queue would keep a request of unknown age; `capture_request` alone would miss a frame that is complete
just before the reader asks. Of the buffers one is read, one waits here, the others are being filled.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

from rhot_node.clock import NodeClock

WANTED = frozenset({"SensorTimestamp", "ExposureTime", "ScalerCrop", "SyncReady"})


@dataclass(frozen=True, slots=True)
class Arrival:
    """A completed request, how many came before it, and when it was complete. Whoever takes it releases it."""

    request: Any
    index: int
    t_node_ns: int


class NewestRequest:
    """Holds one request. `put` is picamera2's callback, in its thread; the rest is the reader's."""

    def __init__(self, clock: NodeClock) -> None:
        self._clock = clock
        self._changed = threading.Condition()
        self._newest: Arrival | None = None
        self._count = 0
        self._closed = False

    def put(self, request: Any) -> None:
        """Keep `request` and give the one before it back."""
        t_node_ns = self._clock.now_ns()
        request.acquire()
        with self._changed:
            old = self._newest
            self._newest = Arrival(request, self._count, t_node_ns)
            self._count += 1
            if self._closed:
                old, self._newest = self._newest, None
            self._changed.notify()
        if old is not None:
            old.request.release()

    def take(self, timeout_s: float) -> Arrival | None:
        """The newest request not taken yet; None when none comes in time."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None, timeout_s)
            newest, self._newest = self._newest, None
            return newest

    def close(self) -> None:
        """Give back what waits, and everything that still comes."""
        with self._changed:
            self._closed = True
        waiting = self.take(0.0)
        if waiting is not None:
            waiting.request.release()


def read_metadata(request: Any) -> dict[str, Any]:
    """The few values that are needed, as libcamera gives them: `get_metadata` turns every one into Python's, which
    takes longer than a frame of 200 Hz has to spare."""
    return {key.name: value for key, value in request.request.metadata.items() if key.name in WANTED}
