"""The bare hand live: its contours in the images of the nodes, beside its markers or landmarks if it has any.

The hand is predicted to each camera's next frame, the node is asked to search across the contours expected there, and
the edges that come back are residuals of the one state, as markers are. Nodes send a small foreground map with them:
it starts the track and tells when it is wrong.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import STEP_M
from rhot_app.barehand.key_frames import KeyFrames
from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, ImageFrame, SliceRequest, edges_of
from rhot_app.barehand.relocalisation import SAME_POSE_M
from rhot_app.barehand.tracker import START_SD, BareHandTracker
from rhot_app.hand.motion.hand_process import BIAS
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, Knowledge, SeenContour, no_hand
from rhot_app.tracking.contours.evidence import Evidence, joints_of, same_hand, seen_contour
from rhot_app.tracking.contours.finder import LEAST_GAIN, SAME_MAPS_NS, Finder, Maps, NewestMaps
from rhot_app.tracking.contours.markers import MarkersOfHand, weigh
from rhot_app.tracking.contours.occlusion import Capsules
from rhot_app.tracking.contours.requests import JUMP_NS, NEVER, Requests, asked
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag
from rhot_node.wire.slices import SLICES_MAX

Array = NDArray[np.float64]
Estimate = tuple[Array, Array]


class ContourEstimator:
    """Implements `Tracker` and `ImageTracking`: a state after the edges of every frame."""

    def __init__(self, rig: Rig, hands: int = 1) -> None:
        """`hands`: share the nodes' requests. Raises RigError when markers are observed and one has no place on the
        hand."""
        self._rig, self._most = rig, SLICES_MAX // hands
        self.beside: Callable[[int], Capsules | None] = lambda _: None
        self._hand = BareHandTracker(rig, known_size=not rig.tracker.float_scale)
        self._markers = MarkersOfHand(rig, self._hand) if _marked(rig) else None
        self._finder = Finder(self._hand, alone=hands == 1)
        self._pending: deque[CameraObservations | ImageFrame] = deque(maxlen=64)
        self._names = tuple(node.name for node in rig.nodes)
        self.key_frames = KeyFrames(self._hand.model)
        self._sequence = 0
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states."""
        self._pending.clear()
        self._begin_again()

    def _begin_again(self) -> None:
        """Forget what was taken in."""
        self._finder.reset()
        self.key_frames.clear()
        if self._markers is not None:
            self._markers.reset()
        self._hand.frames, self._hand.tracking = [None] * len(self._names), False
        self._hand.relocaliser.average_odds = 0.0
        self._requests = Requests(self._hand, self._predict, lambda t_ns: self.beside(t_ns), self._most)
        self._cameras = self._requests.cameras
        self._evidence, self._maps = Evidence(self._hand, self._cameras), NewestMaps(self._cameras)
        self._waiting: dict[int, tuple[EdgeFrame, ContourFrame]] = {}
        self._unjudged: Maps | None = None
        self._epoch_ns, self.overlaps = 0, [False] * len(self._names)
        self._maps_ns = self._agreed_ns = NEVER
        self._tracking = self._ever = False
        self._latest: CameraObservations | EdgeFrame | None = None

    # -- Tracker and ImageTracking -------------------------------------------------------------------------------------

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame's markers in; it tells when the camera's frames come."""
        self._pending.append(observations)

    def ingest_image(self, frame: ImageFrame) -> None:
        """Take the edges or the foreground of one frame in."""
        self._pending.append(frame)

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first."""
        return tuple(camera.newest for camera in self._cameras)

    def seen(self) -> list[SeenContour]:
        """See `ShowsContours`."""
        if not (self._tracking and self._evidence.confirmed):
            return []
        state, found = self._hand.filter.newest.state, []
        for name, camera, frame in zip(self._names, self._cameras, list(self._hand.frames), strict=True):
            if frame is not None:
                found.append(seen_contour(name, camera.answered_ns, frame, state))
        return found

    def requests(self) -> list[SliceRequest]:
        """What the nodes shall search now."""
        return self._requests.take()

    def warm_up(self) -> None:
        """Have everything compiled, with a hand half a metre before the first camera, then forget it."""
        hand, world = self._hand, np.eye(4)
        first = hand.cameras[0].world_from_camera
        world[:3, :3], world[:3, 3] = first[:3, :3], first[:3, :3] @ np.array([0.0, 0.0, 0.5]) + first[:3, 3]
        disc = np.hypot(*np.mgrid[-30:30, -40:40]) < 12.0
        maps = Maps(1, [disc.astype(np.float32)] * len(self._names))
        hand.start(HandPose(world, hand.model.pose_prior.mean.copy()), 0)
        contour = asked(hand, 0, *hand.filter.predict(0.0), STEP_M)
        contour.observe(edges_of(len(contour.slices), np.zeros(1, np.int64), np.array([[0.0, 1.0, 9.0, 1.0, 0.0]])))
        hand.frames[0] = contour
        hand.filter.add(0.0, [contour, *hand.constraints])
        state = hand.filter.newest.state
        hand.process.difference(state, state)  # compiled here, for `MarkersOfHand.choose`
        self._finder.relocalise(maps, hand.filter.newest.state, hand.filter.newest.covariance, 0.03)
        self._finder.wait()
        self._finder.look(maps)
        self._finder.wait()
        hand.state()
        self.reset()

    def wait(self) -> None:
        """Until the hand that is looked for is found or not."""
        self._finder.wait()

    # -- beside another hand -------------------------------------------------------------------------------------------

    @property
    def hand(self) -> BareHandTracker:
        """What follows it."""
        return self._hand

    @property
    def tracking(self) -> bool:
        """Whether a hand is followed, perhaps one that is not confirmed."""
        return self._tracking

    @property
    def confirmed(self) -> bool:
        """Whether a hand is followed that was found twice."""
        return self._tracking and self._evidence.confirmed

    def state_at(self, t_ns: int) -> Array:
        """Of the hand that is followed, at master time `t_ns`."""
        return self._predict(t_ns)[0]

    def start(self, pose: HandPose, t_ns: int) -> None:
        """Follow the hand from a pose on."""
        self._start(pose, t_ns)

    @property
    def same_ns(self) -> float:
        """How far apart maps of one moment are at most, ns."""
        return self._maps.same_ns

    def give_up(self) -> None:
        """Follow it no longer, and look for a hand."""
        self._give_up()

    # -- Tracker -------------------------------------------------------------------------------------------------------

    def solve(self) -> HandState | None:
        """The state after the frames since the last one; None when they tell nothing new."""
        begun, due = time.perf_counter(), False
        while self._pending:
            frame = self._pending.popleft()
            if isinstance(frame, CameraObservations):
                due = self._take_frame(frame) or due
            elif isinstance(frame, EdgeFrame):
                due = self._take_edges(frame) or due
            else:
                self._take_map(frame)
            self._judge()
        if not due or self._latest is None:
            return None
        self._sequence += 1
        return self._state(self._latest, begun)

    # -- frames --------------------------------------------------------------------------------------------------------

    def _take_frame(self, frame: CameraObservations) -> bool:
        """Note when a camera's frames come, look for the hand or see whether it is lost. Whether a state is due."""
        camera = self._cameras[frame.camera]
        if camera.newest is not None:
            since_ns = frame.t_row0_master_ns - camera.newest.t_row0_master_ns
            if -JUMP_NS < since_ns <= 0:
                return False
            if since_ns <= -JUMP_NS:  # another session, or a clock that was set
                self._begin_again()
                camera = self._cameras[frame.camera]
        camera.take(frame)
        self._hand.row_s[frame.camera] = 1e-9 * frame.row_time_ns
        t_ns = frame.t_row0_master_ns
        if self._tracking and (self._time_ns() - t_ns > JUMP_NS or self._evidence.lost(t_ns)):
            self._give_up()
        marked = self._markers is not None and self._take_markers(frame, self._markers)
        if not self._tracking:
            self._requests.look(frame)
        elif camera.overdue(t_ns):
            self._requests.ask(frame.camera, t_ns)
        if marked or not (self._tracking and self._evidence.confirmed):
            self._latest = frame
            return True
        return False

    def _take_edges(self, frame: EdgeFrame) -> bool:
        """Weigh the edges of one frame once those of the other cameras are there: one camera alone tells distances
        poorly. What waits is weighed without it if it is nearer to the frame before. Whether a state is due."""
        contour = self._requests.contour(frame) if self._tracking else None
        if contour is None:
            return False
        apart_ns = max((frame.t_row0_master_ns - one.t_row0_master_ns for one, _ in self._waiting.values()), default=0)
        due = apart_ns > 0.5 * self._cameras[frame.camera].period_ns and self._weigh()
        if not self._tracking:
            return False
        self._waiting[frame.camera] = frame, contour
        answering = [number for number, camera in enumerate(self._cameras) if camera.answers(frame.t_row0_master_ns)]
        return (all(number in self._waiting for number in answering) and self._weigh()) or due

    def _weigh(self) -> bool:
        """Weigh the edges that wait, and ask for those of the next frames. Whether a state is due."""
        waiting, self._waiting = self._waiting, {}
        try:
            weigh(self._hand, self._markers, waiting, self._epoch_ns)
        except np.linalg.LinAlgError:  # the estimate contradicts itself
            self._give_up()
            return False
        self._hand.frames = [None] * len(self._names)
        for number, (one, contour) in waiting.items():
            self._hand.frames[number] = contour
            self._requests.ask(number, one.t_row0_master_ns)
        self._evidence.take_edges(waiting.values())
        if not self._evidence.confirmed:
            return False
        self.key_frames.offer(self._hand)
        self._latest = max((one for one, _ in waiting.values()), key=lambda one: one.t_row0_master_ns)
        return True

    def _take_map(self, frame: ForegroundFrame) -> None:
        """See whether the hand is on the foreground of one frame, or look for it there."""
        maps = self._maps.take(frame)
        if not self._tracking:
            self._begin(maps)
            return
        self._evidence.take_map(frame, self.state_at(frame.t_row0_master_ns))
        self._unjudged = maps or self._unjudged

    def _judge(self) -> None:
        """Judge the track by the newest maps of all cameras, once no edges wait to be weighed."""
        maps = self._unjudged
        if maps is None or self._waiting or not self._tracking:
            return
        self._unjudged = None
        if maps.t_ns == self._maps_ns:
            return
        self._maps_ns = maps.t_ns
        shown_ns = max(self._epoch_ns, maps.t_ns - max(SAME_MAPS_NS, self._maps.same_ns))
        if not self._evidence.confirmed and self._evidence.seen_ns > shown_ns:
            self._confirm(maps)
        if any(self.overlaps):  # in an image, with another hand: what foreground is whose, it does not say
            return
        if self._finder.follow(maps, self._seconds(maps.t_ns), 1e-9 * min(one.period_ns for one in self._cameras)):
            self._requests.renew()

    def _confirm(self, maps: Maps) -> None:
        """Have the hand looked for once more: two random searches agree on a wrong hand less often than one errs.
        Markers that show the same hand are as good."""
        if maps.t_ns - self._agreed_ns < SAME_MAPS_NS:
            self._evidence.confirmed = self._ever = True
            return
        found = self._finder.found()
        if found is None:
            self._finder.look(maps)
            return
        pose, t_ns = found
        state, _ = self._predict(t_ns)
        other, _ = self._hand.process.start(pose.world_from_palm, pose.angles, START_SD[:2])
        other[BIAS:], relocaliser = state[BIAS:], self._hand.relocaliser
        odds = relocaliser.odds_of(maps.probabilities)
        gain = relocaliser.log_odds(odds, other) - relocaliser.log_odds(odds, state)
        apart_m = float(np.linalg.norm(joints_of(self._hand, other) - joints_of(self._hand, state), axis=1).mean())
        same = same_hand(self._hand, state, pose)
        if gain > (LEAST_GAIN if same else 0.0) and apart_m > SAME_POSE_M:  # it has come in since, or is another one
            self._start(pose, t_ns)
        elif same:
            self._evidence.confirmed = self._ever = True
        else:
            self._finder.look(maps)

    # -- the track -----------------------------------------------------------------------------------------------------

    def _begin(self, maps: Maps | None) -> None:
        """Start where the finder has found a hand, or let it look in the newest maps."""
        found = self._finder.found()
        if found is not None:
            self._start(*found)
        elif maps is not None:
            self._finder.look(maps)

    def _start(self, pose: HandPose, t_ns: int) -> None:
        self._hand.start(pose, t_ns)
        self._hand.relocaliser.average_odds = 0.0
        self._finder.reset()
        self.key_frames.clear()
        if self._markers is not None:
            self._markers.begin(t_ns)
        self._epoch_ns, self._maps_ns, self._agreed_ns = t_ns, NEVER, NEVER
        self._tracking, self._waiting, self._unjudged = True, {}, None
        self._evidence.begin(t_ns)
        self._requests.begin(t_ns)

    def _give_up(self) -> None:
        self._tracking = False
        self._hand.tracking = False
        self._hand.frames = [None] * len(self._names)
        self._finder.reset()
        self._requests.give_up()
        self._waiting = {}
        if self._markers is not None:
            self._markers.forget()

    def _take_markers(self, frame: CameraObservations, markers: MarkersOfHand) -> bool:
        """Begin with one frame's markers, or weigh them. Whether they, or some that waited, showed anything."""
        if not (self._tracking and self._evidence.confirmed):
            self._locate(frame, markers)
        if not self._tracking:
            return False
        try:
            return markers.take(frame, self._cameras)
        except np.linalg.LinAlgError:  # the estimate contradicts itself
            self._give_up()
            return False

    def _locate(self, frame: CameraObservations, markers: MarkersOfHand) -> None:
        """Begin where the markers show a hand, or see whether they show the one that is followed."""
        found = markers.locate(frame)
        if found is None:
            return
        pose, t_ns = found
        if self._tracking and same_hand(self._hand, self._hand.filter.newest.state, pose):
            self._agreed_ns = t_ns
        else:
            self._start(pose, t_ns)

    # -- times and states ----------------------------------------------------------------------------------------------

    def _seconds(self, t_ns: int) -> float:
        return 1e-9 * (t_ns - self._epoch_ns)

    def _predict(self, t_ns: int) -> Estimate:
        return self._hand.filter.predict(self._seconds(t_ns))

    def _time_ns(self) -> int:
        return self._epoch_ns + round(1e9 * self._hand.filter.newest.t_s)

    def _state(self, frame: CameraObservations | EdgeFrame, begun: float) -> HandState:
        newest = self._hand.filter.newest if self._tracking else None
        wide = self._markers.widened(newest.state, newest.covariance) if self._markers and newest else None
        hand = self._hand.state(begun, wide and wide[1]) if self._tracking and self._evidence.confirmed else no_hand(
            frame.t_row0_master_ns, Condition.LOST if self._ever else Condition.SEARCHING)
        return _published(hand, self._sequence - 1, frame, self.newest_frames(), self._rig.markers.ids, self._names,
                         time.perf_counter() - begun)


