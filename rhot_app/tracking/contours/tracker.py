"""The bare hand live: its contours in the images of the nodes, beside its markers or landmarks if it has any.

The hand is predicted to each camera's next frame, the node is asked to search across the contours expected there, and
the edges that come back are residuals of the one state, as markers are. Nodes send a small foreground map with them:
it starts the track and tells when it is wrong.
"""

from __future__ import annotations

import copy
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame, Contours
from rhot_app.barehand.contours import STEP_M
from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, ImageFrame, SliceRequest, edges_of
from rhot_app.barehand.silhouette import CORRELATED
from rhot_app.barehand.start import STEP
from rhot_app.barehand.tracker import (
    CONFUSED_PX,
    COVER_DROP,
    COVER_SHARE,
    PASSES,
    RELOCATION_LOG_ODDS,
    START_SD,
    BareHandTracker,
)
from rhot_app.estimation.filter import update
from rhot_app.estimation.residual import Residual
from rhot_app.hand.motion.hand_process import BIAS, POSE
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, SeenContour, no_hand
from rhot_app.tracking.contours.evidence import (
    CONFUSED_M,
    asked,
    joints_of,
    matched,
    on_foreground,
    same_hand,
    seen_contour,
)
from rhot_app.tracking.contours.finder import Finder, Maps
from rhot_app.tracking.contours.markers import BesideContours, MarkersOfHand
from rhot_app.tracking.contours.states import published
from rhot_app.tracking.markers.estimator import LOST_AFTER_NS, LOST_AFTER_PERIODS, WRONG_AFTER_NS, WRONG_AFTER_PERIODS
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.slices import SLICES_MAX

Array = NDArray[np.float64]
Estimate = tuple[Array, Array]

MOST = 0.5
"""Part above which more speaks for a hand than against it: of the contour that is found, of joints on foreground."""

LEAST_GAIN = RELOCATION_LOG_ODDS * CORRELATED
"""Log odds of pixels by which another pose must cover the foreground better (`barehand.tracker`)."""

RENEW_NS = 300_000_000
"""A node that is asked for a map alone is asked again after this long: three times before its request ends."""

_SAME_NS = 100_000_000  # maps of different cameras farther apart are of different moments
_JUMP_NS = 1_000_000_000  # frames farther apart are of different sessions
_PERIOD_S = 1.0 / 30.0  # of a camera of which one frame has come
_NEVER = -(1 << 62)


@dataclass(slots=True)
class _Camera:
    """What is known of one camera's frames. `period_ns`: between them; `target_ns`: the frame that was asked about
    last; `searched_ns`, `mapped_ns`: the newest whose edges and whose foreground came; `supported_ns`, `covered_ns`:
    the newest of these that showed the contour of the hand where it is estimated, and foreground there; `whole`: most
    of the hand lies in its image.
    """

    newest: CameraObservations | None = None
    period_ns: float = 1e9 * _PERIOD_S
    target_ns: int = _NEVER
    asked_ns: int = _NEVER
    answered_ns: int = _NEVER
    supported_ns: int = _NEVER
    covered_ns: int = _NEVER
    searched_ns: int = _NEVER
    mapped_ns: int = _NEVER
    whole: bool = False

    @property
    def seen_ns(self) -> int:
        """When it last showed the hand. Edges and foreground of one frame come apart."""
        return min(self.supported_ns, self.covered_ns)

    @property
    def judged_ns(self) -> int:
        """Until when it could have shown the hand."""
        return min(self.searched_ns, self.mapped_ns)

    def delivers(self, t_ns: int) -> bool:
        """Whether frames come from it about `t_ns`."""
        return (self.newest is not None
                and abs(t_ns - self.newest.t_row0_master_ns) < WRONG_AFTER_PERIODS * self.period_ns)


class _Expected(NamedTuple):
    """What is known of a request: after how many starts it was made, and the contour that was expected."""

    start: int
    contour: ContourFrame


