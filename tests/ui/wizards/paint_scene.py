"""Painted fingertips before two cameras, for the tests of the colour wizard; drawn once and moved."""

from __future__ import annotations

from functools import cached_property

import cv2
import msgspec
import numpy as np
from colour_scenes import PAINTS, picture, place

from rhot_app.ui.backend.feed import Picture
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import to_bgr
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet, load_markers

BESIDE = -14  # px to the right: the second camera sees everything there
STEPS = 12
_MOVE_PX = 9  # down from picture to picture, and as much to and fro: another place for every marker


class PaintScene:
    """`draw` for a `FakeRigClient`: the hand rests, or it goes down and comes up, a step with every picture."""

    def __init__(self, paints: dict[str, tuple[int, int, int]] = PAINTS, **options: object) -> None:
        self.moving = False
        self._turns = {1: 0, 2: 0}
        self._first = to_bgr(picture(paints, **options))

    @staticmethod
    def _shift(node_id: int, step: int) -> tuple[float, float]:
        return (BESIDE if node_id == 2 else 0) + _MOVE_PX * (step % 2), _MOVE_PX * step

    def draw(self, node_id: int, t_s: float = 0.0) -> np.ndarray:
        """The next picture of a node."""
        self._turns[node_id] += self.moving
        turn = self._turns[node_id] % (2 * STEPS - 1) if self.moving else 0  # odd: who sees every second sees all
        step = min(turn, 2 * STEPS - 2 - turn)
        x, y = self._shift(node_id, step)
        moved = cv2.warpAffine(self._first, np.array([[1.0, 0.0, x], [0.0, 1.0, y]]), (320, 240),
                               flags=cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        return cv2.convertScaleAbs(moved, alpha=1.0 - 0.02 * step)

    @cached_property
    def at_rest(self) -> dict[str, Picture]:
        """What both cameras see of a hand that rests."""
        return {name: Picture(name, self.draw(node_id), node_id, 0, 0) for node_id, name in ((1, "left"), (2, "right"))}

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
