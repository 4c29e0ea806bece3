"""What cameras whose times are off would see: rays that miss each other, and rigid distances that breathe.

A marker that moves across the epipolar lines at v px/s and is seen dt later by one camera misses its epipolar line by
v dt. That tells the cameras' offsets, and their row times as far as the marker is in different rows of their pictures.
Two markers on one stiff thing, in rows dy apart, are seen r dy after each other by every camera: their distance changes
with their speed. That tells the row time r that the cameras have in common.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.time.tracks import CameraTracks, interpolate
from rhot_app.estimation.se3 import skew

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SLOW_S = 2.0
"""Distances are compared with their mean over this time: a hand that changes its shape slowly tells nothing wrong."""

_STEP_S = 1e-4  # for derivatives


@dataclass(frozen=True, slots=True)
class Times:
    """What is sought, per camera (C,): offset to be added to its times, s, and its row time, s."""

    offsets_s: Array
    row_times_s: Array

    @property
    def vector(self) -> Array:
        """(2 C,) offsets, then row times."""
        return np.concatenate([self.offsets_s, self.row_times_s])

    def of_camera(self, camera: int) -> tuple[float, float]:
        """Offset and row time of one camera."""
        return float(self.offsets_s[camera]), float(self.row_times_s[camera])

    @classmethod
    def of(cls, vector: Array) -> Times:
        """The inverse of `vector`."""
        half = len(vector) // 2
        return cls(vector[:half].copy(), vector[half:].copy())


@dataclass(frozen=True, slots=True)
class CameraPair:
    """Two cameras: `first` is interpolated to the times of `second`. `essential` (3, 3): second^T E first = 0."""

    first: int
    second: int
    essential: Array
    focal_px: float


def camera_pairs(cameras: tuple[CameraTracks, ...]) -> tuple[CameraPair, ...]:
    """All pairs; the camera with more frames is interpolated."""
    found = []
    for a, b in itertools.combinations(range(len(cameras)), 2):
        first, second = (a, b) if cameras[a].period_s <= cameras[b].period_s else (b, a)
        second_from_first = cameras[second].model.camera_from_world @ cameras[first].model.world_from_camera
        focal = np.mean([cameras[c].model.intrinsics[:2].mean() for c in (a, b)])
        essential = skew(second_from_first[:3, 3]) @ second_from_first[:3, :3]
        found.append(CameraPair(first, second, essential, float(focal)))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Residuals:
    """`miss_px` (E,): how far each sample is from the epipolar line of the other camera's track (Sampson's distance).
    `breath_m` (R,): distance of two markers minus its slow mean. NaN where not seen. Their derivatives by all offsets
    and row times, (E, 2 C) px/s and (R, 2 C) m/s, are 0 where they are not known."""

    miss_px: Array
    breath_m: Array
    miss_slopes: Array
    breath_slopes: Array


class TimeModel:
    """The residuals of a recording as functions of `Times`. All arrays keep their shapes, whatever the times."""

    def __init__(self, cameras: tuple[CameraTracks, ...]) -> None:
        self.cameras = cameras
        self.pairs = camera_pairs(cameras)
        self.marker_pairs = np.array(list(itertools.combinations(range(len(cameras[0].tracks)), 2)),
                                     dtype=np.intp).reshape(-1, 2)
        self._instants = [self._grid(pair) for pair in self.pairs]
        self.miss_times_s = np.concatenate([self._starts(pair) for pair in self.pairs])
        self.breath_times_s = np.concatenate([np.repeat(grid, len(self.marker_pairs)) for grid in self._instants])
        self.breath_group = np.concatenate([np.tile(np.arange(len(self.marker_pairs)), len(grid))
                                            for grid in self._instants])

    def misses(self, times: Times) -> Array:
        """`Residuals.miss_px` alone."""
        return np.concatenate([self.pair_misses(pair, times) for pair in self.pairs])

    def pair_misses(self, pair: CameraPair, times: Times) -> Array:
        """The part of `misses` of one pair of cameras, marker by marker."""
        return pair.focal_px * _sampson(pair.essential, self._across(pair, times, 0.0)[:, :2], self._rays(pair))

    def misalignment(self) -> Array:
        """(E, 3 P) what a calibration that is slightly off adds to the misses: for each of P pairs a constant and
        slopes over the second picture."""
        result = np.zeros((len(self.miss_times_s), 3 * len(self.pairs)))
        row = 0
        for k, pair in enumerate(self.pairs):
            rays = self._rays(pair)
            result[row:row + len(rays), 3 * k:3 * k + 3] = np.column_stack([np.ones(len(rays)), rays])
            row += len(rays)
        return result

    def residuals(self, times: Times) -> Residuals:
        """Everything at `times`, with derivatives."""
        misses = [self._pair_misses(pair, times) for pair in self.pairs]
        breaths = [self._pair_breath(pair, grid, times) for pair, grid in zip(self.pairs, self._instants, strict=True)]
        return Residuals(*(np.concatenate([parts[k] for parts in both])
                           for k in (0, 1) for both in (misses, breaths)))

    def _pair_misses(self, pair: CameraPair, times: Times) -> tuple[Array, Array]:
        """A later first camera sees what it saw a moment before; rows are later in proportion."""
        here = self._across(pair, times, 0.0)
        rays = self._rays(pair)
        miss, ahead, back = (pair.focal_px * _sampson(pair.essential, seen[:, :2], rays) for seen in (
            here, self._across(pair, times, _STEP_S), self._across(pair, times, -_STEP_S)))
        slope = (ahead - back) / (2.0 * _STEP_S)
        rows = np.concatenate([track.rows for track in self.cameras[pair.second].tracks])
        return miss, self._columns(pair, slope, slope * here[:, 2], -slope, -slope * rows)

    def _pair_breath(self, pair: CameraPair, grid: Array, times: Times) -> tuple[Array, Array]:
        first, second = (self._at(camera, grid, times, 0.0) for camera in (pair.first, pair.second))
        places = self._places(pair, first, second)
        moved = []
        for k, camera in enumerate((pair.first, pair.second)):
            ends = []
            for shift in (_STEP_S, -_STEP_S):
                seen = [first, second]
                seen[k] = self._at(camera, grid, times, shift)
                ends.append(self._places(pair, *seen))
            moved.append((ends[0] - ends[1]) / (2.0 * _STEP_S))
        m, n = self.marker_pairs.T
        apart = places[:, m] - places[:, n]
        distance = np.linalg.norm(apart, axis=2)
        direction = apart / distance[..., None]
        window = max(3, round(SLOW_S / self.cameras[pair.second].period_s))
        known = np.isfinite(distance)

        def change(speed: Array) -> Array:
            along = ((speed[:, m] - speed[:, n]) * direction).sum(axis=2)
            return _without_slow_part(along, window, known & np.isfinite(along)).ravel()

        columns = [change(speed * rows) for speed, seen in zip(moved, (first, second), strict=True)
                   for rows in (1.0, seen[..., 2:])]
        breath = _without_slow_part(distance, window, known).ravel()
        return breath, self._columns(pair, *columns)

    def _columns(self, pair: CameraPair, *changes: Array) -> Array:
        """(N, 2 C) of derivatives by the first camera's offset and row time, then the second's."""
        count = len(self.cameras)
        result = np.zeros((len(changes[0]), 2 * count))
        for column, change in zip((pair.first, count + pair.first, pair.second, count + pair.second), changes,
                                  strict=True):
            result[:, column] = np.nan_to_num(change)
        return result

    def _across(self, pair: CameraPair, times: Times, shift_s: float) -> Array:
        """(E_p, 3) rays and rows of the first camera at the samples of the second, the first one's times shifted."""
        second = self.cameras[pair.second]
        offset_s, row_s = times.of_camera(pair.second)
        return np.concatenate([
            self._at(pair.first, track.times(offset_s, row_s), times, shift_s, marker)[:, 0]
            for marker, track in enumerate(second.tracks)])

    def _at(self, camera: int, instants: Array, times: Times, shift_s: float, marker: int | None = None) -> Array:
        """(T, M, 3) rays and rows of one camera's markers (or of one) at `instants` (T,), its times shifted."""
        offset_s, row_s = times.of_camera(camera)
        tracks = self.cameras[camera].tracks if marker is None else self.cameras[camera].tracks[marker:marker + 1]
        return np.stack([interpolate(track.times(offset_s + shift_s, row_s), np.column_stack([track.rays, track.rows]),
                                     track.joined, instants) for track in tracks], axis=1)

    def _rays(self, pair: CameraPair) -> Array:
        return np.concatenate([track.rays for track in self.cameras[pair.second].tracks])

    def _starts(self, pair: CameraPair) -> Array:
        return np.concatenate([track.start_s for track in self.cameras[pair.second].tracks])

    def _grid(self, pair: CameraPair) -> Array:
        """Instants at which markers are located: those of the second camera's frames, in the middle of its picture."""
        camera = self.cameras[pair.second]
        return np.unique(self._starts(pair)) + 0.5 * camera.model.height * camera.row_time_s

    def _places(self, pair: CameraPair, first: Array, second: Array) -> Array:
        """(T, M, 3) m: the middle of both cameras' rays where they are nearest."""
        ends = [_world_ray(self.cameras[camera].model.world_from_camera, seen[..., :2])
                for camera, seen in ((pair.first, first), (pair.second, second))]
        return _middle(*ends)


