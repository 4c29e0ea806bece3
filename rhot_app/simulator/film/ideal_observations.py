"""What a node would say of a hand, without a picture: for long runs and quick trials.

Each marker's silhouette is where it was at its own row's time; what other fingers and the palm hide is left out of it.
White noise and a bias that varies slowly, mostly alike in all cameras as limb shading makes it, are added; the stated
covariance is larger than either, as the detector's (`benchmarks/marker_errors.py`). Colours are never mixed up. Paint
on one side of a finger is a disc that is lost when it is turned away; gaps, wear and gloves are not sketched.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import project_normalised
from rhot_app.hand.skeleton import WRIST_ROLE
from rhot_app.simulator.film.node_log import lost
from rhot_app.simulator.film.points import at_own_rows
from rhot_app.simulator.film.shot import Shot, camera_seed
from rhot_app.simulator.film.truth import FrameTruth
from rhot_app.simulator.render.body import (
    ACROSS,
    BOUNDS,
    CAPSULE,
    GROUP,
    HALF,
    KIND,
    ON_ONE_SIDE,
    PALM_GROUP,
    SIDE,
    HandBody,
)
from rhot_app.simulator.render.raycast import PREPARED, hit, prepare
from rhot_node.wire.messages import NO_FLAGS, MarkerFlag, MarkerObservation

Array = NDArray[np.float64]

_GRID_HZ = 250.0  # of the splines through the markers' ways
_WHOLE, _ENOUGH = 0.9, 0.4  # visible parts: above the first a marker is in plain view, below the second it is lost
_BIAS_GRID_S = 0.05
_STEP, _TICK_S = 1e-4, 1e-4  # normalised, and s, of derivatives
_RADIUS_M = 8e-3  # where the marker set gives none
_FACES = 0.2  # cosine to the line of sight from which on a patch on one side of a finger shows


@dataclass(frozen=True, slots=True)
class ObservationNoise:
    """px per axis. `white`: from frame to frame; `stated`: what the covariance says of it. `common` and `own`: rms of
    the slow bias that all cameras share, and of each one's own; `slow_s`: how long a bias lasts."""

    white: float = 0.02
    stated: float = 0.045
    common: float = 0.04
    own: float = 0.015
    slow_s: float = 0.7


ORDINARY = ObservationNoise()


def ideal_observations(shot: Shot, index: int,
                       noise: ObservationNoise = ORDINARY) -> tuple[list[list[MarkerObservation]], FrameTruth]:
    """What camera `index` says of every frame, and what was visible. Raises SimulatorError when no hand is shown."""
    body = shot.scene_object.thing
    if not isinstance(body, HandBody):
        raise SimulatorError(f"a {shot.scene_object.name} is not seen without pictures; show a hand.")
    if shot.hidden:
        raise SimulatorError("a hand with unpainted markers is not seen without pictures; render them.")
    eye = _Eye(shot, body, index, noise)
    frames = [[eye.observation(number, marker) for marker in range(body.marker_count)]
              for number in range(len(eye.times_s))]
    return frames, FrameTruth(eye.times_s, np.nan_to_num(eye.seen[:, :, 0]))


