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
class Track:
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
    tracks: tuple[Track, ...]
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


def _track(table: CameraTable, marker: int, start_s: Array, model: CameraModel, longest_s: float) -> Track:
    pixels = table.pixels[:, marker]
    rays = model.undistort(pixels) if len(pixels) else np.empty((0, 2))
    kept = ((table.flags[:, marker] & DOUBTFUL) == 0) & np.isfinite(rays).all(axis=1)
    acquired = (table.flags[kept, marker] & int(MarkerFlag.ACQUIRED)) != 0
    gaps = np.diff(start_s[kept], prepend=-np.inf)
    return Track(start_s[kept], pixels[kept, 1], rays[kept], (gaps <= longest_s) & ~acquired)
