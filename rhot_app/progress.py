"""Progress of long work: how solvers report it, and how a terminal shows it on one line that is rewritten."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

from rhot_node.errors import printable

Progress = Callable[[str, float], None]
"""Called by long work with what it does and how much is done, 0..1. Whoever wants it to stop raises from here: the work
passes every exception on and leaves nothing half-done."""

_EVERY_S = 0.2


def silent(text: str, fraction: float) -> None:
    """The progress of work that nobody watches."""


def within(progress: Progress, start: float, end: float) -> Progress:
    """The progress of a part of the work: its 0..1 are `start`..`end` of the whole's."""
    return lambda text, fraction: progress(text, start + (end - start) * fraction)


class ProgressLine:
    """Shows "what: 42 %, 12 s left" on `stream`; silent where it is not a terminal, except for the end."""

    def __init__(self, what: str, stream: TextIO | None = None) -> None:
        self._what = printable(what)
        self._stream = getattr(stream or sys.stderr, "terminal", stream or sys.stderr)  # a line is rewritten by escapes
        self._began = time.monotonic()
        self._shown = 0.0

    def report(self, text: str, fraction: float) -> None:
        """Show a solver's progress; a `Progress`."""
        self._what = printable(text)
        self(round(1000 * fraction), 1000)

    def __call__(self, done: int, total: int) -> None:
        """Report progress; calls may be frequent."""
        now = time.monotonic()
        if not self._stream.isatty() or (now - self._shown < _EVERY_S and done < total):
            return
        self._shown = now
        elapsed = now - self._began
        left = f", {elapsed * (total - done) / done:.0f} s left" if done else ""
        self._stream.write(f"\r{self._what}: {100 * done // max(total, 1)} %{left}\x1b[K")
        self._stream.flush()

    def finish(self) -> None:
        """End the line and say how long it took."""
        start, end = ("\r", "\x1b[K") if self._stream.isatty() else ("", "")
        self._stream.write(f"{start}{self._what}: done in {time.monotonic() - self._began:.1f} s{end}\n")
        self._stream.flush()
