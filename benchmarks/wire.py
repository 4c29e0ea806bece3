"""What a datagram of observations costs to write and read, beside the thesis's text; and what a node's memory is.

    python benchmarks/wire.py [--rounds N] [--json FILE]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from tables import arguments, publish, table

from rhot_app.sources.validation import Point, parse_text
from rhot_node.detect.fast import FastDetector
from rhot_node.detectors import warm_up, warm_up_image
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import MarkerObservation, Observations

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
SIZE = (640, 480)


def six() -> Observations:
    """A frame's observations."""
    markers = [MarkerObservation(k, 100.0 + 80.31 * k, 200.0 + 7.17 * k, 16.2, 0.0021, 0.0001, 0.0019, 0.97)
               for k in range(6)]
    return Observations(1, 7, 1234, 10**12, 10**12 + 9_000_000, 900_000, 4_000_000, 48_000, *SIZE, 1234,
                        MARKERS.checksum, markers)


def format_text(points: list[Point]) -> bytes:
    """The thesis's text datagram of these positions, px."""
    return ";".join(f"{x:.3f},{y:.3f}" for x, y in points).encode() + b"\n"


def median_us(work: Callable[[], object], rounds: int) -> float:
    """Microseconds of one call, median over rounds of 100."""
    taken = []
    for _ in range(rounds):
        start = time.perf_counter_ns()
        for _ in range(100):
            work()
        taken.append(1e-5 * (time.perf_counter_ns() - start))
    return float(np.median(taken))


def resident_mb() -> float:
    """Resident memory of this process, MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(float(line.split()[1]) / 1024.0 for line in lines if line.startswith("VmRSS"))


def main() -> int:
    """Run, print the table, write the JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=200)
    args = parser.parse_args()
    frame = six()
    points = [(mark.x, mark.y) for mark in frame.markers]
    datagram, text = encode(frame), format_text(points)
    rows = [["RHOT", len(datagram), median_us(lambda: encode(frame), args.rounds),
             median_us(lambda: decode(datagram), args.rounds)],
            ["the thesis's text, without covariances, times and sizes", len(text),
             median_us(lambda: format_text(points), args.rounds), median_us(lambda: parse_text(text, 6), args.rounds)]]
    detector = FastDetector(MARKERS)
    warm_up(detector, MARKERS, SIZE)
    image = warm_up_image(MARKERS, SIZE)
    before = resident_mb()
    for _ in range(2000):
        detector.detect(image)
    after = resident_mb()
    publish(args, {"formats": rows, "memory_mb": [before, after]},
            table(["a datagram of six markers", "bytes", "write, µs", "read, µs"], rows),
            f"A process with the warm detector holds {before:.0f} MB; 2000 frames add {after - before:.1f} MB.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
