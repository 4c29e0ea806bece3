"""How one node's clock stands to the master's, from four-timestamp exchanges, with a bound that holds.

One exchange: the master sends at t1, the node receives at t2 and answers at t3, the master receives at t4. Then
offset = ((t2 - t1) + (t3 - t4)) / 2 and delay = (t4 - t1) - (t3 - t2), and by causality alone the true offset
(node minus master) is within delay / 2 of that, however unequal the two ways were. The interval grows by the drift
allowance while it ages. The true offset lies in every interval, so in their intersection. The interval's ends are
t2 - t1 and t3 - t4: each way is judged by its own quickest datagrams, and the estimate is the middle of the
intersection once all are carried forward by the measured drift. That is the most likely offset where delays are a fixed
part and an exponential one, the same both ways (Jeske 2005), and far better than the single exchange of least delay.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

DRIFT_ALLOWANCE = 100e-6
"""Two crystals of ±50 ppm each, s/s: what the interval of an offset grows by."""

DRIFT_WANDER = 5e-6
"""How far a drift measured over the history may be from the drift now, s/s; used to choose among samples."""

_WINDOW_NS = 10_000_000_000  # samples older than this cannot tighten the intersection
_HISTORY_NS = 60_000_000_000  # best sample of each second, for the drift
_LEAST_HISTORY_NS = 4_000_000_000
_SAMPLES_TO_TRUST = 3
_LONGEST_EXCHANGE_NS = 1_000_000_000
_WIDEST_BOUND_S = 0.05
_STEP_SLACK_NS = 2_000  # timestamp rounding and the clock's own reading time


@dataclass(frozen=True, slots=True)
class Exchange:
    """One answered clock request: master time of its middle, offset node - master and round trip, ns."""

    t_master_ns: int
    offset_ns: int
    delay_ns: int

    def half_width_ns(self, t_master_ns: int, rate: float = DRIFT_ALLOWANCE) -> float:
        """Half-width of the interval that holds the offset at `t_master_ns`."""
        return self.delay_ns / 2 + rate * abs(t_master_ns - self.t_master_ns)


@dataclass(frozen=True, slots=True)
class ClockEstimate:
    """Offset (node - master) at `t_master_ns` with the half-width that holds there, and the drift to carry it on."""

    t_master_ns: int
    offset_ns: float
    half_width_ns: float
    drift: float

    def bound_s(self, t_master_ns: int) -> float:
        """Half-width at another time, s. The drift carried on may itself be wrong, so both rates widen it."""
        age_ns = abs(t_master_ns - self.t_master_ns)
        return 1e-9 * (self.half_width_ns + (DRIFT_ALLOWANCE + abs(self.drift)) * age_ns)

    def to_master_ns(self, t_node_ns: int) -> int:
        """Master time at which the node's clock showed `t_node_ns`."""
        # Solved about the reference time: offsets of hours times a rate must not lose nanoseconds.
        elapsed_node_ns = t_node_ns - self.t_master_ns - round(self.offset_ns)
        return self.t_master_ns + round(elapsed_node_ns / (1.0 + self.drift))


