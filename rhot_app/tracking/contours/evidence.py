"""Whether the cameras show the hand that is followed: its contour found, its joints on foreground, and nothing that
contradicts it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import SILHOUETTE
from rhot_app.barehand.follower import MAJORITY
from rhot_app.barehand.joints import place_joints
from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame
from rhot_app.barehand.relocalisation import SAME_HAND_M, SAME_POSE_M
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import HandPose
from rhot_app.state import SeenContour
from rhot_app.tracking.contours.requests import NEVER, CameraFrames
from rhot_app.tracking.markers.estimator import LOST_AFTER_NS, LOST_AFTER_PERIODS, WRONG_AFTER_NS, WRONG_AFTER_PERIODS

Array = NDArray[np.float64]

NEAR_SD = 3.0
"""Standard deviations from the contour within which an edge is shown as the hand's."""


@dataclass(slots=True)
class _Shown:
    """What one camera has shown. `searched_ns`, `mapped_ns`: its newest frame whose edges and whose foreground came;
    `supported_ns`, `covered_ns`: the newest of these that showed the contour of the hand where it is estimated, and
    foreground there; `whole`: most of the hand lies in its image.
    """

    supported_ns: int = NEVER
    covered_ns: int = NEVER
    searched_ns: int = NEVER
    mapped_ns: int = NEVER
    whole: bool = False

    @property
    def seen_ns(self) -> int:
        """When it last showed the hand. Edges and foreground of one frame come apart."""
        return min(self.supported_ns, self.covered_ns)

    @property
    def judged_ns(self) -> int:
        """Until when it could have shown the hand."""
        return min(self.searched_ns, self.mapped_ns)


class Evidence:
    """What the cameras show of one hand. `confirmed`: it was found twice; `seen_ns`: when all cameras that should show
    it last did, master ns. Until it is confirmed, all should; then those in whose images most of it lies."""

    def __init__(self, hand: BareHandTracker, cameras: Sequence[CameraFrames]) -> None:
        self._hand, self._cameras = hand, cameras
        self.begin(NEVER)

    def begin(self, t_ns: int) -> None:
        """A hand was found at `t_ns`."""
        self.confirmed = False
        self._shown = [_Shown() for _ in self._cameras]
        self.seen_ns, self._judged_ns = t_ns, NEVER

    def take_edges(self, weighed: Iterable[tuple[EdgeFrame, ContourFrame]]) -> None:
        """The edges of some frames have been weighed."""
        for frame, contour in weighed:
            camera, counts = self._shown[frame.camera], contour.slice_counts.sum(axis=0)
            camera.searched_ns = frame.t_row0_master_ns
            if counts[0] > MAJORITY * counts[1]:
                camera.supported_ns = frame.t_row0_master_ns
        self._note()

    def take_map(self, frame: ForegroundFrame, state: Array) -> None:
        """See whether the hand, in `state` then, lies on foreground in one frame."""
        camera = self._shown[frame.camera]
        inside, share = on_foreground(self._hand, frame, state)
        camera.whole = inside > MAJORITY
        camera.mapped_ns = frame.t_row0_master_ns
        if share > MAJORITY and (self.confirmed or camera.whole):
            camera.covered_ns = frame.t_row0_master_ns
        self._note()

    def lost(self, t_ns: int) -> bool:
        """Whether no camera has shown the hand for too long, or the images of one contradict it. One that is not
        confirmed is given more time."""
        period_ns = min(camera.period_ns for camera in self._cameras)
        silent_ns = max(LOST_AFTER_NS, 2 * LOST_AFTER_PERIODS * period_ns)
        wrong_ns = max(WRONG_AFTER_NS, WRONG_AFTER_PERIODS * period_ns) if self.confirmed else silent_ns
        return bool(t_ns - self.seen_ns > silent_ns + 2 * period_ns or self._judged_ns - self.seen_ns > wrong_ns)

    def _note(self) -> None:
        """Note when all cameras that should show the hand last did, and until when they could have. The others say
        nothing: it may be there or not."""
        newest_ns = max(max(one.searched_ns, one.mapped_ns) for one in self._shown)
        judging = [one for one, camera in zip(self._shown, self._cameras, strict=True)
                   if (one.whole or not self.confirmed) and camera.delivers(newest_ns)]
        if any(one.whole for one in judging):
            self.seen_ns = max(self.seen_ns, min(one.seen_ns for one in judging))
        self._judged_ns = min((one.judged_ns for one in judging), default=NEVER)


def on_foreground(hand: BareHandTracker, frame: ForegroundFrame, state: Array) -> tuple[float, float]:
    """Part of the 21 joints of a hand in `state` that lie in a camera's image where anything is known of it, and of
    these, that lie on foreground."""
    camera = hand.cameras[frame.camera]
    places = camera.project(joints_of(hand, state))
    with np.errstate(invalid="ignore"):
        inside = np.all((places > -0.5) & (places < [camera.width - 0.5, camera.height - 0.5]), axis=1)
    rows, columns = frame.probability.shape
    x, y = (places[inside] // frame.step).astype(int).T
    shown = frame.probability[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)]
    shown = shown[~np.isnan(shown)]
    return len(shown) / len(places), float(np.mean(shown > 0.5)) if len(shown) else 0.0


def same_hand(hand: BareHandTracker, state: Array, pose: HandPose) -> bool:
    """Whether the hand in `state` is the one in `pose`, whose fingers are the same and which is not far away."""
    ours, theirs = joints_of(hand, state), forward(hand.model, pose).joints
    ours_centre, theirs_centre = ours.mean(axis=0), theirs.mean(axis=0)
    shape = np.linalg.norm((ours - ours_centre) - (theirs - theirs_centre), axis=1)
    return bool(np.mean(shape) < SAME_POSE_M and np.linalg.norm(ours_centre - theirs_centre) < SAME_HAND_M)


def joints_of(hand: BareHandTracker, state: Array) -> Array:
    """(21, 3) m of a hand in `state`."""
    points, covariances, motion = np.empty((26, 3)), np.empty((26, 3, 3)), np.empty((2, 21))
    place_joints(state, np.zeros((len(hand.process.stationary),) * 2), hand.model.dh, hand.surface.bone, points,
                 covariances, motion)
    return points[:21]


def seen_contour(camera: str, t_ns: int, frame: ContourFrame, state: Array) -> SeenContour:
    """What one image shows of a hand in `state`."""
    offset, _, good = frame.predict(state)
    centre, normal, half = frame.slices[:, :2], frame.slices[:, 2:4], frame.slices[:, 4:]
    ends = np.hstack([centre - half * normal, centre + half * normal])
    places, near = np.empty((0, 2)), np.empty(0, np.bool_)
    if frame.edges is not None:
        edges = frame.edges
        row, column = np.nonzero((np.arange(edges.offset.shape[1]) < edges.number[:, None]) & good[:, None])
        along = edges.offset[row, column]
        places = centre[row] + along[:, None] * normal[row]
        near = np.abs(along - offset[row]) < NEAR_SD * np.hypot(frame.expected_sd[row], edges.sd[row, column])
    return SeenContour(camera, t_ns, (centre + offset[:, None] * normal)[good], frame.points.behind[good] == SILHOUETTE,
                       ends[good], places, near)
