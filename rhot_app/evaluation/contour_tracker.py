"""The contour trackers as a user runs them, offline and live: they learn the background of the first pictures, then
wait for a hand that takes the start pose.

`SearchedNodes` search pictures for a tracker, as `rhot_node.slice_search` does, without sockets and processes.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, SliceRequest
from rhot_app.errors import TrackingError
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig, TrackerSettings
from rhot_app.state import HandState
from rhot_app.tracking.contours.follower import HandFollower
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraFrame, CameraObservations, Tracker, may_be_due
from rhot_node.detect.edges import find_edges, noise_of
from rhot_node.detect.foreground import Foreground, foreground_map, learn_background, skin_foreground
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

PERIOD_NS: Final = 33_333_333
FIRST_NS: Final = 10**9

AGE_NS: Final = 9_000_000
"""ns from a frame's exposure to its arrival: what a node without load needs for detection and network."""


class SearchedNodes:
    """Hands the frames of some cameras to a tracker, and does what it asks for. Searches beside the frames are waited
    for, so that a run can be repeated; `states` are those that came of it."""

    def __init__(self, tracker: Tracker, foreground: Sequence[Foreground], markers: int, *,
                 forget: bool = False) -> None:
        """`foreground`: what each camera has learnt. `markers`: of the rig's set. `forget`: requests are given back as
        a log has them."""
        tracker.warm_up()
        self.tracker, self.foreground, self.markers, self.forget = tracker, list(foreground), markers, forget
        self.asked: list[SliceRequest | None] = [None] * len(foreground)
        self.states: list[HandState] = []

    def step(self, number: int, images: Sequence[Picture | None], pixels: Sequence[Array] | None = None,
             seen: Sequence[CameraObservations] | None = None, times_ns: Sequence[int] | None = None) -> None:
        """Frame `number` of each camera, RGB, None of one that gives none; `pixels` (M, 2) of its markers, or all that
        is `seen` of them at another time. `times_ns`: the frames' own, of all rows at once; PERIOD_NS apart by
        default."""
        for camera, image in enumerate(images):
            t_ns = FIRST_NS + number * PERIOD_NS if times_ns is None else times_ns[camera]
            if image is None:
                continue
            request, known = self.asked[camera], self.foreground[camera]
            if seen is not None:
                self.give(replace(seen[camera], t_row0_master_ns=t_ns, t_receive_ns=t_ns + AGE_NS))
            else:
                self.give(observations_at(camera, t_ns, np.full((self.markers, 2), np.nan) if pixels is None
                                          else pixels[camera]))
            if request is None:
                continue
            if len(request.slices):
                found = find_edges(image, request.slices, known, noise_of(image))
                answered = replace(request, expected=None) if self.forget else request
                self.give(EdgeFrame(camera, t_ns, 0, t_ns + AGE_NS, 0.004, 0.001, answered, found))
            if request.map_step:
                self.give(ForegroundFrame(camera, t_ns, 0, t_ns + AGE_NS, request.map_step,
                                          foreground_map(image, known, request.map_step)))

    def give(self, frame: CameraFrame) -> None:
        """Hand one frame to the tracker, keep its state if one is due, and note what it asks for."""
        self.tracker.ingest(frame)
        self.tracker.wait()
        state = next(self.tracker.states(), None) if may_be_due(frame) else None
        if state is not None:
            self.states.append(state)
        for request in self.tracker.requests():
            self.asked[request.camera] = request


def observations_at(camera: int, t_ns: int, pixels: Array) -> CameraObservations:
    """Markers at `pixels` (M, 2), NaN for lost."""
    count = len(pixels)
    return CameraObservations(
        camera, t_ns, 0, 1e-4, t_ns + AGE_NS, 0.004, 0.001, pixels, np.tile(0.01 * np.eye(2), (count, 1, 1)),
        np.full(count, 12.0), np.ones(count), np.where(np.isnan(pixels[:, 0]), MarkerFlag.LOST, 0).astype(np.uint16))


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
