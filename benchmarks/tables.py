"""What all benchmarks share: arguments with `--json`, and tables in Markdown, which `accuracy_page.py` takes over.

A benchmark measures everything, then prints its tables with `publish`, so that one that fails prints none. Progress
goes to standard error. Exit code 1: an aim is missed.
"""

from __future__ import annotations

import argparse
import json
import math
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

WIDTH = 100  # characters of a line of Markdown


def arguments(doc: str | None) -> argparse.ArgumentParser:
    """A parser that explains itself by the module's docstring and has `--json`."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write all figures there")
    return parser


def cell(value: Any) -> str:
    """Text as it is; None and NaN as a dash; a number with three digits, two below 1, but never whole ones dropped."""
    if value is None:
        return "-"
    if isinstance(value, (str, int, np.integer)):
        return str(value)
    if not math.isfinite(value):
        return "-"
    size = math.floor(math.log10(abs(value))) if value else 0
    return f"{value:.1e}" if size < -4 else f"{value:.{max(0, 2 - size if size >= 0 else 1 - size)}f}"


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A Markdown table; its columns are aligned for the terminal."""
    lines = [tuple(head), *(tuple(cell(value) for value in row) for row in rows)]
    widths = [max(3, *map(len, column)) for column in zip(*lines, strict=True)]
    lines.insert(1, tuple("-" * width for width in widths))
    return "\n".join("| " + " | ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) + " |"
                     for line in lines)


def publish(args: argparse.Namespace, figures: Any, *parts: str) -> None:
    """Print tables and paragraphs, a blank line between them; write the figures where `--json` says."""
    print("\n\n".join(part if part.startswith("|") else textwrap.fill(part, WIDTH) for part in parts), flush=True)
    if args.json is not None:
        args.json.write_text(json.dumps(figures, indent=1) + "\n")
