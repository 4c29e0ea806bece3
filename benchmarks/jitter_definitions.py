"""The definitions of jitter (docs/jitter.md) on hands at rest and in motion, with noise that is known.

    python benchmarks/jitter_definitions.py [--seconds 10] [--seed 1] [--json FILE]

The index fingertip of the twin's motions, with white noise of 0.05, 0.05 and 0.4 mm, as of two cameras at 0.6 m.
`noise`: its rms. `differences`: `rhot_app.filters.jitter.moving`; `parabolas`: `resting`. `filtered`: what a filter of
5 Hz leaves of the noise, and what both say of its output.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_app.filters import jitter
from rhot_app.filters.one_euro import OneEuroFilter
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.film.truth import true_object
from rhot_app.simulator.scene.scene import make_scene, twin_defaults

Array = NDArray[np.float64]
MOTIONS = ("still", "rest", "grasp", "wave", "brisk", "fast")
NOISE_M = np.array([0.05, 0.05, 0.4]) * 1e-3
SETTLED = 50  # samples after which the filter has begun


def filtered(times_s: Array, values: Array) -> Array:
    """Through a low-pass filter of 5 Hz: a 1-euro filter without beta."""
    one = OneEuroFilter(values.shape[1], 5.0, 0.0)
    return np.array([one(float(t), row) for t, row in zip(times_s, values, strict=True)])


def judged(times_s: Array, way: Array, noise: Array) -> dict[str, float]:
    """mm rms: the noise, what both definitions say of a way (T, 3) with it, and the same of the filtered way."""
    smooth = filtered(times_s, way + noise)
    left = (smooth - filtered(times_s, way))[SETTLED:]
    found = {"noise_mm": np.sqrt(np.square(noise).sum(axis=1).mean()),
             "differences_mm": jitter.moving(times_s, way + noise),
             "parabolas_mm": jitter.resting(times_s, way + noise),
             "filtered_noise_mm": np.sqrt(np.square(left).sum(axis=1).mean()),
             "filtered_differences_mm": jitter.moving(times_s, smooth),
             "filtered_parabolas_mm": jitter.resting(times_s, smooth)}
    return {name: 1e3 * float(value) for name, value in found.items()}


def main() -> int:
    """Print both definitions of each motion, at 40 and 120 Hz."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    scene, rng = make_scene(twin_defaults(), args.seed), np.random.default_rng(args.seed)
    rows, figures = [], []
    for rate_hz in (40.0, 120.0):
        times = np.arange(0.0, args.seconds, 1.0 / rate_hz)
        for motion in MOTIONS:
            shot = make_shot(scene, motion, args.seconds)
            way = true_object(shot.scene_object, args.seconds, ()).markers_at(times)[:, 1]
            speed = np.percentile(np.linalg.norm(np.gradient(way, times, axis=0), axis=1), 95)
            found = judged(times, way, rng.normal(0.0, 1.0, way.shape) * NOISE_M)
            figures.append({"rate_hz": rate_hz, "motion": motion, "speed_m_s": float(speed), **found})
            rows.append([f"{motion}, {rate_hz:.0f} Hz", f"{speed:.2f}", *(f"{value:.2f}" for value in found.values())])
    publish(args, figures, table(["motion", "speed, m/s (95 %)", "noise, mm rms", "differences", "parabolas",
                                  "filtered: noise", "differences", "parabolas"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
