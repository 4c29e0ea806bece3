"""Observations of markers by pairs of cameras at one instant, a store of bounded size, and their epipolar errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TWIST = 6
"""Numbers of a camera's correction: turn rad, shift m."""

HISTORY_S = 300.0
"""Older observations are left out: in five minutes a warm camera drifts by as much as they determine."""

CAPACITY = 3000
"""Observations: six markers twice a second, for four minutes."""

VOXEL_M = 0.05


PAIR = np.dtype([("t_s", "f8"), ("first", "i8"), ("second", "i8"), ("marker", "i8"), ("voxel", "i8"),
                 ("rays", "f8", (2, 2)), ("noise", "f8", (2, 2, 2))])
"""An epipolar observation of a `marker` by the cameras `first` and `second`, in a `voxel` (a hash). `rays`: normalised,
of both cameras, the marker's body taken into account; `noise`: their covariances."""

Pairs = NDArray[np.void]
"""(N,) PAIR."""


class PairStore:
    """At most `CAPACITY` observations of the last `HISTORY_S` seconds, spread over the volume: a new one takes the
    place of the oldest in the fullest voxel."""

    def __init__(self) -> None:
        self._rows, self.count = np.zeros(CAPACITY, PAIR), 0

    def add(self, t_s: float, cameras: tuple[int, int], marker: int, rays: Array, noise: Array, place: Array) -> None:
        """Keep one observation of `marker` at `t_s` and `place` (3,) m."""
        x, y, z = (int(value) + 512 for value in np.clip(np.floor(place / VOXEL_M), -512, 511))
        voxel = (x << 20) | (y << 10) | z
        row = self.count if self.count < CAPACITY else self._worst()
        self.count = max(self.count, row + 1)
        self._rows[row] = t_s, *cameras, marker, voxel, rays, noise

    def recent(self, now_s: float) -> Pairs:
        """Those that are not too old, in the order of time."""
        rows = self._rows[:self.count]
        rows = rows[rows["t_s"] > now_s - HISTORY_S]
        return rows[np.argsort(rows["t_s"], kind="stable")]

    def _worst(self) -> int:
        t_s, voxel = self._rows["t_s"], self._rows["voxel"]
        oldest = int(np.argmin(t_s))
        if t_s[oldest] < t_s.max() - HISTORY_S:
            return oldest
        _, where, counts = np.unique(voxel, return_inverse=True, return_counts=True)
        fullest = np.flatnonzero(where == np.argmax(counts))
        return int(fullest[np.argmin(t_s[fullest])])


@dataclass(frozen=True, slots=True)
class Linearised:
    """N epipolar errors at poses of the cameras: `error_px` (N,), signed, the distance of both rays' points from the
    nearest pair that meets; its `sd_px` (N,) by the stated covariances; `jacobian` (N, 6 (C - 1)) px per rad and m."""

    error_px: Array
    sd_px: Array
    jacobian: Array


def linearise(rows: Pairs, world_from_camera: Array, focal: Array) -> Linearised:
    """The epipolar errors (Sampson's distance) of `rows` for cameras at `world_from_camera` (C, 4, 4), with `focal`
    (C, 2) px."""
    i, j = rows["first"], rows["second"]
    turns, centres = world_from_camera[:, :3, :3], world_from_camera[:, :3, 3]
    ones = np.ones((len(i), 1))
    x_i, x_j = np.hstack([rows["rays"][:, 0], ones]), np.hstack([rows["rays"][:, 1], ones])
    a, b = np.einsum("nij,nj->ni", turns[i], x_i), np.einsum("nij,nj->ni", turns[j], x_j)
    base = centres[j] - centres[i]
    n_j = np.einsum("nji,nj->ni", turns[j], np.cross(base, a))  # of the error by the second ray, its own axes
    m_i = np.einsum("nji,nj->ni", turns[i], np.cross(b, base))
    error, across = np.sum(n_j * x_j, axis=1), np.cross(a, b)
    # A longer baseline makes `error` larger, and `per_px` as well: their ratio does not depend on it.
    across -= base * (np.sum(across * base, axis=1) / np.sum(base * base, axis=1))[:, None]
    per_px = np.sqrt(np.square(n_j[:, :2] / focal[j]).sum(axis=1) + np.square(m_i[:, :2] / focal[i]).sum(axis=1))
    variance = (np.einsum("ni,nij,nj->n", m_i[:, :2], rows["noise"][:, 0], m_i[:, :2])
                + np.einsum("ni,nij,nj->n", n_j[:, :2], rows["noise"][:, 1], n_j[:, :2]))
    jacobian = np.zeros((len(i), len(turns), TWIST))
    every = np.arange(len(i))
    jacobian[every, j, :3] = np.cross(x_j, n_j)
    jacobian[every, j, 3:] = np.einsum("nji,nj->ni", turns[j], across)
    jacobian[every, i, :3] = np.cross(x_i, m_i)
    jacobian[every, i, 3:] = -np.einsum("nji,nj->ni", turns[i], across)
    return Linearised(error / per_px, np.sqrt(variance) / per_px,
                      jacobian[:, 1:].reshape(len(i), -1) / per_px[:, None])


def midpoints(rows: Pairs, poses: Array) -> Array:
    """(N, 3) m: the places between both rays of each observation, with cameras at `poses` (C, 4, 4)."""
    ones = np.ones((len(rows), 1))
    a = np.einsum("nij,nj->ni", poses[rows["first"], :3, :3], np.hstack([rows["rays"][:, 0], ones]))
    b = np.einsum("nij,nj->ni", poses[rows["second"], :3, :3], np.hstack([rows["rays"][:, 1], ones]))
    base = poses[rows["second"], :3, 3] - poses[rows["first"], :3, 3]
    aa, bb, ab = np.sum(a * a, 1), np.sum(b * b, 1), np.sum(a * b, 1)
    ac, bc = np.sum(a * base, 1), np.sum(b * base, 1)
    below = aa * bb - ab * ab
    s, u = (ac * bb - bc * ab) / below, (ac * ab - bc * aa) / below
    return np.asarray(poses[rows["first"], :3, 3] + 0.5 * (s[:, None] * a + base + u[:, None] * b))
