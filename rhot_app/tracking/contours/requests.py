"""Requests to the nodes, and the contours of their answers. The requested slices lie across the contours of the hand
that is predicted for each camera's next frame."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import STEP_M
from rhot_app.barehand.observations import EdgeFrame, SliceRequest
from rhot_app.barehand.silhouette import STEP
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.estimation.track import NEVER, SESSION_NS, WRONG_PERIODS
from rhot_app.tracking.contours.occlusion import Capsules, visible
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.detect.edges import Edges
from rhot_node.wire.search import SLICES_MAX, pack_slices, unpack_slices

Array = NDArray[np.float64]

RENEW_NS = 300_000_000
"""ns: interval of the requests for a map alone: a node gets three before the first one expires."""

MIN_COSINE = 0.9
"""Cosine of the largest angle between a recorded slice and the contour's normal, 26 degrees. Chosen: an error across
the contour is then a tenth longer along the slice."""

MATCH_PX = 2.0
"""px: largest distance from a recorded slice's end to a point of the contour that it crosses. The points are half of
STEP_M apart, 2 mm, which is about as many pixels."""

_PERIOD_S = 1.0 / 30.0  # assumed of a camera until its second frame


@dataclass(slots=True)
class CameraFrames:
    """The times of one camera's frames and requests, master ns. `newest`: what its node reported last of markers.
    `newest_ns`: its newest frame. `period_ns`: between two frames. `target_ns`: the frame of the last request for
    slices. `map_requested_ns`: the last request for a map alone. `answered_ns`: the newest frame with edges.
    `has_slices`: the last request or answer has slices, because the hand is in the image.
    """

    newest: CameraObservations | None = None
    newest_ns: int = NEVER
    period_ns: float = 1e9 * _PERIOD_S
    target_ns: int = NEVER
    map_requested_ns: int = NEVER
    answered_ns: int = NEVER
    has_slices: bool = False

    def take(self, t_ns: int) -> None:
        """Take the time of one frame."""
        since_ns = t_ns - self.newest_ns
        if 0 < since_ns < SESSION_NS:
            self.period_ns += 0.1 * (since_ns - self.period_ns)
        self.newest_ns = t_ns

    def delivers(self, t_ns: int) -> bool:
        """Whether the camera delivers frames about `t_ns`."""
        return abs(t_ns - self.newest_ns) < WRONG_PERIODS * self.period_ns

    def returns_edges(self, t_ns: int) -> bool:
        """Whether edges of the hand about `t_ns` can be expected from the camera."""
        return self.has_slices and t_ns - self.answered_ns < WRONG_PERIODS * self.period_ns

    def overdue(self, t_ns: int) -> bool:
        """Whether the requested edges are missing at a frame of `t_ns`."""
        return t_ns - self.target_ns > 1.5 * self.period_ns


class _Expected(NamedTuple):
    """The contour of a request. `version`: of the track; each start and each relocalisation makes a new one."""

    version: object
    contour: ContourFrame


class Requests:
    """Requests for one hand. `cameras`: the times of each camera's frames."""

    def __init__(self, hand: BareHandTracker, predict: Callable[[int], tuple[Array, Array]],
                 occluder: Callable[[int], Capsules | None], max_slices: int = SLICES_MAX) -> None:
        """`predict`: the hand's state and covariance at a master time, ns. `occluder`: the other hand at that time,
        None without one. `max_slices`: of one request."""
        self.cameras = [CameraFrames() for _ in hand.cameras]
        self._hand, self._predict, self._occluder, self._max_slices = hand, predict, occluder, max_slices
        self._requests: list[SliceRequest] = []
        self._version = object()

    def take(self) -> list[SliceRequest]:
        """Remove and return the requests since the last call, the newest one of each camera."""
        found, self._requests = self._requests, []
        return found

    def request_map(self, frame: CameraObservations) -> None:
        """Request foreground maps of the camera of `frame`."""
        camera = self.cameras[frame.camera]
        if not 0 <= frame.t_row0_master_ns - camera.map_requested_ns < RENEW_NS:
            camera.map_requested_ns = frame.t_row0_master_ns
            self._requests.append(SliceRequest(frame.camera, np.empty((0, 5)), STEP))

    def start(self, t_ns: int) -> None:
        """Request slices of all cameras for a track that starts at `t_ns`, and expect edges from all of them."""
        self._version = object()
        for number, camera in enumerate(self.cameras):
            if camera.newest is not None:
                camera.answered_ns = camera.newest.t_row0_master_ns
                self.request_slices(number, max(camera.newest.t_row0_master_ns, t_ns))

    def restart(self) -> None:
        """Request slices of all cameras after a relocalisation."""
        self._version = object()
        for number, camera in enumerate(self.cameras):
            if camera.newest is not None:
                self.request_slices(number, camera.newest.t_row0_master_ns)

    def stop(self) -> None:
        """Expect no edges any more: the track has ended."""
        for camera in self.cameras:
            camera.map_requested_ns = camera.answered_ns = NEVER

    def request_slices(self, number: int, t_row0_ns: int) -> None:
        """Request the slices across the predicted contour in the frame after the one at `t_row0_ns`."""
        camera = self.cameras[number]
        camera.target_ns = t_row0_ns + round(camera.period_ns)
        t_ns = camera.target_ns + self._middle_ns(number)
        contour = requested_contour(self._hand, number, *self._predict(t_ns), STEP_M, self._occluder(t_ns),
                                    self._max_slices)
        camera.has_slices = len(contour.slices) > 0
        self._requests = [one for one in self._requests if one.camera != number]
        self._requests.append(SliceRequest(number, contour.slices, STEP, _Expected(self._version, contour)))

    def contour(self, frame: EdgeFrame) -> ContourFrame | None:
        """The contour on the slices of an answer, with their edges: the one that was requested, or, in a log, that of
        the present prediction. None without slices: then no edges are expected from the camera. None also when the
        request is older than the track's start or relocalisation: its slices belong to another pose."""
        expected = frame.request.expected
        if isinstance(expected, _Expected) and expected.version is not self._version:
            return None
        camera, contour = self.cameras[frame.camera], self._answered(frame)
        camera.has_slices = contour is not None
        if contour is not None:
            camera.answered_ns = frame.t_row0_master_ns
        return contour

    def _answered(self, frame: EdgeFrame) -> ContourFrame | None:
        expected = frame.request.expected
        if isinstance(expected, _Expected):
            contour = copy.copy(expected.contour)  # keep the request's own for later answers
            contour.observe(frame.edges)
            return contour
        t_ns = frame.t_row0_master_ns + self._middle_ns(frame.camera)
        return matched_contour(self._hand, frame, *self._predict(t_ns), self._occluder(t_ns))

    def _middle_ns(self, camera: int) -> int:
        """Time from the exposure of row 0 to that of the middle row, ns."""
        return round(0.5e9 * self._hand.row_s[camera] * self._hand.cameras[camera].height)


