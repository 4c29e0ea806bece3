"""What the nodes are asked to search, and the contours that their answers show: slices lie across the contours of the
hand as it is predicted for each camera's next frame."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import STEP_M, ContourPoints
from rhot_app.barehand.observations import EdgeFrame, SliceRequest
from rhot_app.barehand.start import STEP
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.hand.motion.hand_process import MOTION
from rhot_app.tracking.contours.occlusion import Capsules, visible
from rhot_app.tracking.markers.estimator import WRONG_AFTER_PERIODS
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.detect.edges import Edges
from rhot_node.wire.slices import SLICES_MAX, pack_slices, unpack_slices

Array = NDArray[np.float64]

JUMP_NS = 1_000_000_000
"""ns: frames farther apart are of different sessions."""

NEVER = -(1 << 62)
"""ns: the time of what has not been."""

RENEW_NS = 300_000_000
"""A node that is asked for a map alone is asked again after this long: three times before its request ends."""

ALIKE = 0.9
"""Cosine of the largest angle between a recorded slice and the normal of the contour on it, 26 degrees. Chosen: a slice
that is more oblique is a tenth longer than the way across the contour."""

BESIDE_PX = 2.0
"""px: a recorded slice crosses the contour if one of its points is no farther beyond the slice's end: the points are
half of STEP_M apart, 2 mm, which is about as many pixels."""

_PERIOD_S = 1.0 / 30.0  # of a camera of which one frame has come


@dataclass(slots=True)
class CameraFrames:
    """When the frames of one camera come, and what its node was asked of them. `period_ns`: between them; `target_ns`:
    the frame that was asked about last; `asked_ns`: when a map was asked for; `answered_ns`: the newest frame whose
    edges came; `searched`: the next edges are of the hand, which is in its image.
    """

    newest: CameraObservations | None = None
    period_ns: float = 1e9 * _PERIOD_S
    target_ns: int = NEVER
    asked_ns: int = NEVER
    answered_ns: int = NEVER
    searched: bool = False

    def take(self, frame: CameraObservations) -> None:
        """Note one frame."""
        since_ns = 0 if self.newest is None else frame.t_row0_master_ns - self.newest.t_row0_master_ns
        if 0 < since_ns < JUMP_NS:
            self.period_ns += 0.1 * (since_ns - self.period_ns)
        self.newest = frame

    def delivers(self, t_ns: int) -> bool:
        """Whether frames come from it about `t_ns`."""
        return (self.newest is not None
                and abs(t_ns - self.newest.t_row0_master_ns) < WRONG_AFTER_PERIODS * self.period_ns)

    def answers(self, t_ns: int) -> bool:
        """Whether edges of the hand come about `t_ns`, so that they are worth waiting for."""
        return self.searched and t_ns - self.answered_ns < WRONG_AFTER_PERIODS * self.period_ns

    def overdue(self, t_ns: int) -> bool:
        """Whether edges were asked for that have not come by a frame at `t_ns`."""
        return t_ns - self.target_ns > 1.5 * self.period_ns


class _Expected(NamedTuple):
    """The contour that a request is about, of the hand where it was found or moved to as `place`."""

    place: object
    contour: ContourFrame


class Requests:
    """Requests about one hand; `cameras`: when the frames of each come."""

    def __init__(self, hand: BareHandTracker, predict: Callable[[int], tuple[Array, Array]],
                 beside: Callable[[int], Capsules | None], most: int = SLICES_MAX) -> None:
        """`predict`: the hand's state and covariance at a master time, ns; `beside`: another hand then, which may hide
        this one. `most`: slices of one request."""
        self.cameras = [CameraFrames() for _ in hand.cameras]
        self._hand, self._predict, self._beside, self._most = hand, predict, beside, most
        self._requests: list[SliceRequest] = []
        self._place = object()

    def take(self) -> list[SliceRequest]:
        """The requests since the last call, the newest of each camera."""
        found, self._requests = self._requests, []
        return found

    def look(self, frame: CameraObservations) -> None:
        """Have the node send foreground maps."""
        camera = self.cameras[frame.camera]
        if not 0 <= frame.t_row0_master_ns - camera.asked_ns < RENEW_NS:
            camera.asked_ns = frame.t_row0_master_ns
            self._requests.append(SliceRequest(frame.camera, np.empty((0, 5)), STEP))

    def begin(self, t_ns: int) -> None:
        """The hand was found at `t_ns`: have all nodes search from now on, and wait for all of them."""
        self._place = object()
        for number, camera in enumerate(self.cameras):
            if camera.newest is not None:
                camera.answered_ns = camera.newest.t_row0_master_ns
                self.ask(number, max(camera.newest.t_row0_master_ns, t_ns))

    def renew(self) -> None:
        """The hand was moved: have all nodes search there."""
        self._place = object()
        for number, camera in enumerate(self.cameras):
            if camera.newest is not None:
                self.ask(number, camera.newest.t_row0_master_ns)

    def give_up(self) -> None:
        """There is no hand: no edges are waited for."""
        for camera in self.cameras:
            camera.asked_ns = camera.answered_ns = NEVER

    def ask(self, number: int, t_row0_ns: int) -> None:
        """Have the node search the frame after the one at `t_row0_ns`, where the hand will be then."""
        camera = self.cameras[number]
        camera.target_ns = t_row0_ns + round(camera.period_ns)
        t_ns = camera.target_ns + self._middle_ns(number)
        contour = asked(self._hand, number, *self._predict(t_ns), STEP_M, self._beside(t_ns), self._most)
        camera.searched = len(contour.slices) > 0
        self._requests = [one for one in self._requests if one.camera != number]
        self._requests.append(SliceRequest(number, contour.slices, STEP, _Expected(self._place, contour)))

    def contour(self, frame: EdgeFrame) -> ContourFrame | None:
        """The contour on the slices that were searched, with their edges: as it was expected, or in a log as it is now.
        None without any; the camera is then not waited for. None, too, when they were asked for before the hand was
        found or moved: where it was not, other edges would be taken for its."""
        expected = frame.request.expected
        if isinstance(expected, _Expected) and expected.place is not self._place:
            return None
        camera, contour = self.cameras[frame.camera], self._searched(frame)
        camera.searched = contour is not None
        if contour is not None:
            camera.answered_ns = frame.t_row0_master_ns
        return contour

    def _searched(self, frame: EdgeFrame) -> ContourFrame | None:
        expected = frame.request.expected
        if isinstance(expected, _Expected):
            contour = copy.copy(expected.contour)  # for this frame
            contour.observe(frame.edges)
            return contour
        t_ns = frame.t_row0_master_ns + self._middle_ns(frame.camera)
        return matched(self._hand, frame, *self._predict(t_ns), self._beside(t_ns))

    def _middle_ns(self, camera: int) -> int:
        """From the exposure of row 0 to that of the middle row, ns."""
        return round(0.5e9 * self._hand.row_s[camera] * self._hand.cameras[camera].height)


def asked(hand: BareHandTracker, camera: int, state: Array, covariance: Array, step_m: float,
          beside: Capsules | None = None, most: int = SLICES_MAX) -> ContourFrame:
    """The slices across the contours of a hand in `state`, whose centres lie in the image, rounded as they are sent; of
    more than `most`, every second or third. Those that a hand `beside` it hides are left out."""
    frame, model = hand.expected_contour(camera, state, covariance, step_m), hand.cameras[camera]
    x, y = frame.slices[:, 0], frame.slices[:, 1]
    good = (x >= 0.0) & (y >= 0.0) & (x <= model.width - 1) & (y <= model.height - 1)
    if beside is not None:
        good &= visible(hand, frame, model, state, beside)
    kept = np.flatnonzero(good)
    kept = kept[::max(math.ceil(len(kept) / most), 1)]
    return _on(hand, camera, frame, kept, unpack_slices(pack_slices(frame.slices[kept])))


def matched(hand: BareHandTracker, frame: EdgeFrame, state: Array, covariance: Array,
            beside: Capsules | None = None) -> ContourFrame | None:
    """The contour of a hand in `state` on the slices of a recorded request that cross it, with their edges; the frame
    stays as it is. None without any. `beside`: as of `asked`."""
    expected, slices = hand.expected_contour(frame.camera, state, covariance, 0.5 * STEP_M), frame.request.slices
    if not len(expected.slices) or not len(slices):
        return None
    apart = slices[:, None, :2] - expected.pixel[None]
    distance = np.hypot(*apart.transpose(2, 0, 1))
    distance += np.where(slices[:, 2:4] @ expected.normal.T < ALIKE, 1e6, 0.0)
    if beside is not None:
        distance += np.where(visible(hand, expected, hand.cameras[frame.camera], state, beside), 0.0, 1e6)
    nearest = np.argmin(distance, axis=1)
    order = np.argsort(expected.points.capsule[nearest], kind="stable")
    reach = distance[np.arange(len(slices)), nearest]
    order = order[(reach < slices[:, 4] + BESIDE_PX)[order]]
    if not len(order):
        return None
    contour = _on(hand, frame.camera, expected, nearest[order], slices[order])
    contour.observe(Edges(*(column[order] for column in frame.edges)))
    return contour


def _on(hand: BareHandTracker, camera: int, frame: ContourFrame, chosen: NDArray[np.int64],
        slices: Array) -> ContourFrame:
    """The frame with the chosen points on other slices."""
    p = frame.points
    points = ContourPoints(p.capsule[chosen], p.kind[chosen], p.along[chosen], p.behind[chosen], p.pixel[chosen],
                           p.normal[chosen], p.scale[chosen])
    return ContourFrame(hand.surface, points, frame.pose, frame.intrinsics, slices, frame.expected_sd[chosen],
                        frame.late_s[chosen], MOTION, frame.repeated)
