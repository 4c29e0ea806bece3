"""Jitter of a hand that does not move at all: fast detector and the thesis's pipeline on the same frames.

    python benchmarks/jitter.py [--seconds 10] [--distance 0.6] [--preset wide] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import msgspec

from rhot_app.evaluation.run import evaluate_frames
from rhot_app.simulator.film.film import film
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.scene.scene import TwinSettings, make_scene, twin_defaults

DETECTORS = ("fast", "reference")


def main() -> int:
    """Render once, play once per detector, print 3-D jitter per marker and its ratio."""
    parser = argparse.ArgumentParser(description="3-D jitter per marker of a static hand, both detectors.")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--distance", type=float, default=0.6)
    parser.add_argument("--preset", default="wide", choices=("wide", "fast"))
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures there")
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
    print(f"static hand at {args.distance:g} m, preset {args.preset}: rms 3-D jitter, unfiltered, and error, mm")
    heads = "".join(f"{name + ' jitter':>18}{name + ' error':>18}" for name in DETECTORS)
    print(f"{'marker':<10}{heads}   ratio")
    key, error = "marker_jitter_unfiltered_mm_each", "marker_rms_mm_each"
    for marker, fast in figures["fast"][key].items():
        cells = "".join(f"{_cell(figures[name][key][marker]):>18}{_cell(figures[name][error][marker]):>18}"
                        for name in DETECTORS)
        reference = figures["reference"][key][marker]
        ratio = f"{reference / fast:8.1f}" if fast and reference else f"{'-':>8}"
        print(f"{marker:<10}{cells}{ratio}")
    if args.json is not None:
        args.json.write_text(json.dumps(figures, indent=1) + "\n")
    return 0


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


if __name__ == "__main__":
    sys.exit(main())
