"""Colour calibration on the twin: is a marker lost by another lamp, and does the warning come where tracking fails?

    python benchmarks/colours.py [--seeds N] [--frames N] [--only lamps|paints|others] [--json FILE]

First table: colours learnt by lamps of 4300, 6500 and 3000 K in turn, on wood with things on it and on cloth; then
other poses by lamps of 3000 to 6500 K with 80 to 120 % of the light. Every marker of which half can be seen counts;
lost, or found in another place or together with something else. Compared with the marker set's nominal colours.

Second table: one paint mixed step by step with the colours of skin, wood and another marker. Every marker counts.
Warned: the calibration says that it will be mistaken or lost; advice on exposure (burnt, pale) is listed, not counted.
Fails: in more than 5 % of the pictures the marker is lost or found elsewhere. Third table: other mixtures and scenes.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "calibration"))

from colour_twin import SKIN, WOOD_RGB, HandScene, calibrate, repainted, tally  # noqa: E402
from tables import arguments, publish, table  # noqa: E402

from rhot_app.calibration.colour.colours import ColourResult  # noqa: E402
from rhot_app.calibration.verdict import Grade  # noqa: E402
from rhot_node.files import resource_path  # noqa: E402
from rhot_node.markers import load_markers  # noqa: E402

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
KELVINS = (3000.0, 3600.0, 4300.0, 5200.0, 6500.0)
BRIGHTNESSES = (0.8, 1.0, 1.2)
LEARN_S = np.array([0.2, 0.5, 0.9, 1.4, 2.0, 2.7])
LEARNT_KELVINS = (4300.0, 6500.0, 3000.0)
FAILS = 0.05
WARNINGS = frozenset({"skin", "runs-on", "overlap", "same-colour", "room", "fails", "lamp"})
TARGETS: dict[str, tuple[float, float, float]] = {
    "skin": SKIN, "wood": WOOD_RGB, **{name: MARKERS.markers[MARKERS.ids.index(name)].display_rgb
                                       for name in ("wrist", "ring", "middle")}}
MIXTURES = (("thumb", "skin"), ("index", "skin"), ("wrist", "skin"), ("index", "wood"), ("thumb", "wrist"),
            ("little", "ring"), ("index", "middle"))
OTHERS = (("middle", "skin"), ("ring", "wood"), ("middle", "ring"), ("index", "wrist"), ("little", "middle"))
OTHER_SHARES = (0.6, 0.8, 0.92, 1.0)
OTHER_SEEDS = 34
SHARES = (0.0, 0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


def lamps(background: str, seeds: int, frames: int) -> dict[str, Any]:
    """Counts over all lamps for one background."""
    rows: dict[str, np.ndarray] = {}
    warned = 0
    for seed in range(1, seeds + 1):
        scene = HandScene(background, seed)
        result = calibrate(scene, LEARN_S, LEARNT_KELVINS[(seed - 1) % 3])
        warned += sum(finding.code in WARNINGS for finding in result.verdict.findings)
        for kelvin in KELVINS:
            for brightness in BRIGHTNESSES:
                shown = list(scene.frames(np.arange(frames) * 0.43 + 3.1, kelvin, brightness))
                for name, markers in (("learnt", result.markers), ("nominal", scene.markers)):
                    for way in ("stills", "tracked"):
                        got = tally(markers, shown, way == "stills")
                        counts = np.array([got.visible.sum(), got.lost.sum(), got.misplaced.sum()])
                        rows[f"{name}, {way}"] = rows.get(f"{name}, {way}", np.zeros(3, dtype=int)) + counts
    return {"warnings": warned, **{name: counts.tolist() for name, counts in rows.items()}}


def paint(name: str, target: str, share: float, frames: int, number: int) -> list[dict[str, Any]]:
    """With one mixed paint: whether each marker is warned of, and how often it fails by all lamps."""
    seed, kelvin = 11 + number % 5, LEARNT_KELVINS[number % 3]
    scene = HandScene("cloth" if target != "wood" else "clutter", seed,
                      markers=repainted(MARKERS, name, TARGETS[target], share))
    result = calibrate(scene, LEARN_S, kelvin)
    shown = [frame for kelvin in KELVINS[::2] for brightness in BRIGHTNESSES[::2]
             for frame in scene.frames(np.arange(frames) * 0.61 + 3.1, kelvin, brightness)]
    failed = np.maximum(*(tally(result.markers, shown, stills).failed for stills in (True, False)))
    return [{"mixed": name, "towards": target, "share": share, "marker": marker, "said": said_of(result, marker),
             "failed": round(float(part), 3)} for marker, part in zip(scene.markers.ids, failed, strict=True)]


def said_of(result: ColourResult, name: str) -> list[str]:
    """Codes of the findings that concern a marker."""
    return [finding.code for finding in result.verdict.findings
            if finding.grade is not Grade.GOOD and re.search(rf"\b{name}\b", finding.figure)]


def agreement(name: str, rows: list[dict[str, Any]]) -> list[Any]:
    """How well warnings and failures agree: a row of the table."""
    warned = np.array([bool(WARNINGS.intersection(row["said"])) for row in rows])
    fails = np.array([row["failed"] > FAILS for row in rows])
    both = int((warned & fails).sum())
    return [name, len(rows), int(fails.sum()), both, int((warned & ~fails).sum()), both / max(warned.sum(), 1),
            both / max(fails.sum(), 1)]


def main() -> int:
    """Run, print the tables, write the JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--only", choices=("lamps", "paints", "others"))
    args = parser.parse_args()
    result: dict[str, Any] = {"seeds": args.seeds, "frames": args.frames}
    printed = []
    if args.only in (None, "lamps"):
        rows = []
        for background in ("cloth", "clutter"):
            result[background] = lamps(background, args.seeds, args.frames)
            rows += [[background, *name.split(", "), *counts] for name, counts in result[background].items()
                     if isinstance(counts, list)]
        printed.append(table(["background", "colours", "images", "markers in view", "lost", "elsewhere"], rows))
    rows = []
    for part, mixtures, shares, first in (("paints", MIXTURES, SHARES, 1),
                                          ("others", OTHERS, OTHER_SHARES, OTHER_SEEDS)):
        if args.only in (None, part):
            mixed = [(name, target, share) for name, target in mixtures for share in shares]
            result[part] = [row for k, one in enumerate(mixed, first) for row in paint(*one, args.frames, k)]
            rows.append(agreement({"paints": "one paint mixed", "others": "other mixtures and scenes"}[part],
                                  result[part]))
    if rows:
        printed.append(table(["set", "markers", "fail", "warned of and failing", "false warnings", "precision",
                              "recall"], rows))
    publish(args, result, *printed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
