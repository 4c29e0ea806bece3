"""Rates and latencies over the last seconds, written for every state and read a few times a second."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from rhot_app.engine.status import LatencySummary
from rhot_app.tracking.state import LATENCY_STAGES

WINDOW = 600
"""States over which latency is summarised: five seconds at 120 Hz."""

LEAST_S = 0.25
"""Events of a shorter time come in a burst, as after a start, and tell no rate."""


class RateMeter:
    """Events per second over the last second. One thread writes, another may read."""

    def __init__(self, window_s: float = 1.0) -> None:
        self._times: deque[int] = deque(maxlen=4096)
        self._window_ns = round(1e9 * window_s)

    def tick(self, t_ns: int) -> None:
        """Note one event."""
        self._times.append(t_ns)

    def rate_hz(self, now_ns: int) -> float:
        """Events per second in the window that ends now."""
        recent = [t for t in self._times.copy() if now_ns - t <= self._window_ns]
        if len(recent) < 2 or recent[-1] == recent[0]:
            return 0.0
        # Intervals, not events: a window cut between two events would else flicker by one.
        since_last = now_ns - recent[-1]
        span = recent[-1] - recent[0]
        seconds = 1e-9 * (span + max(0, since_last - span // (len(recent) - 1)))
        return (len(recent) - 1) / max(seconds, LEAST_S)


class LatencyMeter:
    """The last latencies of every stage. One thread writes, another may read."""

    def __init__(self, window: int = WINDOW) -> None:
        self._values = np.full((window, len(LATENCY_STAGES)), np.nan)
        self._next = 0

    def add(self, latency_s: dict[str, float]) -> None:
        """Note one state's latencies by stage, s; a stage that is missing is not known."""
        self._values[self._next] = [latency_s.get(stage, math.nan) for stage in LATENCY_STAGES]
        self._next = (self._next + 1) % len(self._values)

    def summary(self) -> dict[str, LatencySummary]:
        """Median and 99th percentile of each stage that has any value."""
        ordered = np.sort(self._values, axis=0)  # NaN last
        counts = np.count_nonzero(~np.isnan(ordered), axis=0)
        return {stage: LatencySummary(float(ordered[int(0.5 * (count - 1)), k]),
                                      float(ordered[round(0.99 * (count - 1)), k]))
                for k, (stage, count) in enumerate(zip(LATENCY_STAGES, counts.tolist(), strict=True)) if count}

    def clear(self) -> None:
        """Forget all values: a new run begins."""
        self._values[:] = np.nan
