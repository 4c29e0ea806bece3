"""The gate as others may ask it: the mask is made of the very pixels that the search joins into blobs."""

from __future__ import annotations

import numpy as np
from marker_rendering import SKIN, Canvas, capsule, disc
from shipped_markers import RHOT6

from rhot_node.detect.image import YuvImage
from rhot_node.detect.search import ColourGate


def picture() -> YuvImage:
    canvas = Canvas(320, 240).paint(capsule((40, 200), (280, 60), 22), SKIN, (160, 130), 180, 0.3)
    for k, marker in enumerate(RHOT6.markers):
        canvas.paint(disc(30 + 50 * k, 60 + 20 * k, 11), marker.display_rgb, (30 + 50 * k, 60 + 20 * k), 14, 0.3)
    return canvas.expose(np.random.default_rng(4))


def test_labels_are_the_pixels_of_the_blobs() -> None:
    image, gate = picture(), ColourGate(RHOT6)
    labels, blobs = gate.labels(image), gate.blobs(image, range(6))
    assert {blob.label for blob in blobs} == {1, 2, 3, 4, 5, 6}
    for label in range(1, 7):
        in_blobs = sum(blob.area for blob in blobs if blob.label == label)
        specks = (labels == label).sum() - in_blobs
        assert in_blobs > 60
        assert 0 <= specks <= 6  # what the search leaves out as noise


def test_too_dark_and_too_bright_pixels_are_nobodys() -> None:
    image = picture()
    luma = image.y.copy()
    luma[:, :160], luma[:, 160:] = 5, 253
    assert not ColourGate(RHOT6).labels(YuvImage(luma, image.u, image.v)).any()
