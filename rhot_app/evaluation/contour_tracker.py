"""The contour tracker as a user runs it: it learns the background of the first pictures, then looks for a hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.follower import HandFollower
from rhot_app.errors import TrackingError
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_node.detect.foreground import Foreground, learn_background, skin_foreground

Picture = NDArray[np.uint8]

BACKGROUND_PICTURES: Final = 8
"""Pictures of each camera, without a hand, from which its background is learnt: a quarter of a second at 30 Hz, in
which every case of the evaluation shows the background alone."""


class ContourTracker:
    """A `HandFollower` of the evaluation. `finds`: it looks for a hand from the beginning, else from `start` on."""

    def __init__(self, rig: Rig, *, known_size: bool, finds: bool) -> None:
        self._follower = HandFollower(rig, None, known_size=known_size)
        self._finds = finds
        self._empty: list[list[Picture]] = [[] for _ in rig.nodes]
        self._foreground: list[Foreground] = []

    def start(self, pose: HandPose, t_ns: int) -> None:
        """Begin at a pose."""
        self._follower.start(pose, t_ns)
        self._finds = True

    def step(self, images: Sequence[Picture | None], t_ns: Sequence[int]) -> HandState:
        """The hand after one picture of each camera. Raises TrackingError while there is none."""
        if not self._foreground:
            self._learn(images)
            raise TrackingError("the background is being learnt.")
        if not self._finds:
            raise TrackingError("there is no hand in the pictures yet.")
        state = self._follower.step(images, t_ns)
        if not state.tracked:
            raise TrackingError("there is no hand in the pictures.")
        return state

    def _learn(self, images: Sequence[Picture | None]) -> None:
        for kept, image in zip(self._empty, images, strict=True):
            if image is not None:
                kept.append(image)
        if min(len(kept) for kept in self._empty) >= BACKGROUND_PICTURES:
            self._foreground = [learn_background(skin_foreground(), kept) for kept in self._empty]
            self._follower.set_foreground(self._foreground)
