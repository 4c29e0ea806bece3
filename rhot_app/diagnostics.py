"""What a tracker fails over, and what it warns of: counted, and told once.

A part of a frame is one camera's observations, one hand or one object. An exception loses that part of that frame only.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Literal

log = logging.getLogger(__name__)

RESTART_AFTER: Final = 10
"""Failures in a row after which a part begins anew, as it may be in any state: five frame periods of two cameras, after
which a hand counts as lost (`estimation.track.LOST_PERIODS`)."""


@dataclass(slots=True)
class Diagnostic:
    """An exception of one kind in one part (`error`), or an ambiguity in what is observed (`warning`). `count`: frames;
    `last_ns`: `time.monotonic_ns` of the last."""

    level: Literal["error", "warning"]
    what: str
    count: int = 0
    last_ns: int = 0

    @property
    def sentence(self) -> str:
        """For the operator."""
        if self.level == "warning":
            return self.what
        frames = "one frame" if self.count == 1 else f"{self.count} frames"
        return f"The tracker failed over {self.what} in {frames}. The rest is tracked. Record a log and report this."


class Diagnostics:
    """Those of one tracker. One thread writes, others may read."""

    def __init__(self) -> None:
        self._found: dict[str, Diagnostic] = {}
        self._in_a_row: dict[str, int] = {}

    def part(self, name: str, restart: Callable[[], None], *, among: str = "") -> Part:
        """A context in which an exception is counted and goes no further. After RESTART_AFTER in a row, `restart` is
        called. `among`: a success of any part of this group ends the row."""
        return Part(self, name, restart, among or name)

    def warn(self, sentence: str) -> None:
        """Count a frame of which `sentence` holds."""
        self._count(sentence, "warning", sentence)

    def all(self) -> list[Diagnostic]:
        """In the order of their first occurrence."""
        return list(self._found.values())

    def since(self, t_ns: int) -> list[Diagnostic]:
        """Those of `time.monotonic_ns` `t_ns` or later."""
        return [one for one in self.all() if one.last_ns >= t_ns]

    def clear(self) -> None:
        """A new run begins."""
        self._found, self._in_a_row = {}, {}

    def passed(self, group: str) -> None:
        """A part of a frame was taken."""
        if self._in_a_row:
            self._in_a_row.pop(group, None)

    def failed(self, name: str, error: Exception, restart: Callable[[], None], group: str) -> None:
        """A part of a frame was lost."""
        kind = type(error).__name__
        if self._count(f"{name} {kind}", "error", f"{name} ({kind}: {error})") == 1:
            log.error("the tracker failed over %s; further failures of this kind are counted", name, exc_info=error)
        in_a_row = self._in_a_row.get(group, 0) + 1
        self._in_a_row[group] = in_a_row % RESTART_AFTER
        if in_a_row == RESTART_AFTER:
            restart()

    def _count(self, key: str, level: Literal["error", "warning"], what: str) -> int:
        one = self._found.setdefault(key, Diagnostic(level, what))
        one.what, one.last_ns = what, time.monotonic_ns()
        one.count += 1
        return one.count


class Part:
    """See `Diagnostics.part`. `failed`: whether the context ended with an exception."""

    def __init__(self, diagnostics: Diagnostics, name: str, restart: Callable[[], None], group: str) -> None:
        self.failed = False
        self._diagnostics, self._name, self._restart, self._group = diagnostics, name, restart, group

    def __enter__(self) -> Part:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> bool:
        if error is None:
            self._diagnostics.passed(self._group)
            return False
        if not isinstance(error, Exception):
            return False
        self.failed = True
        self._diagnostics.failed(self._name, error, self._restart, self._group)
        return True


def diagnostics_of(tracker: Any) -> Diagnostics:
    """The tracker's own, or new ones."""
    found = getattr(tracker, "diagnostics", None)
    return found if isinstance(found, Diagnostics) else Diagnostics()
