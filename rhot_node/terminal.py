"""What a program writes for people: examples at the end of a command's help, text that is safe for a terminal, and
log lines, bounded, so that nobody fills a disk with them."""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, TextIO, cast

from rhot_node.files import MIB

_UNSAFE = re.compile(r"[^\n\t\x20-\x7e\xa0-\u2027\u202f-\u2065\u206a-\ud7ff\ue000-\U0010ffff]")
"""Control characters, which may move the cursor or the window's title, those that turn the direction of writing, and
halves of characters, which no encoding has."""


class HelpFormatter(argparse.HelpFormatter):
    """Wraps a sentence to the terminal's width; text of several lines stays as it is laid out."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return text if "\n" in text else super()._fill_text(text, width, indent)


def add_examples(parser: argparse.ArgumentParser, first: str, second: str) -> None:
    """End what ``--help`` prints with two commands that a person can give, the plain one first."""
    parser.formatter_class = HelpFormatter
    examples = f"examples:\n  {first}\n  {second}"
    parser.epilog = f"{parser.epilog}\n\n{examples}" if parser.epilog else examples


class PrintableStream:
    """A text stream that escapes what is not printable. `terminal`: the stream itself, for what moves the cursor."""

    def __init__(self, terminal: TextIO) -> None:
        self.terminal = terminal

    def write(self, text: str) -> int:
        """Write the text, safe for a terminal and in the characters that it has."""
        safe = _UNSAFE.sub(lambda found: found[0].encode("unicode_escape").decode(), text)
        encoding = self.terminal.encoding or "utf-8"
        self.terminal.write(safe.encode(encoding, "backslashreplace").decode(encoding))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.terminal, name)


@contextlib.contextmanager
def printable_output() -> Iterator[None]:
    """All that is printed in the block is printable."""
    with (contextlib.redirect_stdout(cast(TextIO, PrintableStream(sys.stdout))),
          contextlib.redirect_stderr(cast(TextIO, PrintableStream(sys.stderr)))):
        yield


# -- log lines ---------------------------------------------------------------------------------------------------------

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
