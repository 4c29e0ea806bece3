"""How fast hands move, in recordings: the rates and spreads of the estimator's process (`hand/motion/hand_process.py`).

    python benchmarks/process_prior.py FILE [FILE ...]

FILE: a recording of a hand (Qualisys .tsv, Leap Motion .csv). A Matérn 5/2 process of variance 1 and rate r has a
velocity of standard deviation r / sqrt(3). So the rate of the angles follows from their velocity in standard deviations
of the natural pose, over all files. With the same white jerk, an integrated Matérn 3/2 process of spread 1 has a
velocity of 2 r / sqrt(3). The spread of the palm is that of a hand twice as fast as the file in which it is the
fastest: other hands are faster than those recorded.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rhot_app.errors import RhotError
from rhot_app.hand.model import HandModel, build_model
from rhot_app.simulator.scene.recorded import recorded_motion
from rhot_app.simulator.scene.scene import make_scene, twin_defaults

EDGE_S, EVERY_S, STEP_S = 0.3, 0.01, 1e-3  # of the differences; the filter's ends say nothing


def speeds(path: Path, model: HandModel, centre: np.ndarray) -> tuple[float, float, float]:
    """Root mean squares: m/s and rad/s of the palm, by axis, and standard deviations of the natural pose per second."""
    motion = recorded_motion(path, model, centre)
    times = np.arange(EDGE_S, motion.period_s - EDGE_S, EVERY_S)
    (before, bent), (after, later) = (motion.sample(times + shift) for shift in (-STEP_S, STEP_S))
    moved = (after[:, :3, 3] - before[:, :3, 3]) / (2.0 * STEP_S)
    turned = Rotation.from_matrix(after[:, :3, :3] @ before[:, :3, :3].swapaxes(1, 2)).as_rotvec() / (2.0 * STEP_S)
    bending = (later - bent) / (2.0 * STEP_S)
    angles = np.einsum("ni,ij,nj->n", bending, model.pose_prior.information, bending).mean() / bending.shape[1]
    return float(np.sqrt(np.mean(moved**2))), float(np.sqrt(np.mean(turned**2))), math.sqrt(angles)


def main() -> int:
    """Print a line for each recording, and what the process takes from them."""
    parser = argparse.ArgumentParser(description="Rates and spreads of the estimator's process, from recordings.")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="Qualisys .tsv or Leap Motion .csv")
    scene = make_scene(twin_defaults(), 1)
    model, found = build_model(scene.hand), []
    for path in parser.parse_args().files:
        try:
            found.append(speeds(path, model, scene.centre))
        except RhotError as exc:
            print(exc, file=sys.stderr)
            return 2
        print("{}: palm {:.3f} m/s, {:.2f} rad/s; angles {:.2f} natural sd/s".format(path.name, *found[-1]))
    rate = math.sqrt(3.0 * np.mean([angles**2 for *_, angles in found]))
    moved, turned, _ = np.max(found, axis=0)
    print(f"rate {rate:.2f} /s, spread of the palm {math.sqrt(3.0) * moved / rate:.3f} m, "
          f"{math.sqrt(3.0) * turned / rate:.2f} rad")
    return 0


if __name__ == "__main__":
    sys.exit(main())