def _sampson(essential: Array, first: Array, second: Array) -> Array:
    """(N,) signed distance of correspondences (N, 2) from the epipolar constraint, normalised coordinates."""
    a = np.column_stack([first, np.ones(len(first))])
    b = np.column_stack([second, np.ones(len(second))])
    line_b, line_a = a @ essential.T, b @ essential
    return np.asarray((b * line_b).sum(axis=1) / np.sqrt((line_b[:, :2]**2).sum(axis=1)
                                                        + (line_a[:, :2]**2).sum(axis=1)))


def _world_ray(world_from_camera: Array, rays: Array) -> tuple[Array, Array]:
    """Origin (3,) and directions (..., 3) of normalised coordinates (..., 2)."""
    directions = np.concatenate([rays, np.ones((*rays.shape[:-1], 1))], axis=-1) @ world_from_camera[:3, :3].T
    return world_from_camera[:3, 3], directions


def _middle(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """(..., 3) the points halfway between two bundles of rays where each two are nearest."""
    (p, u), (q, v) = one, other
    uu, uv, vv = (u * u).sum(axis=-1), (u * v).sum(axis=-1), (v * v).sum(axis=-1)
    up, vp = u @ (q - p), v @ (q - p)
    determinant = uu * vv - uv * uv
    along_u, along_v = (vv * up - uv * vp) / determinant, (uv * up - uu * vp) / determinant
    return np.asarray(0.5 * (p + along_u[..., None] * u + q + along_v[..., None] * v))


def _without_slow_part(values: Array, window: int, known: Mask) -> Array:
    """`values` (T, P) minus their mean over the `window` neighbours that are `known` (T, P); NaN where not known."""
    half = window // 2
    sums = np.cumsum(np.stack([np.where(known, values, 0.0), known.astype(np.float64)]), axis=1)
    sums = np.concatenate([np.zeros((2, 1, values.shape[1])), sums], axis=1)
    ends = np.minimum(np.arange(len(values)) + half + 1, len(values))
    begins = np.maximum(np.arange(len(values)) - half, 0)
    total, count = sums[:, ends] - sums[:, begins]
    return np.where(known, values - total / np.maximum(count, 1.0), np.nan)
