"""How well bones are found: hands whose bones are known, two halves of a real recording, and six markers.

``python benchmarks/bones.py [--persons N] [--json FILE]`` prints a table for each. Beside each figure stands the plain
average: every bone scaled as the mean distance between the markers at its two ends is scaled against the base hand.
"""

from __future__ import annotations

import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "calibration"))

from bones_twin import RICH, SIX, Sloppiness, base_hand, bones_mm, person, record
from tables import arguments, publish, table

from rhot_app.calibration.hand.bones import solve_bones
from rhot_app.calibration.hand.bones_result import BonesResult, Known
from rhot_app.calibration.hand.bundle_model import Poses, expected
from rhot_app.calibration.hand.marker_places import MarkerTracks, tracks_of
from rhot_app.calibration.hand.shape import HandUnknowns
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import neutral_pose
from rhot_app.recording.qualisys import read_qualisys

Array = NDArray[np.float64]

QUALISYS = Path(__file__).parents[2] / "shared" / "data" / "hand_motion" / "qualisys_hand_30s.tsv"
NOISES_MM = (0.1, 0.3, 0.4)
"""Of motion capture, which is better still, and of two cheap cameras, well and less well set up."""

TARGET_MM, TARGET_HALVES_MM, TARGET_SIZE = 2.0, 1.0, 0.02


def plain_average(tracks: MarkerTracks, base: HandAnatomy) -> Array:
    """(5, 3) mm: what the mean distances between neighbouring markers of a finger make of the base hand's bones."""
    unknowns = HandUnknowns(base, tracks.places)
    relaxed = Poses(np.eye(4)[None], neutral_pose().angles[None])
    typical = expected(unknowns, unknowns.prior.mean, relaxed)[0]
    out = bones_mm(base)
    for finger in range(5):
        worn = sorted((place.segment, k) for k, place in enumerate(tracks.places) if place.finger == finger)
        for (segment, a), (last, b) in pairwise(worn):
            seen = float(np.nanmean(np.linalg.norm(tracks.positions[:, a] - tracks.positions[:, b], axis=1)))
            out[finger, segment:last + 1] *= np.sqrt(seen / np.linalg.norm(typical[a] - typical[b]))
    return out


def lengths_mm(result: BonesResult) -> Array:
    """(5, 3) mm."""
    return np.array([bone.length_mm for bone in result.bones]).reshape(5, 3)


def rich_twin(persons: int, noise_mm: float) -> list[dict[str, Any]]:
    """Known hands with a marker on every bone and three on the back of the hand, left and right in turn."""
    rows = []
    for seed in range(persons):
        side = "left" if seed % 2 else "right"
        hand = person(seed, side=side)
        tracks = record(hand, RICH, seed, sloppiness=Sloppiness(noise_m=1e-3 * noise_mm))
        begun = time.perf_counter()
        result = solve_bones(tracks, base_hand(side))
        errors = lengths_mm(result) - bones_mm(hand)
        plain = np.abs(plain_average(tracks, base_hand(side)) - bones_mm(hand))
        deviations = np.array([bone.std_mm for bone in result.bones]).reshape(5, 3)
        rows.append({"person": seed, "side": side, "noise_mm": noise_mm, "worst_mm": float(np.abs(errors).max()),
                     "inner_bones_mm": float(np.abs(errors[:, :2]).max()),
                     "rms_mm": float(np.sqrt(np.mean(errors ** 2))),
                     "errors_per_std": float(np.sqrt(np.mean((errors / deviations) ** 2))),
                     "within_95": int((np.abs(errors) < 1.96 * deviations).sum()),
                     "plain_worst_mm": float(plain.max()), "seconds": time.perf_counter() - begun})
        say(f"rich marker set, {noise_mm:g} mm of noise: person {seed} worst {rows[-1]['worst_mm']:.2f} mm")
    return rows


