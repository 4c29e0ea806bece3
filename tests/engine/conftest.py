"""The programs that this room starts begin as forks; two nodes that stream to them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from processes import forked_programs, fresh_programs  # noqa: F401
from synthetic_node import SyntheticNode, synthetic_rig

from rhot_app.project import Rig


@pytest.fixture
def streaming_rig() -> Iterator[Rig]:
    """A rig whose two nodes stream when they are told to."""
    rig = synthetic_rig()
    nodes = [SyntheticNode(rig, camera) for camera in (0, 1)]
    for node in nodes:
        node.start()
    yield rig
    for node in nodes:
        node.close()
