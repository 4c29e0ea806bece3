"""How soon a turned camera is noticed by a moving hand alone, and how well it is refined.

Observations without pictures (`rhot_app.simulator.film.ideal_observations`) of a hand that moves through the volume
before two cameras; each seed has its own motion, noise and camera phases. A camera is turned about a random axis, or
shifted across the baseline in a random direction, at 60 s; the pose is refined every ten seconds. Reported are the time
until it is noticed, the errors 120 s after the knock, the share of them inside the stated 95 %, and alarms on a rig
that nobody touched. With `--bias` the markers' centroids are off by that much in every camera, all the time.

    python benchmarks/self_calibration.py [--seeds 6] [--still-seconds 600] [--bias 0.05] [--json FILE]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "tracking"))

from knocked_rig import filmed, rig_of, scene_of, volume_motion
from tables import arguments, publish, table

from rhot_app.tracking.refinement.refined_rig import Refinement
from rhot_app.tracking.refinement.rig_refinement import RigRefiner
from rhot_app.tracking.tracker import CameraObservations

KNOCK_S, AFTER_S, EVERY_S = 60.0, 120.0, 10.0
TURN_RAD, SHIFT_M = np.radians(0.3), 2e-3
NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Run:
    """One seed: seconds from the knock until it was noticed (NaN: never), alarms before it, the last refinement, and
    the processor's ms per second for frames and for refining."""

    noticed_s: float
    alarms: int
    found: Refinement
    take_ms_s: float
    refine_ms: float


def random_turn(rng: np.random.Generator) -> np.ndarray:
    """A turn about any axis."""
    axis = rng.normal(size=3)
    return np.concatenate([TURN_RAD * axis / np.linalg.norm(axis), np.zeros(3)])


def random_shift(rng: np.random.Generator) -> np.ndarray:
    """A shift across the baseline, which is x."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return np.concatenate([np.zeros(4), SHIFT_M * np.array([np.cos(angle), np.sin(angle)])])


def nothing(rng: np.random.Generator) -> np.ndarray:
    """A rig that nobody touches."""
    return np.zeros(6)


def run(frames: list[CameraObservations], refiner: RigRefiner, knock_s: float) -> Run:
    """Feed all frames, refine every ten seconds."""
    noticed_s, alarms, due_s, taken_s, refining = float("nan"), 0, EVERY_S, 0.0, []
    found, begun_ns = None, frames[0].t_row0_master_ns
    for frame in frames:
        since = time.process_time()
        refiner.take(frame)
        taken_s += time.process_time() - since
        now_s = 1e-9 * (frame.t_row0_master_ns - begun_ns)
        if now_s >= due_s:
            due_s += EVERY_S
            since = time.process_time()
            found = refiner.step()
            refining.append(time.process_time() - since)
            if found is not None and not found.holds:
                alarms += now_s < knock_s
                noticed_s = noticed_s if now_s < knock_s or np.isfinite(noticed_s) else now_s - knock_s
    found = refiner.step()
    assert found is not None
    return Run(noticed_s, alarms, found, 1e3 * taken_s / now_s, 1e3 * float(np.mean(refining)))


def study(knock: Callable[[np.random.Generator], np.ndarray], seeds: int, seconds: float, knock_s: float,
          bias_px: float) -> dict[str, Any]:
    """All seeds of one kind of knock: errors of the worst seed, medians of the processor's time."""
    runs, errors_deg, errors_mm, ratios = [], [], [], []
    for seed in range(1, seeds + 1):
        rng = np.random.default_rng([seed, 0xBEC])
        scene, correction = scene_of(seed), knock(rng)
        biases = rng.normal(0.0, bias_px, (2, len(scene.markers.ids), 2)) if bias_px else None
        one = run(filmed(scene, volume_motion(seed), seconds, correction, knock_s, bias_px=biases),
                  RigRefiner(rig_of(scene)), knock_s)
        camera = one.found.cameras[0]
        runs.append(one)
        away = np.concatenate([camera.turn, camera.shift])[[0, 1, 2, 4, 5]] - correction[[0, 1, 2, 4, 5]]
        errors_deg.append(np.degrees(np.abs(away[:3])))
        errors_mm.append(1e3 * np.abs(away[3:]))
        ratios.append(away / np.sqrt(np.diag(camera.covariance)[[0, 1, 2, 4, 5]]))
    return {"noticed_s": [one.noticed_s for one in runs], "alarms": sum(one.alarms for one in runs),
            "errors_deg": np.max(errors_deg, axis=0).tolist(), "errors_mm": float(np.max(errors_mm)),
            "inside": float(np.mean(np.abs(ratios) < NORMAL_95)),
            "dispersion": max(one.found.dispersion for one in runs),
            "frames_ms_per_s": float(np.median([one.take_ms_s for one in runs])),
            "refinement_ms": float(np.median([one.refine_ms for one in runs]))}


def main() -> int:
    """Print the table; exit code 1 when a knock of 0.3 degrees is missed for a minute, the refined pose is off by more
    than 0.03 degrees, or a rig that nobody touched raised an alarm."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--still-seconds", type=float, default=600.0)
    parser.add_argument("--bias", type=float, default=0.0, help="px, rms of each marker in each camera")
    args = parser.parse_args()
    whole, still = KNOCK_S + AFTER_S, args.still_seconds
    kept = {name: study(knock, args.seeds, seconds, knock_s, args.bias) for name, knock, seconds, knock_s in (
        ("turned by 0.3 degrees about a random axis", random_turn, whole, KNOCK_S),
        ("moved by 2 mm across the baseline", random_shift, whole, KNOCK_S),
        (f"untouched for {still:g} s", nothing, still, still + 1.0))}
    turned, *others = kept.values()
    noticed = {name: np.nan_to_num(one["noticed_s"], nan=np.inf) for name, one in kept.items()}
    publish(args, kept, table(
        ["camera", "noticed after, s: median", "worst", "false alarms", "worst error about x, y, z, degrees",
         "across the baseline, mm", "inside 95 %"],
        [[name, float(np.median(noticed[name])), float(noticed[name].max()), one["alarms"],
          ", ".join(f"{error:.4f}" for error in one["errors_deg"]), f"{one['errors_mm']:.3f}",
          f"{100.0 * one['inside']:.0f} %"] for name, one in kept.items()]),
        f"Seeds: {args.seeds}. Frames take {turned['frames_ms_per_s']:.1f} ms of the processor per second, a "
        f"refinement {turned['refinement_ms']:.0f} ms.")
    return int(max(noticed[next(iter(kept))]) > 60.0 or max(turned["errors_deg"]) > 0.03
               or any(one["alarms"] for one in (turned, *others)))


if __name__ == "__main__":
    sys.exit(main())