class NodeClockModel:
    """What is known of one node's clock. One thread writes; any may read."""

    def __init__(self) -> None:
        self._boot_id: int | None = None
        self._window: deque[Exchange] = deque()
        self._history: deque[Exchange] = deque()
        self._estimate: ClockEstimate | None = None
        self.resets = 0

    def add(self, t1_master_ns: int, t2_node_ns: int, t3_node_ns: int, t4_master_ns: int, boot_id: int) -> bool:
        """Take one exchange in. Returns True when it showed another boot or a stepped clock: all before is forgotten.

        An impossible exchange (answer before question, longer than a second) is ignored.
        """
        delay_ns = (t4_master_ns - t1_master_ns) - (t3_node_ns - t2_node_ns)
        if t3_node_ns < t2_node_ns or not 0 <= delay_ns <= _LONGEST_EXCHANGE_NS:
            return False
        exchange = Exchange((t1_master_ns + t4_master_ns) // 2,
                            ((t2_node_ns - t1_master_ns) + (t3_node_ns - t4_master_ns)) // 2, delay_ns)
        changed = self._boot_id is not None and (boot_id != self._boot_id or self._contradicts(exchange))
        if changed:
            self.reset()
        self._boot_id = boot_id
        self._remember(exchange)
        if len(self._window) >= _SAMPLES_TO_TRUST:
            self._estimate = _estimate(self._window, self._history, exchange.t_master_ns)
        return changed

    def reset(self) -> None:
        """Forget everything; nothing is converted until enough new exchanges agree."""
        self._window.clear()
        self._history.clear()
        self._estimate = None
        self._boot_id = None
        self.resets += 1

    def estimate_at(self, t_master_ns: int) -> ClockEstimate | None:
        """The estimate, fit to convert times around `t_master_ns`; None while too few exchanges agree or the last is
        too long ago. Safe to call from another thread: what it returns does not change."""
        estimate = self._estimate
        return estimate if estimate is not None and estimate.bound_s(t_master_ns) <= _WIDEST_BOUND_S else None

    @property
    def bound_s(self) -> float | None:
        """The bound at the last exchange, s."""
        return None if self._estimate is None else self._estimate.bound_s(self._estimate.t_master_ns)

    @property
    def offset_s(self) -> float | None:
        """Node clock minus master clock at the last exchange, s."""
        return None if self._estimate is None else self._estimate.offset_ns * 1e-9

    @property
    def drift(self) -> float:
        """Measured rate of the node's clock against the master's, s/s; 0 while the history is too short."""
        return 0.0 if self._estimate is None else self._estimate.drift

    @property
    def round_trip_s(self) -> float | None:
        """Round trip of the last exchange, s."""
        return self._window[-1].delay_ns * 1e-9 if self._window else None

    def _contradicts(self, exchange: Exchange) -> bool:
        """True when no steady clock could show both the samples so far and this one."""
        if not self._window:
            return False
        t = exchange.t_master_ns
        low = max(s.offset_ns - s.half_width_ns(t) for s in self._window)
        high = min(s.offset_ns + s.half_width_ns(t) for s in self._window)
        half = exchange.delay_ns / 2 + _STEP_SLACK_NS
        return exchange.offset_ns + half < low or exchange.offset_ns - half > high

    def _remember(self, exchange: Exchange) -> None:
        self._window.append(exchange)
        while exchange.t_master_ns - self._window[0].t_master_ns > _WINDOW_NS:
            self._window.popleft()
        if self._history and exchange.t_master_ns // 1_000_000_000 == self._history[-1].t_master_ns // 1_000_000_000:
            if exchange.delay_ns < self._history[-1].delay_ns:
                self._history[-1] = exchange
        else:
            self._history.append(exchange)
        while exchange.t_master_ns - self._history[0].t_master_ns > _HISTORY_NS:
            self._history.popleft()


def _estimate(window: deque[Exchange], history: deque[Exchange], now_ns: int) -> ClockEstimate:
    drift = _measure_drift(history)
    allowance = DRIFT_WANDER if drift is not None else DRIFT_ALLOWANCE
    rate = drift or 0.0
    carried = [(sample.offset_ns + rate * (now_ns - sample.t_master_ns), sample.half_width_ns(now_ns, allowance))
               for sample in window]
    offset = 0.5 * (max(at - half for at, half in carried) + min(at + half for at, half in carried))
    low = max(sample.offset_ns - sample.half_width_ns(now_ns) for sample in window)
    high = min(sample.offset_ns + sample.half_width_ns(now_ns) for sample in window)
    offset = min(max(offset, low), high) if low <= high else 0.5 * (low + high)
    return ClockEstimate(now_ns, offset, max(high - offset, offset - low, 0.0) + _STEP_SLACK_NS, rate)


def _measure_drift(history: deque[Exchange]) -> float | None:
    """Slope of the offset over the history, weighted by how well each sample is known, s/s; None when too short."""
    if len(history) < 4 or history[-1].t_master_ns - history[0].t_master_ns < _LEAST_HISTORY_NS:
        return None
    first = history[0]
    t = np.array([sample.t_master_ns - first.t_master_ns for sample in history], dtype=float)
    offset = np.array([sample.offset_ns - first.offset_ns for sample in history], dtype=float)
    weight = 1.0 / np.array([sample.delay_ns + 20_000.0 for sample in history]) ** 2
    t_mean, offset_mean = np.average(t, weights=weight), np.average(offset, weights=weight)
    slope = float(np.sum(weight * (t - t_mean) * (offset - offset_mean)) / np.sum(weight * (t - t_mean) ** 2))
    return min(max(slope, -DRIFT_ALLOWANCE), DRIFT_ALLOWANCE)
