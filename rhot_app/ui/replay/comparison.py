"""Two runs of one recording side by side: how far apart their fingertips are at the same instants. No Qt."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.ui.replay.run import Tracked

Array = NDArray[np.float64]

FARTHEST_NS = 50_000_000
"""States farther apart in time are not compared: at 1 m/s a hand moves 5 cm meanwhile."""


class Comparison:
    """`second` beside `first`. `differences_mm` (N, 5): between the fingertips at each of the first one's states."""

    def __init__(self, first: Tracked, second: Tracked) -> None:
        self.partners = nearest(first.times_ns, second.times_ns)
        apart_ns = np.abs(second.times_ns[self.partners] - first.times_ns)
        self.partners[apart_ns > FARTHEST_NS] = -1
        gaps_m = np.linalg.norm(second.fingertips[self.partners] - first.fingertips, axis=2)
        gaps_m[self.partners < 0] = np.nan
        self.differences_mm: Array = 1e3 * gaps_m
        self.times_ns = first.times_ns
        self.of = (first, second)

    def partner(self, number: int) -> int | None:
        """The second run's state at the instant of the first one's; None when there is none."""
        found = int(self.partners[number])
        return found if found >= 0 else None

    def highest_mm(self, least_spacing_ns: int) -> tuple[NDArray[np.int64], Array]:
        """For a plot: times (K,), at least so far apart, and the highest differences (K, 5) from each to the next."""
        spacing_ns = max(1, int(np.median(np.diff(self.times_ns)))) if len(self.times_ns) > 1 else least_spacing_ns
        begins = np.arange(0, len(self.times_ns), max(1, round(least_spacing_ns / spacing_ns)))
        return self.times_ns[begins], np.fmax.reduceat(self.differences_mm, begins, axis=0)

    def percentiles_mm(self, *percents: float) -> Array:
        """(len(percents), 5) of each fingertip's differences over the whole recording; NaN where there are none."""
        found = np.full((len(percents), self.differences_mm.shape[1]), np.nan)
        for finger, column in enumerate(self.differences_mm.T):
            known = column[np.isfinite(column)]
            if len(known):
                found[:, finger] = np.percentile(known, percents)
        return found


def nearest(wanted_ns: NDArray[np.int64], given_ns: NDArray[np.int64]) -> NDArray[np.intp]:
    """(N,) for each of `wanted_ns` (N,) the number of the nearest of `given_ns` (K,), which grows."""
    after = np.clip(np.searchsorted(given_ns, wanted_ns), 0, len(given_ns) - 1)
    before = np.maximum(after - 1, 0)
    nearer_before = np.abs(given_ns[before] - wanted_ns) <= np.abs(given_ns[after] - wanted_ns)
    return np.where(nearer_before, before, after)
