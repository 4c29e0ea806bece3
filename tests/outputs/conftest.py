"""Rigs, and streams that end with their test."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import msgspec
import pytest
from processes import forked_programs, fresh_programs  # noqa: F401
from streams import Stream
from synthetic_node import synthetic_rig

from rhot_app.hand.anatomy import load_hand
from rhot_app.project import OutputSettings, Rig
from rhot_node.files import resource_path


@pytest.fixture
def rig() -> Rig:
    """Two nodes, six markers, a right hand."""
    return synthetic_rig()


@pytest.fixture
def two_hands(rig: Rig) -> Rig:
    """The same with a left hand beside the right one."""
    left = load_hand(resource_path("hands", "left.json"))
    markers = tuple(msgspec.structs.replace(marker, role=f"other_{marker.role}") if k > 2 else marker
                    for k, marker in enumerate(rig.markers.markers))
    return msgspec.structs.replace(rig, other_hand=left, markers=msgspec.structs.replace(rig.markers, markers=markers))


@pytest.fixture
def stream(rig: Rig) -> Iterator[Callable[..., Stream]]:
    """Makes a `Stream` of specs, and ends it."""
    made: list[Stream] = []

    def make(*specs: str | OutputSettings) -> Stream:
        made.append(Stream(rig, *specs))
        return made[-1]
    yield make
    for one in made:
        one.close()
