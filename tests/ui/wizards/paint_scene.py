"""Painted fingertips before two cameras, for the tests of the colour wizard; drawn once, shown in turn."""

from __future__ import annotations

import msgspec
import numpy as np
from colour_scenes import PAINTS, picture, place

from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import to_bgr
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet, load_markers

BESIDE = (-14.0, 0.0)  # the second camera sees everything there
STEPS = 12
_MOVE_PX = 9.0  # down from picture to picture, and as much to and fro: another place for every marker


class PaintScene:
    """`draw` for a `FakeRigAsker`: the hand goes down and comes up, two and a half pictures a second; or it rests."""

    def __init__(self, paints: dict[str, tuple[int, int, int]] = PAINTS, **options: object) -> None:
        self.moving = False
        self._pictures = {(node_id, step): to_bgr(picture(paints, shift=self._shift(node_id, step), seed=step,
                                                          light=1.0 - 0.02 * step, **options))
                          for node_id in (1, 2) for step in range(STEPS)}

    @staticmethod
    def _shift(node_id: int, step: int) -> tuple[float, float]:
        return (BESIDE[0] if node_id == 2 else 0.0) + _MOVE_PX * (step % 2), _MOVE_PX * step

    def draw(self, node_id: int, t_s: float) -> np.ndarray:
        """The picture of a node at a time."""
        turn = int(2.5 * t_s) % (2 * STEPS - 2) if self.moving else 0
        return self._pictures[node_id, min(turn, 2 * STEPS - 2 - turn)]

    @staticmethod
    def where(name: str, node_id: int = 1) -> tuple[float, float]:
        """A marker in a resting camera's picture, px."""
        return place(name, PaintScene._shift(node_id, 0))


def compile_detector() -> None:
    """Have the detector's code compiled before a window waits for it."""
    detector = FastDetector(load_markers(resource_path("markers", "rhot6.json")))
    detector.detect(picture())
    detector.detect(picture(seed=1))
    detector.labels(picture())


def other_colours(markers: MarkerSet) -> MarkerSet:
    """A set with the same markers and colours that have nothing to do with the paints."""
    return msgspec.structs.replace(markers, markers=tuple(
        msgspec.structs.replace(marker, chroma=msgspec.structs.replace(marker.chroma, cb=100.0, cr=0.0 + k))
        for k, marker in enumerate(markers.markers)))
