"""How calm and how prompt a track is: spread of a hand that stands still, lag behind one that moves, time to start."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from rhot_app.evaluation.deviations import Worn, distances
from rhot_app.evaluation.score import VISIBLE_FRACTION
from rhot_app.evaluation.track import Track
from rhot_app.simulator.truth import Truth

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SETTLED_S = 2.0
"""A still hand's spread is measured after this scene time."""

NEAR_M = 5e-3
"""A hand counts as found when every fingertip in sight is as near as this to the truth."""

_LAG_LIMITS_S = (-0.05, 0.1)
_RISING_MPS = 0.1


def spread(track: Track, worn: Worn) -> tuple[Array, float]:
    """Standard deviation of a still hand's fingertips about their means after SETTLED_S: per axis (3,) and in space, m;
    root mean square over the fingers."""
    tips = track.fingertip_positions[track.times_s >= SETTLED_S][:, worn.tip_fingers]
    variances = np.nanmean(np.nanvar(tips, axis=0), axis=0)
    return np.sqrt(variances), float(np.sqrt(variances.sum()))


def lag(times_s: Array, tips: Array, truth: Truth, worn: Worn) -> float:
    """By how much later the truth would have to be to fit the fingertips (N, T, 3) best, s; > 0 is late.

    What a fingertip is off by all the time is no lag, so the mean is left out; the best fit is in the least squares.
    """
    known = np.isfinite(tips).all(axis=(1, 2))

    def misfit(shift_s: float) -> float:
        off = tips[known] - truth.markers_at(times_s[known] - shift_s)[:, worn.tips]
        return float(np.square(off - off.mean(axis=0)).sum())

    grid = np.linspace(*_LAG_LIMITS_S, 31)
    best = int(np.argmin([misfit(shift) for shift in grid]))
    bounds = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    return float(minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-6}).x)


def rising(times_s: Array, truth: Truth) -> Mask:
    """(N,) whether the palm is getting faster at these times, and is no longer at rest."""
    before, now, after = (truth.palm_at(times_s + step)[:, :3, 3] for step in (-5e-3, 0.0, 5e-3))
    speed_before, speed_after = distances(now - before) / 5e-3, distances(after - now) / 5e-3
    return np.asarray((speed_after > speed_before) & (speed_after > _RISING_MPS))


def found_after(track: Track, truth: Truth, worn: Worn, first_s: float) -> float | None:
    """Time from the first datagram, received at scene time `first_s`, until a state has every fingertip whose marker is
    truly visible nearer than NEAR_M to the truth, s. None when there never is one."""
    off = distances(track.fingertip_positions[:, worn.tip_fingers] - truth.markers_at(track.times_s)[:, worn.tips])
    visible = truth.visible_at(track.times_s)[:, worn.tips] >= VISIBLE_FRACTION
    good = visible.any(axis=1) & np.where(visible, off < NEAR_M, True).all(axis=1)
    return float(track.receive_s[np.argmax(good)] - first_s) if good.any() else None


def settled_after(times_s: Array, ratios: Array, tolerance: float) -> float | None:
    """The time from which on a ratio (N,) stays within `tolerance` of 1; None when it does not at the end."""
    outside = np.flatnonzero(~(np.abs(ratios - 1.0) <= tolerance))
    if not outside.size:
        return float(times_s[0])
    return None if outside[-1] == len(times_s) - 1 else float(times_s[outside[-1] + 1])
