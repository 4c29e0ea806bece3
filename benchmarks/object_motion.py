"""How objects accelerate in a recording: root mean square acceleration by speed (`rhot_app/objects/motion.py`).

    python benchmarks/object_motion.py FILE.tsv NAME [NAME ...]

FILE: a Qualisys recording, mm. NAME: a rigid triad, whose markers are NAME_top, NAME_left and NAME_right. Derivatives
are those of a cubic fitted to 90 ms (Savitzky and Golay 1964).
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter
from tables import arguments, publish, table

from rhot_app.errors import RhotError
from rhot_app.estimation.se3 import log_so3
from rhot_app.geometry.transforms import fit_rigid
from rhot_app.recording.qualisys import read_qualisys

WINDOW, ORDER = 9, 3  # samples, degree
SPEEDS = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.4, np.inf]), np.array([0.0, 0.1, 0.25, 0.5, 1.0, 2.0, np.inf])
UNITS = ("m/s", "m/s^2"), ("rad/s", "rad/s^2")


def rates(points: np.ndarray, step_s: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """(speed, acceleration) of the triad's middle, and of its rotation, per sample; `points` (N, 3, 3) m."""
    middle = points.mean(axis=1)
    velocity, acceleration = (savgol_filter(middle, WINDOW, ORDER, deriv=n, delta=step_s, axis=0) for n in (1, 2))
    turned = np.array([fit_rigid(points[0], one)[:3, :3] for one in points])
    spin = np.array([log_so3(b @ a.T) for a, b in pairwise(turned)]) / step_s
    smooth, change = (savgol_filter(spin, WINDOW, ORDER, deriv=n, delta=step_s, axis=0) for n in (0, 1))
    return [(np.linalg.norm(velocity, axis=1), np.linalg.norm(acceleration, axis=1)),
            (np.linalg.norm(smooth, axis=1), np.linalg.norm(change, axis=1))]


def main() -> int:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("names", nargs="+", metavar="NAME")
    args = parser.parse_args()
    try:
        recording = read_qualisys(args.file)
    except RhotError as exc:
        print(exc, file=sys.stderr)
        return 2
    rows = []
    step_s = float(np.median(np.diff(recording.times_s)))
    for name in args.names:
        columns = [recording.names.index(f"{name}_{side}") for side in ("top", "left", "right")]
        points = recording.positions[:, columns]
        points = points[np.isfinite(points).all(axis=(1, 2))]
        for (speed, acceleration), edges, units in zip(rates(points, step_s), SPEEDS, UNITS, strict=True):
            for low, high in pairwise(edges):
                chosen = (speed >= low) & (speed < high)
                if chosen.sum() >= 20:
                    rms = np.sqrt(np.mean(acceleration[chosen] ** 2))
                    rows.append([name, f"{low:g} to {high:g} {units[0]}", f"{rms:.2f} {units[1]}", int(chosen.sum())])
    publish(args, rows, table(["object", "speed", "acceleration, rms", "samples"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
