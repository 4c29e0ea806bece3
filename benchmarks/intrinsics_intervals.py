"""Whether the stated 95 % intervals of a camera's intrinsics hold the truth 95 times of a hundred.

A synthetic camera before a board, another lens and other views with every seed, corners with Gaussian noise; with a
perfect board, with one whose corners are off by a tenth of a millimetre, and with square pixels.

    python benchmarks/intrinsics_intervals.py [--seeds 200] [--views 15] [--noise 0.1] [--json FILE]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from stereo_intervals import Tally

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "calibration"))

from intrinsics_twin import BOARD, twin_views
from tables import arguments, publish, table

from rhot_app.calibration.lens.intrinsics import solve
from rhot_app.geometry.camera import PARAMETERS, PLAIN, full_lens

Array = NDArray[np.float64]

BOARD_OFF_M = np.array([0.08e-3, 0.08e-3, 0.1e-3])
WAYS = {"perfect board": (0.0, False), "board off by 0.1 mm": (1.0, False), "square pixels": (0.0, True)}


def some_lens(random: np.random.Generator, square: bool) -> Array:
    """(12,) a lens as cheap cameras have them."""
    fx = random.uniform(480.0, 620.0)
    fy = fx if square else fx * random.normal(1.0, 0.003)
    centre = random.normal([319.5, 239.5], [12.0, 12.0])
    k1 = random.uniform(-0.32, 0.05)
    radial = [k1, -0.35 * k1 + random.normal(0.0, 0.03)]
    return full_lens([fx, fy, *centre, *radial, *random.normal(0.0, 8e-4, 2), random.normal(0.0, 0.03)])


def run(args: argparse.Namespace, off: float, square: bool) -> Tally:
    """Calibrate with every seed and compare with the truth."""
    tally = Tally()
    for seed in range(args.seeds):
        random = np.random.default_rng([seed, 7])
        lens = some_lens(random, square)
        errors = off * random.normal(0.0, BOARD_OFF_M, (BOARD.count, 3))
        views = twin_views(random, count=args.views, lens=lens, noise_px=args.noise, board_errors=errors)
        report = solve(views, BOARD, square_pixels=square)
        for place, name in enumerate(PARAMETERS[:PLAIN]):
            if not (square and name == "fy"):
                tally.add(name, report.lens[place] - lens[place], report.std[place])
    return tally


def main() -> int:
    """Print the share inside by parameter and pooled; exit code 1 when a pooled share is not 92 to 98 %."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--views", type=int, default=15)
    parser.add_argument("--noise", type=float, default=0.1, help="px per axis")
    args = parser.parse_args()
    kept: dict[str, dict[str, float]] = {}
    for way, (off, square) in WAYS.items():
        tally = run(args, off, square)
        kept[way] = {"pooled": tally.pooled, **{name: tally.inside(name) for name in tally.ratios}}
    columns = ["pooled", *dict.fromkeys(name for figures in kept.values() for name in figures if name != "pooled")]
    publish(args, kept, table(["board; % inside", *columns], [
        [way, *(f"{100.0 * figures[name]:.1f}" if name in figures else None for name in columns)]
        for way, figures in kept.items()]))
    return 0 if all(0.92 <= figures["pooled"] <= 0.98 for figures in kept.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
