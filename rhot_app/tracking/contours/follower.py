"""The bare hand in recorded images: tracked as live, but every update searches the images itself, as often as it needs.

A node searches its next image where the hand is predicted, once. Images that are at hand are searched anew about each
better estimate, and about a better pose of the foreground (`BareHandTracker.update`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, no_hand
from rhot_app.tracking.contours.finder import Maps
from rhot_app.tracking.contours.tracker import ContourEstimator
from rhot_node.detect.foreground import Foreground, learn_skin, no_foreground

Image = NDArray[np.uint8]


class HandFollower(ContourEstimator):
    """One bare hand before the cameras of a rig: start, tracking and loss. `step_s`: times that the tracked steps
    took."""

    def __init__(self, rig: Rig, foreground: Sequence[Foreground] | None, *, known_size: bool,
                 empty_until_ns: int = 0, period_ns: int | None = None) -> None:
        """`foreground`: each camera's model; None: the colours of skin are learnt from every image until there is a
        track. `empty_until_ns`: master time before which no hand is expected. `period_ns`: between two images, if it
        is known."""
        self._period_ns = period_ns
        settings = msgspec.structs.replace(rig.tracker, kind="estimator", observe="contours",
                                          float_scale=not known_size)
        super().__init__(msgspec.structs.replace(rig, tracker=settings))
        self.step_s: list[float] = []
        self._learns_skin, self._empty_until_ns = foreground is None, empty_until_ns
        self._hand.foreground = [no_foreground() for _ in rig.nodes] if foreground is None else list(foreground)

    def _clear(self) -> None:
        super()._clear()
        for camera in self._cameras:
            camera.period_ns = self._period_ns or camera.period_ns

    def follow(self, pose: HandPose, t_ns: int) -> None:
        """Start a confirmed track at a pose that somebody has shown (`BareHandTracker.start`)."""
        self.start(pose, t_ns)
        self.confirm()
        self._empty_until_ns = t_ns

    def step(self, images: Sequence[Image | None], t_ns: Sequence[int]) -> HandState:
        """The state after one image (H, W, 3) RGB of each camera, None where it has none, of master times `t_ns`.
        LOST or SEARCHING, without numbers, where no hand is found."""
        begun, confirmed = time.perf_counter(), self.confirmed
        for camera, image in enumerate(images):
            if image is not None:
                self._advance(camera, t_ns[camera])
        if self._learns_skin and (not self._tracking or self._hand.starting):
            self._hand.foreground = [before if image is None else learn_skin(image)
                                     for image, before in zip(images, self._hand.foreground, strict=True)]
        maps = self._hand.maps_of(images)
        if not self._tracking and min(t_ns) >= self._empty_until_ns and all(image is not None for image in images):
            pose = self._hand.taken(maps)
            if pose is not None:
                self.start(pose, min(t_ns))
        state = self._search(images, t_ns, maps) if self._tracking else None
        if confirmed and self.confirmed:
            self.step_s.append(time.perf_counter() - begun)
        self._sequence += 1
        if state is None or not self.confirmed:
            state = no_hand(min(t_ns), Condition.LOST if self.starts else Condition.SEARCHING, self._names,
                            time.perf_counter() - begun)
        return replace(state, sequence=self._sequence - 1)

    def _search(self, images: Sequence[Image | None], t_ns: Sequence[int],
                maps: list[NDArray[np.float32] | None]) -> HandState | None:
        """Update by the edges in the images, and check the track; None when they contradict it."""
        if self._evidence.lost(max(t_ns)):
            self.drop_track()
            return None
        try:
            state = self._hand.step(images, t_ns)
        except np.linalg.LinAlgError:  # the edges contradict the estimate
            self.drop_track()
            return None
        for camera, (frame, probability) in enumerate(zip(self._hand.frames, maps, strict=True)):
            if frame is not None and probability is not None:
                self._evidence.take_contour(camera, t_ns[camera], frame)
                self._evidence.take_map(camera, t_ns[camera], probability, self.state_at(t_ns[camera]))
        if self.confirmed:
            self.key_frames.offer(self._hand)
        elif self._evidence.observed_ns < min(t_ns):  # not the pose that is shown: look again in the next images
            self.drop_track()
        else:
            self._check(Maps(max(t_ns), maps))
        return state
