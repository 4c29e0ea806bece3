"""Small markers that are spread to the frame's edge before texture are found, and found again, in pictures of the
benchmarks' own drawing (benchmarks/independent_drawing.py)."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from independent_drawing import MARKERS, build_scene
from independent_scenes import RETURN_AIM, right

from rhot_node.detect.fast import FastDetector

ROOMS = ("blotches", "wood", "cloth")
FRAMES = 8
AWAY = 5  # frames for which a marker is hidden


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("size", ["12", "16"])
@pytest.mark.parametrize("still", [True, False], ids=["stills", "sequence"])
def test_spread_discs_are_all_found(size: str, room: str, still: bool) -> None:
    scene, rng, detector = build_scene("spread", size, room, 1, "disc"), np.random.default_rng(1), FastDetector(MARKERS)
    for frame in range(FRAMES):
        if still:
            detector.reset()
        seen = detector.detect(scene.picture(frame).expose(rng))[:len(MARKERS.markers)]
        missed = [MARKERS.ids[mark.index] for mark, shape in zip(seen, scene.at(frame), strict=True)
                  if not right(mark, shape)]
        assert not missed, f"{scene.name}, frame {frame}"


@pytest.mark.parametrize("size", ["12", "16"])
def test_hidden_markers_are_lost_and_found_again(size: str) -> None:
    scene, rng = build_scene("spread", size, "blotches", 2, "disc"), np.random.default_rng(2)
    detector, count = FastDetector(MARKERS), len(MARKERS.markers)
    detector.detect(scene.picture(0).expose(rng))
    for index in range(count):  # one after the other is hidden for AWAY frames, and back for RETURN_AIM frames
        for step in range(AWAY + RETURN_AIM):
            frame, hidden = index * (AWAY + RETURN_AIM) + step, [index] if step < AWAY else []
            seen = detector.detect(scene.picture(frame, hidden).expose(rng))[:count]
            missed = [mark.index for mark, shape in zip(seen, scene.at(frame), strict=True) if not right(mark, shape)]
            assert set(missed) <= {index}, f"frame {frame}"
            assert not hidden or not seen[index].found, f"{MARKERS.ids[index]} is found where it is not, frame {frame}"
        assert not missed, f"{MARKERS.ids[index]} is not found within {RETURN_AIM} frames"
