"""How noisy tracks are, and the same tracks without most of it: a parabola through every tenth of a second or so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

Array = NDArray[np.float64]

WINDOW_S = 0.15
"""A hand that shows its joints changes its course more slowly than this."""

_ORDER = 2
_MAD = 1.4826  # standard deviation per median absolute deviation of Gaussian noise


@dataclass(frozen=True, slots=True)
class SmoothTracks:
    """`positions` (T, M, 3) m, NaN where they were; `raw_noise_m` standard deviation per axis before and `noise_m`
    after smoothing, median over the markers. Tracks too slow to smooth stay as they are, and their noise unknown: 0."""

    positions: Array
    raw_noise_m: float
    noise_m: float


def smooth(times_s: Array, positions: Array) -> SmoothTracks:
    """Smooth tracks (T, M, 3) m at even `times_s` (T,)."""
    period_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else WINDOW_S
    length = int(WINDOW_S / max(period_s, 1e-6)) | 1  # odd: as many samples before as after
    if length <= _ORDER + 1 or len(times_s) < length:
        return SmoothTracks(positions, 0.0, 0.0)
    smoothed = np.full_like(positions, np.nan)
    instants = np.arange(len(positions))
    for marker in range(positions.shape[1]):
        seen = np.isfinite(positions[:, marker, 0])
        if seen.sum() < length:
            continue
        filled = np.stack([np.interp(instants, instants[seen], positions[seen, marker, axis]) for axis in range(3)])
        smoothed[seen, marker] = savgol_filter(filled, length, _ORDER).T[seen]
    own_weight = float(savgol_coeffs(length, _ORDER)[length // 2])
    off = np.abs(positions - smoothed)
    of_marker = [float(np.median(off[:, m][np.isfinite(off[:, m])])) for m in range(off.shape[1])
                 if np.isfinite(off[:, m]).any()]
    raw = _MAD * float(np.median(of_marker)) / np.sqrt(1.0 - own_weight) if of_marker else 0.0
    return SmoothTracks(smoothed, raw, float(raw * np.sqrt(own_weight)))
