"""What really happened in a simulated run: written to a file, read by the evaluation, never seen by the pipeline."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import SimulatorError
from rhot_app.simulator.body import HandBody
from rhot_app.simulator.motion import Motion

Array = NDArray[np.float64]

SAMPLE_HZ = 1000.0
"""Between two samples a hand at 25 m/s^2 strays 3 um from the straight line."""


@dataclass(frozen=True, slots=True)
class FrameTruth:
    """One camera's frames: `times_s` (F,) of row 0's mid-exposure and `visible` (F, M), each marker's visible part."""

    times_s: Array
    visible: Array


@dataclass(frozen=True, slots=True)
class Truth:
    """The hand over scene time, rig frame, m and rad. M markers in the set's order, K samples.

    `markers` (K, M, 3), `joints` (K, 21, 3), `angles` (K, 21), `world_from_palm` (K, 4, 4).
    """

    times_s: Array
    markers: Array
    joints: Array
    angles: Array
    world_from_palm: Array
    cameras: tuple[FrameTruth, ...]

    def markers_at(self, times_s: Array) -> Array:
        """(N, M, 3) m at scene times (N,), s."""
        return _interpolate(self.times_s, self.markers, times_s)

    def joints_at(self, times_s: Array) -> Array:
        """(N, 21, 3) m at scene times (N,), s."""
        return _interpolate(self.times_s, self.joints, times_s)

    def angles_at(self, times_s: Array) -> Array:
        """(N, 21) rad at scene times (N,), s."""
        return _interpolate(self.times_s, self.angles, times_s)

    def visible_at(self, times_s: Array) -> Array:
        """(N, M): smallest visible part over all cameras, in the frames nearest to scene times (N,), s."""
        parts = []
        for camera in self.cameras:
            after = np.clip(np.searchsorted(camera.times_s, times_s), 1, max(1, len(camera.times_s) - 1))
            after = np.minimum(after, len(camera.times_s) - 1)
            before = np.maximum(after - 1, 0)
            nearer = np.where(times_s - camera.times_s[before] < camera.times_s[after] - times_s, before, after)
            parts.append(camera.visible[nearer])
        return np.minimum.reduce(parts)


def _interpolate(times_s: Array, values: Array, at_s: Array) -> Array:
    at_s = np.clip(at_s, times_s[0], times_s[-1])
    after = np.clip(np.searchsorted(times_s, at_s), 1, len(times_s) - 1)
    part = (at_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1])
    part = part.reshape(-1, *([1] * (values.ndim - 1)))
    return np.asarray((1.0 - part) * values[after - 1] + part * values[after])


def true_hand(motion: Motion, body: HandBody, seconds: float, cameras: tuple[FrameTruth, ...]) -> Truth:
    """Sample the hand that was rendered, from scene time 0 to `seconds`."""
    times = np.arange(0.0, seconds + 1.0 / SAMPLE_HZ, 1.0 / SAMPLE_HZ)
    transforms, angles = motion.sample(times)
    points = body.points(transforms, angles)
    return Truth(times, body.marker_centres(points), points[:, :21], angles, transforms, cameras)


def save_truth(path: Path, truth: Truth) -> None:
    """Write a truth file (numpy .npz)."""
    frames = {f"camera{k}_{name}": getattr(camera, name) for k, camera in enumerate(truth.cameras)
              for name in ("times_s", "visible")}
    np.savez_compressed(path, times_s=truth.times_s, markers=truth.markers, joints=truth.joints.astype(np.float32),
                        angles=truth.angles, world_from_palm=truth.world_from_palm, **frames)


def load_truth(path: Path) -> Truth:
    """Read a truth file; raises SimulatorError when it is missing or foreign."""
    try:
        with np.load(path) as data:
            count = sum(name.endswith("_visible") for name in data.files)
            cameras = tuple(FrameTruth(data[f"camera{k}_times_s"], data[f"camera{k}_visible"]) for k in range(count))
            return Truth(data["times_s"], data["markers"], data["joints"].astype(np.float64), data["angles"],
                         data["world_from_palm"], cameras)
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile) as exc:
        raise SimulatorError(f"{path}: not a truth file of a simulated run ({exc}). "
                             "Render one with `rhot simulate --out FOLDER`.") from exc
