"""What pairing by time is worth: three ways to bring two unsynchronised rolling-shutter cameras together.

By arrival: the newest frame of each, taken as simultaneous. By time: interpolated to a common instant by the nodes'
clocks, but as if all rows of a frame were seen at once. By rows: every marker at its own row's time, as the tracker
does. Filters are off. First with exact image positions, so that what remains is the error of the pairing alone; then
in the twin: rendered frames, noise, blur and all, a hand that reaches 2 m/s.

    python benchmarks/pairing.py [--seconds S] [--json FILE]

prints marker errors, mm rms, and how many times less they are than by arrival.
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "tracking"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from synthetic_rig import FAST, WIDE, Preset, Viewing, compare, hand_trajectory, make_rig, observe, run
from tables import arguments, publish, table

from rhot_app.evaluation.score import rms
from rhot_app.project import FilterSettings, Rig
from rhot_app.simulator.film.film import TRUTH_NAME, film
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.film.truth import load_truth
from rhot_app.simulator.scene.scene import Scene, build_rig, make_scene, twin_defaults
from rhot_app.sources.local_nodes import NodePorts
from rhot_app.state import Knowledge
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.capture.yuv import FRAMES_NAME, read_header
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_i420

Array = NDArray[Any]
Frames = list[CameraObservations]

MOTIONS = ("rest", "grasp", "pinch", "wave", "fast")
PRESETS: dict[str, tuple[Preset, float]] = {"wide": (WIDE, 0.6), "fast": (FAST, 1.0)}
TARGET = 5.0


def by_arrival(frames: Frames) -> Iterator[CameraObservations]:
    """What a tracker without clocks sees: the two newest frames, taken as simultaneous, the later one's time."""
    newest: dict[int, CameraObservations] = {}
    for observations in frames:
        newest[observations.camera] = observations
        if len(newest) == 2:
            t_ns = max(held.t_row0_master_ns for held in newest.values())
            for held in newest.values():
                yield dataclasses.replace(held, t_row0_master_ns=t_ns, row_time_ns=0, t_receive_ns=t_ns)
            newest.clear()


def by_time(frames: Frames) -> Iterator[CameraObservations]:
    """Every frame at the time of its middle row."""
    for held in frames:
        middle_ns = held.t_row0_master_ns + 240 * held.row_time_ns
        yield dataclasses.replace(held, t_row0_master_ns=middle_ns, row_time_ns=0)


WAYS = {"by arrival": by_arrival, "by time": by_time, "by rows": iter}


def exact(rig: Rig, motion: str, preset: Preset, distance_m: float, seconds: float) -> dict[str, float]:
    """Marker error, mm rms, of each way, with exact image positions."""
    trajectory = hand_trajectory(rig, motion, seconds, distance_m)
    frames = observe(rig, preset, trajectory, seconds, Viewing(noise_px=0.0))
    return {name: compare(rig, run(make_tracker(rig), list(way(frames))), trajectory).raw_mm
            for name, way in WAYS.items()}


def detected(scene: Scene, folder: Path) -> Frames:
    """What two nodes see in a filmed shot, in the order in which it would arrive."""
    frames = []
    for camera, name in enumerate(scene.names):
        header = read_header(folder / name)
        film_data = np.memmap(folder / name / FRAMES_NAME, np.uint8, "r").reshape(-1, header.frame_bytes)
        detector = FastDetector(scene.markers)
        for data, t_ns in zip(film_data, header.times_ns, strict=True):
            seen = detector.detect(from_i420(data, header.width, header.height))[:len(scene.markers.ids)]
            frames.append(CameraObservations(
                camera, t_ns, header.row_time_ns, 0.0, t_ns + header.exposure_ns // 2 + 480 * header.row_time_ns,
                0.0, 0.0, np.array([(mark.x, mark.y) for mark in seen]),
                np.array([((mark.cov_xx, mark.cov_xy), (mark.cov_xy, mark.cov_yy)) for mark in seen]),
                np.array([mark.diameter for mark in seen]), np.array([mark.quality for mark in seen]),
                np.array([mark.flags for mark in seen], dtype=np.uint16)))
    return sorted(frames, key=lambda held: held.t_receive_ns)


def filmed(preset: str, distance_m: float, seconds: float) -> dict[str, float]:
    """Marker error, mm rms, of each way, in the twin."""
    settings = msgspec.structs.replace(twin_defaults(), preset=preset, distance_m=distance_m)
    scene = make_scene(settings, seed=1)
    ports = tuple(NodePorts(1 + k, 11 + k, 21 + k, 31 + k) for k in range(len(scene.names)))
    rig = msgspec.structs.replace(build_rig(scene, ports), filters=FilterSettings(enabled=False))
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "shot"
        film(make_shot(scene, "fast", seconds), folder)
        frames = detected(scene, folder)
        truth = load_truth(folder / TRUTH_NAME)
    figures = {}
    for name, way in WAYS.items():
        states = [state for state in run(make_tracker(rig), list(way(frames))) if state.t_master_ns > 0.3e9]
        true = truth.markers_at(np.array([1e-9 * state.t_master_ns for state in states]))
        measured = np.array([state.marker_knowledge for state in states]) == Knowledge.MEASURED
        error = np.linalg.norm(np.array([state.marker_raw_positions for state in states]) - true, axis=2)
        figures[name] = 1e3 * (rms(np.where(measured, error, np.nan)) or np.nan)
    return figures


def main() -> int:
    """Print the table; 1 when the target is missed."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=6.0, help="of exact motion; a third of it is rendered")
    args = parser.parse_args()
    found: dict[str, dict[str, float]] = {}
    for name, (preset, distance_m) in PRESETS.items():
        rig = make_rig(preset, filters=FilterSettings(enabled=False))
        for motion in MOTIONS:
            found[f"{name}, {distance_m:g} m, {motion}"] = exact(rig, motion, preset, distance_m, args.seconds)
        found[f"{name}, {distance_m:g} m, fast, rendered"] = filmed(name, distance_m, max(1.0, args.seconds / 3.0))
    gains = {what: figures["by arrival"] / figures["by rows"] for what, figures in found.items()}
    publish(args, found, table(["preset, distance and motion; mm rms", *WAYS, "less than by arrival"],
                               [[what, *figures.values(), f"{gains[what]:.0f} x"] for what, figures in found.items()]))
    return 0 if min(gain for what, gain in gains.items() if "m, fast" in what) >= TARGET else 1


if __name__ == "__main__":
    sys.exit(main())
