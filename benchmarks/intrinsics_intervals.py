"""Whether the stated 95 % intervals of a camera's intrinsics hold the truth 95 times of a hundred.

A synthetic camera before a board, another lens and other views with every seed, corners with Gaussian noise; with a
perfect board, with one whose corners are off by a tenth of a millimetre, and with square pixels.

    python benchmarks/intrinsics_intervals.py [--seeds 200] [--views 15] [--noise 0.1] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from stereo_intervals import Tally

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "calibration"))

from intrinsics_twin import BOARD, twin_views

from rhot_app.calibration.lens.fit import PARAMETERS
from rhot_app.calibration.lens.intrinsics import solve

Array = NDArray[np.float64]

BOARD_OFF_M = np.array([0.08e-3, 0.08e-3, 0.1e-3])
WAYS = {"perfect board": (0.0, False), "board off by 0.1 mm": (1.0, False), "square pixels": (0.0, True)}


def some_lens(random: np.random.Generator, square: bool) -> Array:
    """(9,) a lens as cheap cameras have them."""
    fx = random.uniform(480.0, 620.0)
    fy = fx if square else fx * random.normal(1.0, 0.003)
    centre = random.normal([319.5, 239.5], [12.0, 12.0])
    k1 = random.uniform(-0.32, 0.05)
    radial = [k1, -0.35 * k1 + random.normal(0.0, 0.03)]
    return np.array([fx, fy, *centre, *radial, *random.normal(0.0, 8e-4, 2), random.normal(0.0, 0.03)])


def run(args: argparse.Namespace, off: float, square: bool) -> Tally:
    """Calibrate with every seed and compare with the truth."""
    tally = Tally()
    for seed in range(args.seeds):
        random = np.random.default_rng([seed, 7])
        lens = some_lens(random, square)
        errors = off * random.normal(0.0, BOARD_OFF_M, (BOARD.count, 3))
        views = twin_views(random, count=args.views, lens=lens, noise_px=args.noise, board_errors=errors)
        report = solve(views, BOARD, square_pixels=square)
        for place, name in enumerate(PARAMETERS):
            if not (square and name == "fy"):
                tally.add(name, report.lens[place] - lens[place], report.std[place])
    return tally


def main() -> int:
    """Print the share inside by parameter and pooled; exit code 1 when a pooled share is not 92 to 98 %."""
    parser = argparse.ArgumentParser(description="Share of true parameters inside the stated 95 % intervals.")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--views", type=int, default=15)
    parser.add_argument("--noise", type=float, default=0.1, help="px per axis")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures there")
    args = parser.parse_args()
    kept: dict[str, dict[str, float]] = {}
    for way, (off, square) in WAYS.items():
        began = time.monotonic()
        tally = run(args, off, square)
        kept[way] = {"pooled": tally.pooled, **{name: tally.inside(name) for name in tally.ratios}}
        print(f"{way}: {100 * tally.pooled:.1f} % pooled over {args.seeds} seeds ({time.monotonic() - began:.0f} s)")
        print("  " + "  ".join(f"{name} {100 * tally.inside(name):.0f}" for name in tally.ratios), flush=True)
    if args.json is not None:
        args.json.write_text(json.dumps({"seeds": args.seeds, "views": args.views, "noise_px": args.noise,
                                         "inside": kept}, indent=2))
    return 0 if all(0.92 <= figures["pooled"] <= 0.98 for figures in kept.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
