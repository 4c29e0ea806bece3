"""Two recordings of one hand, held still and moved fast, and what any pair of filters makes of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.filter_meters import JITTER_WINDOW_S, jitter, lag, motion_of, velocities
from rhot_app.calibration.filter_simulation import OFF, Footage, simulate

Array = NDArray[np.float64]

LEAST_INSTANTS = 40
"""A marker must be measured in so many instants of either recording."""


class FilterBench:
    """M markers. Filters are given as parameters (M, 3): min cutoff, beta, derivative cutoff.

    `known` (M,): measured long enough in both recordings. `raw_jitter_m` and `raw_jitter_px` (M,) without any filter;
    `speeds_m_s` (M,) in the fast recording; `drift_m_s`: how fast the hand that was held still wandered.
    """

    def __init__(self, still: Footage, fast: Footage) -> None:
        self._still, self._fast = still, fast
        off = np.tile(OFF, (still.markers, 1))
        resting, moving = simulate(still, off, off)[1], simulate(fast, off, off)[1]
        self._motions = [motion_of(fast.times_s, moving[:, m]) for m in range(still.markers)]
        self.known = np.minimum(*(np.isfinite(one[..., 0]).sum(axis=0) for one in (resting, moving))) >= LEAST_INSTANTS
        self.raw_jitter_m = self._jitter(resting)
        self.raw_jitter_px = _mean_of_known([self._jitter(still.pixels[:, camera])
                                             for camera in range(still.pixels.shape[1])])
        self.speeds_m_s = np.array([motion.speed for motion in self._motions])
        self.drift_m_s = self._drift(resting)

    def jitter_m(self, pixel: Array, position: Array) -> Array:
        """(M,) of the hand held still."""
        return self._jitter(simulate(self._still, pixel, position)[1])

    def lag_and_error(self, pixel: Array, position: Array) -> tuple[Array, Array]:
        """(M,) lag s and rms error m of the moving hand; NaN for markers that hardly move."""
        filtered = simulate(self._fast, pixel, position)[1]
        found = np.array([lag(self._fast.times_s, filtered[:, m], motion) for m, motion in enumerate(self._motions)])
        return found[:, 0], found[:, 1]

    def _jitter(self, values: Array) -> Array:
        return np.array([jitter(self._still.times_s, values[:, m]) for m in range(values.shape[1])])

    def _drift(self, resting: Array) -> float:
        """The median marker's, m/s rms; 0 when no marker is known."""
        speeds = [np.linalg.norm(velocities(self._still.times_s, resting[:, m], JITTER_WINDOW_S), axis=1)
                  for m in np.flatnonzero(self.known)]
        found = [float(np.sqrt(np.mean(np.square(one[np.isfinite(one)])))) for one in speeds if np.isfinite(one).any()]
        return float(np.median(found)) if found else 0.0


def _mean_of_known(rows: list[Array]) -> Array:
    """(M,) mean of the rows that are not NaN."""
    stacked = np.array(rows)
    known = np.isfinite(stacked)
    return np.where(known, stacked, 0.0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)
