"""The poses of another tracker of the last minute, polled in a thread. No Qt."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable

from rhot_app.errors import RhotError
from rhot_app.objects.pose import Validity
from rhot_app.sources.poses.open_source import open_source
from rhot_app.sources.poses.source import ForeignPose, PoseSource
from rhot_app.ui.backend.reader import Reader

KEPT_NS = 60_000_000_000
RATE_NS = 2_000_000_000
_PERIOD_S = 0.004

Open = Callable[[str, str], PoseSource]


class PoseFeed:
    """One source at a time; another `open` ends the one before. Everything from any thread."""

    def __init__(self, open_: Open = open_source) -> None:
        self.open_source = open_
        self._lock = threading.Lock()
        self._poses: deque[ForeignPose] = deque()
        self._came_ns: deque[int] = deque()
        self._source: _Source | None = None
        self._name = self._notice = ""

    def open(self, name: str, tracker: str) -> None:
        """Begin to listen to a source (`open_source`), returning at once. What is wrong with it becomes the notice."""
        before = self._source
        if before is not None:
            before.stop(0.0)
        with self._lock:
            self._poses.clear()
            self._came_ns.clear()
            self._name, self._notice = name, ""
        self._source = _Source(self, name, tracker, before).start()

    def stop(self) -> None:
        """End the source, which takes some seconds at most."""
        if self._source is not None:
            self._source.stop()
            self._source = None

    @property
    def opened(self) -> bool:
        """Whether a source was opened."""
        return self._source is not None

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

    def say(self, name: str, notice: str) -> None:
        """What is listened to, and what is wrong with it."""
        with self._lock:
            self._name, self._notice = name, notice


class _Source(Reader):
    """Listens to one source for `feed`, once the one `before` has ended, which may have the same port."""

    def __init__(self, feed: PoseFeed, name: str, tracker: str, before: _Source | None) -> None:
        super().__init__()
        self._feed, self._source_name, self._tracker, self._before = feed, name, tracker, before

    def _run(self) -> None:
        if self._before is not None:
            self._before.stop()
            self._before = None
        try:
            source = self._feed.open_source(self._source_name, self._tracker)
        except RhotError as exc:
            if not self._ending.is_set():
                self._feed.say(self._source_name, str(exc))
            return
        with contextlib.closing(source):
            while not self._ending.wait(_PERIOD_S):
                poses = source.poll()
                if self._ending.is_set():
                    return
                self._feed.add(poses)
                self._feed.say(source.name, source.notice)
                if source.ended:
                    return
