"""One marker's way through one camera's pictures, at times that are being calibrated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.observations import CameraTable, ObservationTable
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import Rig
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DOUBTFUL = int(MarkerFlag.LOST | MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS)
"""Samples whose centroid may be biased by pixels, or be another blob's."""

LONGEST_PERIODS = 1.6
"""Samples further apart than this many frame periods are not one curve."""


@dataclass(frozen=True, slots=True)
class MarkerTrack:
    """K samples in the order of their frames. `start_s` (K,) of row 0; `rows` (K,) raw px; `rays` (K, 2) undistorted
    normalised coordinates; `joined` (K,): the sample continues the one before it."""

    start_s: Array
    rows: Array
    rays: Array
    joined: Mask

    def times(self, offset_s: float, row_time_s: float) -> Array:
        """(K,) s: when each sample was exposed, if the camera's clock is off by `offset_s`."""
        return np.asarray(self.start_s + offset_s + row_time_s * self.rows)


@dataclass(frozen=True, slots=True)
class CameraTracks:
    """One camera: a track per marker, its model, and what its node says of its rows (median), s."""

    name: str
    model: CameraModel
    tracks: tuple[MarkerTrack, ...]
    period_s: float
    row_time_s: float
    clock_bound_s: float


def build_tracks(table: ObservationTable, rig: Rig) -> tuple[CameraTracks, ...]:
    """All cameras of a recording; times begin at its first frame. Doubtful samples are left out."""
    epoch_ns = min((int(camera.t_row0_ns[0]) for camera in table.cameras if len(camera.t_row0_ns)), default=0)
    return tuple(_camera(camera, CameraModel.from_rig(node.intrinsics, node.pose), epoch_ns)
                 for camera, node in zip(table.cameras, rig.nodes, strict=True))


def interpolate(times: Array, values: Array, joined: Mask, at: Array) -> Array:
    """(N, D) of a track (K,), (K, D) at times `at` (N,): the cubic through the four samples about each.

    NaN where these are not one track. A cubic, because a line between two samples leaves a dt^2 / 8.
    """
    after = np.searchsorted(times, at)
    inside = (after >= 2) & (after <= len(times) - 2)
    after = np.clip(after, 2, max(2, len(times) - 2))
    result = np.full((len(at), values.shape[1]), np.nan)
    if len(times) < 4:
        return result
    whole = inside & joined[after - 1] & joined[after] & joined[after + 1]
    nodes = after[whole, None] + np.arange(-2, 2)
    node_times, t = times[nodes], at[whole]
    found = np.zeros((len(t), values.shape[1]))
    for k in range(4):
        weight = np.ones(len(t))
        for j in range(4):
            if j != k:
                weight *= (t - node_times[:, j]) / (node_times[:, k] - node_times[:, j])
        found += weight[:, None] * values[nodes[:, k]]
    result[whole] = found
    return result


def _camera(table: CameraTable, model: CameraModel, epoch_ns: int) -> CameraTracks:
    start_s = np.asarray(1e-9 * (table.t_row0_ns - epoch_ns), dtype=np.float64)
    period_s = 1.0 / table.rate_hz if table.rate_hz else np.inf
    tracks = tuple(_track(table, marker, start_s, model, LONGEST_PERIODS * period_s)
                   for marker in range(table.flags.shape[1]))
    row_time_ns = float(np.median(table.row_time_ns)) if len(start_s) else 0.0
    bound_s = float(np.median(table.clock_bound_s)) if len(start_s) else np.inf
    return CameraTracks(table.name, model, tracks, period_s, 1e-9 * row_time_ns, bound_s)


def _track(table: CameraTable, marker: int, start_s: Array, model: CameraModel, longest_s: float) -> MarkerTrack:
    pixels = table.pixels[:, marker]
    rays = model.undistort(pixels) if len(pixels) else np.empty((0, 2))
    kept = ((table.flags[:, marker] & DOUBTFUL) == 0) & np.isfinite(rays).all(axis=1)
    acquired = (table.flags[kept, marker] & int(MarkerFlag.ACQUIRED)) != 0
    gaps = np.diff(start_s[kept], prepend=-np.inf)
    return MarkerTrack(start_s[kept], pixels[kept, 1], rays[kept], (gaps <= longest_s) & ~acquired)


# -- smoothed tracks and their noise -----------------------------------------------------------------------------------
# By local polynomials.
# How long a polynomial follows a hand depends on the hand and on the noise that there is to average, so the recording
# decides: a longer window is taken as long as what it changes about the fastest movements is no more than noise
# (Lepski's method). Being off the curve would not average out over the recording as noise does.

