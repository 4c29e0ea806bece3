"""What commands print: examples at the end of their help, and text that is safe for a terminal."""

from __future__ import annotations

import argparse
import contextlib
import re
import sys
from collections.abc import Iterator
from typing import Any, TextIO, cast

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
