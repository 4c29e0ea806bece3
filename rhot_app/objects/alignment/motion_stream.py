"""Sampled motion of one body: positions and rotations with times, interpolated between the samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rhot_app.errors import CalibrationError
from rhot_app.estimation.quantiles import chi_squared, chi_squared_isf
from rhot_app.estimation.se3 import rotation_from_quaternion
from rhot_app.objects.stream import read_samples

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

JUMP_M, JUMP_RAD = 10e-3, 0.1
"""m and rad: a sample this far from the cubic through its four neighbours is an outlier. For a hand at 5 Hz, 60 samples
a second and 50 m/s^2 the cubic errs by less than 1 mm (Lagrange's remainder)."""

OUTLIER_GATE = float(np.sqrt(chi_squared_isf(1e-6, 3) / chi_squared(0.5, 3)))
"""And this many times the median distance: Gaussian errors of a stream with few samples a second go beyond once in a
million samples."""

SAMPLES = 50
"""Fewer samples are no stream: an alignment has 10 unknowns."""

_STENCIL_S = 0.2  # a longer stencil predicts nothing


@dataclass(frozen=True)
class MotionStream:
    """`times_s` (N,) s, strictly ascending; `positions` (N, 3) m; `rotations` (N, 3, 3) world_from_body, or None.

    Raises CalibrationError for fewer than 50 samples, times that do not ascend, or numbers that are not finite.
    """

    times_s: Array
    positions: Array
    rotations: Array | None = None

    def __post_init__(self) -> None:
        if len(self.times_s) < SAMPLES:
            raise CalibrationError(f"A stream has {len(self.times_s)} samples; at least {SAMPLES} are needed. Record "
                                   "20 s.")
        finite = np.isfinite(self.times_s).all() and np.isfinite(self.positions).all()
        if not finite or (self.rotations is not None and not np.isfinite(self.rotations).all()):
            raise CalibrationError("A stream holds numbers that are not finite. Leave missing samples out.")
        if not (np.diff(self.times_s) > 0.0).all():
            raise CalibrationError("The times of a stream do not ascend. Sort it, and keep one sample of each time.")

    @classmethod
    def of_poses(cls, times_s: Array, poses: Array) -> MotionStream:
        """From world_from_body (N, 4, 4)."""
        return cls(times_s, poses[:, :3, 3], poses[:, :3, :3])

    @property
    def duration_s(self) -> float:
        """From the first to the last sample."""
        return float(self.times_s[-1] - self.times_s[0])

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.times_s, self.positions)

    @cached_property
    def _turning(self) -> Array:
        """(N - 1, 3) rad/s: constant angular velocity between neighbouring samples, along the world's axes."""
        assert self.rotations is not None
        turns = Rotation.from_matrix(self.rotations[1:] @ self.rotations[:-1].transpose(0, 2, 1)).as_rotvec()
        return np.asarray(turns / np.diff(self.times_s)[:, None])

    def covers(self, times_s: Array, gap_s: float) -> Mask:
        """(K,) whether each instant lies between two samples not more than `gap_s` apart."""
        after = np.clip(np.searchsorted(self.times_s, times_s), 1, len(self.times_s) - 1)
        inside = (times_s >= self.times_s[0]) & (times_s <= self.times_s[-1])
        return np.asarray(inside & (self.times_s[after] - self.times_s[after - 1] <= gap_s))

    def at(self, times_s: Array) -> tuple[Array, Array, Array, Array]:
        """Positions (K, 3) m and velocities m/s by a cubic spline, rotations (K, 3, 3) and angular velocities (K, 3)
        rad/s, world axes, by spherical linear interpolation; identity and 0 without rotations."""
        place, speed = self._spline(times_s), self._spline(times_s, 1)
        if self.rotations is None:
            return place, speed, np.tile(np.eye(3), (len(times_s), 1, 1)), np.zeros((len(times_s), 3))
        before = np.clip(np.searchsorted(self.times_s, times_s, side="right") - 1, 0, len(self.times_s) - 2)
        rate = self._turning[before]
        turn = Rotation.from_rotvec(rate * (times_s - self.times_s[before])[:, None]).as_matrix()
        return place, speed, turn @ self.rotations[before], rate

    def without_outliers(self) -> MotionStream:
        """The stream without samples that contradict their neighbours; two at either end have too few and go too."""
        kept = consistent(self.times_s, self.positions, JUMP_M)
        if self.rotations is not None:  # the Frobenius norm of a small turn is sqrt(2) times its angle
            kept &= consistent(self.times_s, self.rotations.reshape(-1, 9), np.sqrt(2.0) * JUMP_RAD)
        rotations = None if self.rotations is None else self.rotations[kept]
        return MotionStream(self.times_s[kept], self.positions[kept], rotations)


def consistent(times_s: Array, values: Array, jump: float) -> Mask:
    """(N,) False for values (N, K) that lie off the cubic through their four neighbours by `jump` and by OUTLIER_GATE
    times the median. Of neighbours that contradict each other the worst goes first."""
    kept = np.arange(len(times_s))
    while len(kept) > SAMPLES:
        off = _off_the_cubic(times_s[kept], values[kept])
        limit = max(jump, OUTLIER_GATE * float(np.median(off)))
        around = np.max([np.roll(off, shift) for shift in (-2, -1, 1, 2)], axis=0)
        wrong = (off > limit) & (off >= around)
        if not wrong.any():
            break
        kept = kept[~wrong]
    mask = np.zeros(len(times_s), bool)
    mask[kept[2:-2]] = True
    return mask


def _off_the_cubic(times_s: Array, values: Array) -> Array:
    """(N,) distance of each value from Lagrange's cubic through the two before and the two after it; 0 at the ends and
    where these lie too far apart."""
    count = len(times_s)
    neighbours = np.array([np.arange(2, count - 2) + shift for shift in (-2, -1, 1, 2)])
    away = times_s[neighbours] - times_s[2:-2]
    predicted = np.zeros((count - 4, values.shape[1]))
    for k in range(4):
        weight = np.ones(count - 4)
        for other in range(4):
            if other != k:
                weight *= -away[other] / (away[k] - away[other])
        predicted += weight[:, None] * values[neighbours[k]]
    off = np.zeros(count)
    off[2:-2] = np.where(away[3] - away[0] < _STENCIL_S, np.linalg.norm(values[2:-2] - predicted, axis=1), 0.0)
    return off


def read_stream(path: Path, columns: Sequence[str]) -> MotionStream:
    """Read a CSV file of positions or poses (`objects.stream.read_samples`); raises CalibrationError."""
    rows = read_samples(path, columns, CalibrationError)
    if len(rows) < SAMPLES:
        raise CalibrationError(f"{path}: {len(rows)} samples; at least {SAMPLES} are needed. Record 20 s.")
    rotations = rotation_from_quaternion(rows[:, 4:]) if len(columns) > 4 else None
    return MotionStream(rows[:, 0], rows[:, 1:4], rotations)
