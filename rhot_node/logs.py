"""What a program writes on standard error: bounded, whatever others do to it, so that nobody fills a disk with it."""

from __future__ import annotations

import contextlib
import logging
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from rhot_node.files import MIB

PERIOD_S: Final = 60.0
LINES_AT_ONCE: Final = 10
"""Lines of one place in the program: so many, then one in each period."""

LOG_BYTES_MAX: Final = MIB
"""A log file is kept aside when it is longer, and the one before it removed."""

_SUBJECTS_MAX = 32  # told apart at a time; all further ones count as one


class LogLimit:
    """Counts what somebody else causes, by subject, and says when a line of it is due: at most one in a period."""

    def __init__(self) -> None:
        self._written: dict[str, tuple[float, int]] = {}  # when the last line was written, and how often since

    def due(self, subject: str, now_s: float) -> int:
        """It happened: how often since the last line when one is due now, else 0. `now_s`: monotonic, s."""
        self._written = {name: entry for name, entry in self._written.items()
                         if now_s - entry[0] < PERIOD_S or entry[1]}
        if subject not in self._written and len(self._written) >= _SUBJECTS_MAX:
            subject = "others"
        written_s, since = self._written.get(subject, (now_s - PERIOD_S, 0))
        since += 1
        if now_s - written_s < PERIOD_S:
            self._written[subject] = written_s, since
            return 0
        self._written[subject] = now_s, 0
        return since


class LineLimit(logging.Filter):
    """Leaves out lines of a place in the program that has just written `LINES_AT_ONCE`, and says how many."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._now_s = now_s
        self._periods: dict[tuple[str, int], tuple[float, int]] = {}  # since when, and how many lines

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether the line is written."""
        place, now_s = (record.pathname, record.lineno), self._now_s()
        since_s, count = self._periods.get(place, (now_s, 0))
        if now_s - since_s >= PERIOD_S:
            left_out = max(0, count - LINES_AT_ONCE)
            since_s, count = now_s, LINES_AT_ONCE - 1 if left_out else 0
            if left_out:
                record.msg = f"{record.msg} ({left_out} more lines like this were left out)"
        self._periods[place] = since_s, count + 1
        return count < LINES_AT_ONCE


def log_to_stderr(level: int | str = logging.WARNING, layout: str = "%(message)s") -> None:
    """Have this program's log lines written on standard error; nothing changes where that was done before."""
    handler = logging.StreamHandler()
    handler.addFilter(LineLimit())
    logging.basicConfig(level=level, format=layout, handlers=[handler])


def cut_log(path: Path, longest: int = LOG_BYTES_MAX) -> None:
    """Keep the log of a running program as ``PATH.1`` and empty it, when it is longer than `longest` bytes.

    Whoever writes it has opened it to append, and goes on.
    """
    with contextlib.suppress(OSError):
        if path.stat().st_size > longest:
            with contextlib.suppress(OSError):  # no room for the copy: all the more reason to empty it
                shutil.copyfile(path, before(path))
            os.truncate(path, 0)


def before(path: Path) -> Path:
    """Where the part of a log stands that was before the one in `path`."""
    return path.with_name(f"{path.name}.1")