class _Eye:
    """One camera's frames: `times_s` (F,), `seen` (F, M, 3) as `visible_parts` fills it."""

    def __init__(self, shot: Shot, body: HandBody, index: int, noise: ObservationNoise) -> None:
        scene = shot.scene
        self.times_s = 1e-9 * np.array(scene.frame_times_ns(index, shot.seconds))
        self._camera, self._noise = scene.camera(index), noise
        self._rng = np.random.default_rng([scene.seed, index, 0x516])
        self._radii = np.array([1e-3 * marker.radius_mm if marker.radius_mm else _RADIUS_M
                                for marker in scene.markers.markers])
        solids = body.solids
        patched = np.flatnonzero((solids.marker >= 0) & (solids.paint[:, BOUNDS] == ON_ONE_SIDE))
        self._patches = {int(solids.marker[solid]): int(solid) for solid in patched}
        for marker, solid in self._patches.items():
            self._radii[marker] = math.sqrt(solids.paint[solid, HALF] * solids.paint[solid, ACROSS])
        row_time_s = 1e-9 * scene.row_time_ns
        middle_s = self.times_s + 0.5 * self._camera.height * row_time_s
        transforms, angles = shot.scene_object.source.sample(middle_s)
        local = self._camera.camera_from_world @ transforms
        self._shapes = [self._shape(body, marker, role, local) for marker, role in
                        enumerate(marker.role for marker in scene.markers.markers)]
        placed = body.place(local, angles)
        self._rolled = np.ones((len(self.times_s), body.marker_count))
        discs = self._discs(shot, body, placed, row_time_s)
        self.seen = np.empty((len(discs), body.marker_count, 3))
        groups = np.array([solids.group[list(solids.marker).index(marker)] for marker in range(body.marker_count)])
        hides = solids.group <= PALM_GROUP  # what lies under paint does not hide it
        visible_parts(np.ascontiguousarray(solids.what[hides]), solids.size[hides],
                      np.ascontiguousarray(placed[:, hides]), groups, discs, spots(), self.seen)
        self._diameters = self._sizes(discs)
        self._places = self._middles(discs) + self._biases(shot, camera_seed(scene, index))

    def observation(self, number: int, marker: int) -> MarkerObservation:
        """One marker in one frame; to be asked for in order, because the noise is drawn."""
        part, place, noise = self.seen[number, marker, 0], self._places[number, marker], self._noise
        white = self._rng.normal(0.0, noise.white, 2)
        if not (part >= _ENOUGH and np.isfinite(place).all()):
            return lost(marker)
        diameter = float(self._diameters[number, marker])
        doubt = 0.0 if part >= _WHOLE else (1.0 - part) * diameter
        variance = noise.stated**2 + doubt**2
        x, y = place + white
        return MarkerObservation(marker, float(x), float(y), diameter * math.sqrt(part), variance, 0.0, variance,
                                 float(part), MarkerFlag.PARTIAL if doubt else NO_FLAGS)

    def _shape(self, body: HandBody, marker: int, role: str | None, local: Array) -> Array:
        """(F, 3, 3) or (3, 3) m^2: the marker's ellipsoid in the camera's axes."""
        if marker in self._patches:
            return np.zeros((3, 3))
        if role != WRIST_ROLE:
            return self._radii[marker] ** 2 * np.eye(3)
        half_axes = body.solids.size[list(body.solids.marker).index(marker)]
        turned = local[:, :3, :3] * half_axes
        return np.asarray(turned @ turned.transpose(0, 2, 1))

    def _discs(self, shot: Shot, body: HandBody, placed: Array, row_time_s: float) -> Array:
        """(F, M, 6) as `visible_parts` wants them; NaN for what is not in the picture. `placed` as `HandBody.place`."""
        grid = np.arange(-0.1, shot.seconds + 0.2, 1.0 / _GRID_HZ)
        ways = body.marker_positions(*shot.scene_object.source.sample(grid))
        size = self._camera.width, self._camera.height
        discs = np.full((len(self.times_s), body.marker_count, 6), np.nan)
        for marker in range(body.marker_count):
            way, see = CubicSpline(grid, ways[:, marker]), functools.partial(self._project, marker=marker)
            places, pixels = at_own_rows(way, see, self.times_s, row_time_s, size)
            self._rolled[:, marker] = _rolled(way, see, self.times_s + row_time_s * pixels[:, 1], row_time_s)
            discs[:, marker, :2] = np.where(np.isfinite(pixels), self._silhouette(places, marker), np.nan)
            depth = self._local(places)[:, 2]
            discs[:, marker, 2], discs[:, marker, 3] = self._radii[marker] / depth, depth
            discs[:, marker, 4:] = 0.0 if marker in self._patches else _drawn_out(body, placed, marker)
            if marker in self._patches:
                discs[:, marker] *= _turned(body, placed, self._patches[marker], self._local(places))[:, None]
        return discs

    def _local(self, places: Array) -> Array:
        pose = self._camera.camera_from_world
        return np.asarray(places @ pose[:3, :3].T + pose[:3, 3])

    def _silhouette(self, places: Array, marker: int) -> Array:
        """(F, 2) normalised middle of the outline (`rhot_app.geometry.camera`)."""
        x, y, z = self._local(places).T
        shape = self._shapes[marker]
        below = z**2 - shape[..., 2, 2]
        return np.stack([(x * z - shape[..., 0, 2]) / below, (y * z - shape[..., 1, 2]) / below], axis=1)

    def _sizes(self, discs: Array) -> Array:
        """(F, M) px: diameters of discs that are as large as the outlines, drawn out, and stretched off the axis and
        by rows that are exposed one after the other."""
        flat, step = discs[:, :, :2].reshape(-1, 2), _STEP * np.eye(2)
        rows = [(project_normalised(flat + by, self._camera.intrinsics)
                 - project_normalised(flat - by, self._camera.intrinsics)) / (2.0 * _STEP) for by in step]
        stretch = np.abs(rows[0][:, 0] * rows[1][:, 1] - rows[0][:, 1] * rows[1][:, 0])
        stretch *= np.sqrt(1.0 + np.square(flat).sum(axis=1))
        radius, out = discs[:, :, 2], np.linalg.norm(discs[:, :, 4:], axis=2)
        area = (math.pi * radius**2 + 4.0 * radius * out) * stretch.reshape(radius.shape) * self._rolled
        return np.asarray(2.0 * np.sqrt(area / math.pi))

    def _project(self, places: Array, marker: int) -> Array:
        return np.asarray(project_normalised(self._silhouette(places, marker), self._camera.intrinsics))

    def _middles(self, discs: Array) -> Array:
        """(F, M, 2) px: the outline's middle, moved as what hides a part of it moves it."""
        whole = spots().mean(axis=0)
        moved = self.seen[:, :, 1:] - discs[:, :, :2] - discs[:, :, 2:3] * whole
        partly = (self.seen[:, :, 0] < 1.0)[:, :, None]
        middles = discs[:, :, :2] + np.where(partly, np.nan_to_num(moved), 0.0)
        flat = np.ascontiguousarray(middles.reshape(-1, 2))
        return np.asarray(project_normalised(flat, self._camera.intrinsics)).reshape(middles.shape)

    def _biases(self, shot: Shot, own_seed: int) -> Array:
        """(F, M, 2) px, slowly varying."""
        count, noise = len(self._radii), self._noise
        return (noise.common * _slow(shot, count, shot.scene.seed, noise.slow_s, self.times_s)
                + noise.own * _slow(shot, count, own_seed + 0x1000000, noise.slow_s, self.times_s))


