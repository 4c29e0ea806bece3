"""How a single marker is held or swung before the cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SWING_HZ = (1.3, 0.83)  # right and left, up and down: the path repeats after a hundred seconds only
_TREMOR_HZ, _TREMOR_M = np.array([1.1, 2.7, 8.9]), 0.08e-3


@dataclass(frozen=True)
class MarkerPath:
    """A `PoseSource` of something held at `place` (3,) m and swung by `reach` (2,) m to both sides, right and down; 0:
    held as still as a hand can."""

    place: Array
    reach: tuple[float, float]
    seed: int

    @property
    def top_speed(self) -> float:
        """m/s, at most."""
        return float(2.0 * np.pi * np.hypot(_SWING_HZ[0] * self.reach[0], _SWING_HZ[1] * self.reach[1]))

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """world_from_prop (T, 4, 4) at scene times (T,) s; and no angles, (T, 0)."""
        times_s = np.asarray(times_s, dtype=np.float64)
        rng = np.random.default_rng([self.seed, 0x3A2])
        phases = rng.uniform(0.0, 2.0 * np.pi, (len(_TREMOR_HZ), 3))
        tremor = np.sin(2.0 * np.pi * times_s[:, None, None] * _TREMOR_HZ[:, None] + phases)
        out = np.tile(np.eye(4), (len(times_s), 1, 1))
        out[:, :3, 3] = self.place + _TREMOR_M * np.sqrt(2.0 / len(_TREMOR_HZ)) * tremor.sum(axis=1)
        for axis in range(2):
            phase = rng.uniform(0.0, 2.0 * np.pi)
            out[:, axis, 3] += self.reach[axis] * np.sin(2.0 * np.pi * _SWING_HZ[axis] * times_s + phase)
        return out, np.zeros((len(times_s), 0))


def swing_reach(half_width_m: float, half_height_m: float, baseline_m: float) -> tuple[float, float]:
    """(2,) m: as far as a marker may swing so that both cameras, whose pictures reach so far to every side at the
    marker's distance, see it all the time."""
    return 0.7 * max(half_width_m - 0.5 * baseline_m, 0.01), 0.7 * half_height_m
