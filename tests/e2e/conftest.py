"""Real processes on real sockets: what the end-to-end tests share, and the promise that nothing stays behind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from bench import Bench
from processes import forked_programs, fresh_programs  # noqa: F401


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """A bench whose processes are ended, and shown to have ended, after the test."""
    bench = Bench(tmp_path)
    try:
        yield bench
    finally:
        bench.clear()
