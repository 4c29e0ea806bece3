"""A rigid thing of solids: a painted ball on a stick, as it is held before the cameras to calibrate depth and time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.simulator.render.body import CAPSULE, PAINT_FIELDS, PALM_GROUP, PARAMETERS, POINT_M, SKIN, Solids
from rhot_node.markers import MarkerSet

Array = NDArray[np.float64]

STICK_RGB = (70.0, 68.0, 66.0)
BALL_RADIUS_M = 0.012
_STICK_RADIUS_M, _STICK_M = 0.003, 0.4


@dataclass(frozen=True, slots=True)
class RigidTarget:
    """N capsules fixed in the prop's frame.

    `ends` (N, 2, 3) m in the prop's frame; `centres` (M, 3) m of the set's markers, NaN for those it does not wear.
    """

    solids: Solids
    ends: Array
    centres: Array

    @property
    def marker_count(self) -> int:
        """Number of markers of the set."""
        return len(self.centres)

    def place(self, world_from_prop: Array, _angles: Array) -> Array:
        """(T, N, 12) parameters of the solids in the world for poses (T, 4, 4)."""
        out = np.zeros((len(world_from_prop), len(self.ends), PARAMETERS))
        ends = np.einsum("tij,nkj->tnki", world_from_prop[:, :3, :3], self.ends) + world_from_prop[:, None, None, :3, 3]
        out[:, :, :6] = ends.reshape(len(world_from_prop), -1, 6)
        return out

    def marker_positions(self, world_from_prop: Array, _angles: Array) -> Array:
        """(T, M, 3) m, the markers' centres in the world."""
        return np.asarray(np.einsum("tij,nj->tni", world_from_prop[:, :3, :3], self.centres)
                          + world_from_prop[:, None, :3, 3])


def capsules(groups: Sequence[int], markers: Sequence[int], radii_m: Sequence[float],
             colours: Sequence[tuple[float, float, float]]) -> Solids:
    """Capsules whose whole surface is painted, painted ones first; nothing hides its own paint."""
    count = len(groups)
    size = np.zeros((count, 3))
    size[:, 0] = radii_m
    what = np.array([(CAPSULE, *one) for one in zip(groups, markers, strict=True)], np.int64)
    return Solids(what, size, np.array(colours, np.float64), np.zeros(count), np.zeros((count, PAINT_FIELDS)))


def ball_on_stick(markers: MarkerSet, index: int) -> RigidTarget:
    """A ball in the colour of one marker at the prop's origin; the stick comes from below and touches it."""
    top = np.array([0.0, BALL_RADIUS_M + _STICK_RADIUS_M, 0.0])
    down = np.array([0.0, _STICK_M, 0.0])
    centres = np.full((len(markers.markers), 3), np.nan)
    centres[index] = 0.0
    return RigidTarget(
        capsules((0, PALM_GROUP), (index, SKIN), (BALL_RADIUS_M, _STICK_RADIUS_M),
                 (markers.markers[index].display_rgb, STICK_RGB)),
        ends=np.array([[np.zeros(3), [0.0, POINT_M, 0.0]], [top, top + down]]), centres=centres)


STILL_S = 2.0
MOVE_S = 0.9
_TREMOR_HZ = np.array([0.9, 2.3, 8.7])
_TREMOR_M, _TREMOR_RAD = 0.05e-3, 0.25e-3  # rms of a board held with two hands, elbows on the table


@dataclass(frozen=True)
class BoardPoses:
    """A `PoseSource` that holds each of K poses for STILL_S and takes MOVE_S to the next, round and round.

    Between poses it moves with continuous acceleration (minimum jerk). `poses` (K, 4, 4) world_from_sheet, m. `tremor`
    1 is a hand's, 0 none.
    """

    poses: Array
    seed: int = 0
    tremor: float = 1.0

    @property
    def period_s(self) -> float:
        """How long one round takes."""
        return len(self.poses) * (STILL_S + MOVE_S)

    def rest_times_s(self) -> Array:
        """(K,) s: the middles of the first round's pauses."""
        return np.asarray(np.arange(len(self.poses)) * (STILL_S + MOVE_S) + 0.5 * STILL_S)

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """world_from_sheet (T, 4, 4) at scene times (T,) s; and no angles, (T, 0)."""
        times_s = np.asarray(times_s, dtype=np.float64)
        index, inside = np.divmod(np.mod(times_s, self.period_s), STILL_S + MOVE_S)
        here = index.astype(int) % len(self.poses)
        there = (here + 1) % len(self.poses)
        s = np.clip((inside - STILL_S) / MOVE_S, 0.0, 1.0)
        part = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        tremor = self._tremor(times_s)
        turned = Rotation.from_matrix(self.poses[here, :3, :3])
        turn = (turned.inv() * Rotation.from_matrix(self.poses[there, :3, :3])).as_rotvec()
        rotation = turned * Rotation.from_rotvec(part[:, None] * turn + tremor[:, 3:])
        out = np.tile(np.eye(4), (len(times_s), 1, 1))
        out[:, :3, :3] = rotation.as_matrix()
        step = self.poses[there, :3, 3] - self.poses[here, :3, 3]
        out[:, :3, 3] = self.poses[here, :3, 3] + part[:, None] * step + tremor[:, :3]
        return out, np.zeros((len(times_s), 0))

    def _tremor(self, times_s: Array) -> Array:
        """(T, 6) m and rad."""
        rng = np.random.default_rng([self.seed, 0x7E])
        amplitude = np.sqrt(2.0 / len(_TREMOR_HZ)) * self.tremor * np.repeat([_TREMOR_M, _TREMOR_RAD], 3)
        phases = rng.uniform(0.0, 2.0 * np.pi, (len(_TREMOR_HZ), 6))
        angles = 2.0 * np.pi * times_s[:, None, None] * _TREMOR_HZ[:, None] + phases
        return np.asarray((amplitude * np.sin(angles)).sum(axis=1))
