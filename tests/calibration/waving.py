"""A hand that waves before cameras whose clocks and row times are not what their nodes say."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
from synthetic_rig import WIDE, Preset, Trajectory, Viewing, hand_trajectory, observe

from rhot_app.calibration.observations import ObservationCollector, ObservationTable
from rhot_app.project import Rig
from rhot_app.tracking.tracker import CameraObservations

UP_AND_DOWN = (0.3, 1.0, 0.3)
SIDEWAYS = (1.0, 0.0, 0.3)


def waving(rig: Rig, seconds: float, direction: tuple[float, float, float] = UP_AND_DOWN, *, amplitude_m: float = 0.08,
           seed: int = 3) -> Trajectory:
    """An open hand carried to and fro irregularly along `direction` (x, y, z), as stiff as a hand can be held."""
    resting = hand_trajectory(rig, "rest", seconds)
    rng = np.random.default_rng(seed)
    hertz, phases = 1.3 * rng.uniform(0.7, 1.3, 3), rng.uniform(0.0, 2.0 * np.pi, (3, 3))

    def at(times: np.ndarray) -> np.ndarray:
        times = np.asarray(times)
        swings = np.sin(2.0 * np.pi * hertz * times[:, None, None] + phases).sum(axis=2) / np.sqrt(3.0)
        return resting(times) + (amplitude_m * np.array(direction) * swings)[:, None, :]
    return at


def see(rig: Rig, trajectory: Trajectory, seconds: float, *, late_s: tuple[float, ...], row_times_ns: tuple[int, ...],
        said_ns: tuple[int, ...], noise_px: float = 0.1, marker_loss: float = 0.02) -> list[CameraObservations]:
    """All frames. Camera c says `late_s[c]` less than the true time, and the row time `said_ns[c]`."""
    frames: list[CameraObservations] = []
    for camera, node in enumerate(rig.nodes):
        preset = Preset(WIDE.fps, row_times_ns[camera], WIDE.focal)
        alone = msgspec.structs.replace(rig, nodes=(node,))
        viewing = Viewing(phases=(0.37 * camera % 1.0,), noise_px=noise_px, marker_loss=marker_loss, seed=11 + camera)
        frames += [replace(frame, camera=camera, row_time_ns=said_ns[camera],
                           t_row0_master_ns=frame.t_row0_master_ns - round(1e9 * late_s[camera]))
                   for frame in observe(alone, preset, trajectory, seconds, viewing)]
    return sorted(frames, key=lambda frame: frame.t_receive_ns)


def collect(rig: Rig, frames: list[CameraObservations]) -> ObservationTable:
    """The frames as a table, through the collector."""
    collector = ObservationCollector(tuple(node.name for node in rig.nodes), rig.markers.ids)
    for frame in frames:
        collector.add(frame)
    return collector.table()
