"""The poses of another tracker of the last minute, polled in a thread. No Qt."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from rhot_app.errors import RhotError
from rhot_app.objects.pose import Validity
from rhot_app.sources.poses.open_source import open_source
from rhot_app.sources.poses.source import ForeignPose, PoseSource

KEPT_NS = 60_000_000_000
RATE_NS = 2_000_000_000
_PERIOD_S = 0.004
_END_S = 4.0

Open = Callable[[str, str], PoseSource]


class PoseFeed:
    """One source at a time; another `open` ends the one before. Everything from any thread."""

    def __init__(self, open_: Open = open_source) -> None:
        self._open = open_
        self._lock = threading.Lock()
        self._poses: deque[ForeignPose] = deque()
        self._came_ns: deque[int] = deque()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._name = self._notice = ""

    def open(self, name: str, tracker: str) -> None:
        """Begin to listen to a source (`open_source`), returning at once. What is wrong with it becomes the notice."""
        self._ending.set()
        before, self._ending = self._thread, threading.Event()
        with self._lock:
            self._poses.clear()
            self._came_ns.clear()
            self._name, self._notice = name, ""
        self._thread = threading.Thread(target=self._run, args=(name, tracker, self._ending, before),
                                        name="poses for a wizard", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the source, which takes some seconds at most."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(_END_S)
            self._thread = None

    @property
    def opened(self) -> bool:
        """Whether a source was opened."""
        return self._thread is not None

    @property
    def name(self) -> str:
        """What is listened to."""
        with self._lock:
            return self._name

    @property
    def notice(self) -> str:
        """What is wrong now; "" while all is well."""
        with self._lock:
            return self._notice

    @property
    def rate_hz(self) -> float:
        """Tracked poses per second that came within the last two seconds."""
        since_ns = time.monotonic_ns() - RATE_NS
        with self._lock:
            recent = [t_ns for t_ns in self._came_ns if t_ns > since_ns]
        return 1e9 * len(recent) / RATE_NS

    def between(self, first_ns: int, last_ns: int) -> list[ForeignPose]:
        """The tracked poses of that time, by the master's clock."""
        with self._lock:
            return [pose for pose in self._poses if first_ns <= pose.t_master_ns <= last_ns]

    def add(self, poses: list[ForeignPose]) -> None:
        """Take poses in, as if they had come now."""
        now_ns = time.monotonic_ns()
        with self._lock:
            for pose in poses:
                if pose.validity is Validity.TRACKED:
                    self._poses.append(pose)
                    self._came_ns.append(now_ns)
            while self._came_ns and now_ns - self._came_ns[0] > KEPT_NS:
                self._poses.popleft()
                self._came_ns.popleft()

    def _run(self, name: str, tracker: str, ending: threading.Event, before: threading.Thread | None) -> None:
        if before is not None:
            before.join(_END_S)  # it may have the port that is opened now
        try:
            source = self._open(name, tracker)
        except RhotError as exc:
            with self._lock:
                self._notice = str(exc)
            return
        try:
            while not ending.wait(_PERIOD_S):
                poses = source.poll()
                if ending.is_set():
                    return
                self.add(poses)
                with self._lock:
                    self._name, self._notice = source.name, source.notice
                if source.ended:
                    return
        finally:
            source.close()