def _marked(rig: Rig) -> bool:
    """Whether the hand's markers are observed, of which it may have none beside another hand."""
    return rig.tracker.observe != "contours" and len(rig.markers.markers) > 0


def _published(hand: HandState, sequence: int, frame: CameraObservations | EdgeFrame,
              newest: Sequence[CameraObservations | None], marker_ids: tuple[str, ...], cameras: tuple[str, ...],
              filter_s: float) -> HandState:
    """The state of a hand that `frame` has completed, with what the cameras saw of M markers; where these are in space
    is not said."""
    count = len(marker_ids)
    pixels = np.full((len(cameras), count, 2), np.nan)
    flags = np.full((len(cameras), count), int(MarkerFlag.LOST), np.uint16)
    for number, one in enumerate(newest):
        if one is not None:
            pixels[number], flags[number] = one.pixels, one.flags
    return replace(
        hand, sequence=sequence, t_receive_ns=frame.t_receive_ns, marker_ids=marker_ids,
        marker_positions=np.full((count, 3), np.nan), marker_raw_positions=np.full((count, 3), np.nan),
        marker_covariances=np.full((count, 3, 3), np.nan),
        marker_knowledge=np.full(count, int(Knowledge.UNKNOWN), np.uint8), camera_names=cameras, camera_pixels=pixels,
        camera_flags=flags, epipolar_error_px=np.full(count, np.nan),
        latency_s={"detect": frame.detect_s, "network": frame.network_s, "pair": 0.0, "triangulate": 0.0,
                   "filter": filter_s, "solve": 0.0})
