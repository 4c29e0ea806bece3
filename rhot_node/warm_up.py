"""Warms a detector up: everything is compiled and cached before the first real frame."""

from __future__ import annotations

import numpy as np

from rhot_node.detect.illuminant import fit_temperature_shift
from rhot_node.detect.image import Detector, YuvImage
from rhot_node.markers import MarkerSet

DISC_RADIUS = 10  # px
FRAMES = 3  # acquire, then track


def warm_up(detector: Detector, markers: MarkerSet, size: tuple[int, int]) -> None:
    """Show the detector a few frames of `size` (width, height) with a disc of every marker's colour, then reset it.

    The first frame is blank, so that markers are also sought in other lights; blank frames alone would leave the code
    that measures a marker uncompiled until the first one is seen.
    """
    width, height = size
    grey = np.full((height // 2, width // 2), 128, dtype=np.uint8)
    detector.detect(YuvImage(np.full((height, width), 128, dtype=np.uint8), grey, grey))
    image = warm_up_image(markers, size)
    for _ in range(FRAMES):
        detector.detect(image)
    detector.reset()
    fit_temperature_shift(np.zeros(1), np.zeros((1, 3)), np.linspace(-1.0, 1.0, 3))  # of colours stronger than these


def warm_up_image(markers: MarkerSet, size: tuple[int, int]) -> YuvImage:
    """Mid-grey with the markers' discs on a grid."""
    width, height = size
    luma = np.full((height, width), 128, dtype=np.uint8)
    chroma = np.full((2, height // 2, width // 2), 128, dtype=np.uint8)
    rows, columns = np.mgrid[:height // 2, :width // 2]
    across = max(1, width // (4 * DISC_RADIUS))
    for index, marker in enumerate(markers.markers):
        x, y = 2 * DISC_RADIUS * (1 + 2 * (index % across)), 2 * DISC_RADIUS * (1 + 2 * (index // across))
        disc = (2 * columns + 0.5 - x) ** 2 + (2 * rows + 0.5 - y) ** 2 <= DISC_RADIUS**2
        chroma[0][disc] = np.clip(128 + round(marker.chroma.cb), 0, 255)
        chroma[1][disc] = np.clip(128 + round(marker.chroma.cr), 0, 255)
    return YuvImage(luma, chroma[0], chroma[1])
