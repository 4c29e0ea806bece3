"""Streams of a device and of a point or body on it, moved as a hand moves, with noise, outliers and unknown clocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.objects.alignment.motion_stream import MotionStream

POINT_NOISE_M, POSE_NOISE_M, POSE_NOISE_RAD = 0.3e-3, 0.1e-3, np.radians(0.05)
OUTLIER_M, OUTLIERS = 0.1, 0.05
RIG_HZ, FOREIGN_HZ = 60.0, 127.0
SPREAD_M, SPREAD_RAD = 0.08, 0.35
SPEEDS_HZ = np.array([0.31, 0.57, 0.93, 1.41, 2.2])


@dataclass
class Motion:
    """Sums of sines: rms SPREAD_M along each axis, SPREAD_RAD about each, both to be scaled by axis."""

    rng: np.random.Generator
    spread_m: np.ndarray
    spread_rad: np.ndarray
    slow: float = 1.0

    def __post_init__(self) -> None:
        count = len(SPEEDS_HZ)
        self._size = self.rng.uniform(0.5, 1.0, (2, count, 3)) / np.sqrt(1.0 + SPEEDS_HZ[:, None] ** 4)
        self._size /= np.sqrt(0.5 * np.sum(self._size**2, axis=1, keepdims=True))
        self._phase = self.rng.uniform(0.0, 2.0 * np.pi, (2, count, 3))
        self._speed = self.slow * 2.0 * np.pi * SPEEDS_HZ * self.rng.uniform(0.9, 1.1, count)

    def poses(self, times_s):
        """world_from_device (N, 4, 4) in a frame of the motion's own."""
        waves = np.sin(times_s[:, None, None] * self._speed[:, None] + self._phase[:, None])
        place, turn = np.sum(self._size[:, None] * waves, axis=2)
        out = np.tile(np.eye(4), (len(times_s), 1, 1))
        out[:, :3, 3] = place * self.spread_m
        out[:, :3, :3] = Rotation.from_rotvec(turn * self.spread_rad).as_matrix()
        return out


@dataclass
class Scene:
    """The truth and what is recorded of it."""

    foreign: MotionStream
    rig: MotionStream
    rig_from_foreign: np.ndarray
    tracker_from_body: np.ndarray
    offset_s: float


def random_pose(rng, spread_m):
    return rigid(Rotation.random(random_state=rng).as_matrix(), rng.uniform(-spread_m, spread_m, 3))


def make_scene(seed, offset_s=0.037, seconds=20.0, spread_m=(SPREAD_M,) * 3, spread_rad=(SPREAD_RAD,) * 3,
               slow=1.0, noise=1.0, outliers=OUTLIERS, rates=(RIG_HZ, FOREIGN_HZ), start_s=0.0):
    """A scene; the rig reports positions of a point 5 to 10 cm away from the device."""
    rng = np.random.default_rng(seed)
    motion = Motion(rng, np.array(spread_m), np.array(spread_rad), slow)
    rig_from_motion = random_pose(rng, 0.2)
    rig_from_foreign = random_pose(rng, 1.0)
    body = random_pose(rng, 0.0)
    direction = rng.normal(size=3)
    body[:3, 3] = rng.uniform(0.05, 0.1) * direction / np.linalg.norm(direction)
    rig_s = np.arange(0.0, seconds, 1.0 / rates[0])
    foreign_s = np.arange(0.0, seconds, 1.0 / rates[1]) + rng.uniform(0.0, 0.005)
    device = inverse(rig_from_foreign) @ rig_from_motion @ motion.poses(foreign_s + offset_s)
    seen = rig_from_motion @ motion.poses(rig_s) @ body
    return Scene(recorded(rng, foreign_s + start_s, device, noise * POSE_NOISE_M, noise * POSE_NOISE_RAD, outliers),
                 recorded(rng, rig_s + start_s, seen, noise * POINT_NOISE_M, None, outliers),
                 rig_from_foreign, rigid(np.eye(3), body[:3, 3]), offset_s)


def recorded(rng, times_s, poses, place_sd, turn_sd, outliers):
    count = len(times_s)
    wild = rng.random(count) < outliers
    away = rng.normal(size=(count, 3))
    away *= OUTLIER_M / np.linalg.norm(away, axis=1, keepdims=True)
    place = poses[:, :3, 3] + rng.normal(0.0, place_sd, (count, 3)) + wild[:, None] * away
    if turn_sd is None:
        return MotionStream(times_s, place)
    turn = Rotation.from_rotvec(rng.normal(0.0, turn_sd, (count, 3))).as_matrix()
    return MotionStream(times_s, place, poses[:, :3, :3] @ turn)
