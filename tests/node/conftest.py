"""The programs that this room starts begin as forks. A closed node's control side."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from processes import forked_programs, fresh_programs  # noqa: F401
from trusted_node import TrustedNode


@pytest.fixture
def node(tmp_path: Path) -> Iterator[TrustedNode]:
    node = TrustedNode(tmp_path)
    yield node
    node.close()
