"""A thread that empties a device whose read blocks, so that a slow reader always gets the newest frame."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from rhot_node.clock import NodeClock
from rhot_node.detect.image import Plane


@dataclass(frozen=True, slots=True)
class Grabbed:
    """One image as the device gave it: (H, W, 3) BGR, how many came before it, and when its read returned."""

    image: Plane
    number: int
    t_return_node_ns: int


class LatestGrabber:
    """Calls `grab` for ever in its own thread and keeps the newest image. `grab` returns None when the device failed;
    `release` is called at the end, in the same thread."""

    def __init__(self, grab: Callable[[], Plane | None], release: Callable[[], object], clock: NodeClock) -> None:
        self._grab = grab
        self._release = release
        self._clock = clock
        self._changed = threading.Condition()
        self._newest: Grabbed | None = None
        self._failed = False
        self._ending = False
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._thread.start()

    @property
    def failed(self) -> bool:
        """True when the device gave no more images."""
        return self._failed

    def take(self, timeout_s: float) -> Grabbed | None:
        """The newest image not taken yet; None when none comes in time or the device failed."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._failed, timeout_s)
            newest, self._newest = self._newest, None
            return newest

    def close(self) -> None:
        """End the thread; when the device does not return from its read, leave it to end by itself."""
        self._ending = True
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        number = 0
        while not self._ending:
            image = self._grab()
            t_return_node_ns = self._clock.now_ns()
            with self._changed:
                if image is None:
                    self._failed = True
                    self._changed.notify_all()
                    break
                self._newest = Grabbed(image, number, t_return_node_ns)
                self._changed.notify_all()
            number += 1
        self._release()