class ContourEstimator:
    """Implements `Tracker` and `ImageTracking`: a state after the edges of every frame."""

    def __init__(self, rig: Rig) -> None:
        """Raises RigError when markers are observed and one has no place on the hand."""
        self._rig = rig
        self._hand = BareHandTracker(rig, known_size=not rig.tracker.float_scale)
        self._markers = MarkersOfHand(rig, self._hand) if rig.tracker.observe != "contours" else None
        self._finder = Finder(self._hand)
        self._names = tuple(node.name for node in rig.nodes)
        self._sequence = self._starts = 0
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states."""
        self._finder.reset()
        if self._markers is not None:
            self._markers.reset()
        self._hand.frames, self._hand.cover = [None] * len(self._names), 0.0
        self._cameras = [_Camera() for _ in self._names]
        self._maps: list[ForegroundFrame | None] = [None] * len(self._names)
        self._requests: list[SliceRequest] = []
        self._waiting: dict[int, tuple[EdgeFrame, ContourFrame]] = {}
        self._marked: list[CameraObservations] = []
        self._pending: deque[CameraObservations | ImageFrame] = deque(maxlen=64)
        self._epoch_ns = self._seen_ns = 0
        self._judged_ns = self._maps_ns = self._agreed_ns = _NEVER
        self._tracking = self._confirmed = self._ever = False
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
        if not (self._tracking and self._confirmed):
            return []
        state, found = self._hand.filter.newest.state, []
        for name, camera, frame in zip(self._names, self._cameras, list(self._hand.frames), strict=True):
            if frame is not None:
                found.append(seen_contour(name, camera.answered_ns, frame, state))
        return found

    def requests(self) -> list[SliceRequest]:
        """What the nodes shall search now."""
        found, self._requests = self._requests, []
        return found

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
        hand.frames[0], hand.cover = contour, 1e9  # so that it is looked for elsewhere
        hand.filter.add(0.0, [contour, *hand.known])
        state = hand.filter.newest.state
        hand.process.difference(state, state)  # compiled here, for `_choose`
        self._finder.relocate(maps, hand.filter.newest.state, hand.filter.newest.covariance, 0.03)
        self._finder.wait()
        self._finder.look(maps)
        self._finder.wait()
        hand.state()
        self.reset()

    def wait(self) -> None:
        """Until the hand that is looked for is found or not."""
        self._finder.wait()

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
            if since_ns <= 0 and since_ns > -_JUMP_NS:
                return False
            if 0 < since_ns < _JUMP_NS:
                camera.period_ns += 0.1 * (since_ns - camera.period_ns)
        camera.newest = frame
        self._hand.row_s[frame.camera] = 1e-9 * frame.row_time_ns
        t_ns = frame.t_row0_master_ns
        if self._tracking and abs(t_ns - self._time_ns()) > _JUMP_NS:
            self._give_up()
        if self._tracking and self._lost(t_ns):
            self._give_up()
        marked = self._markers is not None and self._take_markers(frame)
        if not self._tracking:
            self._look(frame)
        elif t_ns - camera.target_ns > 1.5 * camera.period_ns:  # its last answer is missing
            self._ask(frame.camera, t_ns)
        if marked or not (self._tracking and self._confirmed):
            self._latest = frame
            return True
        return False

    def _take_edges(self, frame: EdgeFrame) -> bool:
        """Weigh the edges of one frame once those of the other cameras are there: one camera alone tells distances
        poorly. Ask for those of the next frames. Whether a state is due."""
        if not self._tracking:
            return False
        contour = self._contour(frame)
        if contour is None:
            return False
        self._cameras[frame.camera].answered_ns = frame.t_row0_master_ns
        self._waiting[frame.camera] = frame, contour
        answering = [number for number, camera in enumerate(self._cameras)
                     if frame.t_row0_master_ns - camera.answered_ns < WRONG_AFTER_PERIODS * camera.period_ns]
        if not all(number in self._waiting for number in answering):
            return False
        waiting, self._waiting = self._waiting, {}
        try:
            self._weigh(waiting)
        except np.linalg.LinAlgError:  # the estimate contradicts itself
            self._give_up()
            return False
        for number, (one, contour) in waiting.items():
            self._hand.frames[number] = contour
            seen = contour.seen.sum(axis=0)
            camera = self._cameras[number]
            camera.searched_ns = one.t_row0_master_ns
            if seen[0] > MOST * seen[1]:
                camera.supported_ns = one.t_row0_master_ns
            self._ask(number, one.t_row0_master_ns)
        self._note_seen()
        if not self._confirmed:
            return False
        self._latest = frame
        return True

    def _take_map(self, frame: ForegroundFrame) -> None:
        """Judge the track by the foreground of one frame, or look for the hand in it."""
        self._maps[frame.camera] = frame
        if not self._tracking:
            self._begin(frame)
            return
        camera = self._cameras[frame.camera]
        inside, share = on_foreground(self._hand, frame, self._hand.filter.newest.state)
        camera.whole = inside > MOST
        camera.mapped_ns = frame.t_row0_master_ns
        if share > MOST if camera.whole else self._confirmed:
            camera.covered_ns = frame.t_row0_master_ns
        self._note_seen()
        maps = self._newest_maps(frame.t_row0_master_ns)
        if maps is None or maps.t_ns == self._maps_ns or self._waiting:
            return
        self._maps_ns = maps.t_ns
        if not self._confirmed and self._seen_ns > max(self._epoch_ns, maps.t_ns - _SAME_NS):
            self._confirm(maps)
        self._cover(maps)

    def _note_seen(self) -> None:
        """Note when all cameras last showed the hand, and until when they could have."""
        newest_ns = max(max(camera.searched_ns, camera.mapped_ns) for camera in self._cameras)
        delivering = [camera for camera in self._cameras if camera.delivers(newest_ns)]
        if delivering and any(camera.whole for camera in delivering):
            self._seen_ns = max(self._seen_ns, min(camera.seen_ns for camera in delivering))
        self._judged_ns = min((camera.judged_ns for camera in delivering), default=_NEVER)

    def _confirm(self, maps: Maps) -> None:
        """Have the hand looked for once more: two random searches agree on a wrong hand less often than one errs.
        Markers that show the same hand are as good."""
        if maps.t_ns - self._agreed_ns < _SAME_NS:
            self._confirmed = self._ever = True
            return
        found = self._finder.found()
        if found is None:
            self._finder.look(maps)
            return
        pose, t_ns = found
        state, _ = self._hand.filter.predict(self._seconds(t_ns))
        other, _ = self._hand.process.start(pose.world_from_palm, pose.angles, START_SD[:2])
        other[BIAS:], seen = state[BIAS:], maps.silhouettes(self._hand)
        gain = self._hand.score_of(seen, other) - self._hand.score_of(seen, state)
        apart_m = float(np.linalg.norm(joints_of(self._hand, other) - joints_of(self._hand, state), axis=1).mean())
        same = same_hand(self._hand, state, pose)
        if gain > (LEAST_GAIN if same else 0.0) and apart_m > CONFUSED_M:  # it has come in meanwhile, or is another one
            self._start(pose, t_ns)
        elif same:
            self._confirmed = self._ever = True
        else:
            self._finder.look(maps)

    def _cover(self, maps: Maps) -> None:
        """Move the hand to where it covers the foreground better, if it has come to cover it worse than of late. What
        was found beside the frames is compared in the newest of them."""
        hand, knot = self._hand, self._hand.filter.newest
        seen, moved = maps.silhouettes(hand), self._finder.moved()
        covered = hand.covered(seen, knot.state)
        worse = hand.cover != 0.0 and covered < hand.cover - COVER_DROP
        if worse and moved is not None and hand.score_of(seen, moved) > hand.score_of(seen, knot.state) + LEAST_GAIN:
            hand.restart(knot.t_s, moved)
            self._starts += 1
            for number, camera in enumerate(self._cameras):
                if camera.newest is not None:
                    self._ask(number, camera.newest.t_row0_master_ns)
            return
        if worse:
            self._finder.relocate(maps, knot.state, knot.covariance, 1e-9 * self._cameras[0].period_ns)
        hand.cover += (COVER_SHARE if hand.cover else 1.0) * (covered - hand.cover)

    # -- the track -----------------------------------------------------------------------------------------------------

    def _begin(self, frame: ForegroundFrame) -> None:
        """Start where the finder has found a hand, or let it look in the newest maps."""
        found = self._finder.found()
        if found is not None:
            pose, t_ns = found
            self._start(pose, t_ns)
            return
        maps = self._newest_maps(frame.t_row0_master_ns)
        if maps is not None:
            self._finder.look(maps)

    def _newest_maps(self, t_ns: int) -> Maps | None:
        """The maps of all cameras that deliver frames, of about one moment; None while one is missing."""
        maps: list[ForegroundFrame | None] = []
        for camera, one in zip(self._cameras, self._maps, strict=True):
            fresh = one is not None and abs(t_ns - one.t_row0_master_ns) < _SAME_NS
            if camera.delivers(t_ns) and not fresh:
                return None
            maps.append(one if fresh else None)
        return Maps(t_ns, [None if one is None else one.probability for one in maps])

    def _start(self, pose: HandPose, t_ns: int) -> None:
        self._hand.start(pose, t_ns)
        self._hand.cover = 0.0
        self._starts += 1
        self._finder.reset()
        if self._markers is not None:
            self._markers.begin(self._hand)
        self._epoch_ns, self._seen_ns, self._marked = t_ns, t_ns, []
        self._judged_ns = self._maps_ns = self._agreed_ns = _NEVER
        self._tracking, self._confirmed = True, False
        for number, camera in enumerate(self._cameras):
            camera.supported_ns = camera.covered_ns = camera.searched_ns = camera.mapped_ns = _NEVER
            if camera.newest is not None:
                camera.answered_ns = camera.newest.t_row0_master_ns  # it is waited for
                self._ask(number, max(camera.newest.t_row0_master_ns, t_ns))

    def _give_up(self) -> None:
        self._tracking = self._confirmed = False
        self._hand.tracking = False
        self._hand.frames = [None] * len(self._names)
        self._finder.reset()
        self._waiting, self._marked = {}, []
        for camera in self._cameras:
            camera.asked_ns = camera.answered_ns = _NEVER

    def _lost(self, t_ns: int) -> bool:
        """Whether the cameras have not shown the hand for too long, or their images contradict it."""
        period_ns = min(camera.period_ns for camera in self._cameras)
        silent_ns = max(LOST_AFTER_NS, 2 * LOST_AFTER_PERIODS * period_ns)
        wrong_ns = max(WRONG_AFTER_NS, WRONG_AFTER_PERIODS * period_ns) if self._confirmed else silent_ns
        return bool(t_ns - self._seen_ns > silent_ns + 2 * period_ns or self._judged_ns - self._seen_ns > wrong_ns)

    def _weigh(self, waiting: dict[int, tuple[EdgeFrame, ContourFrame]]) -> None:
        """Estimate, PASSES times with the same edges: each expects the contour twice as near."""
        hand, times_ns = self._hand, [one.t_row0_master_ns + _middle_ns(one) for one, _ in waiting.values()]
        t_s = max(self._seconds(max(times_ns)), hand.filter.knots[0].t_s)
        contours = [contour for _, contour in waiting.values()]
        for contour, t_ns in zip(contours, times_ns, strict=True):
            contour.late_s = contour.late_s + (self._seconds(t_ns) - t_s)
        marked = self._marked_with(waiting)
        hand.take(waiting, t_s)
        prediction, spreads = hand.filter.predict(t_s), [contour.expected_sd for contour in contours]
        found: list[BesideContours] = []
        initial = prediction[0]
        if self._markers is not None:
            prediction, found, initial = self._choose(self._markers, marked, Contours(contours), prediction, t_s)
        residuals: list[Residual] = [*found, Contours(contours), *hand.known]
        for number in range(PASSES):
            for contour, spread in zip(contours, spreads, strict=True):
                contour.expected_sd = np.minimum(spread * 0.5**number, CONFUSED_PX)
            if number < PASSES - 1:
                initial = update(hand.process, t_s, prediction, residuals, initial, hand.filter.partial).state
        knot = hand.filter.add(t_s, residuals, prediction, initial)
        if self._markers is not None:
            self._markers.judge(found, knot)

    def _choose(self, markers: MarkersOfHand, marked: list[CameraObservations], contours: Contours, predicted: Estimate,
                t_s: float) -> tuple[Estimate, list[BesideContours], Array]:
        """The prediction, what the markers say of it, and where the contours are looked for: where it has the hand, or,
        after markers have contradicted it, where these would show a less certain hand, whichever explains both best."""
        hand, t_ns = self._hand, self._epoch_ns + round(1e9 * t_s)
        found, wide = markers.residuals(marked, hand, predicted, t_ns), markers.widened(*predicted)
        if not found or wide is None:
            return predicted, found, predicted[0]
        again, stationary = markers.residuals(marked, hand, wide, t_ns), hand.process.stationary
        residuals: list[Residual] = [*again, *hand.known]
        state = update(hand.process, t_s, wide, residuals, None, hand.filter.partial).state
        state = update(hand.process, t_s, wide, [*residuals, contours], state, hand.filter.partial).state
        away = hand.process.difference(state, predicted[0])[:POSE]
        cost = (2.0 * RELOCATION_LOG_ODDS + float(away @ np.linalg.solve(wide[1][:POSE, :POSE], away))
                + _cost(again, contours, state, stationary))
        if cost < _cost(found, contours, predicted[0], stationary):
            return wide, again, state
        return predicted, found, predicted[0]

    def _take_markers(self, frame: CameraObservations) -> bool:
        """Begin with one frame's markers, or keep them until the edges of the same frame come, so that both are weighed
        at once; weigh those alone whose edges do not come. Whether these showed anything."""
        assert self._markers is not None
        if not (self._tracking and self._confirmed):
            self._locate(frame)
        if not self._tracking:
            return False
        frames = [*self._marked, frame]
        self._marked = [one for one in frames if self._comes(one)]
        try:
            return self._weigh_alone([one for one in frames if not self._comes(one)])
        except np.linalg.LinAlgError:  # the estimate contradicts itself
            self._give_up()
            return False

    def _locate(self, frame: CameraObservations) -> None:
        """Begin where the markers show a hand, or see whether they show the one that is followed."""
        assert self._markers is not None
        found = self._markers.locate(frame)
        if found is None:
            return
        pose, t_ns = found
        if self._tracking and same_hand(self._hand, self._hand.filter.newest.state, pose):
            self._agreed_ns = t_ns
        else:
            self._start(pose, t_ns)

    def _comes(self, frame: CameraObservations) -> bool:
        """Whether the edges of a frame may still come."""
        camera = self._cameras[frame.camera]
        assert camera.newest is not None
        return (camera.newest.t_row0_master_ns - frame.t_row0_master_ns < 1.5 * camera.period_ns
                and frame.t_row0_master_ns - camera.answered_ns < WRONG_AFTER_PERIODS * camera.period_ns)

    def _marked_with(self, waiting: dict[int, tuple[EdgeFrame, ContourFrame]]) -> list[CameraObservations]:
        """The markers of the frames whose edges are `waiting`. Those of earlier frames are weighed alone."""
        edges_ns = {number: frame.t_row0_master_ns for number, (frame, _) in waiting.items()}
        marked = self._marked
        self._marked = [one for one in marked if one.t_row0_master_ns > edges_ns.get(one.camera, _NEVER)]
        self._weigh_alone([one for one in marked if one.t_row0_master_ns < edges_ns.get(one.camera, _NEVER)])
        return [one for one in marked if one.t_row0_master_ns == edges_ns.get(one.camera, _NEVER)]

    def _weigh_alone(self, frames: Sequence[CameraObservations]) -> bool:
        """Weigh the markers of some frames. Whether they showed anything. Raises LinAlgError."""
        assert self._markers is not None or not frames
        return self._markers is not None and bool(
            sum(self._markers.weigh(one, self._hand, self._epoch_ns) for one in frames))

    # -- requests ------------------------------------------------------------------------------------------------------

    def _look(self, frame: CameraObservations) -> None:
        """Have the node send foreground maps."""
        camera = self._cameras[frame.camera]
        if not 0 <= frame.t_row0_master_ns - camera.asked_ns < RENEW_NS:
            camera.asked_ns = frame.t_row0_master_ns
            self._requests.append(SliceRequest(frame.camera, np.empty((0, 5)), STEP))

    def _ask(self, number: int, t_row0_ns: int) -> None:
        """Have the node search the frame after the one at `t_row0_ns`, where the hand will be then."""
        camera, model = self._cameras[number], self._hand.cameras[number]
        camera.target_ns = t_row0_ns + round(camera.period_ns)
        middle_ns = round(0.5e9 * self._hand.row_s[number] * model.height)
        state, covariance = self._hand.filter.predict(self._seconds(camera.target_ns + middle_ns))
        contour = asked(self._hand, number, state, covariance, STEP_M)
        if len(contour.slices) > SLICES_MAX:
            contour = asked(self._hand, number, state, covariance, STEP_M * len(contour.slices) / SLICES_MAX)
        self._requests = [one for one in self._requests if one.camera != number]
        self._requests.append(SliceRequest(number, contour.slices[:SLICES_MAX], STEP,
                                           _Expected(self._starts, contour)))

    def _contour(self, frame: EdgeFrame) -> ContourFrame | None:
        """The contour on the slices that were searched, with their edges: as it was expected, or in a log as it is
        now."""
        expected = frame.request.expected
        if isinstance(expected, _Expected) and expected.contour.surface is self._hand.surface:
            if expected.start != self._starts or len(expected.contour.slices) != len(frame.request.slices):
                return None  # it was asked about the hand as it was taken to be before, and would pull this one there
            contour = copy.copy(expected.contour)  # for this frame
            contour.observe(frame.edges)
            return contour
        middle_ns = round(0.5e9 * self._hand.row_s[frame.camera] * self._hand.cameras[frame.camera].height)
        state, covariance = self._hand.filter.predict(self._seconds(frame.t_row0_master_ns + middle_ns))
        return matched(self._hand, frame, state, covariance)

    # -- times and states ----------------------------------------------------------------------------------------------

    def _seconds(self, t_ns: int) -> float:
        return 1e-9 * (t_ns - self._epoch_ns)

    def _time_ns(self) -> int:
        return self._epoch_ns + round(1e9 * self._hand.filter.newest.t_s)

    def _state(self, frame: CameraObservations | EdgeFrame, begun: float) -> HandState:
        newest = self._hand.filter.newest if self._tracking else None
        wide = self._markers.widened(newest.state, newest.covariance) if self._markers and newest else None
        hand = self._hand.state(begun, wide and wide[1]) if self._tracking and self._confirmed else no_hand(
            frame.t_row0_master_ns, Condition.LOST if self._ever else Condition.SEARCHING)
        return published(hand, self._sequence - 1, frame, self.newest_frames(), self._rig.markers.ids, self._names,
                         time.perf_counter() - begun)


def _cost(markers: list[BesideContours], contours: Contours, state: Array, stationary: Array) -> float:
    """-2 log of how probable a hand in `state` makes its markers and contours, but for a constant."""
    cost = float(np.sum(contours.linearise(state).error ** 2))
    return cost + sum(one.cost(state, stationary) for one in markers)


def _middle_ns(frame: EdgeFrame) -> int:
    """From the exposure of row 0 to that of the mean row of the slices, ns."""
    slices = frame.request.slices
    return round(float(slices[:, 1].mean()) * frame.row_time_ns) if len(slices) else 0
