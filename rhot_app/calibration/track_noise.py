"""How noisy tracks are, and the same tracks without most of it: a parabola through every tenth of a second or so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WINDOW_S = 0.1
"""A parabola follows a finger for so long: on motion capture of a hand that takes hold of things it is off by 0.02 mm
in the median, with half as much again 0.04 mm, which is more than the longer window takes from the noise."""

_ORDER = 2
_LEAST_SAMPLES = 5  # in a window: fewer do not average anything
_WORST_GAIN = 1.5  # a sample with gaps around it is left out: the odd ones would be taken for odd poses
_MAD = 1.4826  # standard deviation per median absolute deviation of Gaussian noise
_THIRD_DIFFERENCE = np.sqrt(20.0)  # standard deviation of x0 - 3 x1 + 3 x2 - x3, of one sample's


@dataclass(frozen=True, slots=True)
class SmoothTracks:
    """`positions` (T, M, 3) m, NaN where a marker was missing or too alone to be averaged; `raw_noise_m` standard
    deviation per axis before and `noise_m` after smoothing, median over the markers; `looks`: as many independent
    instants with `noise_m` are worth as much as the recording."""

    positions: Array
    raw_noise_m: float
    noise_m: float
    looks: float


def smooth(times_s: Array, positions: Array) -> SmoothTracks:
    """Smooth tracks (T, M, 3) m at even `times_s` (T,). Those too slow for it stay as they are."""
    raw = _noise(positions)
    period_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else WINDOW_S
    half = int(0.5 * WINDOW_S / max(period_s, 1e-6))
    if 2 * half + 1 < _LEAST_SAMPLES:
        return SmoothTracks(positions, raw, raw, float(len(positions)))
    smoothed = np.full_like(positions, np.nan)
    gains = []
    for marker in range(positions.shape[1]):
        smoothed[:, marker], gain = _parabolas(positions[:, marker], half)
        gains.append(gain[np.isfinite(smoothed[:, marker, 0])])
    kept = np.concatenate(gains)
    left = float(np.mean(kept)) if len(kept) else 1.0
    return SmoothTracks(smoothed, raw, raw * float(np.sqrt(left)), left * len(positions))


def _noise(positions: Array) -> float:
    """Standard deviation per axis from third differences, which leave nothing of a smooth course."""
    if len(positions) < 2 * _LEAST_SAMPLES:
        return 0.0
    third = np.abs(np.diff(positions, 3, axis=0))
    of_marker = [float(np.median(track[np.isfinite(track)])) for track in third.transpose(1, 0, 2)
                 if np.isfinite(track).any()]
    return _MAD * float(np.median(of_marker)) / float(_THIRD_DIFFERENCE) if of_marker else 0.0


def _parabolas(track: Array, half: int) -> tuple[Array, Array]:
    """Least-squares parabola through the samples of each window of `half` to either side, at its middle: positions
    (T, 3), NaN where the middle is missing or too few are there, and what is left of the noise's variance (T,)."""
    seen = np.isfinite(track[:, 0])
    offsets = np.arange(-half, half + 1) / max(half, 1)

    def moments(values: Array, power: int) -> Array:
        return np.asarray(np.correlate(values, offsets ** power, mode="same"))

    counts = moments(seen.astype(np.float64), 0)
    powers = np.stack([moments(seen.astype(np.float64), power) for power in range(2 * _ORDER + 1)], axis=1)
    matrix = powers[:, np.add.outer(np.arange(_ORDER + 1), np.arange(_ORDER + 1))]
    usable = seen & (counts >= _LEAST_SAMPLES)
    matrix[~usable] = np.eye(_ORDER + 1)
    filled = np.where(seen[:, None], track, 0.0)
    right = np.stack([[moments(filled[:, axis], power) for axis in range(3)] for power in range(_ORDER + 1)])
    inverse = np.linalg.inv(matrix + 1e-9 * np.eye(_ORDER + 1))
    middle = np.einsum("tp,pat->ta", inverse[:, 0], right)
    gain = np.asarray(inverse[:, 0, 0], dtype=np.float64)
    if usable.any():
        usable &= gain <= _WORST_GAIN * float(np.median(gain[usable]))
    return np.asarray(np.where(usable[:, None], middle, np.nan), dtype=np.float64), gain
