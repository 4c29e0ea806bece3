"""Whether the stated 95 % intervals of a stereo calibration hold the truth 95 times of a hundred.

A synthetic rig before a board, another k3 in each lens and corners with Gaussian noise, many seeds. Lenses are found
from the same views, or given with their own standard deviations and kept, or refined; and once the board itself is off
by a tenth of a millimetre.

    python benchmarks/stereo_intervals.py [--seeds 200] [--shots 14] [--noise 0.2] [--json FILE]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "calibration"))

from stereo_twin import SIZE, Twin, stereo_twin
from tables import arguments, publish, table

from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.stereo.calibrate import calibrate
from rhot_app.estimation.se3 import log_so3
from rhot_app.geometry.camera import LENS, PARAMETERS, PLAIN, full_lens

Array = NDArray[np.float64]

LENS_STD = full_lens([1.0, 1.0, 1.5, 1.5, 5e-3, 1e-2, 3e-4, 3e-4, 1e-2])
K3_SPREAD = 0.04
NORMAL_95 = 1.959964
BOARD_OFF_M = 1e-4


@dataclass
class Tally:
    """Errors in standard deviations, by parameter."""

    ratios: dict[str, list[float]] = field(default_factory=dict)

    def add(self, name: str, error: float, std: float) -> None:
        """One more run of a parameter."""
        self.ratios.setdefault(name, []).append(error / std)

    def inside(self, name: str) -> float:
        """Share inside the interval."""
        return float(np.mean(np.abs(self.ratios[name]) < NORMAL_95))

    @property
    def pooled(self) -> float:
        """Share inside over all parameters."""
        return float(np.mean([abs(ratio) < NORMAL_95 for each in self.ratios.values() for ratio in each]))


def from_views(twin: Twin, rng: np.random.Generator) -> list[LensStart]:
    """Lenses somewhere near, to be found from the same views."""
    return [LensStart(lens + rng.normal(size=LENS) * LENS_STD, SIZE, None, "views") for lens in twin.lenses]


def given(twin: Twin, rng: np.random.Generator) -> list[LensStart]:
    """Lenses as another calibration would give them: off, and saying by how much."""
    return [LensStart(lens + rng.normal(size=LENS) * LENS_STD, SIZE, LENS_STD) for lens in twin.lenses]


def run(starts: Callable[[Twin, np.random.Generator], list[LensStart]], args: argparse.Namespace, *,
        lenses_too: bool, refine: bool, board_off_m: float = 0.0) -> Tally:
    """Calibrate with every seed and compare with the truth."""
    tally = Tally()
    for seed in range(args.seeds):
        rng = np.random.default_rng([seed, 1])
        twin = stereo_twin(seed, args.shots)
        lenses = twin.lenses + np.outer(rng.normal(0.0, K3_SPREAD, len(twin.lenses)), np.eye(LENS)[PLAIN - 1])
        twin = replace(twin, lenses=lenses, board_errors_m=rng.normal(0.0, board_off_m, (twin.board.count, 3)))
        figures = calibrate(twin.views(rng, args.noise), starts(twin, rng), refine=refine).figures
        if figures is None:
            raise SystemExit(f"seed {seed} could not be solved")
        (pair,) = figures.pairs
        truth = twin.camera_from_world[1]
        shift, turn = pair.translation_m - truth[:3, 3], pair.rotation_rad - log_so3(truth[:3, :3])
        for i, axis in enumerate("xyz"):
            tally.add(f"T{axis}", shift[i], pair.translation_std_m[i])
            tally.add(f"R{axis}", turn[i], pair.rotation_std_rad[i])
        if lenses_too:
            for camera, lens in zip(figures.cameras, twin.lenses, strict=True):
                for i, name in enumerate(PARAMETERS[:PLAIN]):
                    tally.add(name, camera.lens[i] - lens[i], camera.lens_std[i])
    return tally


def main() -> int:
    """Print the share inside by parameter and pooled; exit code 1 when a pooled share is not 92 to 98 %."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--shots", type=int, default=14)
    parser.add_argument("--noise", type=float, default=0.2, help="px per axis")
    args = parser.parse_args()
    kept: dict[str, dict[str, float]] = {}
    ways = {"lenses from the same views": (from_views, True, False, 0.0),
            "lenses given and kept": (given, False, False, 0.0),
            "lenses given and refined": (given, True, True, 0.0),
            "lenses from the same views, board 0.1 mm off": (from_views, True, False, BOARD_OFF_M)}
    for way, (starts, lenses_too, refine, board_off_m) in ways.items():
        tally = run(starts, args, lenses_too=lenses_too, refine=refine, board_off_m=board_off_m)
        kept[way] = {"pooled": tally.pooled, **{name: tally.inside(name) for name in tally.ratios}}
    columns = ["pooled", *dict.fromkeys(name for figures in kept.values() for name in figures if name != "pooled")]
    publish(args, kept, table(["lenses; % inside", *columns], [
        [way, *(f"{100.0 * figures[name]:.1f}" if name in figures else None for name in columns)]
        for way, figures in kept.items()]))
    return 0 if all(0.92 <= each["pooled"] <= 0.98 for each in kept.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
