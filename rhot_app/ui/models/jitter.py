"""How much each marker trembles: rms over a sliding second of the raw position, with the hand's own motion removed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking.state import HandState

Array = NDArray[np.float64]

ORDER = 3
"""Differences are of third order: they remove any motion that is a parabola over four states."""


def difference_weights(times_s: Array) -> Array:
    """(4,) weights that annul every parabola sampled at `times_s` (4,) s and pass white noise with gain one.

    They are those of the third divided difference, scaled to unit length, so unevenly spaced states are no problem.
    """
    gaps = times_s[:, None] - times_s[None, :]
    np.fill_diagonal(gaps, 1.0)
    weights = 1.0 / gaps.prod(axis=1)
    return np.asarray(weights / np.linalg.norm(weights))


class JitterWindow:
    """Fed with every state; tells each marker's jitter over the last `span_s` seconds, m."""

    def __init__(self, span_s: float = 1.0, capacity: int = 512, gap_s: float = 0.12) -> None:
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
        """(M,) three-dimensional rms jitter of each marker, m; NaN with fewer than four values in the window."""
        n = min(self._count, self._capacity)
        inside = now_ns - self._times[:n] <= self._span_ns
        squares = self._squares[:n][inside]
        known = np.isfinite(squares)
        count = known.sum(axis=0)
        total = np.where(known, squares, 0.0).sum(axis=0)
        return np.where(count >= 4, np.sqrt(total / np.maximum(count, 1)), np.nan)
