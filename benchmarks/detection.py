"""What finding six markers costs: this detector, the thesis's pipeline, and reading one frame, in one process.

    python benchmarks/detection.py [--rounds N] [--processor] [--json FILE]

640x480, five painted fingertips and a tilted wrist band, shaded and noisy. Every call gets the next of a ring of frames
that is larger than the caches; OpenCV and all else use one thread. Medians. `--processor` counts the processor's time
instead of the clock's: on a busy machine long calls are interrupted, short ones hardly ever.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "detect"))

from marker_rendering import SKIN, Canvas, band, capsule  # noqa: E402
from thesis_pipeline import ThesisPipeline  # noqa: E402

from rhot_node.detect.fast import SEARCH_STEP, FastDetector  # noqa: E402
from rhot_node.detect.gate import ColourGate  # noqa: E402
from rhot_node.detect.image import YuvImage, to_bgr  # noqa: E402
from rhot_node.files import resource_path  # noqa: E402
from rhot_node.markers import load_markers  # noqa: E402

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
BAND_TILT_RAD = 0.35
DIFFERENT, RING = 6, 96  # frames drawn; frames in the ring: 44 MB of YUV, 88 MB of BGR
SETTLE = 12  # frames until all markers are followed


def build_scene() -> Canvas:
    """Five painted fingertips 16 px wide and a wrist band 44 px wide, shaded by 25 %."""
    canvas = Canvas(640, 480, (96, 104, 118))
    places = [(118.3, 214.6), (214.8, 152.4), (305.1, 131.7), (396.6, 149.9), (478.2, 196.3), (311.4, 390.8)]
    for (x, y), marker in zip(places[:5], MARKERS.markers[:5], strict=True):
        canvas.paint(capsule((x, y + 90), (x, y + 6), 8), SKIN, (x, y + 50), 60)
        canvas.paint(capsule((x, y + 6), (x, y - 6), 8), marker.display_rgb, (x, y), 18, 0.25)
    x, y = places[5]
    canvas.paint(band(x, y, 22, 88, BAND_TILT_RAD, 0.05), SKIN, (x, y), 70)
    canvas.paint(band(x, y, 22, 19, BAND_TILT_RAD, 0.05), MARKERS.markers[5].display_rgb, (x, y), 40, 0.25)
    return canvas


def own_copies(images: Sequence[YuvImage]) -> list[YuvImage]:
    """A ring of frames, each in memory of its own."""
    return [YuvImage(*(plane.copy() for plane in (image.y, image.u, image.v)))
            for image in (images[k % len(images)] for k in range(RING))]


def measure(work: Callable[[Any], object], frames: Sequence[Any], rounds: int,
            before: Callable[[], object] | None = None, clock: Callable[[], int] = time.perf_counter_ns) -> np.ndarray:
    """(N,) microseconds of one call, over the ring, by a clock of nanoseconds."""
    taken = []
    for _ in range(rounds):
        for frame in frames:
            if before is not None:
                before()
            start = clock()
            work(frame)
            taken.append(clock() - start)
    return 1e-3 * np.array(taken)


def stages(rounds: int, clock: Callable[[], int]) -> dict[str, np.ndarray]:
    """Microseconds per call by stage. Stages take turns, so that a busy machine slows all alike."""
    rng = np.random.default_rng(1)
    drawn = [build_scene().expose(rng) for _ in range(DIFFERENT)]
    yuv = own_copies(drawn)
    bgr = [to_bgr(image) for image in yuv]
    room, thesis, gate = np.empty_like(bgr[0]), ThesisPipeline(MARKERS), ColourGate(MARKERS)
    fit, soft, lost, cold = (FastDetector(MARKERS, precise=name != "soft") for name in ("fit", "soft", "lost", "cold"))
    everything = range(len(MARKERS.markers))
    for detector in (fit, soft, lost):
        for image in yuv[:SETTLE]:
            detector.detect(image)
    thesis.full(bgr[0])
    few = max(len(yuv) // 8, 1)
    plans: dict[str, tuple[Callable[[Any], object], Sequence[Any], Callable[[], object] | None]] = {
        "read one BGR frame (copy)": (lambda frame: np.copyto(room, frame), bgr, None),
        "read one BGR frame (sum)": (lambda frame: frame.sum(), bgr[:few], None),
        "thesis, whole frame": (thesis.full, bgr[:few], None),
        "thesis, regions of interest": (thesis.regions, bgr[:few], None),
        "acquire: search for all six": (lambda image: gate.blobs(image, everything, step=SEARCH_STEP), yuv, None),
        "track, soft only": (soft.detect, yuv, None),
        "track, with fit": (fit.detect, yuv, None),
        "all lost, light known": (lost.detect, yuv[:few], lost.lose_all),
        "cold start": (cold.detect, yuv[:few], cold.reset),
    }
    taken: dict[str, list[np.ndarray]] = {name: [] for name in plans}
    for _ in range(rounds):
        for name, (work, frames, before) in plans.items():
            taken[name].append(measure(work, frames, 1, before, clock))
    return {name: np.concatenate(parts) for name, parts in taken.items()}


def main() -> int:
    """Run, print the table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--processor", action="store_true", help="the processor's time, not the clock's")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    taken = stages(max(options.rounds, 1), time.thread_time_ns if options.processor else time.perf_counter_ns)
    median = {name: float(np.median(parts)) for name, parts in taken.items()}
    read = median["read one BGR frame (copy)"]
    print(f"{'640x480, six markers':<30} {'us p50':>9} {'us p90':>9} {'/ read':>8} {'thesis full /':>14} {'ROI /':>8}")
    for name, value in median.items():
        print(f"{name:<30} {value:9.1f} {np.percentile(taken[name], 90):9.1f} {value / read:8.2f} "
              f"{median['thesis, whole frame'] / value:14.1f} {median['thesis, regions of interest'] / value:8.1f}")
    if options.json:
        options.json.write_text(json.dumps({"frames": RING, "size": [640, 480], "us_p50": median}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
