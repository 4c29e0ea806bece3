"""Is what a node states about a painted hand's markers true? The stated covariances against the real errors.

    python benchmarks/painted_hand.py [--seconds S] [--background cloth|clutter] [--seed N] [--each] [--json FILE]

The twin's hand at 0.6 m in both presets, at rest, grasping, pinching and moving fast. Error: the stated place minus the
centroid of the marker's true outline at its row's mid-exposure (band: the middle of its ellipsoid's silhouette, as the
master takes it), bias and all; of a marker that is half hidden, minus that of its whole outline. The normalised squared
error e' C^-1 e, C the stated covariance, has a median of 1.4 and a 95th percentile of 6 when C is true. Per marker, of
those in plain view; then of those that something hides unnoticed (not plain in truth), and of those flagged.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tables import arguments, publish, table
from twin_frames import WHOLE, moving_frames, twin_scene

from rhot_node.detect.fast import FastDetector
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.wire.messages import MarkerFlag

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
MOTIONS = ("rest", "grasp", "pinch", "fast")
DOUBTFUL = MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS
SHOWN = (*(("all in plain view", key) for key in ("real_median", "stated_median", "nse_p50", "nse_p95")),
         ("wrist", "nse_p50"), ("wrist", "nse_p95"), ("hidden unnoticed", "nse_p95"))
SETTLE = 2  # frames until a track knows its marker's size

# Columns of what is scored of one marker in one picture.
INDEX, FLAGS, VISIBLE, ERROR2, STATED2, NORMALISED = range(6)
Array = NDArray[np.float64]


def scored(preset: str, background: str, motion: str, seconds: float, seed: int) -> Array:
    """(N, 6) of every marker found, in both cameras' frames."""
    scene = twin_scene(background, preset, seed=seed)
    rows = []
    for camera in (0, 1):
        detector = FastDetector(MARKERS)
        for number, moment in enumerate(moving_frames(scene, motion, camera, round(seconds * scene.preset.fps))):
            for seen in detector.detect(moment.image):
                if not seen.found or number < SETTLE or not np.isfinite(moment.place[seen.index]).all():
                    continue
                error = np.array([seen.x, seen.y]) - moment.place[seen.index]
                stated = np.array([[seen.cov_xx, seen.cov_xy], [seen.cov_xy, seen.cov_yy]])
                rows.append((seen.index, int(seen.flags), moment.visible[seen.index], error @ error,
                             np.trace(stated), error @ np.linalg.solve(stated, error)))
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def figures(rows: Array) -> dict[str, float]:
    """Root mean square of errors and of what is stated, px (both axes), their ratio, and percentiles of the normalised
    squared errors."""
    real, stated = np.sqrt(rows[:, ERROR2].mean()), np.sqrt(rows[:, STATED2].mean())
    median, most, nearly_all = np.percentile(rows[:, NORMALISED], (50, 95, 99))
    return {"count": len(rows), "real": real, "stated": stated, "stated_over_real": stated / real,
            "stated_median": float(np.sqrt(np.median(rows[:, STATED2]))),
            "real_median": float(np.sqrt(np.median(rows[:, ERROR2]))),
            "nse_p50": median, "nse_p95": most, "nse_p99": nearly_all}


def groups(rows: Array) -> dict[str, Array]:
    """Rows by marker, of those in plain view, and by what is wrong with the others."""
    flags = rows[:, FLAGS].astype(np.int64)
    plain, whole = flags & DOUBTFUL == 0, rows[:, VISIBLE] > WHOLE
    parts = {name: rows[plain & whole & (rows[:, INDEX] == index)] for index, name in enumerate(MARKERS.ids)}
    return parts | {
        "all in plain view": rows[plain & whole], "hidden unnoticed": rows[plain & ~whole],
        "partial": rows[flags & MarkerFlag.PARTIAL > 0], "edge": rows[flags & MarkerFlag.EDGE > 0],
        "ambiguous": rows[flags & MarkerFlag.AMBIGUOUS > 0]}


def main() -> int:
    """Run, print the tables, write the JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--background", choices=("cloth", "clutter"), default="cloth")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", action="store_true", help="print each marker and each flag, too")
    args = parser.parse_args()
    report: dict[str, Any] = {preset: {motion: {
        name: figures(part) for name, part in groups(scored(
            preset, args.background, motion, args.seconds, args.seed)).items() if len(part)}
        for motion in MOTIONS} for preset in ("wide", "fast")}
    printed = [table(
        ["preset, motion", "real, px, median", "reported", "p50", "p95", "wrist's p50", "p95", "p95, hidden unnoticed"],
        [[f"{preset}, {motion}", *(found.get(name, {}).get(key) for name, key in SHOWN)]
         for preset, motions in report.items() for motion, found in motions.items()])]
    if args.each:
        columns = ("count", "real", "stated", "real_median", "stated_median", "nse_p50", "nse_p95", "nse_p99")
        printed.append(table(
            ["preset, motion", "markers", "count", "real rms", "reported", "real median", "reported", "p50", "p95",
             "p99"],
            [[f"{preset}, {motion}", name, *(row[column] for column in columns)] for preset, motions in report.items()
             for motion, found in motions.items() for name, row in found.items()]))
    publish(args, report, *printed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
