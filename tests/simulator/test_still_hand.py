"""The markers of a rendered hand that does not move stay where they are, also beside others of the hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rhot_app.simulator.film.film import film
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

WIDTH, HEIGHT = 640, 480
BEGUN, JITTER_PX = 20, 0.06  # frames that outlines are learnt in; the wrist's is 0.04


def test_no_marker_of_a_still_hand_wanders(tmp_path: Path) -> None:
    film(make_shot(make_scene(twin_defaults(), 1), "still", 2.0), tmp_path / "frames")
    markers = load_markers(resource_path("markers", "rhot6.json"))
    pixels = WIDTH * HEIGHT
    for camera in ("left", "right"):
        raw = np.fromfile(tmp_path / "frames" / camera / "frames.i420", np.uint8).reshape(-1, 3 * pixels // 2)
        detector, places = FastDetector(markers), []
        for frame in raw:
            u, v = frame[pixels:].reshape(2, HEIGHT // 2, WIDTH // 2)
            seen = detector.detect(YuvImage(frame[:pixels].reshape(HEIGHT, WIDTH), u, v))
            places.append([(one.x, one.y) for one in seen[:len(markers.ids)]])
        spread = np.std(places[BEGUN:], axis=0)
        assert (spread < JITTER_PX).all(), dict(zip(markers.ids, spread.tolist(), strict=True))
