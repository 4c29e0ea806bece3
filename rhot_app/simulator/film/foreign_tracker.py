"""A tracker of another system that is tied to the simulated hand: it has a world, a clock and errors of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.geometry.transforms import quaternion_from_rotation, rigid
from rhot_app.simulator.film.scene_objects import SceneObject
from rhot_app.simulator.render.body import HandBody

Array = NDArray[np.float64]

RATE_HZ = 120.0
DELAY_S = 0.037
"""s: what it reports at an instant is the pose of so long ago."""

NOISE_M, NOISE_RAD = 0.1e-3, 0.05e-2
"""m and rad, of an axis: of the order of a Vive's at rest (Niehorster, Li and Lappe 2017)."""

_WORLD_M, _LEVER_M = 1.0, 0.06  # how far its world's origin and it itself are away
_SEED = 0x51FE


class ForeignTracker:
    """Everything random in it is drawn from the scene's `seed`. On a hand it sits at the index fingertip, else at the
    origin of what is shown."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, _SEED])
        self.foreign_from_rig = rigid(Rotation.random(random_state=rng).as_matrix(),
                                      rng.uniform(-_WORLD_M, _WORLD_M, 3))
        away = rng.normal(size=3)
        self.body_from_tracker = rigid(Rotation.random(random_state=rng).as_matrix(),
                                       _LEVER_M * away / np.linalg.norm(away))
        self._noise = rng

    def rows(self, scene_object: SceneObject, marker: int, times_s: Array) -> Array:
        """(N, 7): position, m, and quaternion wxyz in its own world, reported at scene times (N,), s. `marker` is the
        number of the fingertip's in the set."""
        poses = self.foreign_from_rig @ world_from_body(scene_object, marker, times_s - DELAY_S)
        poses = poses @ self.body_from_tracker
        turns = Rotation.from_rotvec(self._noise.normal(0.0, NOISE_RAD, (len(times_s), 3))).as_matrix()
        places = poses[:, :3, 3] + self._noise.normal(0.0, NOISE_M, (len(times_s), 3))
        quaternions = [quaternion_from_rotation(turn) for turn in poses[:, :3, :3] @ turns]
        return np.column_stack([places, np.array(quaternions).reshape(-1, 4)])


def world_from_body(scene_object: SceneObject, marker: int, times_s: Array) -> Array:
    """(N, 4, 4) m: the segment that carries a hand's marker, its origin at the marker; another thing's own pose."""
    transforms, angles = scene_object.source.sample(times_s)
    if isinstance(scene_object.thing, HandBody):
        return scene_object.thing.marker_poses(transforms, angles, marker)
    return transforms
