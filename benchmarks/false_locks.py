"""How often a marker is seen that is not there: the twin's hand with paint missing, before its rooms.

    python benchmarks/false_locks.py [--frames N] [--json FILE]

Skin before cloth, and before a wooden desk with things on it, saturated ones among them; the hand wears no paint at
all, or lacks one marker. A lock is judged by the colour under it: that of skin, wood or cloth, or of a coloured thing;
and by whether the node states it with confidence or as ambiguous, which is no false lock: a lone thing of a marker's
colour looks like a lone marker. `true` counts the markers that are there: those found, and those of them that are
stated as ambiguous. `--frames` counts both cameras, all four cases together.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from twin_frames import twin_scene

from rhot_app.simulator.shot import make_renderer, make_shot
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage, from_i420
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.wire.messages import MarkerFlag

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
MOTIONS = ("grasp", "fast", "wave", "spread", "rest")
RUN = 125  # frames per scene, motion and camera
SKIN_HUE_DEG, HUES_DEG = 134.0, 20.0  # of skin and wood, and how far they reach
DULL, GREY = 50.0, 10.0  # chroma that skin and wood do not exceed, and that cloth does not


def run(background: str, seed: int, motion: str, missing: frozenset[str]) -> Counter[str]:
    """Locks by what is under them and how they are stated, in 2 RUN frames of one scene."""
    scene = twin_scene(background, seed=seed)
    shot = make_shot(scene, motion, 10.0, missing)
    locks: Counter[str] = Counter()
    for index in (0, 1):
        renderer, detector = make_renderer(shot, index), FastDetector(MARKERS)
        for number, t_ns in enumerate(scene.frame_times_ns(index, RUN / scene.preset.fps)[:RUN]):
            packed, _ = renderer.render(shot.act.source, 1e-9 * t_ns, number)
            image = from_i420(packed, scene.preset.width, scene.preset.height)
            for seen in detector.detect(image):
                sure = "in doubt" if seen.flags & MarkerFlag.AMBIGUOUS else "confident"
                if seen.found and MARKERS.ids[seen.index] in missing:
                    locks[f"{under(image, seen.x, seen.y)}, {sure}"] += 1
                elif seen.found:
                    locks[f"true, {sure}"] += 1
    return locks


def under(image: YuvImage, x: float, y: float) -> str:
    """What a place of a picture shows, by its chroma."""
    row, column = round(0.5 * (y - 0.5)), round(0.5 * (x - 0.5))
    around = np.s_[max(row - 1, 0):row + 2, max(column - 1, 0):column + 2]
    cb, cr = image.u[around].mean() - 128.0, image.v[around].mean() - 128.0
    away = (np.degrees(np.arctan2(cr, cb)) - SKIN_HUE_DEG + 180.0) % 360.0 - 180.0
    magnitude = np.hypot(cb, cr)
    dull = magnitude < GREY or (abs(away) < HUES_DEG and magnitude < DULL)
    return "skin, wood or cloth" if dull else "coloured things"


def tally(background: str, bare: bool, frames: int) -> dict[str, Any]:
    """At least `frames` frames of one room, of hands without paint or with one marker missing."""
    seen, seed = 0, 100
    locks: Counter[str] = Counter()
    while seen < frames:
        missing = frozenset(MARKERS.ids if bare else (MARKERS.ids[seed % len(MARKERS.ids)],))
        locks += run(background, seed, MOTIONS[seed % len(MOTIONS)], missing)
        seen, seed = seen + 2 * RUN, seed + 1
    return {"frames": seen, "locks": {f"{name}, {sure}": locks[f"{name}, {sure}"] for sure in ("confident", "in doubt")
                                      for name in ("skin, wood or cloth", "coloured things", "true")}}


def main() -> int:
    """Run, print what was seen, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    report: dict[str, Any] = {}
    for background in ("cloth", "clutter"):
        for bare in (True, False):
            name = f"{background}, {'no paint' if bare else 'one marker missing'}"
            report[name] = tally(background, bare, options.frames // 4)
            print(f"{name:<28} {report[name]}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(report, indent=2) + "\n")
    return int(any(part["locks"][f"{name}, confident"] for part in report.values()
                   for name in ("skin, wood or cloth", "coloured things")))


if __name__ == "__main__":
    sys.exit(main())
