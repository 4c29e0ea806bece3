"""Waiting in tests for what other threads and processes do: however busy the machine is, and never for a fixed time."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

PATIENCE_S = 40.0  # only a broken program takes it all; a machine with ten times too much to do does not
PATIENCE_MS = round(1e3 * PATIENCE_S)  # as Qt and ZeroMQ count
LOOK_S = 0.005


def eventually(condition: Callable[[], Any], timeout_s: float = PATIENCE_S,
               told: Callable[[], Any] | None = None) -> float:
    """Wait until `condition` holds; returns the seconds that took. Fails with what `told` gives when it never does."""
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() < begun + timeout_s, told() if told is not None else f"not within {timeout_s:g} s"
        time.sleep(LOOK_S)
    return time.monotonic() - begun


def settled(condition: Callable[[], Any], seconds: float = 0.3) -> bool:
    """Whether `condition` stays true for a while: for what must not happen. A slow machine only makes this kinder."""
    end = time.monotonic() + seconds
    while condition():
        if time.monotonic() >= end:
            return True
        time.sleep(LOOK_S)
    return False


def quickest(call: Callable[[], Any], enough_s: float = 0.0, times: int = 5,
             clock: Callable[[], float] = time.perf_counter) -> float:
    """Seconds that `call` took at its quickest: whatever else a machine does, it only makes things longer.

    Ends as soon as a call took less than `enough_s`, which is what the test demands of it. `clock`: of what only
    computes, `time.process_time`, which does not count what other programs do in between.
    """
    best = float("inf")
    for _ in range(times):
        begun = clock()
        call()
        best = min(best, clock() - begun)
        if best < enough_s:
            break
    return best
