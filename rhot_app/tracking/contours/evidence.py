"""Whether the cameras observe the tracked hand: most of its contour is found, and most of its joints lie on
foreground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.joints import points_in
from rhot_app.barehand.start import MAJORITY, joints_on_foreground
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.estimation.track import LOST_NS, LOST_PERIODS, NEVER, WRONG_NS, WRONG_PERIODS
from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import JOINTS, HandPose
from rhot_app.tracking.contours.requests import CameraFrames

Array = NDArray[np.float64]

SAME_POSE_M = 0.02
"""m: joints of one pose are nearer to each other, in the mean or at most; beyond, a finger is taken for another one.
Neighbouring knuckles are so far apart in the hand files."""

SAME_HAND_M = 0.1
"""m: palms of one hand are nearer to each other: a hand's breadth."""


@dataclass(slots=True)
class _CameraEvidence:
    """The observations of one camera, by the master times of its frames. `searched_ns`, `mapped_ns`: the newest frame
    with edges, and with foreground. `supported_ns`, `covered_ns`: the newest one of each that agrees with the estimated
    hand. `whole`: most of the hand lies in the image.
    """

    supported_ns: int = NEVER
    covered_ns: int = NEVER
    searched_ns: int = NEVER
    mapped_ns: int = NEVER
    whole: bool = False

    @property
    def observed_ns(self) -> int:
        """Newest time at which it observed the hand. Edges and foreground of one frame arrive separately."""
        return min(self.supported_ns, self.covered_ns)

    @property
    def checked_ns(self) -> int:
        """Newest time at which both edges and foreground are known."""
        return min(self.searched_ns, self.mapped_ns)


class Evidence:
    """The observations of one tracked hand. `confirmed`: it has held its start pose, or markers show it. `observed_ns`:
    newest master time at which all cameras that should observe it did: all of them until it is confirmed, then those in
    whose images most of it lies."""

    def __init__(self, hand: BareHandTracker, cameras: Sequence[CameraFrames]) -> None:
        self._hand, self._cameras = hand, cameras
        self.start(NEVER)

    def start(self, t_ns: int) -> None:
        """Start with a track of master time `t_ns`."""
        self.confirmed = False
        self._of_camera = [_CameraEvidence() for _ in self._cameras]
        self.observed_ns, self._checked_ns = t_ns, NEVER

    def take_contour(self, camera: int, t_ns: int, contour: ContourFrame) -> None:
        """Take the contour in one camera's frame of `t_ns`, after the update by its edges."""
        own, (found, expected) = self._of_camera[camera], contour.slice_counts.sum(axis=0)
        own.searched_ns = t_ns
        if found > MAJORITY * expected:
            own.supported_ns = t_ns
        self._update()

    def take_map(self, camera: int, t_ns: int, probability: NDArray[np.float32], state: Array) -> None:
        """Take the foreground `probability` (h, w) in one camera's frame of `t_ns`, where the hand is in `state`."""
        own = self._of_camera[camera]
        inside, share = joints_on_foreground(self._hand.cameras[camera], joints_of(self._hand, state), probability)
        own.whole = inside > MAJORITY
        own.mapped_ns = t_ns
        if share > MAJORITY and (self.confirmed or own.whole):
            own.covered_ns = t_ns
        self._update()

    def lost(self, t_ns: int) -> bool:
        """Whether the track is lost at `t_ns`: no camera has observed the hand for too long, or one contradicts it. The
        limit is longer until it is confirmed."""
        period_ns = min(camera.period_ns for camera in self._cameras)
        silent_ns = max(LOST_NS, 2 * LOST_PERIODS * period_ns)
        wrong_ns = max(WRONG_NS, WRONG_PERIODS * period_ns) if self.confirmed else silent_ns
        return bool(t_ns - self.observed_ns > silent_ns + 2 * period_ns
                    or self._checked_ns - self.observed_ns > wrong_ns)

    def _update(self) -> None:
        """Update `observed_ns` and `_checked_ns` by the cameras that should observe the hand. The others have no
        information: it may be there or not."""
        newest_ns = max(max(one.searched_ns, one.mapped_ns) for one in self._of_camera)
        observing = [one for one, camera in zip(self._of_camera, self._cameras, strict=True)
                   if (one.whole or not self.confirmed) and camera.delivers(newest_ns)]
        if any(one.whole for one in observing):
            self.observed_ns = max(self.observed_ns, min(one.observed_ns for one in observing))
        self._checked_ns = min((one.checked_ns for one in observing), default=NEVER)


def same_hand(hand: BareHandTracker, state: Array, pose: HandPose) -> bool:
    """Whether the hands in `state` and in `pose` agree: SAME_POSE_M in shape, SAME_HAND_M in position."""
    ours, theirs = joints_of(hand, state), forward(hand.model, pose).joints
    ours_centre, theirs_centre = ours.mean(axis=0), theirs.mean(axis=0)
    shape = np.linalg.norm((ours - ours_centre) - (theirs - theirs_centre), axis=1)
    return bool(np.mean(shape) < SAME_POSE_M and np.linalg.norm(ours_centre - theirs_centre) < SAME_HAND_M)


def joints_of(hand: BareHandTracker, state: Array) -> Array:
    """(21, 3) m, world: the joints of a hand in `state`."""
    return np.asarray(points_in(hand.model.dh, hand.surface.bone, state)[0][:len(JOINTS)])
