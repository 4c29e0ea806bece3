"""Frames per second of a node that looks for markers alone, and for markers and fiducial tags.

    python benchmarks/tags.py [--frames N] [--json FILE]

640x480, six markers and 0 to 4 tags of the dictionary 36h11, 64 px wide. One frame after the other: `markers` is what a
frame costs the detector of markers, `tags` what it costs that of tags. With tags in a thread of their own, as in the
daemon, markers keep their rate where two processors are free; `together` is the rate where there is one.

A Raspberry Pi 4 is taken to be as many times slower as --slower says (default 6). No Pi was measured.
"""

from __future__ import annotations

import time

import cv2
import numpy as np
from independent_drawing import MARKERS, build_scene
from tables import arguments, publish, table

from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.detect.tags import TagDetector

DICTIONARY, SIDE_PX, SETTLE = "DICT_APRILTAG_36h11", 64, 12
PAPER_PX = 20  # a quarter of the side and more
PLACES = ((10, 10), (520, 10), (10, 360), (520, 360))


def pictures(count: int) -> list[YuvImage]:
    """A ring of frames with `count` tags in the corners."""
    scene, rng = build_scene("compact", "16", "grey", 1), np.random.default_rng(1)
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    found = []
    for frame in range(16):
        image = scene.picture(min(frame, 16 - frame), ()).expose(rng)
        luma = image.y.copy()
        for number, (x, y) in enumerate(PLACES[:count]):
            tag = np.pad(cv2.aruco.generateImageMarker(family, number, SIDE_PX), PAPER_PX, constant_values=255)
            luma[y:y + len(tag), x:x + len(tag)] = tag
        found.append(YuvImage(cv2.GaussianBlur(luma, (0, 0), 0.7), image.u, image.v))
    return found


def main() -> int:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--slower", type=float, default=6.0, help="of a Pi 4 (default 6)")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    rows = []
    for count in range(5):
        ring, markers, tags = pictures(count), FastDetector(MARKERS), TagDetector([DICTIONARY])
        for image in ring[:SETTLE]:
            markers.detect(image)
            tags.detect(image.y)
        marker_s, tag_s, seen = [], [], 0
        for frame in range(args.frames):
            image = ring[frame % len(ring)]
            begun = time.process_time()
            markers.detect(image)
            between = time.process_time()
            seen += len(tags.detect(image.y))
            marker_s.append(between - begun)
            tag_s.append(time.process_time() - between)
        one, other = float(np.median(marker_s)), float(np.median(tag_s))
        rows.append({"tags": count, "found_per_frame": seen / args.frames, "markers_ms": 1e3 * one,
                     "tags_ms": 1e3 * other, "together_hz": 1.0 / (one + other), "ratio": (one + other) / one,
                     "pi4_markers_hz": 1.0 / (args.slower * one), "pi4_tags_hz": 1.0 / (args.slower * other)})
    publish(args, rows, table(list(rows[0]), [list(row.values()) for row in rows]))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
