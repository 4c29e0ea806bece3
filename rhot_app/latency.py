"""How latencies are summarised, wherever they are shown or judged: one definition (docs/jitter.md).

A stage's figures are the median and the 99th percentile of its own values. Those of the whole way are of each state's
sum over the stages, not sums of percentiles. The last of `LATENCY_STAGES` overlaps the others and is not added.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.state import LATENCY_STAGES, HandState

Array = NDArray[np.float64]

STACKED: tuple[str, ...] = LATENCY_STAGES[:-1]
"""The stages that follow one another."""

PERCENTS = 50.0, 99.0


def latency_row(state: HandState) -> list[float]:
    """One state's latencies in the order of `LATENCY_STAGES`, s; a stage that it does not name is NaN."""
    return [state.latency_s.get(stage, np.nan) for stage in LATENCY_STAGES]


def whole_way(rows: Array) -> Array:
    """(N,) s of (N, stages): from the frame to the state. A stage that is not known adds nothing; NaN where none is."""
    stacked = rows[:, :len(STACKED)]
    known = np.isfinite(stacked)
    return np.where(known.any(axis=1), np.where(known, stacked, 0.0).sum(axis=1), np.nan)


def p50_p99(values: Array) -> tuple[Array, Array]:
    """Median and 99th percentile of the finite values of each column of (N, ...), between two of them in proportion;
    NaN without any."""
    ordered = np.sort(np.where(np.isfinite(values), values, np.nan), axis=0)  # NaN last
    last = np.count_nonzero(np.isfinite(ordered), axis=0) - 1
    found = []
    for percent in PERCENTS:
        place = 0.01 * percent * np.maximum(last, 0)
        low, high = (np.take_along_axis(ordered, np.expand_dims(end(place).astype(int), 0), axis=0)[0]
                     if len(ordered) else np.full(values.shape[1:], np.nan) for end in (np.floor, np.ceil))
        found.append(np.asarray(low + (place - np.floor(place)) * (high - low)))
    return found[0], found[1]
