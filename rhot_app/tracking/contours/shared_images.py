"""Two bare hands in the same images: the nodes search the contours of both.

The part of an image that one hand occludes has no information on the other one. So the foreground of each is the rest,
and its contour is searched where the other one does not occlude it. Two estimates in one place are one hand: the
foreground decides which.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, ImageFrame, SliceRequest
from rhot_app.barehand.pose_search import CORRELATED, RELOCALISATION_LOG_ODDS
from rhot_app.barehand.silhouette import STEP, score
from rhot_app.barehand.start import START_SD
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.estimation.track import NEVER, SESSION_NS
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.skeleton import JOINT_SLICES
from rhot_app.project import Rig
from rhot_app.tracking.contours.evidence import joints_of
from rhot_app.tracking.contours.finder import Maps
from rhot_app.tracking.contours.occlusion import Capsules, capsules_in, occluded_pixels, visible
from rhot_app.tracking.contours.tracker import ContourEstimator
from rhot_node.detect.edges import Edges

Array = NDArray[np.float64]


class _JointRequest(NamedTuple):
    """The requests of both hands that were joined to one request for a camera; None of a hand without one."""

    hand: SliceRequest | None
    other: SliceRequest | None


_PALM_JOINTS = [0, *(joints.start for joints in JOINT_SLICES[1:])]  # wrist and knuckles


class SharedImages:
    """Gives each of two bare hands its part of every image, and joins their requests."""

    def __init__(self, rig: Rig, hands: Sequence[ContourEstimator]) -> None:
        """`hands`: of the rig's hand and of its other hand."""
        self._both = hands
        for hand in hands:
            hand.occluder = partial(self._occluder, hand)
        self._cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
        self._thick_m = 1e-3 * rig.hand.palm_thickness_mm
        self.reset()

    def reset(self) -> None:
        """Discard everything."""
        self._asked: list[list[SliceRequest | None]] = [[None, None] for _ in self._cameras]
        self._maps: list[ForegroundFrame | None] = [None] * len(self._cameras)
        self._occluder_ns = [NEVER, NEVER]

    # -- images --------------------------------------------------------------------------------------------------------

    def ingest(self, frame: ImageFrame) -> None:
        """Take the edges or the foreground of one frame."""
        if isinstance(frame, EdgeFrame):
            self._take_edges(frame)
            return
        self._maps[frame.camera] = frame
        t_ns = frame.t_row0_master_ns
        apart_ns = [abs(t_ns - one.t_row0_master_ns) for one in self._maps if one is not None]
        simultaneous = not any(self._both[0].simultaneous_ns < apart < SESSION_NS for apart in apart_ns)
        if simultaneous and self._both[0].tracking and self._both[1].tracking:
            self._resolve_duplicate(t_ns)
        masked = [self._masked_for(number, frame) for number in range(2)]
        for hand, one in zip(self._both, masked, strict=True):
            hand.ingest(one)

    def _take_edges(self, frame: EdgeFrame) -> None:
        """Give each hand the edges of its own slices; from a log, which does not attribute them, all."""
        own = frame.request.expected
        if own is None:
            for hand in self._both:
                hand.ingest(frame)
        if not isinstance(own, _JointRequest):  # a log, or the request of an earlier tracker
            return
        first = 0
        for hand, request in zip(self._both, own, strict=True):
            if request is None or not len(request.slices):
                continue
            part = slice(first, first + len(request.slices))
            first = part.stop
            edges = Edges._make(column[part] for column in frame.edges)
            hand.ingest(replace(frame, request=request, edges=edges))

    def _masked_for(self, number: int, frame: ForegroundFrame) -> ForegroundFrame:
        """The foreground for one hand: NaN, not known, where the other one may occlude it."""
        hand, t_ns = self._both[number], frame.t_row0_master_ns
        other = self._occluder(hand, t_ns)
        if other is None:  # a lost one is assumed to be there for SESSION_NS more
            if not 0 <= t_ns - self._occluder_ns[number] < SESSION_NS:
                hand.overlaps[frame.camera] = False
            return frame
        self._occluder_ns[number] = t_ns
        hand.overlaps[frame.camera] = False
        masked = self._without(other, frame)
        if not hand.tracking:
            return masked
        camera = self._cameras[frame.camera]
        places = [joints_of(one.hand, one.state_at(t_ns)) for one in (hand, self._both[1 - number])]
        with np.errstate(invalid="ignore"):  # behind the camera
            columns, rows = (camera.project(places[0]) // frame.step).T
            inside = (columns >= 0) & (rows >= 0) & (columns < masked.probability.shape[1]) & (
                rows < masked.probability.shape[0])
        hand.overlaps[frame.camera] = bool(np.isnan(
            masked.probability[rows[inside].astype(int), columns[inside].astype(int)]).any())
        far = [float(np.linalg.norm(one[_PALM_JOINTS].mean(axis=0) - camera.centre)) for one in places]
        return masked if far[1] < far[0] else frame

    def _without(self, other: Capsules, frame: ForegroundFrame) -> ForegroundFrame:
        probability = frame.probability.copy()
        probability[occluded_pixels(self._cameras[frame.camera], other, probability.shape, frame.step)] = np.nan
        return replace(frame, probability=probability)

    def _occluder(self, hand: ContourEstimator, t_ns: int) -> Capsules | None:
        """The capsules of the other hand at master time `t_ns`; None until it is confirmed."""
        other = self._both[1] if hand is self._both[0] else self._both[0]
        return capsules_in(other.hand, other.state_at(t_ns)) if other.confirmed else None

    # -- which hand is which -------------------------------------------------------------------------------------------

    def _resolve_duplicate(self, t_ns: int) -> None:
        """If both hands are nearer to each other than a hand is thick, drop the less probable one, unless it explains
        foreground that the other one does not."""
        states = [one.state_at(t_ns) for one in self._both]
        places = [joints_of(one.hand, state) for one, state in zip(self._both, states, strict=True)]
        if _palm_distance_m(*places) > self._thick_m:
            return
        maps = self._newest_maps(t_ns)
        foreground = self._both[0].hand.search.odds_of(maps.probabilities)
        odds = [one.hand.search.log_odds(foreground, state) + RELOCALISATION_LOG_ODDS * one.confirmed
                for one, state in zip(self._both, states, strict=True)]
        worse = int(odds[0] >= odds[1])
        one, better = self._both[worse], self._both[1 - worse]
        rest = self._newest_maps(t_ns, capsules_in(better.hand, states[1 - worse]))
        if _own_log_odds(one.hand, states[worse], rest) < CORRELATED * RELOCALISATION_LOG_ODDS:
            one.drop_track()

    def _newest_maps(self, t_ns: int, without: Capsules | None = None) -> Maps:
        """The foreground maps of about `t_ns`, NaN where the hand `without` is."""
        maps = [one if one is not None and abs(t_ns - one.t_row0_master_ns) <= self._both[0].simultaneous_ns else None
                for one in self._maps]
        if without is not None:
            maps = [None if one is None else self._without(without, one) for one in maps]
        return Maps(t_ns, [None if one is None else one.probability for one in maps])

    def requests(self) -> list[SliceRequest]:
        """The newest requests to the nodes, joined for both hands."""
        changed = set()
        for number, hand in enumerate(self._both):
            for request in hand.requests():
                self._asked[request.camera][number] = request
                changed.add(request.camera)
        found = []
        for camera in sorted(changed):
            own = [one for one in self._asked[camera] if one is not None]
            found.append(SliceRequest(camera, np.vstack([one.slices for one in own]),
                                      max(one.map_step for one in own), _JointRequest(*self._asked[camera])))
        return found

    def warm_up(self) -> None:
        """Compile what hides one hand from another."""
        one, camera = self._both[0].hand, self._cameras[0]
        world = camera.world_from_camera @ rigid(np.eye(3), np.array([0.0, 0.0, 0.5]))
        state, covariance = one.process.start(world, one.model.pose_prior.mean.copy(), START_SD[:2])
        capsules = capsules_in(one, state)
        occluded_pixels(camera, capsules, (60, 80), STEP)
        visible(one, one.expected_contour(0, state, covariance), camera, state, capsules)


def _palm_distance_m(ours: Array, theirs: Array) -> float:
    """Distance of the palms of two hands with joints (21, 3) m."""
    return float(np.linalg.norm((ours - theirs)[_PALM_JOINTS].mean(axis=0)))


def _own_log_odds(hand: BareHandTracker, state: Array, maps: Maps) -> float:
    """Log odds of the pixels of a hand in `state`, without the ring about it."""
    _, parts = score(hand.surface, state, hand.search.odds_of(maps.probabilities))
    return float(parts[:, 0].sum())
