"""What jitter means here: the definitions, and which one is used where (docs/jitter.md).

`moving` is for unfiltered positions of a hand that may move, `resting` for positions of a hand at rest, also filtered
ones, `scatter` for errors against the truth and for lengths that are known to be constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDER = 3
"""Differences are of third order: they remove any motion that is a parabola over four samples."""

GAP_S = 0.12
"""s: samples farther apart are not subtracted from each other."""

WINDOW_S = 0.5
"""s: length of the parabola about each sample of a hand at rest."""

LEAST = 4
"""Values of which a root mean square is told."""

_LEAST_NEIGHBOURS = 2  # on each side of a parabola
_LONGEST_WINDOW = 1.5  # times its length, when samples are missing


def moving(times_s: Array, values: Array) -> float:
    """rms of the third differences of `values` (T, D), scaled so that white noise keeps its own rms. NaN with too few
    samples in a row."""
    if len(times_s) <= ORDER:
        return np.nan
    rows = np.arange(len(times_s) - ORDER)[:, None] + np.arange(ORDER + 1)
    whole = (np.diff(times_s[rows], axis=1) <= GAP_S).all(axis=1) & (np.diff(times_s[rows], axis=1) > 0.0).all(axis=1)
    rows = rows[whole]
    squares = np.square(np.einsum("nk,nkd->nd", difference_weights(times_s[rows]), values[rows])).sum(axis=1)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if len(squares) >= LEAST else np.nan


def difference_weights(times_s: Array) -> Array:
    """(..., 4) weights that annul every parabola sampled at `times_s` (..., 4) s and pass white noise with gain one.

    They are those of the third divided difference, scaled to unit length, so unevenly spaced samples are no problem.
    """
    gaps = times_s[..., :, None] - times_s[..., None, :] + np.eye(times_s.shape[-1])
    weights = 1.0 / gaps.prod(axis=-1)
    return np.asarray(weights / np.linalg.norm(weights, axis=-1, keepdims=True))


def resting(times_s: Array, values: Array) -> float:
    """rms distance of `values` (T, D) from the parabolas through their half seconds; NaN with too few of them."""
    middles, _, leverage = parabolas(times_s, values, WINDOW_S)
    away = np.square(values - middles).sum(axis=1) / (1.0 - leverage)
    return float(np.sqrt(np.nanmean(away))) if np.isfinite(away).any() else np.nan


def scatter(errors: Array) -> float | None:
    """Standard deviation of errors (N, D) about their mean, all axes together; None below two samples."""
    finite = errors[np.isfinite(errors).all(axis=1)]
    return float(np.sqrt(finite.var(axis=0).sum())) if len(finite) > 1 else None


def parabolas(times_s: Array, values: Array, window_s: float) -> tuple[Array, Array, Array]:
    """Least squares about each sample of (T, D): value and slope there (T, D), and the sample's own say (T,); NaN
    where the sample or too many of its neighbours are missing, and at both ends."""
    middles, slopes = np.full((2, *values.shape), np.nan)
    leverage = np.full(len(times_s), np.nan)
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    if len(known) < 2 * _LEAST_NEIGHBOURS + 1:
        return middles, slopes, leverage
    period_s = float(np.median(np.diff(times_s)))
    half = max(_LEAST_NEIGHBOURS, round(0.5 * window_s / period_s))
    around = known[np.arange(half, len(known) - half)[:, None] + np.arange(-half, half + 1)]
    rows = around[:, half]
    dt = (times_s[around] - times_s[rows, None]) / window_s
    whole = np.ptp(dt, axis=1) < _LONGEST_WINDOW * max(1.0, 2 * half * period_s / window_s)
    rows, around, dt = rows[whole], around[whole], dt[whole]
    powers = np.stack([np.ones_like(dt), dt, dt * dt], axis=2)
    normal = np.linalg.inv(powers.transpose(0, 2, 1) @ powers)
    solved = normal @ (powers.transpose(0, 2, 1) @ values[around])
    middles[rows], slopes[rows], leverage[rows] = solved[:, 0], solved[:, 1] / window_s, normal[:, 0, 0]
    return middles, slopes, leverage
