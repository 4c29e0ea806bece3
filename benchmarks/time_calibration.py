"""Offsets and row times found in rendered pictures of a waving hand, against what the simulated cameras really had.

Each camera is rendered once with its own rolling shutter and its frames go through the detector; then the nodes are
made to say other times than the true ones, in several ways, and the calibration is asked.

    python benchmarks/time_calibration.py [--seconds 20] [--row-times 48 30] [--json FILE]
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tables import arguments, publish, table

from rhot_app.calibration.observations import ObservationCollector
from rhot_app.calibration.time.offset import calibrate_times
from rhot_app.progress import ProgressLine
from rhot_app.project import Rig
from rhot_app.simulator.film.shot import make_renderer, make_shot
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.scene.scene import Scene, build_rig, make_scene, twin_defaults
from rhot_app.sources.local_nodes import NodePorts
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_i420

OFFSETS_MS = (0.0, 3.0, 8.0)

# Up and down, 20 cm wide, not too evenly.
KEYS = ((0.0, 0, 0), (0.3, 20, -85), (0.65, 5, 60), (1.0, -25, -70), (1.45, 10, 95), (1.8, 0, -60), (2.25, -15, 80),
        (2.6, 25, -95), (3.0, 10, 45))


def motion_file(folder: Path) -> Path:
    """The waving as a motion file."""
    path = folder / "updown.json"
    path.write_text(json.dumps({
        "format": "rhot-motion", "version": 1, "name": "updown", "description": "", "period_s": 3.3, "base_deg": {},
        "sway": {"position_mm": 2.0, "rotation_deg": 1.2, "angle_deg": 1.0, "tremor_mm": 0.05},
        "keys": [{"t_s": t, "position_mm": [x, y, 0], "rotation_deg": [0, 0, 0]} for t, x, y in KEYS]}))
    return path


def film(scene: Scene, motion: Path, camera: int, row_time_us: float, seconds: float) -> tuple[CameraObservations, ...]:
    """Render and detect every frame of one camera whose rows are `row_time_us` apart."""
    shot = make_shot(scene, str(motion), seconds)
    renderer = make_renderer(shot, camera)
    shutter = Shutter(1e-9 * scene.exposure_ns, 1e-6 * row_time_us)
    renderer.expose(replace(renderer.exposure, shutter=shutter))
    detector = FastDetector(scene.markers)
    width, height = scene.preset.width, scene.preset.height
    times = scene.frame_times_ns(camera, seconds)
    line = ProgressLine(f"camera {scene.names[camera]}")
    found = []
    for number, t_ns in enumerate(times):
        pixels, _ = renderer.render(shot.scene_object.source, 1e-9 * t_ns, number)
        markers = detector.detect(from_i420(pixels, width, height))[:len(scene.markers.ids)]
        found.append(CameraObservations(
            camera=camera, t_row0_master_ns=t_ns, row_time_ns=round(1e3 * row_time_us), clock_bound_s=1e-4,
            t_receive_ns=t_ns, detect_s=0.0, network_s=0.0, pixels=np.array([(m.x, m.y) for m in markers]),
            covariances=np.array([((m.cov_xx, m.cov_xy), (m.cov_xy, m.cov_yy)) for m in markers]),
            diameters=np.array([m.diameter for m in markers]), qualities=np.array([m.quality for m in markers]),
            flags=np.array([m.flags for m in markers], dtype=np.uint16)))
        line(number + 1, len(times))
    line.finish()
    return tuple(found)


def ask(rig: Rig, films: list[tuple[CameraObservations, ...]], offset_ms: float, said_us: tuple[float, float],
        true_us: tuple[float, float]) -> dict[str, Any]:
    """Calibrate when the second node is `offset_ms` late and both say the row times `said_us`."""
    collector = ObservationCollector(tuple(node.name for node in rig.nodes), rig.markers.ids)
    for frames, late_ms, row_us in zip(films, (0.0, offset_ms), said_us, strict=True):
        for frame in frames:
            collector.add(replace(frame, t_row0_master_ns=frame.t_row0_master_ns - round(1e6 * late_ms),
                                  row_time_ns=round(1e3 * row_us)))
    report = calibrate_times(collector.table(), rig)
    second = report.cameras[1]
    return {"offset_ms": offset_ms, "said_us": said_us, "found_ms": 1e3 * second.with_row_time_s,
            "sd_ms": 1e3 * second.sd_s, "error_ms": 1e3 * second.with_row_time_s - offset_ms,
            "row_times_us": [1e6 * camera.row_time_s for camera in report.cameras],
            "row_time_sd_us": [1e6 * camera.row_time_sd_s for camera in report.cameras],
            "row_time_error": [1e6 * camera.row_time_s / true - 1.0 for camera, true
                               in zip(report.cameras, true_us, strict=True)], "grade": report.verdict.grade.value}


def main() -> int:
    """Print a row per case."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--row-times", type=float, nargs=2, default=(48.0, 30.0), metavar="US")
    args = parser.parse_args()
    scene = make_scene(twin_defaults(), 1)
    rig = build_rig(scene, (NodePorts(1, 2, 3), NodePorts(4, 5, 6)))
    true = tuple(args.row_times)
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        motion = motion_file(Path(work))
        films = [film(scene, motion, camera, true[camera], args.seconds) for camera in (0, 1)]
    figures = [ask(rig, films, offset, said, true) for offset in OFFSETS_MS for said in (true, (0.0, 0.0))]
    publish(args, figures, table(
        ["true offset, ms", "row times reported, µs", "offset found, ms", "error, ms", "row times found, µs", "off, %"],
        [[one["offset_ms"], ", ".join(f"{us:g}" for us in one["said_us"]),
          f"{one['found_ms']:.3f} ± {one['sd_ms']:.3f}",
          one["error_ms"], ", ".join(f"{us:.2f}" for us in one["row_times_us"]),
          ", ".join(f"{100 * error:+.2f}" for error in one["row_time_error"])] for one in figures]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
