"""Jitter of a hand that does not move at all: fast detector and the thesis's pipeline on the same frames.

    python benchmarks/jitter.py [--seconds 10] [--distance 0.6] [--preset wide] [--json FILE]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import msgspec
from tables import arguments, publish, table

from rhot_app.evaluation.run import evaluate_frames
from rhot_app.simulator.film.film import film
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.scene.scene import TwinSettings, make_scene, twin_defaults

DETECTORS = ("fast", "reference")


def main() -> int:
    """Render once, play once per detector, print 3-D jitter per marker and its ratio."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--distance", type=float, default=0.6)
    parser.add_argument("--preset", default="wide", choices=("wide", "fast"))
    args = parser.parse_args()
    merged = msgspec.to_builtins(twin_defaults()) | {"preset": args.preset, "distance_m": args.distance}
    scene = make_scene(msgspec.convert(merged, TwinSettings), 1)
    figures: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        film(make_shot(scene, "still", args.seconds), Path(work) / "frames")
        for detector in DETECTORS:
            place = Path(work) / detector
            place.mkdir()
            figures[detector] = evaluate_frames(Path(work) / "frames", place, detector=detector)
    key = "marker_jitter_unfiltered_mm_each"
    rows = []
    for marker, fast in figures["fast"][key].items():
        thesis = figures["reference"][key][marker]
        rows.append([marker, fast, thesis, thesis / fast if fast and thesis else None])
    publish(args, figures, table(["marker, mm rms", "this detector", "thesis's pipeline", "ratio"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
