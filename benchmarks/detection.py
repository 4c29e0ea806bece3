"""The fast detector against the thesis's own, on the same noisy frames of six standing markers, in one process.

    python benchmarks/detection.py [--frames N] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "detect"))

from marker_rendering import SKIN, Canvas, band, capsule  # noqa: E402

from rhot_node.detect.detector import Detector  # noqa: E402
from rhot_node.detect.fast import FastDetector  # noqa: E402
from rhot_node.detect.image import YuvImage  # noqa: E402
from rhot_node.detect.reference import ReferenceDetector  # noqa: E402
from rhot_node.files import resource_path  # noqa: E402
from rhot_node.markers import load_markers  # noqa: E402

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
BAND_TILT_RAD = 0.35
WARM_FRAMES = 3


def build_scene() -> tuple[Canvas, np.ndarray]:
    """Five painted fingertips 16 px wide and a wrist band 44 px wide, shaded by 25 %, and their (6, 2) true places."""
    canvas = Canvas(640, 480, (96, 104, 118))
    places = np.array([(118.3, 214.6), (214.8, 152.4), (305.1, 131.7), (396.6, 149.9), (478.2, 196.3), (311.4, 390.8)])
    for (x, y), marker in zip(places[:5], MARKERS.markers[:5], strict=True):
        canvas.paint(capsule((x, y + 90), (x, y + 6), 8), SKIN, (x, y + 50), 60)
        canvas.paint(capsule((x, y + 6), (x, y - 6), 8), marker.display_rgb, (x, y), 18, 0.25)
    x, y = places[5]
    canvas.paint(band(x, y, 22, 88, BAND_TILT_RAD, 0.05), SKIN, (x, y), 70)
    canvas.paint(band(x, y, 22, 19, BAND_TILT_RAD, 0.05), MARKERS.markers[5].display_rgb, (x, y), 40, 0.25)
    return canvas, places


def time_frames(detector: Detector, images: list[YuvImage],
                before: Callable[[], None]) -> tuple[np.ndarray, np.ndarray]:
    """(N,) seconds per frame and (N, 6, 2) positions."""
    seconds, points = [], []
    for image in images:
        before()
        start = time.perf_counter()
        seen = detector.detect(image)
        seconds.append(time.perf_counter() - start)
        points.append([(marker.x, marker.y) for marker in seen])
    return np.array(seconds), np.array(points)


def measure(detector: Detector, images: list[YuvImage], truth: np.ndarray) -> dict[str, Any]:
    """Times tracked and searching; jitter (rms about the mean), bias and rms error of every marker, px.

    A box centre moves in half pixels: standing still it may show no jitter at all, and a large error.
    """
    time_frames(detector, images[:WARM_FRAMES], lambda: None)
    tracked, points = time_frames(detector, images, lambda: None)
    searching, _ = time_frames(detector, images[:40], detector.reset)
    return {
        "tracked_ms": {"p50": 1e3 * float(np.median(tracked)), "p99": 1e3 * float(np.percentile(tracked, 99))},
        "search_ms": {"p50": 1e3 * float(np.median(searching)), "p99": 1e3 * float(np.percentile(searching, 99))},
        "found": float(np.isfinite(points[:, :, 0]).mean()),
        "jitter_px": dict(zip(MARKERS.ids, np.sqrt(np.nanvar(points, axis=0).sum(axis=1)).tolist(), strict=True)),
        "bias_px": dict(zip(MARKERS.ids, np.hypot(*(np.nanmean(points, axis=0) - truth).T).tolist(), strict=True)),
        "error_px": dict(zip(MARKERS.ids, np.sqrt(np.nanmean(((points - truth) ** 2).sum(axis=2), axis=0)).tolist(),
                             strict=True)),
    }


def main() -> int:
    """Run, print the table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    canvas, truth = build_scene()
    rng = np.random.default_rng(1)
    images = [canvas.expose(rng) for _ in range(max(options.frames, WARM_FRAMES))]
    result: dict[str, Any] = {"frames": len(images), "size": [640, 480],
                              "fast": measure(FastDetector(MARKERS), images, truth),
                              "reference": measure(ReferenceDetector(MARKERS), images, truth)}
    fast, reference = result["fast"], result["reference"]
    print(f"{'640x480, six markers':<28} {'fast':>10} {'reference':>10} {'ratio':>8}")
    for label, key in (("tracked frame, ms", "tracked_ms"), ("full search, ms", "search_ms")):
        for quantile in ("p50", "p99"):
            a, b = fast[key][quantile], reference[key][quantile]
            print(f"{label + ' ' + quantile:<28} {a:10.3f} {b:10.3f} {b / a:8.1f}")
    print(f"{'found':<28} {fast['found']:10.3f} {reference['found']:10.3f}")
    for label, key in (("jitter, px", "jitter_px"), ("bias, px", "bias_px"), ("rms error, px", "error_px")):
        for name in MARKERS.ids:
            a, b = fast[key][name], reference[key][name]
            print(f"{label + ' ' + name:<28} {a:10.3f} {b:10.3f} {b / a:8.1f}")
    if options.json:
        options.json.write_text(json.dumps(result, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
