"""Where the time goes: median and 99th percentile of every stage over the last seconds, and of the whole way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking.state import LATENCY_STAGES, HandState

Array = NDArray[np.float64]

STACKED: tuple[str, ...] = LATENCY_STAGES[:-1]
"""The stages that follow one another; the last entry of `LATENCY_STAGES` overlaps them and is not stacked."""

BUDGET_S = 1.0 / 90.0
"""One frame at the 90 fps that the thesis names as the camera's limit (RHOT ch. 9): 11.1 ms."""


class LatencyWindow:
    """Fed with every state; keeps the last `capacity` of them and looks at those of the last `span_s` seconds."""

    def __init__(self, span_s: float = 2.0, capacity: int = 1024) -> None:
        self._span_ns = round(span_s * 1e9)
        self._times = np.zeros(capacity, dtype=np.int64)
        self._stages = np.full((capacity, len(STACKED)), np.nan)
        self._count = 0

    def clear(self) -> None:
        """Forget everything."""
        self._count = 0

    def add(self, state: HandState) -> None:
        """Take one state in; stages it does not name are unknown."""
        slot = self._count % len(self._times)
        self._times[slot] = state.t_master_ns
        self._stages[slot] = [state.latency_s.get(stage, np.nan) for stage in STACKED]
        self._count += 1

    def summary(self, now_ns: int) -> tuple[Array, Array]:
        """p50 and p99, each (stages + 1,) s: of every stage of `STACKED`, and last of their sum. NaN without states.

        The sum's percentiles are those of the whole way of each state, not sums of percentiles.
        """
        n = min(self._count, len(self._times))
        inside = self._stages[:n][now_ns - self._times[:n] <= self._span_ns]
        p50 = np.full(len(STACKED) + 1, np.nan)
        p99 = p50.copy()
        known = np.isfinite(inside)
        if not known.any():
            return p50, p99
        whole = np.where(known, inside, 0.0).sum(axis=1)
        for column in range(len(STACKED)):
            values = inside[known[:, column], column]
            if len(values):
                p50[column], p99[column] = np.percentile(values, (50, 99))
        p50[-1], p99[-1] = np.percentile(whole, (50, 99))
        return p50, p99
