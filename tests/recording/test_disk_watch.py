"""How long the disk lasts: by the rate of the last seconds, and nothing while that cannot be told."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rhot_app.recording.recorder import WINDOW_S, DiskWatch
from rhot_node.files import free_bytes


def test_the_rate_is_that_of_the_last_seconds() -> None:
    watch = DiskWatch(Path("/"), lambda folder: 60_000)
    watch.look(8192, 0.0)
    watch.look(8692, 1.0)
    assert watch.seconds_left == math.inf, "a second tells no rate"
    watch.look(10192, 2.0)
    assert watch.seconds_left == pytest.approx(60.0)
    for second in range(3, 40):
        watch.look(10192 + 100 * (second - 2), float(second))
    assert watch.seconds_left == pytest.approx(600.0)
    for second in range(40, 42 + round(WINDOW_S)):
        watch.look(14000, float(second))
    assert watch.seconds_left == math.inf, "what does not grow fills nothing"


def test_a_disk_that_tells_nothing_warns_of_nothing() -> None:
    def broken(folder: Path) -> int:
        raise OSError("gone")

    watch = DiskWatch(Path("/"), broken)
    watch.look(0, 0.0)
    watch.look(10**9, 5.0)
    assert watch.seconds_left == math.inf
    assert free_bytes(Path("/")) > 0
