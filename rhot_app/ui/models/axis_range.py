"""How high a plot's axis reaches: rare spikes do not flatten everything else, and are told instead of drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_USUAL_PERCENT = 90.0
_ROOM = 1.6  # times the usual: what stays below is drawn whole
_STEPS = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])


@dataclass(frozen=True, slots=True)
class Peak:
    """A run of values above the axis: when its highest one was, s, and how high."""

    second: float
    value: float


def usual_top(values: Array) -> float:
    """The greatest of `values` (any shape), or 1.6 times their 90th percentile where that is less; NaN without any."""
    known = values[np.isfinite(values)]
    if not len(known):
        return float("nan")
    return float(min(known.max(), max(_ROOM * np.percentile(known, _USUAL_PERCENT), 0.0)))


def round_top(top: float, least: float) -> float:
    """A round number a little above `top`, and at least `least`."""
    if not np.isfinite(top) or top <= 0:
        return least
    scale = 10.0 ** np.floor(np.log10(top))
    step = _STEPS[np.searchsorted(_STEPS, 1.05 * top / scale).clip(max=len(_STEPS) - 1)]
    return float(max(scale * step, least))


def peaks_above(seconds: Array, values: Array, top: float) -> list[Peak]:
    """One peak for each run of `values` (n,) above `top`; a gap or a value below ends a run."""
    above = np.flatnonzero(np.nan_to_num(values, nan=-np.inf) > top)
    if not len(above):
        return []
    runs = np.split(above, np.flatnonzero(np.diff(above) > 1) + 1)
    highest = [run[np.argmax(values[run])] for run in runs]
    return [Peak(float(seconds[k]), float(values[k])) for k in highest]
