"""How long the disk lasts at the rate at which a log grows, so that the person is told before it is full."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable
from pathlib import Path

WINDOW_S = 10.0
"""The rate is that of the last seconds: nodes may be started and stopped while a log is written."""

_LEAST_S = 2.0  # of growth before it is a rate


def free_bytes(folder: Path) -> int:
    """What an ordinary user may still write in `folder`; raises OSError."""
    facts = os.statvfs(folder)
    return facts.f_bavail * facts.f_frsize


class DiskWatch:
    """`look` is called by the thread that writes, because a slow disk may keep it waiting; anybody may read."""

    def __init__(self, folder: Path, free: Callable[[Path], int] = free_bytes) -> None:
        self.seconds_left = math.inf
        self._folder, self._free = folder, free
        self._sizes: deque[tuple[float, int]] = deque()

    def look(self, size: int, now_s: float) -> None:
        """The log has `size` bytes now."""
        self._sizes.append((now_s, size))
        while now_s - self._sizes[0][0] > WINDOW_S:
            self._sizes.popleft()
        begun_s, before = self._sizes[0]
        if now_s - begun_s < _LEAST_S:
            return
        try:
            left = self._free(self._folder)
        except OSError:
            self.seconds_left = math.inf
            return
        self.seconds_left = left * (now_s - begun_s) / (size - before) if size > before else math.inf