WINDOWS_S = (0.08, 0.1, 0.15, 0.2)
"""None is longer: at 0.3 s a curve was off by a tenth of a millimetre where fingers turn round, hidden in noise of 0.4
mm, and that alone made a last phalanx 3 mm shorter."""

_ORDER = 4
_LEAST_SAMPLES = 2 * _ORDER - 1  # in a window: fewer do not average enough to be worth it
_WORST_GAIN = 1.5  # a sample with gaps around it is left out: the odd ones would be taken for odd poses
_MAD = 1.4826  # standard deviation per median absolute deviation of Gaussian noise
_THIRD_DIFFERENCE = np.sqrt(20.0)  # standard deviation of x0 - 3 x1 + 3 x2 - x3, of one sample's
_FAST = 99.0, 3.3682  # a percentile of distances, which the fastest samples decide; its value in a 3-D unit Gaussian
_DOUBT = 1.15  # the noise is known to a few hundredths, and gaps leave some samples with more of it
_LOOKED_AT = 6  # markers suffice to choose the window


@dataclass(frozen=True, slots=True)
class SmoothTracks:
    """`positions` (T, M, 3) m, NaN where a marker was missing or too alone to be averaged; `raw_noise_m` standard
    deviation per axis before and `noise_m` after smoothing, median over the markers; `looks`: as many independent
    instants with `noise_m` are worth as much as the recording."""

    positions: Array
    raw_noise_m: float
    noise_m: float
    looks: float

    @property
    def apart(self) -> int:
        """So many samples lie between instants whose noise has nothing to do with each other's any more."""
        return int(np.ceil(len(self.positions) / max(self.looks, 1.0)))


def smooth(times_s: Array, positions: Array) -> SmoothTracks:
    """Smooth tracks (T, M, 3) m at even `times_s` (T,). Those too slow for it stay as they are."""
    raw = _noise(positions)
    half = _best_half(times_s, positions, raw)
    if half == 0:
        return SmoothTracks(positions, raw, raw, float(len(positions)))
    smoothed, left = _smooth_all(positions, half)
    return SmoothTracks(smoothed, raw, raw * float(np.sqrt(left)), left * len(positions))


def _best_half(times_s: Array, positions: Array, raw_noise_m: float) -> int:
    """How many samples to either side make the best window; 0 when even the longest holds too few."""
    period_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else WINDOWS_S[0]
    halves = sorted({int(0.5 * window_s / max(period_s, 1e-6)) for window_s in WINDOWS_S})
    looked_at = positions[:, ::max(1, positions.shape[1] // _LOOKED_AT)]
    best, before, before_left = 0, looked_at, 1.0
    for half in halves:
        if not _LEAST_SAMPLES <= 2 * half + 1 <= len(positions):
            continue
        smoothed, left = _smooth_all(looked_at, half)
        change = np.linalg.norm(smoothed - before, axis=2)
        change = change[np.isfinite(change)]
        noise = _FAST[1] * raw_noise_m * float(np.sqrt(max(before_left - left, 0.0)))
        if not len(change) or (best and float(np.percentile(change, _FAST[0])) > _DOUBT * noise):
            break
        best, before, before_left = half, smoothed, left
    return best


def _smooth_all(positions: Array, half: int) -> tuple[Array, float]:
    """Tracks smoothed with windows of `half` to either side, and the part of the noise's variance that is left."""
    smoothed = np.full_like(positions, np.nan)
    gains = []
    for marker in range(positions.shape[1]):
        smoothed[:, marker], gain = _polynomials(positions[:, marker], half)
        gains.append(gain[np.isfinite(smoothed[:, marker, 0])])
    kept = np.concatenate(gains)
    return smoothed, float(np.mean(kept)) if len(kept) else 1.0


def _noise(positions: Array) -> float:
    """Standard deviation per axis from third differences, which leave nothing of a smooth course."""
    if len(positions) < 10:
        return 0.0
    third = np.abs(np.diff(positions, 3, axis=0))
    of_marker = [float(np.median(track[np.isfinite(track)])) for track in third.transpose(1, 0, 2)
                 if np.isfinite(track).any()]
    return _MAD * float(np.median(of_marker)) / float(_THIRD_DIFFERENCE) if of_marker else 0.0


def _polynomials(track: Array, half: int) -> tuple[Array, Array]:
    """Least-squares polynomial through the samples of each window of `half` to either side, at its middle: positions
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
