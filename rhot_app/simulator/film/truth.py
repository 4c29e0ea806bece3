"""What really happened in a simulated run: written to a file, read by the evaluation, never seen by the pipeline."""

from __future__ import annotations

import contextlib
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import SimulatorError
from rhot_app.simulator.bare_hand.painter import BareHand
from rhot_app.simulator.film.scene_objects import SceneObject
from rhot_app.simulator.render.body import HandBody
from rhot_app.simulator.scene.rigid_target import RigidTarget
from rhot_node.files import open_archive

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

    def palm_at(self, times_s: Array) -> Array:
        """(N, 4, 4) world_from_palm at scene times (N,), s; rotations to the 1e-5 that a straight line between two
        samples leaves."""
        return _interpolate(self.times_s, self.world_from_palm, times_s)

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


@dataclass(frozen=True, slots=True)
class ThingTruth:
    """Something rigid over scene time, rig frame, m. K samples; M markers in the set's order, NaN for those it does not
    wear; 0 on paper.

    `world_from_thing` (K, 4, 4): a board's frame is that of `rhot_app.calibration.board.boards`. `markers` (K, M, 3).
    """

    times_s: Array
    world_from_thing: Array
    markers: Array
    cameras: tuple[FrameTruth, ...]


def true_object(scene_object: SceneObject, seconds: float, cameras: tuple[FrameTruth, ...]) -> Truth | ThingTruth:
    """Sample what was rendered, from scene time 0 to `seconds`."""
    times = np.arange(0.0, seconds + 1.0 / SAMPLE_HZ, 1.0 / SAMPLE_HZ)
    transforms, angles = scene_object.source.sample(times)
    if isinstance(scene_object.thing, HandBody | BareHand):
        joints, worn = scene_object.thing.joints_and_markers(transforms, angles)
        return Truth(times, worn, joints, angles, transforms, cameras)
    markers = np.zeros((len(times), 0, 3))
    if isinstance(scene_object.thing, RigidTarget):
        markers = scene_object.thing.marker_positions(transforms, angles)
    return ThingTruth(times, transforms, markers, cameras)


def save_truth(path: Path, truth: Truth | ThingTruth) -> None:
    """Write a truth file (numpy .npz)."""
    arrays = {f"camera{k}_{name}": getattr(camera, name) for k, camera in enumerate(truth.cameras)
              for name in ("times_s", "visible")}
    if isinstance(truth, Truth):
        arrays |= {"joints": truth.joints.astype(np.float32), "angles": truth.angles,
                   "world_from_palm": truth.world_from_palm}
    else:
        arrays["world_from_thing"] = truth.world_from_thing
    np.savez_compressed(path, times_s=truth.times_s, markers=truth.markers, **arrays)


def load_truth(path: Path) -> Truth:
    """Read the truth about a hand; raises SimulatorError when the file is missing, foreign, or about something else."""
    with _opened(path) as data:
        if "world_from_thing" in data.files:
            raise SimulatorError(f"{path}: no hand was filmed here, so there is none to compare with.")
        return Truth(data["times_s"], data["markers"], data["joints"].astype(np.float64), data["angles"],
                     data["world_from_palm"], _cameras(data))


def load_thing_truth(path: Path) -> ThingTruth:
    """Read the truth about a board, ruler or marker; raises SimulatorError when there is none."""
    with _opened(path) as data:
        return ThingTruth(data["times_s"], data["world_from_thing"], data["markers"], _cameras(data))


def _cameras(data: Any) -> tuple[FrameTruth, ...]:
    count = sum(name.endswith("_visible") for name in data.files)
    return tuple(FrameTruth(data[f"camera{k}_times_s"], data[f"camera{k}_visible"]) for k in range(count))


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """An open truth file; whatever is wrong with it becomes a SimulatorError."""
    try:
        with open_archive(path) as file, np.load(file) as data:
            yield data
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile) as exc:
        raise SimulatorError(f"{path}: not a truth file of a simulated run ({exc}). "
                             "Render one with `rhot simulate --out FOLDER`.") from exc