def real_halves() -> dict[str, Any] | None:
    """The two halves of the recording of a real hand; None where it is not there."""
    if not QUALISYS.exists():
        return None
    points = read_qualisys(QUALISYS)
    tracks = tracks_of(points.times_s, points.positions, points.names)
    middle = 0.5 * tracks.duration_s
    halves = [tracks.within(0.0, middle), tracks.within(middle, np.inf)]
    reports = [solve_bones(half, base_hand()) for half in halves]
    say("real recording: both halves solved")
    apart = np.abs(lengths_mm(reports[0]) - lengths_mm(reports[1]))
    plain = np.abs(np.subtract(*(plain_average(half, base_hand()) for half in halves)))
    return {"worst_mm": float(apart.max()), "rms_mm": float(np.sqrt(np.mean(apart ** 2))),
            "plain_worst_mm": float(plain.max()), "sizes": [result.size for result in reports],
            "observed": [sum(bone.known is not Known.PRIOR for bone in result.bones) for result in reports]}


def six_markers(persons: int) -> list[dict[str, Any]]:
    """Painted fingertips and a wrist band, 40 frames a second, noise as of two cameras."""
    base = base_hand()
    rows = []
    for seed in range(persons):
        hand = person(seed)
        tracks = record(hand, SIX, seed, rate_hz=40.0, sloppiness=Sloppiness(noise_m=0.5e-3))
        result = solve_bones(tracks, base)
        truth = HandUnknowns(hand, ()).shape(HandUnknowns(hand, ()).prior.mean).reaches
        usual = HandUnknowns(base, ()).shape(HandUnknowns(base, ()).prior.mean).reaches
        size = float(np.mean(truth[1:] / usual[1:]))
        rows.append({"person": seed, "size": size, "size_error": result.size / size - 1.0,
                     "stated_std": result.size_std,
                     "not_observed": sum(bone.known is Known.PRIOR for bone in result.bones)})
    say(f"six markers: {persons} persons solved")
    return rows


def say(what: str) -> None:
    """Progress, away from the tables."""
    print(what, file=sys.stderr, flush=True)


def main() -> int:
    """Measure all three and print their tables."""
    parser = arguments(__doc__)
    parser.add_argument("--persons", type=int, default=6)
    args = parser.parse_args()
    halves, six = real_halves(), six_markers(args.persons)
    rich = [row for noise_mm in NOISES_MM for row in rich_twin(args.persons, noise_mm)]
    others = [[f"six markers, 40 Hz, 0.5 mm of noise, {len(six)} persons: the hand's size is off by, %",
               " to ".join(f"{end(100.0 * abs(row['size_error']) for row in six):.1f}" for end in (min, max))],
              ["the same, reported standard deviation, %",
               " to ".join(f"{end(100.0 * row['stated_std'] for row in six):.1f}" for end in (min, max))]]
    if halves is not None:
        others[:0] = [["real hand, 100 Hz, 11 markers: its two halves of 15 s disagree, worst bone, rms; mm",
                       f"{halves['worst_mm']:.2f}, {halves['rms_mm']:.2f}"],
                      ["the same, scaled plainly, worst bone, mm", halves["plain_worst_mm"]],
                      ["bones of 15 that the halves observe", ", ".join(map(str, halves["observed"]))]]
    publish(args, {"rich": rich, "halves": halves, "six": six},
            table(["noise, mm", "worst bone of each person, mm", "worst inner bone", "rms", "in 95 %", "plain, worst",
                   "a solve, s"],
                  [[f"{noise_mm:g}", ", ".join(f"{row['worst_mm']:.2f}" for row in rows),
                    max(row["inner_bones_mm"] for row in rows),
                    float(np.sqrt(np.mean([row["rms_mm"] ** 2 for row in rows]))),
                    f"{sum(row['within_95'] for row in rows)} of {15 * len(rows)}",
                    max(row["plain_worst_mm"] for row in rows), float(np.median([row["seconds"] for row in rows]))]
                   for noise_mm in NOISES_MM if (rows := [row for row in rich if row["noise_mm"] == noise_mm])]),
            table(["other recordings", "result"], others))
    return 0


if __name__ == "__main__":
    sys.exit(main())
