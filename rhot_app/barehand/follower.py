"""Tracks a bare hand from images alone: waits until it takes its start pose, and decides when it is lost."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.key_frames import KeyFrames
from rhot_app.barehand.start import MAJORITY, MIN_DWELL_NS, joints_on_foreground
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, no_hand
from rhot_node.detect.foreground import Foreground, learn_skin

Image = NDArray[np.uint8]

BLIND_NS: Final = 250_000_000
"""ns: after longer without any image the track is lost: a hand at 4 m/s, twice the speed of the fastest motion in
`resources/motions`, may have left the image."""


class HandFollower:
    """One bare hand before the cameras of a rig: start, tracking and loss."""

    def __init__(self, rig: Rig, foreground: Sequence[Foreground] | None, *, known_size: bool,
                 empty_until_ns: int = 0) -> None:
        """`foreground`: each camera's model; None: the colours of skin are learnt from every image until a hand has
        taken the start pose. `empty_until_ns`: master time before which none is expected."""
        self.tracker = BareHandTracker(rig, known_size=known_size, foreground=foreground)
        self.key_frames = KeyFrames(self.tracker.model)
        self.starts = 0
        self.step_s: list[float] = []
        self._learns_skin, self._empty_until_ns = foreground is None, empty_until_ns
        self._learn_next = False
        self._names = tuple(node.name for node in rig.nodes)
        self._following = False
        self._begun_ns: int | None = None
        self._count, self._image_ns = 0, 0

    @property
    def following(self) -> bool:
        """Whether the newest state has a hand."""
        return self._following

    def set_foreground(self, foreground: Sequence[Foreground]) -> None:
        """Use these models of hand and background, one of each camera, and learn no skin any more."""
        self.tracker.foreground, self._learns_skin, self._learn_next = list(foreground), False, False

    def start(self, pose: HandPose, t_ns: int) -> None:
        """Start a track at a pose that somebody has shown (`BareHandTracker.start`)."""
        self._learn_next = self._learns_skin
        self.tracker.start(pose, t_ns)
        self._following, self._image_ns, self._empty_until_ns = True, t_ns, t_ns
        self._started()

    def step(self, images: Sequence[Image | None], t_ns: Sequence[int]) -> HandState:
        """The state after one image (H, W, 3) RGB of each camera, None where it has none, of master times `t_ns`.
        LOST or SEARCHING, without numbers, where no hand is found."""
        begun, following = time.perf_counter(), self._following
        if not following and self._begun_ns is None and not self._begin(images, min(t_ns)):
            return self._none(min(t_ns), begun)
        if self._learn_next:
            self._learn_skin(images)
        state = self.tracker.step(images, t_ns)
        if any(image is not None for image in images):
            good = state.tracked and self._supported() and self._on_foreground(images, state, not following)
            self._image_ns = max(t_ns)
        else:
            good = max(t_ns) - self._image_ns < BLIND_NS
        followed = following
        if self._begun_ns is not None and (not good or min(t_ns) - self._begun_ns >= MIN_DWELL_NS):
            self._begun_ns, followed = None, good and self.tracker.verified(self.tracker.maps_of(images))
        self._following = good and followed
        if not self._following:
            return self._none(min(t_ns), begun)
        if following:
            self.step_s.append(time.perf_counter() - begun)
            self.key_frames.offer(self.tracker)
        else:
            self._started()
        self._count += 1
        return replace(state, sequence=self._count - 1)

    def _started(self) -> None:
        """Count a new track. Its hand may be another one than before, so the key frames begin anew."""
        self.starts += 1
        self._begun_ns = None
        self.key_frames.clear()

    def _begin(self, images: Sequence[Image | None], t_ns: int) -> bool:
        """Whether a hand has taken the start pose in these images."""
        if any(image is None for image in images) or t_ns < self._empty_until_ns:
            return False
        if self._learns_skin:
            self._learn_skin(images)
        if not self.tracker.begin(images, t_ns):
            return False
        self._begun_ns = t_ns
        return True

    def _learn_skin(self, images: Sequence[Image | None]) -> None:
        """Learn the colours of skin from each image; a camera without one keeps what it has."""
        self._learn_next = False
        self.tracker.foreground = [before if image is None else learn_skin(image)
                                   for image, before in zip(images, self.tracker.foreground, strict=True)]

    def _supported(self) -> bool:
        """Whether most of the expected contour is found in the last images."""
        found, expected = self.tracker.slice_counts.sum(axis=(0, 1))
        return bool(found > MAJORITY * expected)

    def _on_foreground(self, images: Sequence[Image | None], state: HandState, whole: bool) -> bool:
        """Whether most joints lie on foreground in every image in which most of them are. At least one camera must have
        such an image; with `whole`, every camera. Cameras with an uninformative foreground are not asked about it."""
        mostly_inside = []
        for camera, one, model in zip(self.tracker.cameras, self.tracker.maps_of(images), self.tracker.foreground,
                                      strict=True):
            if one is not None:
                inside, share = joints_on_foreground(camera, state.joint_positions, one)
                mostly_inside.append(inside > MAJORITY)
                if mostly_inside[-1] and model.informative and share <= MAJORITY:
                    return False
        return all(mostly_inside) if whole else any(mostly_inside)

    def _none(self, t_ns: int, begun: float) -> HandState:
        self._count += 1
        state = no_hand(t_ns, Condition.LOST if self.starts else Condition.SEARCHING, self._names,
                        time.perf_counter() - begun)
        return replace(state, sequence=self._count - 1)