def requested_contour(hand: BareHandTracker, camera: int, state: Array, covariance: Array, step_m: float,
                      occluder: Capsules | None = None, max_slices: int = SLICES_MAX) -> ContourFrame:
    """The slices across the contours of a hand in `state` with centres in the image, rounded as the wire rounds them.
    Of more than `max_slices`, every second or third is kept. Those that the `occluder` hides are left out."""
    frame, model = hand.expected_contour(camera, state, covariance, step_m), hand.cameras[camera]
    x, y = frame.slices[:, 0], frame.slices[:, 1]
    good = (x >= 0.0) & (y >= 0.0) & (x <= model.width - 1) & (y <= model.height - 1)
    if occluder is not None:
        good &= visible(hand, frame, model, state, occluder)
    kept = np.flatnonzero(good)
    kept = kept[::max(math.ceil(len(kept) / max_slices), 1)]
    return _on(frame, kept, unpack_slices(pack_slices(frame.slices[kept])))


def matched_contour(hand: BareHandTracker, frame: EdgeFrame, state: Array, covariance: Array,
                    occluder: Capsules | None = None) -> ContourFrame | None:
    """The contour of a hand in `state` on the slices of a recorded request that cross it, with their edges; None
    without any. `frame` is not changed. `occluder`: see `requested_contour`."""
    expected, slices = hand.expected_contour(frame.camera, state, covariance, 0.5 * STEP_M), frame.request.slices
    if not len(expected.slices) or not len(slices):
        return None
    apart = slices[:, None, :2] - expected.slices[None, :, :2]
    distance = np.hypot(*apart.transpose(2, 0, 1))
    distance += np.where(slices[:, 2:4] @ expected.slices[:, 2:4].T < MIN_COSINE, 1e6, 0.0)
    if occluder is not None:
        distance += np.where(visible(hand, expected, hand.cameras[frame.camera], state, occluder), 0.0, 1e6)
    nearest = np.argmin(distance, axis=1)
    order = np.argsort(expected.points.capsule[nearest], kind="stable")
    reach = distance[np.arange(len(slices)), nearest]
    order = order[(reach < slices[:, 4] + MATCH_PX)[order]]
    if not len(order):
        return None
    contour = _on(expected, nearest[order], slices[order])
    contour.observe(Edges(*(column[order] for column in frame.edges)))
    return contour


def _on(frame: ContourFrame, chosen: NDArray[np.int64], slices: Array) -> ContourFrame:
    """The frame with its points of indices `chosen` (K,) on other slices (K, 5)."""
    out = ContourFrame(frame.surface, frame.camera, frame.points[chosen].view(np.recarray), slices,
                       frame.expected_sd[chosen], frame.late_s[chosen], frame.repeated)
    out.ambiguous = frame.ambiguous
    return out
