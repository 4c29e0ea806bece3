"""Skin in the real stereo video: where a landmark network sees the hand, the foreground does too."""

from __future__ import annotations

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_node.detect.foreground import foreground_map, learn_skin

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "bare_hand_stereo"
FIRST = 13


@pytest.mark.skipif(not FOLDER.exists(), reason="../shared/data/bare_hand_stereo is not there")
@pytest.mark.parametrize("camera", [0, 1])
def test_landmarks_of_a_real_hand_lie_on_its_foreground(camera: int) -> None:
    with (FOLDER / f"landmarks_c{camera}.csv").open() as file:
        points = {int(row["frame"]): np.array([[float(row[f"x{k}"]), float(row[f"y{k}"])] for k in range(21)])
                  for row in csv.DictReader(file)}
    capture = cv2.VideoCapture(str(FOLDER / f"cam{camera}_first120.mp4"))
    model, hits, areas = None, [], []
    for number in range(100):
        read, image = capture.read()
        assert read
        if number < FIRST or (number - FIRST) % 20:
            continue
        image = np.ascontiguousarray(image[..., ::-1])
        model = learn_skin(image) if model is None else model
        probability = foreground_map(image, model, 4)
        if number in points:
            at = np.clip(points[number] / 4.0, 0, np.array(probability.shape[::-1]) - 1).astype(int)
            hits.append(np.mean(probability[at[:, 1], at[:, 0]] > 0.5))
            areas.append(np.mean(probability > 0.5))
    assert np.mean(hits) > 0.85
    assert np.max(areas) < 0.35
