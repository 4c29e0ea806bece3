"""Errors of the alignment with another tracker, from simulated streams with noise and outliers, over random scenes.

    python benchmarks/alignment.py [--seeds 20] [--seconds 20] [--json FILE]

prints the median and the largest error of each unknown, against the target. NEES is the mean squared error by the
covariance, per parameter: 1 when the covariance is true.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "objects"))

from aligned_streams import FOREIGN_HZ, OUTLIER_M, OUTLIERS, RIG_HZ, make_scene
from tables import arguments, publish, table

from rhot_app.estimation.se3 import log_so3
from rhot_app.geometry.transforms import apply, inverse
from rhot_app.objects.alignment.report import AlignmentSolution, calibrate_alignment

TARGETS = {"origin mm": 0.5, "motion mm": 0.5, "point mm": 0.5, "rotation deg": 0.1, "offset ms": 1.0}


def errors_of(solution: AlignmentSolution, scene: Any) -> dict[str, float]:
    """By name: of the other world's origin, of a position in the middle of the motion, of the point on the tracker, of
    the rotation and the time offset; and NEES."""
    fit, truth = solution.fit, scene.rig_from_foreign
    turn = log_so3(fit.rig_from_foreign[:3, :3] @ truth[:3, :3].T)
    origin, point = (fit.rig_from_foreign - truth)[:3, 3], (fit.tracker_from_body - scene.tracker_from_body)[:3, 3]
    offset = fit.offset_s - scene.offset_s
    parameters = np.concatenate([origin, turn, point, [offset]])
    away = apply(fit.rig_from_foreign, apply(inverse(truth), fit.centre)) - fit.centre
    return {"origin mm": 1e3 * float(np.linalg.norm(origin)), "motion mm": 1e3 * float(np.linalg.norm(away)),
            "point mm": 1e3 * float(np.linalg.norm(point)), "rotation deg": float(np.degrees(np.linalg.norm(turn))),
            "offset ms": 1e3 * abs(offset),
            "NEES": float(parameters @ np.linalg.solve(fit.covariance, parameters)) / 10}


def main() -> int:
    """Measure, print the table, write JSON when asked; exit code 1 when a target is missed."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0)
    args = parser.parse_args()
    errors = []
    for seed in range(args.seeds):
        scene = make_scene(seed, seconds=args.seconds)
        errors.append(errors_of(calibrate_alignment(scene.foreign, scene.rig), scene))
    found = {key: [row[key] for row in errors] for key in errors[0]}
    publish(args, {"errors": found, "targets": TARGETS},
            table(["error", "median", "worst", "aim"],
                  [[key, float(np.median(found[key])), max(found[key]), target] for key, target in TARGETS.items()]),
            f"{args.seconds:g} s, {RIG_HZ:g} and {FOREIGN_HZ:g} Hz, {100 * OUTLIERS:g} % outliers of "
            f"{1e3 * OUTLIER_M:g} mm, {args.seeds} seeds. "
            f"NEES per parameter: {np.mean(found['NEES']):.2f}.")
    return int(any(max(found[key]) > target for key, target in TARGETS.items()))


if __name__ == "__main__":
    sys.exit(main())
