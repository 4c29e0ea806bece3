"""A rigid thing of solids: a painted ball on a stick, as it is held before the cameras to calibrate depth and time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.simulator.render.body import CAPSULE, PAINT_FIELDS, PALM_GROUP, PARAMETERS, POINT_M, SKIN
from rhot_node.markers import MarkerSet

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

STICK_RGB = (70.0, 68.0, 66.0)
BALL_RADIUS_M = 0.012
_STICK_RADIUS_M, _STICK_M = 0.003, 0.4


@dataclass(frozen=True, slots=True)
class RigidTarget:
    """N capsules, painted ones first, fixed in the prop's frame; a `Solids`. Fields as of `body.HandBody`.

    `ends` (N, 2, 3) m in the prop's frame; `centres` (M, 3) m of the set's markers, NaN for those it does not wear.
    """

    group: Indices
    marker: Indices
    size: Array
    rgb: Array
    ends: Array
    centres: Array

    @property
    def kind(self) -> Indices:
        """(N,) all capsules."""
        return np.full(len(self.group), CAPSULE, dtype=np.int64)

    @property
    def margin(self) -> Array:
        """(N,) m: nothing hides its own paint."""
        return np.zeros(len(self.group))

    @property
    def paint(self) -> Array:
        """(N, PAINT_FIELDS): all of every surface."""
        return np.zeros((len(self.group), PAINT_FIELDS))

    @property
    def marker_count(self) -> int:
        """Number of markers of the set."""
        return len(self.centres)

    def place(self, world_from_prop: Array, _angles: Array) -> Array:
        """(T, N, 12) parameters of the solids in the world for poses (T, 4, 4)."""
        out = np.zeros((len(world_from_prop), len(self.group), PARAMETERS))
        ends = np.einsum("tij,nkj->tnki", world_from_prop[:, :3, :3], self.ends) + world_from_prop[:, None, None, :3, 3]
        out[:, :, :6] = ends.reshape(len(world_from_prop), -1, 6)
        return out

    def marker_positions(self, world_from_prop: Array, _angles: Array) -> Array:
        """(T, M, 3) m, the markers' centres in the world."""
        return np.asarray(np.einsum("tij,nj->tni", world_from_prop[:, :3, :3], self.centres)
                          + world_from_prop[:, None, :3, 3])


def ball_on_stick(markers: MarkerSet, index: int) -> RigidTarget:
    """A ball in the colour of one marker at the prop's origin; the stick comes from below and touches it."""
    top = np.array([0.0, BALL_RADIUS_M + _STICK_RADIUS_M, 0.0])
    down = np.array([0.0, _STICK_M, 0.0])
    centres = np.full((len(markers.markers), 3), np.nan)
    centres[index] = 0.0
    return RigidTarget(
        group=np.array([0, PALM_GROUP], dtype=np.int64), marker=np.array([index, SKIN], dtype=np.int64),
        size=np.array([[BALL_RADIUS_M, 0.0, 0.0], [_STICK_RADIUS_M, 0.0, 0.0]]),
        rgb=np.array([markers.markers[index].display_rgb, STICK_RGB], dtype=np.float64),
        ends=np.array([[np.zeros(3), [0.0, POINT_M, 0.0]], [top, top + down]]), centres=centres)
