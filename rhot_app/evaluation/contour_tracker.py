"""The contour trackers as a user runs them, offline and live: they learn the background of the first pictures, then
wait for a hand that takes the start pose."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import TrackingError
from rhot_app.evaluation.searched_nodes import FIRST_NS, SearchedNodes
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig, TrackerSettings
from rhot_app.state import HandState
from rhot_app.tracking.contours.follower import HandFollower
from rhot_app.tracking.scene import make_tracker
from rhot_node.detect.foreground import Foreground, learn_background, skin_foreground

Picture = NDArray[np.uint8]

BACKGROUND_PICTURES: Final = 8
"""Pictures of each camera, without a hand, from which its background is learnt: a quarter of a second at 30 Hz, in
which every case of the evaluation shows the background alone."""


class ContourTracker:
    """A `HandFollower` of the evaluation. `waits`: it waits for a hand from the beginning, else from `start` on."""

    def __init__(self, rig: Rig, *, known_size: bool, waits: bool) -> None:
        self._rig, self._known_size, self._empty_until_ns = rig, known_size, 0 if waits else sys.maxsize
        self._background = _Background(len(rig.nodes))
        self._follower: HandFollower | None = None

    def start(self, pose: HandPose, t_ns: int) -> None:
        """Begin at a pose, with a background that has been learnt."""
        assert self._follower is not None
        self._follower.follow(pose, t_ns)

    def step(self, images: Sequence[Picture | None], t_ns: Sequence[int]) -> HandState:
        """The hand after one picture of each camera. Raises TrackingError while there is none."""
        if self._follower is None:
            foreground = self._background.learnt_from(images)
            self._follower = HandFollower(self._rig, foreground, known_size=self._known_size,
                                          empty_until_ns=self._empty_until_ns)
            raise TrackingError("the background has been learnt.")
        return _tracked(self._follower.step(images, t_ns))


class LiveContourTracker:
    """A live `ContourEstimator` with nodes that search the pictures for it. It waits for a hand from the beginning. Its
    searches take no time: they are waited for, so that a run can be repeated."""

    def __init__(self, rig: Rig, *, known_size: bool) -> None:
        """Raises RigError."""
        settings = TrackerSettings("estimator", observe="contours", float_scale=not known_size,
                                   start_poses=rig.tracker.start_poses)
        self._rig = msgspec.structs.replace(rig, tracker=settings)
        self._background = _Background(len(rig.nodes))
        self._nodes: SearchedNodes | None = None

    def step(self, images: Sequence[Picture | None], t_ns: Sequence[int]) -> HandState:
        """The newest state after one picture of each camera. Raises TrackingError while there is none."""
        if self._nodes is None:
            foreground = self._background.learnt_from(images)
            self._nodes = SearchedNodes(make_tracker(self._rig), foreground, len(self._rig.markers.ids))
            raise TrackingError("the background has been learnt.")
        self._nodes.step(0, images, times_ns=[FIRST_NS + one for one in t_ns])
        if not self._nodes.states:
            raise TrackingError("there is no state yet.")
        state = _tracked(self._nodes.states[-1])
        return replace(state, t_master_ns=state.t_master_ns - FIRST_NS)


class _Background:
    """Learns each camera's background of its first pictures."""

    def __init__(self, cameras: int) -> None:
        self._empty: list[list[Picture]] = [[] for _ in range(cameras)]

    def learnt_from(self, images: Sequence[Picture | None]) -> list[Foreground]:
        """Take one more picture of each camera, and return their foreground models. Raises TrackingError while a camera
        has fewer than BACKGROUND_PICTURES."""
        for kept, image in zip(self._empty, images, strict=True):
            if image is not None:
                kept.append(image)
        if min(len(kept) for kept in self._empty) < BACKGROUND_PICTURES:
            raise TrackingError("the background is being learnt.")
        return [learn_background(skin_foreground(), kept) for kept in self._empty]


def _tracked(state: HandState) -> HandState:
    if not state.tracked:
        raise TrackingError("there is no hand in the pictures.")
    return state
