"""Progress of long work on a terminal: one line that is rewritten, with the time that remains."""

from __future__ import annotations

import sys
import time
from typing import TextIO

_EVERY_S = 0.2


class ProgressLine:
    """Shows "what: 42 %, 12 s left" on `stream`; silent where it is not a terminal, except for the end."""

    def __init__(self, what: str, stream: TextIO | None = None) -> None:
        self._what = what
        self._stream = stream or sys.stderr
        self._began = time.monotonic()
        self._shown = 0.0

    def __call__(self, done: int, total: int) -> None:
        """Report progress; calls may be frequent."""
        now = time.monotonic()
        if not self._stream.isatty() or (now - self._shown < _EVERY_S and done < total):
            return
        self._shown = now
        elapsed = now - self._began
        left = f", {elapsed * (total - done) / done:.0f} s left" if done else ""
        self._stream.write(f"\r{self._what}: {100 * done // max(total, 1)} %{left}   ")
        self._stream.flush()

    def finish(self) -> None:
        """End the line and say how long it took."""
        start = "\r" if self._stream.isatty() else ""
        self._stream.write(f"{start}{self._what}: done in {time.monotonic() - self._began:.1f} s   \n")
        self._stream.flush()
