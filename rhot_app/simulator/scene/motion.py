"""How the twin's hand moves: smooth curves of palm pose and joint angles over scene time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rhot_app.hand.skeleton import ANGLES, HandPose

Array = NDArray[np.float64]

FACING = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Rotation world_from_palm of a hand that shows its palm to the cameras, fingers up (x right, y down, z away)."""

BACK_FACING = np.diag([-1.0, 1.0, -1.0]) @ FACING
"""The same of a hand that shows its back, fingers up."""

WRIST_BELOW_CENTRE_M = 0.085
"""The middle of an open hand is this far from the wrist; it is what stands before the cameras at position zero."""

VALUES = 6 + len(ANGLES)
"""A pose as numbers: wrist position (3) m, rotation vector from FACING (3) rad, 21 angles rad."""

_SWAY_HZ = np.array([0.11, 0.19, 0.31, 0.47, 0.71])
_TREMOR_HZ = np.array([8.3, 9.7, 11.6])


NotNegative = Annotated[float, Meta(ge=0)]


class Sway(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What no hand can help, rms per axis: slow sway, and physiological tremor at 8 to 12 Hz. Seeds differ in it."""

    position_mm: NotNegative = 0.0
    rotation_deg: NotNegative = 0.0
    angle_deg: NotNegative = 0.0
    tremor_mm: NotNegative = 0.0


class SwayCurve:
    """Seeded sums of sines whose rms per axis is what `Sway` says; smooth, and never the same for two seeds."""

    def __init__(self, sway: Sway, seed: int) -> None:
        rng = np.random.default_rng([seed, 0x5A1])
        slow = np.concatenate([np.full(3, 1e-3 * sway.position_mm), np.full(3, np.radians(sway.rotation_deg)),
                               np.full(len(ANGLES), np.radians(sway.angle_deg))])
        fast = np.concatenate([np.full(3, 1e-3 * sway.tremor_mm), np.zeros(VALUES - 3)])
        self._frequencies = np.concatenate([_SWAY_HZ, _TREMOR_HZ])
        # Sines of equal amplitude a have an rms of a sqrt(n / 2).
        self._amplitudes = np.concatenate([
            np.tile(slow * np.sqrt(2.0 / len(_SWAY_HZ)), (len(_SWAY_HZ), 1)),
            np.tile(fast * np.sqrt(2.0 / len(_TREMOR_HZ)), (len(_TREMOR_HZ), 1))])
        self._phases = rng.uniform(0.0, 2.0 * np.pi, self._amplitudes.shape)
        self._frequencies = self._frequencies * rng.uniform(0.95, 1.05, len(self._frequencies))

    def __call__(self, times_s: Array) -> Array:
        """(N, VALUES) to add to a pose at scene times (N,), s."""
        angle = 2.0 * np.pi * times_s[:, None, None] * self._frequencies[:, None] + self._phases
        return np.asarray((self._amplitudes * np.sin(angle)).sum(axis=1))


@dataclass(frozen=True)
class Motion:
    """A moving hand. World frame is the rig frame, metres; poses are twice continuously differentiable in time.

    `curve` maps (N,) s to (N, VALUES); its rotation vectors turn a hand that stands as `facing` (3, 3) says. A
    repeating motion starts again after `period_s`; any other stands still before its start and after its end.
    `centre` (3,) m is where position zero puts the wrist.
    """

    name: str
    period_s: float
    repeats: bool
    curve: CubicSpline
    centre: Array
    limits: Array
    sway: SwayCurve
    facing: Array = field(default_factory=FACING.copy)

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """(N, 4, 4) world_from_palm and (N, 21) angles rad at scene times (N,), s; angles within their limits."""
        times_s = np.asarray(times_s, dtype=np.float64)
        inside = np.mod(times_s, self.period_s) if self.repeats else np.clip(times_s, 0.0, self.period_s)
        values = self.curve(inside) + self.sway(times_s)
        transforms = np.tile(np.eye(4), (len(values), 1, 1))
        transforms[:, :3, :3] = Rotation.from_rotvec(values[:, 3:6]).as_matrix() @ self.facing
        transforms[:, :3, 3] = self.centre + values[:, :3]
        return transforms, np.clip(values[:, 6:], self.limits[:, 0], self.limits[:, 1])

    def pose(self, t_s: float) -> HandPose:
        """The pose at one scene time, s."""
        transforms, angles = self.sample(np.array([t_s]))
        return HandPose(transforms[0], angles[0])