def _rolled(way: Callable[[Array], Array], see: Callable[[Array], Array], times_s: Array, row_time_s: float) -> Array:
    """(F,) how much higher than it is what moves down the picture looks, at its own rows' `times_s` (F,): the rows go
    with it. `way` and `see` as in `at_own_rows`."""
    rows = see(way(times_s + _TICK_S))[:, 1] - see(way(times_s - _TICK_S))[:, 1]
    return np.asarray(1.0 / (1.0 - rows * row_time_s / (2.0 * _TICK_S)))


def _drawn_out(body: HandBody, placed: Array, marker: int) -> Array:
    """(F, 2) normalised: by how much the outline of a marker on the hand (`placed` as `HandBody.place`) is drawn out
    to either side of a disc: half of what lies between the ends of a capsule, as it is seen."""
    solid = list(body.solids.marker).index(marker)
    if body.solids.kind[solid] != CAPSULE:
        return np.zeros((len(placed), 2))
    start, end = placed[:, solid, :3], placed[:, solid, 3:6]
    middle, half = 0.5 * (start + end), 0.5 * (end - start)
    across = half - middle * (half[:, 2:] / middle[:, 2:])
    return np.asarray(across[:, :2] / middle[:, 2:])


def _turned(body: HandBody, placed: Array, solid: int, places: Array) -> Array:
    """(F,) 1 in frames in which a patch on one side of a finger, `places` (F, 3) m in the camera's frame, shows; NaN
    where it is turned away."""
    out = body.solids.paint[solid, SIDE] * placed[:, solid, 6:9]
    facing = -np.einsum("fi,fi->f", out, places) / np.linalg.norm(places, axis=1)
    return np.where(facing > _FACES, 1.0, np.nan)


