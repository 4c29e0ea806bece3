"""A marker held at known distances, as a table for the depth calibration: mean disparities that ideal detectors see."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.project import save_rig
from rhot_app.simulator.nodes.film import new_folder
from rhot_app.simulator.nodes.nodes import NodePorts
from rhot_app.simulator.nodes.shot import RIG_NAME, make_shot
from rhot_app.simulator.scene.scene import Scene, build_rig
from rhot_app.simulator.scene.scene_description import FARTHEST_M, NEAREST_M, MarkerShow
from rhot_app.simulator.truth.points import PointNoise

TABLE_NAME: Final = "table.csv"
_SECONDS = 1.0  # at each distance


def write_distances(scene: Scene, distances_m: Sequence[float], folder: Path, noise: PointNoise) -> None:
    """Write ``table.csv`` (real_cm, disparity_px: left minus right) and the rig into the new `folder`.

    Raises SimulatorError for a distance that the scene does not reach.
    """
    for distance in distances_m:
        if not NEAREST_M <= distance <= FARTHEST_M:
            raise SimulatorError(f"a marker can be held at {100 * NEAREST_M:g} to {100 * FARTHEST_M:g} cm, not at "
                                 f"{100 * distance:g} cm.")
    rows = [(100.0 * distance, disparity(scene, distance, noise)) for distance in distances_m]
    with new_folder(folder) as work:
        save_rig(work / RIG_NAME, build_rig(scene, (NodePorts(0, 0, 0),) * len(scene.names)))
        with (work / TABLE_NAME).open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(("real_cm", "disparity_px"))
            table.writerows((f"{distance:g}", f"{pixels:.3f}") for distance, pixels in rows)


def disparity(scene: Scene, distance_m: float, noise: PointNoise) -> float:
    """px, left minus right: the mean over a second of frames of both cameras."""
    shot = make_shot(scene, MarkerShow(distance_m=distance_m), _SECONDS)
    rng = np.random.default_rng([scene.seed, round(1e4 * distance_m)])
    means = []
    for index in (0, 1):
        times = 1e-9 * np.array(scene.frame_times_ns(index, _SECONDS))
        centres = shot.scene_object.source.sample(times)[0][:, :3, 3]  # a ball's centre is its own origin
        x = scene.camera(index).project(centres)[:, 0]
        means.append(float(np.mean(x + rng.normal(0.0, noise.sigma_px, len(x)))))
    return means[0] - means[1]
