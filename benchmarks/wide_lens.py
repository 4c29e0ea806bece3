"""Wide lenses: a pair of exactly equidistant ones is calibrated from pictures, and a hand tracked through it.

    python benchmarks/wide_lens.py [--seeds 3] [--seconds 6] [--across 120] [--json FILE]

The pictures of the board are drawn by r = f theta. So is the twin's hand, by a rational lens that is equidistant to a
thousandth of a pixel where the image reaches. It is tracked with the calibrated pair, straight ahead and 45 degrees
aside, and with a narrow pair of the same pixels per degree that looks at it. Exit code 1: a focal length is off by more
than 0.3 %, the baseline by more than 0.2 mm, or a fingertip by more than 1.2 times what the narrow pair leaves.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "tests" / "calibration")]

from equidistant import CENTRE, RIGHT_FROM_LEFT, focal_px, wide_views  # noqa: E402
from intrinsics_twin import BOARD, SIZE  # noqa: E402
from tables import arguments, publish, table  # noqa: E402

from rhot_app.calibration.lens.fit import find_lens  # noqa: E402
from rhot_app.calibration.stereo.calibrate import KnownLengths, calibrate, calibrated_rig  # noqa: E402
from rhot_app.calibration.stereo.result import StereoFigures  # noqa: E402
from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation  # noqa: E402
from rhot_app.evaluation.accuracy import Figures, accuracy, deviations, pooled, worn_by  # noqa: E402
from rhot_app.evaluation.compare import TRACKERS  # noqa: E402
from rhot_app.evaluation.data_sets import Order, data_set  # noqa: E402
from rhot_app.evaluation.track import rig_with, tracked  # noqa: E402
from rhot_app.geometry.camera import CameraModel, rig_intrinsics  # noqa: E402
from rhot_app.project import CameraPose, Rig  # noqa: E402
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults  # noqa: E402

Array = NDArray[np.float64]

ASIDE_DEG = 45.0
FOCAL_AIM, BASELINE_AIM_M, TRACKING_AIM = 0.003, 2e-4, 1.2
BASELINE_M = float(-RIGHT_FROM_LEFT[0, 3])


def equidistant_lens(focal: float, most_deg: float = 80.0) -> Array:
    """(12,) the rational lens that is nearest to an equidistant one up to this angle from the axis."""
    angle = np.radians(np.linspace(0.5, most_deg, 400))
    square, ratio = np.tan(angle) ** 2, angle / np.tan(angle)
    powers = square[:, None] ** np.arange(1, 4)  # 1 + k1 s + k2 s^2 + k3 s^3 = ratio (1 + k4 s + k5 s^2 + k6 s^3)
    weight = np.tan(angle) / (1.0 + np.sum(powers * (1.6, 0.73, 0.08), axis=1))
    k1, k2, k3, k4, k5, k6 = np.linalg.lstsq(weight[:, None] * np.hstack([powers, -ratio[:, None] * powers]),
                                             weight * (ratio - 1.0), rcond=None)[0]
    return np.array([focal, focal, *CENTRE, k1, k2, 0.0, 0.0, k3, k4, k5, k6])


def calibrated(across_deg: float, seed: int) -> StereoFigures:
    """A pair, calibrated from drawn pictures."""
    views = wide_views(np.random.default_rng(seed), focal_px(across_deg), pictures=True)
    lenses = [find_lens([view for view in views.of_camera(camera) if view is not None], BOARD, name)
              for camera, name in enumerate(views.cameras)]
    report = calibrate(views, lenses, known=KnownLengths(BASELINE_M))
    if report.figures is None or not report.verdict.acceptable:
        raise SystemExit(f"seed {seed}: {report.verdict.sentence}")
    return report.figures


def scene_of(seed: int, lens: Array, turned_deg: float) -> Scene:
    """The twin before cameras with this lens, each turned to the left by an angle."""
    scene = make_scene(msgspec.structs.replace(twin_defaults(), baseline_mm=1e3 * BASELINE_M), seed)
    turn = tuple(float(q) for q in quaternion_from_rotation(exp_so3([0.0, -np.radians(turned_deg), 0.0])))
    poses = tuple(CameraPose(turn, pose.translation_m) for pose in scene.poses)
    return replace(scene, intrinsics=rig_intrinsics(SIZE, lens), poses=poses)


def rig_by(figures: StereoFigures | None, rig: Rig) -> Rig:
    """The rig with the lenses as calibrated, and with the calibration's error in how its cameras stand to each other;
    None: the exact one. Cameras that are turned stand otherwise than the calibrated ones did, so the error is added in
    the right camera's frame."""
    if figures is None:
        return rig
    left, right = (CameraModel.from_rig(node.intrinsics, node.pose) for node in calibrated_rig(rig, figures).nodes)
    error = right.camera_from_world @ left.world_from_camera @ np.linalg.inv(RIGHT_FROM_LEFT)
    true = CameraModel.from_rig(rig.nodes[1].intrinsics, rig.nodes[1].pose)
    pose = true.world_from_camera @ np.linalg.inv(error)
    place = CameraPose(tuple(float(q) for q in quaternion_from_rotation(pose[:3, :3])),
                       tuple(float(x) for x in pose[:3, 3]))
    one, other = calibrated_rig(rig, figures).nodes
    return msgspec.structs.replace(rig, nodes=(
        msgspec.structs.replace(rig.nodes[0], intrinsics=one.intrinsics),
        msgspec.structs.replace(rig.nodes[1], intrinsics=other.intrinsics, pose=place)))