def _slow(shot: Shot, count: int, seed: int, slow_s: float, times_s: Array) -> Array:
    """(F, count, 2) of unit variance: a random walk that is drawn back to zero (Ornstein, Uhlenbeck), at times (F,)."""
    rng = np.random.default_rng([seed, 0xB1A5])
    grid = np.arange(0.0, shot.seconds + 2.0 * _BIAS_GRID_S, _BIAS_GRID_S)
    kept = math.exp(-_BIAS_GRID_S / slow_s)
    kicks = rng.normal(0.0, 1.0, (len(grid), count, 2))
    walk = kicks.copy()
    for k in range(1, len(grid)):
        walk[k] = kept * walk[k - 1] + math.sqrt(1.0 - kept**2) * kicks[k]
    return np.asarray(CubicSpline(grid, walk)(times_s))


# -- occluded part of each marker --------------------------------------------------------------------------------------

Indices = NDArray[np.int64]

_RINGS = (0, 6, 12)  # rays at the centre, and on rings about it


def spots() -> Array:
    """(K, 2) places that cover the unit disc evenly."""
    places = [(0.0, 0.0)]
    for ring, count in enumerate(_RINGS[1:], start=1):
        radius = 0.92 * ring / (len(_RINGS) - 1)
        angles = 2.0 * np.pi * (np.arange(count) + 0.5 * ring) / count
        places += list(zip(radius * np.cos(angles), radius * np.sin(angles), strict=True))
    return np.array(places)


@njit(cache=True)
def visible_parts(what: Indices, sizes: Array, placed: Array, own: Indices, discs: Array, places: Array,
                  seen: Array) -> None:
    """Fill `seen` (F, M, 3): the visible part 0..1 of each marker's disc and the middle of what is visible of it.

    `what` (N, 3) and `sizes` (N, 3) m as in `body.Solids`, `placed` (F, N, 12) in the camera's frame.
    `own` (M,): the group that does not hide the marker: its own finger. `discs` (F, M, 6): normalised x and y of the
    middle, normalised radius, depth m, and normalised x and y of by how much the disc is drawn out to either side, as
    that of a capsule is; `places` (K, 2) in the unit disc. A disc that is NaN is not visible.
    """
    table = np.empty((1, len(what), PREPARED))
    for f in range(placed.shape[0]):
        for n in range(len(what)):
            prepare(what[n, KIND], placed[f, n], sizes, table, 0, n)
        for m in range(own.shape[0]):
            x0, y0, radius, depth, along_x, along_y = discs[f, m]
            out = math.hypot(along_x, along_y)
            if out > 0.0:
                along_x, along_y = along_x / out, along_y / out
            count, sum_x, sum_y = 0, 0.0, 0.0
            for k in range(places.shape[0]):
                drawn = out * (places[k, 0] * along_x + places[k, 1] * along_y)
                x = x0 + radius * places[k, 0] + drawn * along_x
                y = y0 + radius * places[k, 1] + drawn * along_y
                free = x == x
                for n in range(len(what)):
                    if free and what[n, GROUP] != own[m] and hit(what[n, KIND], table, 0, n, x, y) < depth:
                        free = False
                if free:
                    count += 1
                    sum_x += x
                    sum_y += y
            seen[f, m, 0] = count / places.shape[0]
            seen[f, m, 1] = sum_x / count if count else np.nan
            seen[f, m, 2] = sum_y / count if count else np.nan
