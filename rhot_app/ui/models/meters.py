"""The figures of the live plots: jitter of each marker, latency by stage, rates and losses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.status import EngineStatus, NodeStatus
from rhot_app.filters.jitter import GAP_S, LEAST, ORDER, difference_weights
from rhot_app.latency import STACKED, latency_row, p50_p99, whole_way
from rhot_app.state import LATENCY_STAGES, HandState

Array = NDArray[np.float64]


class JitterWindow:
    """`filters.jitter.moving` of each marker over the last `span_s` seconds, m, fed with one state after the other."""

    def __init__(self, span_s: float = 1.0, capacity: int = 512, gap_s: float = GAP_S) -> None:
        self._span_ns = round(span_s * 1e9)
        self._gap_ns = round(gap_s * 1e9)
        self._capacity = capacity
        self.clear()

    def clear(self) -> None:
        """Forget everything, e.g. when another rig is opened."""
        self.marker_ids: tuple[str, ...] = ()
        self._recent_t: list[int] = []
        self._recent: list[Array] = []
        self._times = np.zeros(self._capacity, dtype=np.int64)
        self._squares = np.zeros((self._capacity, 0))
        self._count = 0

    def add(self, state: HandState) -> None:
        """Take one state in."""
        if state.marker_ids != self.marker_ids:
            self.clear()
            self.marker_ids = state.marker_ids
            self._squares = np.full((self._capacity, len(state.marker_ids)), np.nan)
        if self._recent_t and not 0 < state.t_master_ns - self._recent_t[-1] <= self._gap_ns:
            self._recent_t.clear()
            self._recent.clear()
        self._recent_t.append(state.t_master_ns)
        self._recent.append(state.marker_raw_positions)
        if len(self._recent) <= ORDER:
            return
        times = np.array([t - self._recent_t[0] for t in self._recent_t]) * 1e-9
        difference = np.tensordot(difference_weights(times), np.stack(self._recent), axes=1)
        slot = self._count % self._capacity
        self._times[slot] = state.t_master_ns
        self._squares[slot] = (difference**2).sum(axis=1)
        self._count += 1
        del self._recent_t[0], self._recent[0]

    def rms(self, now_ns: int) -> Array:
        """(M,) three-dimensional rms jitter of each marker, m; NaN with fewer than `LEAST` values in the window."""
        n = min(self._count, self._capacity)
        inside = now_ns - self._times[:n] <= self._span_ns
        squares = self._squares[:n][inside]
        known = np.isfinite(squares)
        count = known.sum(axis=0)
        total = np.where(known, squares, 0.0).sum(axis=0)
        return np.where(count >= LEAST, np.sqrt(total / np.maximum(count, 1)), np.nan)


# -- latency by stage --------------------------------------------------------------------------------------------------

BUDGET_S = 1.0 / 90.0
"""One frame at the 90 fps that the thesis names as the camera's limit (RHOT ch. 9): 11.1 ms."""


class LatencyWindow:
    """Fed with every state; keeps the last `capacity` of them and looks at those of the last `span_s` seconds."""

    def __init__(self, span_s: float = 2.0, capacity: int = 1024) -> None:
        self._span_ns = round(span_s * 1e9)
        self._times = np.zeros(capacity, dtype=np.int64)
        self._stages = np.full((capacity, len(LATENCY_STAGES)), np.nan)
        self._count = 0

    def clear(self) -> None:
        """Forget everything."""
        self._count = 0

    def add(self, state: HandState) -> None:
        """Take one state in; stages it does not name are unknown."""
        slot = self._count % len(self._times)
        self._times[slot] = state.t_master_ns
        self._stages[slot] = latency_row(state)
        self._count += 1

    def summary(self, now_ns: int) -> tuple[Array, Array]:
        """p50 and p99, each (stages + 1,) s: of every stage of `STACKED`, and last of their sum. NaN without states.

        The sum's percentiles are those of the whole way of each state, not sums of percentiles.
        """
        n = min(self._count, len(self._times))
        inside = self._stages[:n][now_ns - self._times[:n] <= self._span_ns]
        p50, p99 = p50_p99(np.column_stack([inside[:, :len(STACKED)], whole_way(inside)]))
        return p50, p99


# -- rates and losses --------------------------------------------------------------------------------------------------

_AT_START = frozenset({"clock_in_doubt", "no_clock", "not_started", "session"})

SETTLE_NS = 1_200_000_000


class LossMeter:
    """Turns the ever growing counts of lost and dropped datagrams into losses per second."""

    def __init__(self) -> None:
        self._last: EngineStatus | None = None

    def clear(self) -> None:
        """Forget the last counts."""
        self._last = None

    def per_second(self, status: EngineStatus) -> float:
        """Lost and dropped datagrams of all nodes per second since the last status; NaN when that is not known.

        Counts that fell (a new session, another engine) start anew instead of giving a negative rate.
        """
        last, self._last = self._last, status
        if last is None or last.session != status.session or last.pid != status.pid:
            return float("nan")
        elapsed = (status.t_master_ns - last.t_master_ns) * 1e-9
        lost = count_lost(status) - count_lost(last)
        return lost / elapsed if elapsed > 0 and lost >= 0 else float("nan")


def count_lost(status: EngineStatus) -> int:
    """Frames that could not be used, all nodes together."""
    return sum(sum(unused_frames(node).values()) for node in status.nodes)


def unused_frames(node: NodeStatus) -> dict[str, int]:
    """How many frames of a node could not be used, by reason ("lost": never arrived); each is counted once.

    One that the kernel had no room for is a gap in the sequence too. What comes before the clock and the session are
    agreed is no loss: every start has some.
    """
    found = {reason: count for reason, count in node.dropped.items() if count and reason not in _AT_START}
    lost = max(node.lost - node.dropped.get("kernel_overflow", 0), 0)
    return {**({"lost": lost} if lost else {}), **found}


class RateRows:
    """Rates of a status as a row; unknown until a run has lasted as long as the engine's own window of one second.

    Before that the engine counts what had piled up while it started as if it had come in that moment.
    """

    def __init__(self) -> None:
        self._run: tuple[int, int] | None = None
        self._began_ns = 0

    def clear(self) -> None:
        """Forget the run."""
        self._run = None

    def row(self, status: EngineStatus) -> Array:
        """Rates (1 + nodes,) Hz; NaN while nothing arrives, so that a silence is a gap and not a line at zero."""
        run = (status.pid, status.session)
        if run != self._run:
            self._run, self._began_ns = run, status.t_master_ns
        values = [status.state_rate_hz, *(node.rate_hz for node in status.nodes)]
        settled = status.t_master_ns - self._began_ns >= SETTLE_NS
        return np.array([value if value > 0 and settled else np.nan for value in values])


def rate_names(status: EngineStatus) -> tuple[str, ...]:
    """Names of the columns of `RateRows.row`."""
    return ("states", *(node.name for node in status.nodes))