def track(scene: Scene, figures: StereoFigures | None, seconds: float, folder: Path) -> dict[str, Figures]:
    """The figures of every tracker on a hand that grasps."""
    one = data_set(Order(scene, "grasp", seconds), folder)
    results = {}
    for name, settings in TRACKERS.items():
        rig = rig_with(rig_by(figures, one.rig), settings)
        states = tracked(one.records(), rig)
        results[name] = accuracy(states, deviations(states, one.truth, worn_by(rig)), one.truth, worn_by(rig))
    return results


def measured(args: argparse.Namespace) -> tuple[dict[str, float], dict[str, dict[str, Figures]]]:
    """Errors of the calibrations, and figures by view and tracker."""
    focal = focal_px(args.across)
    lens = equidistant_lens(focal)
    views = {"narrow, ahead": (np.array([focal, focal, *CENTRE, *np.zeros(8)]), 0.0), "wide, ahead": (lens, 0.0),
             f"wide, {ASIDE_DEG:g} degrees aside": (lens, ASIDE_DEG)}
    off: list[tuple[float, float, float]] = []
    runs: dict[str, dict[str, list[Figures]]] = {name: {tracker: [] for tracker in TRACKERS} for name in views}
    for seed in range(1, args.seeds + 1):
        figures = calibrated(args.across, seed)
        lenses = np.array([camera.lens[:2] for camera in figures.cameras])
        off.append((float(np.abs(lenses / focal - 1.0).max()), abs(figures.pairs[0].baseline_m - BASELINE_M),
                    figures.rms_px))
        for name, (own, turned) in views.items():
            with tempfile.TemporaryDirectory() as folder:
                found = track(scene_of(seed, own, turned), figures if own is lens else None, args.seconds, Path(folder))
            for tracker, each in found.items():
                runs[name][tracker].append(each)
        print(f"seed {seed}: done", file=sys.stderr, flush=True)
    worst = {"focal_percent": 100.0 * max(each[0] for each in off), "baseline_mm": 1e3 * max(each[1] for each in off),
             "rms_px": max(each[2] for each in off)}
    return worst, {name: {tracker: pooled(each) for tracker, each in found.items()} for name, found in runs.items()}


SHOWN = {"tip_visible_mm": "fingertip, mm", "marker_mm": "marker, mm", "angles_deg": "angles, degrees",
         "measured_share": "measured"}


def main() -> int:
    """Print what is off, and by how much more than before the narrow pair."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=6.0, help="length of a take")
    parser.add_argument("--across", type=float, default=120.0, help="degrees that the lens sees across")
    args = parser.parse_args()
    worst, results = measured(args)
    (_, narrow), *wide = results.items()
    ratios = [found[tracker]["tip_visible_mm"] / narrow[tracker]["tip_visible_mm"]  # type: ignore[operator]
              for _, found in wide for tracker in TRACKERS]
    publish(args, {"calibration": worst, "tracking": results},
            table(["lens", "focal length off, %", "baseline off, mm", "rms, px"],
                  [[f"{args.across:g} degrees across", worst["focal_percent"], worst["baseline_mm"], worst["rms_px"]]]),
            table(["cameras and hand", "tracker", *SHOWN.values(), "fingertip, times"],
                  [[name, tracker, *(figures[key] for key in SHOWN),
                    figures["tip_visible_mm"] / narrow[tracker]["tip_visible_mm"]]  # type: ignore[operator]
                   for name, found in results.items() for tracker, figures in found.items()]))
    return 0 if (worst["focal_percent"] <= 100.0 * FOCAL_AIM and worst["baseline_mm"] <= 1e3 * BASELINE_AIM_M
                 and max(ratios) <= TRACKING_AIM) else 1


if __name__ == "__main__":
    sys.exit(main())
