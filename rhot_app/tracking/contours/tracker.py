"""The bare hand live: tracked by its contours in the nodes' images, and by its markers or landmarks if it has any.

The hand is predicted to each camera's next frame, and its node is requested to search across the contours there. The
returned edges are residuals of one state, as markers are. A node sends a small foreground map with them, by which a
track is started, where the hand has taken the pose that is shown, and verified.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import AMBIGUOUS_PX, ContourFrame, seen_contour
from rhot_app.barehand.contours import STEP_M
from rhot_app.barehand.key_frames import KeyFrames
from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, ImageFrame, SliceRequest, edges_of
from rhot_app.barehand.start import MIN_DWELL_NS
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.diagnostics import Diagnostics
from rhot_app.estimation.filter import Estimate
from rhot_app.estimation.track import NEVER, SESSION_NS
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, SeenContour, no_hand
from rhot_app.tracking.contours.evidence import Evidence, same_hand
from rhot_app.tracking.contours.finder import SAME_MAPS_NS, Finder, Maps, NewestMaps
from rhot_app.tracking.contours.markers import MarkersOfHand
from rhot_app.tracking.contours.occlusion import Capsules
from rhot_app.tracking.contours.requests import Requests, requested_contour
from rhot_app.tracking.tracker import CameraFrame, CameraObservations, HandFrame, Tracker
from rhot_node.wire.search import SLICES_MAX

Array = NDArray[np.float64]


class ContourEstimator(Tracker):
    """A state after the edges of each frame."""

    def __init__(self, rig: Rig, hands: int = 1, lateral_m: float = 0.0) -> None:
        """`hands`: number of hands that share the nodes' requests. `lateral_m`: see `barehand.start.shown_pose`. Raises
        RigError when markers are observed and one has no position on the hand."""
        self.diagnostics = Diagnostics()
        self._rig, self._max_slices = rig, SLICES_MAX // hands
        self.occluder: Callable[[int], Capsules | None] = lambda _: None
        self._hand = BareHandTracker(rig, known_size=not rig.tracker.float_scale, lateral_m=lateral_m)
        marked = rig.tracker.observe != "contours" and len(rig.markers.markers) > 0
        self._markers = MarkersOfHand(rig, self._hand) if marked else None
        self._finder = Finder(self._hand)
        self._pending: deque[CameraObservations | ImageFrame | HandFrame] = deque(maxlen=64)
        self._names, self._tracked_with = tuple(node.name for node in rig.nodes), rig.tracked_with
        self.key_frames: KeyFrames = KeyFrames(self._hand.model)
        self._shown_contours: list[SeenContour] = []
        self._sequence = 0
        self.reset()

    def reset(self) -> None:
        """Discard everything but the number of states."""
        self._pending.clear()
        self._clear()

    def _clear(self) -> None:
        """Discard all frames and the track."""
        self._finder.reset()
        self.key_frames.clear()
        if self._markers is not None:
            self._markers.reset()
        self._hand.frames = [None] * len(self._names)
        self._requests = Requests(self._hand, self._predict, lambda t_ns: self.occluder(t_ns), self._max_slices)
        self._cameras = self._requests.cameras
        self._evidence, self._maps = Evidence(self._hand, self._cameras), NewestMaps(self._cameras)
        self._unverified: Maps | None = None
        self._waiting: dict[int, tuple[EdgeFrame, ContourFrame]] = {}
        self._used = self._waiting  # by the last update
        self.overlaps = [False] * len(self._names)
        self._agreed_ns = NEVER
        self._tracking = False
        self.starts = 0
        self._latest: CameraObservations | EdgeFrame | None = None

    # -- Tracker -------------------------------------------------------------------------------------------------------

    def ingest(self, frame: CameraFrame) -> None:
        """Take the edges or the foreground of one frame, or its markers, which also have the time of the camera's
        frame."""
        if (isinstance(frame, CameraObservations | EdgeFrame | ForegroundFrame | HandFrame)
                and self._tracked_with[frame.camera]):
            self._pending.append(frame)

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first."""
        return tuple(camera.newest for camera in self._cameras)

    def seen(self) -> list[SeenContour]:
        """See `Tracker`. Without a hand, the pose that it is to take."""
        if not self.confirmed:
            return self._shown()
        state = self._hand.filter.newest.state
        return [seen_contour(self._names[number], image.t_row0_master_ns, contour, state, image.t_row0_node_ns)
                for number, (image, contour) in self._used.items()]

    def _shown(self) -> list[SeenContour]:
        hand, pose = self._hand, self._hand.start_pose
        if not self._shown_contours:
            state, covariance = hand.process.start(pose.world_from_palm, pose.angles, (1e-6, 1e-6))
            self._shown_contours = [seen_contour(name, 0, hand.expected_contour(number, state, covariance), state,
                                                 shown=True) for number, name in enumerate(self._names)]
        return [replace(contour, t_master_ns=frame.t_row0_master_ns, t_node_ns=frame.t_row0_node_ns)
                for contour, frame in zip(self._shown_contours, self.newest_frames(), strict=True) if frame is not None]

    def requests(self) -> list[SliceRequest]:
        """The newest requests to the nodes."""
        return self._requests.take()

    def warm_up(self) -> None:
        """Compile everything, with a hand half a metre before the first camera, which is then discarded."""
        hand, world = self._hand, np.eye(4)
        first = hand.cameras[0].world_from_camera
        world[:3, :3], world[:3, 3] = first[:3, :3], first[:3, :3] @ np.array([0.0, 0.0, 0.5]) + first[:3, 3]
        disc = np.hypot(*np.mgrid[-30:30, -40:40]) < 12.0
        hand.start(HandPose(world, hand.model.pose_prior.mean.copy()), 0)
        contour = requested_contour(hand, 0, *hand.filter.predict(0.0), STEP_M)
        contour.observe(edges_of(len(contour.slices), np.zeros(1, np.int64), np.array([[0.0, 1.0, 9.0, 1.0, 0.0]])))
        hand.frames[0] = contour
        hand.filter.add(0.0, [contour, *hand.constraints])
        maps = Maps(1, [disc.astype(np.float32)] * len(self._names))
        self._finder.relocalise(maps, hand.filter.newest.state, hand.filter.newest.covariance, 0.03)
        self._finder.wait()
        self._finder.look(maps)
        self._finder.wait()
        hand.state()
        self.reset()

    def wait(self) -> None:
        """Wait for the running search."""
        self._finder.wait()

    # -- for two hands -------------------------------------------------------------------------------------------------

    @property
    def hand(self) -> BareHandTracker:
        """The tracker of its contours."""
        return self._hand

    @property
    def tracking(self) -> bool:
        """Whether there is a track, confirmed or not."""
        return self._tracking

    @property
    def confirmed(self) -> bool:
        """Whether there is a confirmed track: the hand has held its start pose, or markers and contours agree on it."""
        return self._tracking and self._evidence.confirmed

    def stands(self, state: HandState) -> bool:
        """See `Tracker`."""
        return self.confirmed or not state.tracked

    def state_at(self, t_ns: int) -> Array:
        """The predicted state (n,) at master time `t_ns`."""
        return self._predict(t_ns)[0]

    @property
    def simultaneous_ns(self) -> float:
        """Longest time between simultaneous maps, ns."""
        return self._maps.simultaneous_ns

    def start(self, pose: HandPose, t_ns: int) -> None:
        """Start a track, not yet confirmed, at a pose of master time `t_ns`."""
        self._hand.start(pose, t_ns)
        self._finder.reset()
        self.key_frames.clear()
        if self._markers is not None:
            self._markers.start()
        self._agreed_ns = NEVER
        self._tracking, self._waiting, self._unverified = True, {}, None
        self._used = {}
        self._evidence.start(t_ns)
        self._requests.start(t_ns)

    def confirm(self) -> None:
        """The track is confirmed."""
        self.starts += not self._evidence.confirmed
        self._evidence.confirmed = True

    def drop_track(self) -> None:
        """End the track, and wait for a hand that takes its start pose."""
        self._tracking = False
        self._hand.frames = [None] * len(self._names)
        self._requests.stop()
        self._waiting = {}

    # -- Tracker -------------------------------------------------------------------------------------------------------

    def solve(self) -> HandState | None:
        """The state after the frames since the last one; None when they have no new information."""
        begun, due = time.perf_counter(), False
        while self._pending:
            frame = self._pending.popleft()
            if isinstance(frame, CameraObservations):
                due = self._take_frame(frame) or due
            elif isinstance(frame, EdgeFrame):
                due = self._take_edges(frame) or due
            elif isinstance(frame, HandFrame):
                self._weigh(frame)
            else:
                self._take_map(frame)
            self._verify()
        if not due or self._latest is None:
            return None
        self._sequence += 1
        return self._state(self._latest, begun)

    # -- frames --------------------------------------------------------------------------------------------------------

    def _take_frame(self, frame: CameraObservations) -> bool:
        """Take the time and the markers of one frame, and end a lost track. Returns whether a state is due."""
        t_ns = frame.t_row0_master_ns
        if not self._advance(frame.camera, t_ns):
            return False
        camera = self._cameras[frame.camera]
        camera.newest = frame
        self._hand.row_s[frame.camera] = 1e-9 * frame.row_time_ns
        marked = self._markers is not None and self._take_markers(frame, self._markers)
        if not self._tracking:
            self._requests.request_map(frame)
        elif camera.overdue(t_ns):
            self._requests.request_slices(frame.camera, t_ns)
        if marked or not self.confirmed:
            self._latest = frame
            return True
        return False

    def _advance(self, camera: int, t_ns: int) -> bool:
        """Take the time of a frame, and end a track that is lost by then. Returns whether it is the camera's newest."""
        since_ns = t_ns - self._cameras[camera].newest_ns
        if -SESSION_NS < since_ns <= 0:
            return False
        if since_ns <= -SESSION_NS:  # another session, or a clock that was set
            self._clear()
        self._cameras[camera].take(t_ns)
        if self._tracking and (self._hand.filter.newest_ns - t_ns > SESSION_NS or self._evidence.lost(t_ns)):
            self.drop_track()
        return True

    def _weigh(self, frame: HandFrame) -> None:
        """Weigh what another kind observes of a hand that is tracked."""
        hand = self._hand
        if self._tracking:
            hand.prepare_update((), hand.filter.seconds(frame.t_ns))
            try:
                hand.filter.weigh(frame.t_ns, frame.residuals, hand.constraints)
            except np.linalg.LinAlgError:  # the observations contradict the estimate
                self.drop_track()

    def _take_edges(self, frame: EdgeFrame) -> bool:
        """Collect the edges of one frame, and update once all cameras have theirs: one camera alone measures depth
        poorly. Edges nearer to the previous frame are used without this one. Returns whether a state is due."""
        contour = self._requests.contour(frame) if self._tracking else None
        if contour is None:
            return False
        apart_ns = max((frame.t_row0_master_ns - one.t_row0_master_ns for one, _ in self._waiting.values()), default=0)
        due = apart_ns > 0.5 * self._cameras[frame.camera].period_ns and self._update()
        if not self._tracking:
            return False
        self._waiting[frame.camera] = frame, contour
        t_ns = frame.t_row0_master_ns
        expected = [number for number, camera in enumerate(self._cameras) if camera.returns_edges(t_ns)]
        return (all(number in self._waiting for number in expected) and self._update()) or due

    def _update(self) -> bool:
        """Update the state by the collected edges, and request those of the next frames. Returns whether a state is
        due."""
        waiting, self._waiting = self._waiting, {}
        try:
            self._solve(waiting)
        except np.linalg.LinAlgError:  # the observations contradict the estimate
            self.drop_track()
            return False
        self._used = waiting
        self._hand.frames = [None] * len(self._names)
        for number, (one, contour) in waiting.items():
            if self._markers is not None:
                contour.ambiguous = 0.0  # markers tell the fingers apart
            self._hand.frames[number] = contour
            self._requests.request_slices(number, one.t_row0_master_ns)
        for number, (one, contour) in waiting.items():
            self._evidence.take_contour(number, one.t_row0_master_ns, contour)
        if not self._evidence.confirmed:
            return False
        self.key_frames.offer(self._hand)
        self._latest = max((one for one, _ in waiting.values()), key=lambda one: one.t_row0_master_ns)
        return True

    def _solve(self, waiting: Mapping[int, tuple[EdgeFrame, ContourFrame]]) -> None:
        """Update the state by the edges of some cameras, by number. Every pass has the same edges, and expects the
        contour with half the standard deviation. Raises LinAlgError when they contradict the estimate."""
        hand, edges = self._hand, [contour for _, contour in waiting.values()]
        times_s = [self._hand.filter.seconds(one.t_row0_master_ns + _middle_ns(one)) for one, _ in waiting.values()]
        t_s, spreads = max(*times_s, hand.filter.knots[0].t_s), [contour.expected_sd for contour in edges]
        for contour, one_s in zip(edges, times_s, strict=True):
            contour.late_s = contour.late_s + (one_s - t_s)

        def narrowed(number: int, _: Array) -> list[ContourFrame]:
            for contour, spread in zip(edges, spreads, strict=True):
                contour.expected_sd = np.minimum(spread * 0.5**number, AMBIGUOUS_PX)
            return edges

        hand.prepare_update(waiting, t_s)
        prediction = hand.filter.predict(t_s)
        hand.solve(t_s, prediction, prediction[0], narrowed)

    def _take_map(self, frame: ForegroundFrame) -> None:
        """Take the foreground of one frame: to verify the track, or to acquire one."""
        maps = self._maps.take(frame)
        if self._tracking:
            t_ns = frame.t_row0_master_ns
            self._evidence.take_map(frame.camera, t_ns, frame.probability, self.state_at(t_ns))
            self._unverified = maps or self._unverified
            return
        found = self._finder.found()
        if found is not None:
            self.start(*found)
        elif maps is not None:
            self._finder.look(maps)

    def _verify(self) -> None:
        """Relocalise and check the track by the newest maps of all cameras, once all edges are used."""
        maps = self._unverified
        if maps is None or self._waiting or not self._tracking:
            return
        self._unverified = None
        # Overlapping hands are not verified: whose foreground it is, is ambiguous.
        if not any(self.overlaps) and self._finder.verify(
                maps, self._hand.filter.seconds(maps.t_ns), 1e-9 * min(one.period_ns for one in self._cameras)):
            self._requests.restart()
        self._check(maps)

    def _check(self, maps: Maps) -> None:
        """Confirm a track that has held its start pose, or end it, by maps of all cameras."""
        observed_ns = self._evidence.observed_ns
        held = observed_ns - self._hand.filter.begun_ns >= MIN_DWELL_NS
        if self._evidence.confirmed or observed_ns <= max(
                self._hand.filter.begun_ns, maps.t_ns - max(SAME_MAPS_NS, self._maps.simultaneous_ns)):
            return
        if maps.t_ns - self._agreed_ns < SAME_MAPS_NS or (
                held and self._hand.verified(maps.probabilities, self._predict(maps.t_ns)[0])):
            self.confirm()
        elif held:
            self.drop_track()

    # -- the track -----------------------------------------------------------------------------------------------------

    def _take_markers(self, frame: CameraObservations, markers: MarkersOfHand) -> bool:
        """Start a track by the markers of one frame, or update by them. Returns whether a state is due."""
        if not self.confirmed:
            self._locate(frame, markers)
        if not self._tracking:
            return False
        try:
            return markers.update(frame) and not self._cameras[frame.camera].returns_edges(frame.t_row0_master_ns)
        except np.linalg.LinAlgError:  # the observations contradict the estimate
            self.drop_track()
            return False

    def _locate(self, frame: CameraObservations, markers: MarkersOfHand) -> None:
        """Start a track where the markers show a hand, unless they show the tracked one, which then is confirmed."""
        found = markers.locate(frame)
        if found is None:
            return
        pose, t_ns = found
        if self._tracking and same_hand(self._hand, self._hand.filter.newest.state, pose):
            self._agreed_ns = t_ns
        else:
            self.start(pose, t_ns)

    # -- times and states ----------------------------------------------------------------------------------------------

    def _predict(self, t_ns: int) -> Estimate:
        return self._hand.filter.predict_ns(t_ns)

    def _state(self, frame: CameraObservations | EdgeFrame, begun: float) -> HandState:
        """The state of the hand after `frame`, with the pixels and flags of its markers; their positions in space are
        not estimated."""
        ids = self._rig.markers.ids
        hand = self._hand.state(begun, ids) if self.confirmed else no_hand(
            frame.t_row0_master_ns, Condition.LOST if self.starts else Condition.SEARCHING, self._names,
            markers=ids)
        for number, one in enumerate(self.newest_frames()):
            if one is not None:
                hand.camera_pixels[number], hand.camera_flags[number] = one.pixels, one.flags
        return replace(hand, sequence=self._sequence - 1, t_receive_ns=frame.t_receive_ns,
                       latency_s={"detect": frame.detect_s, "network": frame.network_s, "pair": 0.0,
                                  "triangulate": 0.0, "filter": time.perf_counter() - begun, "solve": 0.0})


def _middle_ns(frame: EdgeFrame) -> int:
    """Time from the exposure of row 0 to that of the mean row of the slices, ns."""
    slices = frame.request.slices
    return round(float(slices[:, 1].mean()) * frame.row_time_ns) if len(slices) else 0
