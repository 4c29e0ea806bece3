"""The estimator: one hand from every marker that any camera sees, each at its own time.

Rehg's idea (1995, chapter 2): one kinematic model, every observation a residual on it. Cameras need no synchronisation,
a marker that one camera sees counts, and what no marker observes follows the pose prior. Here are
association, loss and re-acquisition; the estimation itself is in `rhot_app.estimation`.
"""

from __future__ import annotations

import copy
import math
import time
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import CalibrationAccuracy
from rhot_app.diagnostics import Diagnostics
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.track import LOST_NS, NEVER, PREDICTED_NS, SESSION_NS, Life, TrackFilter
from rhot_app.geometry.camera import undistort_points
from rhot_app.geometry.turns import turns_covariance
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.landmarks import LASTING_S
from rhot_app.hand.motion.hand_process import HandProcess
from rhot_app.hand.motion.hand_state import MOTION, STATE, TANGENT
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import ANGLE_SLICES, HandPose
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState
from rhot_app.tracking.association import GATE, MarkerAssociation
from rhot_app.tracking.locate import Located
from rhot_app.tracking.markers.acquisition import START_SD, Starter, pose_before_camera, pose_on_plane
from rhot_app.tracking.markers.estimator_state import EstimatorStates, RecentObservations
from rhot_app.tracking.markers.hand_size import HandSize
from rhot_app.tracking.markers.marker_model import TURN_SD_RAD, MarkerModel, compile_markers
from rhot_app.tracking.markers.marker_residual import MarkerFrame, lasting_covariances
from rhot_app.tracking.rig_arrays import RigArrays, compile_rig
from rhot_app.tracking.tracker import CameraFrame, CameraObservations, HandFrame, Tracker
from rhot_app.tracking.trust import JUMP_FLOOR_M
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]

REJECTIONS = 2
"""Observations rejected in a row that are no outliers: of one in ten mistaken, two in a row have a chance of 1 %."""

KNOCKED, KNOCK_MOST = 3, 100.0
"""Markers that a camera rejects so at once, half or more of those that it sees: it has been knocked. Two may be fingers
that bend faster than expected, or things of their colours. And the variance of the cameras' turns, over TURN_SD_RAD's,
up to which it grows with every such frame: knocks of some ten milliradians (half a degree)."""

_PENDING = 16


Kept = TypeVar("Kept")


@dataclass(frozen=True, slots=True)
class Weighed:
    """What a state is made of beside its knot: the frame that was weighed, and, as they were after it, the other
    `recent` observations, the process, the hand's scale with its standard deviation, and whether one camera alone had
    begun the hand."""

    frame: CameraObservations
    recent: RecentObservations
    process: HandProcess
    scale: tuple[float, float]
    by_one: bool


def copied(original: Kept) -> Kept:
    """A copy with arrays of its own."""
    out = copy.copy(original)
    for name, value in vars(original).items():
        if isinstance(value, np.ndarray):
            setattr(out, name, value.copy())
    return out


class Estimator(Tracker):
    """Implements `Tracker`: a state after every frame."""

    def __init__(self, rig: Rig) -> None:
        """Raises RigError when a marker has no place on the hand."""
        self.diagnostics = Diagnostics()
        self._rig, self._markers = compile_rig(rig), compile_markers(rig)
        self._tracked_with = rig.tracked_with
        self._file_size, prior = self._markers, self._markers.pose_prior
        self._size: HandSize | None = None
        if rig.tracker.float_scale:
            self._size = HandSize(self._markers.dh, self._markers.limits, prior, self._markers.paint_variance)
        self._process = self._markers.process()
        plane = rig.tracker.palm_plane
        self._plane = None if plane is None else PalmOnPlane(plane)
        self._filter, self._life = TrackFilter(self._process), Life()
        self._scale = 1.0, 0.0
        self._starter = Starter(self._rig, self._markers)
        self._association = MarkerAssociation(self._rig)  # without a prediction, by rays
        self._observations = RecentObservations(self._rig, self._markers)
        self._states = EstimatorStates(self._rig, self._markers, self._observations)
        self._sequence = 0
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states."""
        self._pending: list[CameraObservations | HandFrame] = []
        self._starter.reset()
        self._association.reset()
        self._observations.reset()
        if self._size is not None:
            self._size.reset()
            self._resize(*self._size.known)
        self._life, self._by_one = Life(), False
        self._filter.end()
        self._rejections = Rejections(self._rig, self._markers)
        self._states.turns = self._markers.turn_sd

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame in; it is weighed by the next `solve`."""
        if isinstance(frame, CameraObservations | HandFrame) and self._tracked_with[frame.camera]:
            self._pending = [*self._pending[1 - _PENDING:], frame]

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first."""
        return tuple(self._observations.newest)

    def solve(self) -> HandState | None:
        """The state after the frames since the last one, None without any."""
        pending, self._pending = self._pending, []
        begun = time.perf_counter()
        taken = []
        for frame in pending:
            if isinstance(frame, HandFrame):
                self._weigh(frame)
            elif self._take(frame):
                taken.append(frame)
        if not taken:
            return None
        if self._size is not None:
            self._size.work()
            self._resize(*self._size.follow(taken[-1].t_row0_master_ns))
        self._sequence += 1
        if not self._life.alive:
            return self._states.none(self._sequence - 1, Condition.LOST if self._life.ever else Condition.SEARCHING,
                                     taken[-1], begun)
        knot = self._filter.newest
        return self._states.describe(self._filter.newest_ns, knot.state, knot.covariance, self._sequence - 1,
                                      taken[-1], begun, by_one=self._by_one)

    def published_error(self, stated: CalibrationAccuracy) -> CalibrationAccuracy:
        """See `Tracker`. Cameras that are found to be turned otherwise than the rig says are so about the axis, too,
        about which this cannot be found."""
        turns = np.where(self._tracked_with, self._states.turns, 0.0)
        return stated.with_turns(turns, self._markers.reference)

    def _take(self, observations: CameraObservations) -> bool:
        """Weigh one frame; False when it came before."""
        frame = MarkerFrame(self._markers, observations)
        if self._life.alive and abs(frame.t_ns - self._filter.newest_ns) > SESSION_NS:
            self._give_up()
            self._observations.reset()
        too_late = self._life.alive and self._filter.forgot(frame.t_ns)
        if too_late or not self._observations.enter(frame):
            return False
        chosen = self._association.select(observations)
        if not self._life.alive or self._by_one or self._size is not None:
            self._starter.ingest(chosen)
        if not self._life.alive or self._by_one:
            located = self._starter.locate()
            scale = 1.0 if self._size is None else self._size.scale
            pose = None if located is None else self._starter.pose_of(located.positions, scale)
            if located is not None and pose is not None:
                self._by_one = False
                self._start(located.t_ns, pose, located)
                return True
        if not self._life.alive:
            if self._plane is not None:
                pose = pose_on_plane(self._plane, frame, self._process)
                if pose is not None:
                    self._start(frame.t_ns, pose)
            elif self._alone_with(frame):
                pose = pose_before_camera(frame, self._process)
                if pose is not None:
                    self._by_one = True
                    self._start(frame.t_ns, pose)
            return True
        self._update(frame)
        if self._size is not None and (located := self._starter.locate()) is not None:
            state = self._filter.newest.state
            self._size.look(located, pose_matrix(state), state[STATE.angles])
        newest_ns, period_ns = self._filter.newest_ns, 1e9 * self._observations.shortest_period_s
        if self._life.lost(newest_ns, period_ns) or self._life.wrong(newest_ns, period_ns):
            self._give_up()
        return True

    def _weigh(self, frame: HandFrame) -> None:
        """Weigh what another kind observes of a hand that is tracked."""
        if not self._life.alive:
            return
        try:
            self._filter.weigh(frame.t_ns, frame.residuals, [] if self._plane is None else [self._plane])
        except np.linalg.LinAlgError:  # the estimate contradicts itself
            self._give_up()

    def _alone_with(self, frame: MarkerFrame) -> bool:
        """Whether this camera alone sees landmarks: another one would show how far they are."""
        others = [one for camera, one in enumerate(self._observations.newest) if one is not None
                  and camera != frame.camera and abs(one.t_row0_master_ns - frame.t_ns) < LOST_NS]
        lost = int(MarkerFlag.LOST)
        return bool((frame.seen & self._markers.landmark).any()) and all((one.flags & lost).all() for one in others)

    def _start(self, t_ns: int, pose: HandPose, located: Located | None = None) -> None:
        """Start at a pose and weigh again what was seen since."""
        if self._size is not None:
            self._size.settle()
            if located is not None:
                self._size.look(located, pose.world_from_palm, pose.angles)
            self._resize(*self._size.known)
        state, _ = self._process.start(pose.world_from_palm, pose.angles, START_SD)
        self._process.set_lasting(lasting_covariances(state, self._markers.arrays))
        self._filter.begin(t_ns, *self._process.start(pose.world_from_palm, pose.angles, START_SD))
        self._life.begin(t_ns)
        for frame in self._observations.recent(t_ns):
            self._update(frame)

    def _resize(self, log_scale: float, variance: float) -> None:
        """Let the hand be exp(`log_scale`) times as large as its file says, with `variance` of the logarithm."""
        self._markers = self._file_size.scaled(math.exp(log_scale))
        self._process.dh = self._markers.dh
        self._scale = math.exp(log_scale), math.sqrt(variance)
        self._states.resize(*self._scale)

    def _give_up(self) -> None:
        self._life.end()
        self._filter.end()
        self._starter.reset()

    def _update(self, frame: MarkerFrame) -> None:
        """Associate a frame with the prediction, and weigh it."""
        frame = copy.copy(frame)  # it may be weighed again, by another prediction
        t_s = self._filter.seconds(frame.t_ns)
        candidates = np.count_nonzero(frame.seen)
        prediction = self._filter.predict(t_s)
        self._observations.note_sizes(frame, prediction[0])
        frame.add_landmark_noise(prediction[0])
        pixels, covariances = frame.predict_pixels(*prediction)
        distances = frame.distances(pixels, covariances)
        frame = frame.associated(pixels, covariances, distances)
        self._process.set_lasting(lasting_covariances(prediction[0], self._markers.arrays))
        try:
            knot = self._filter.add(t_s, [frame] if self._plane is None else [frame, self._plane], prediction)
        except np.linalg.LinAlgError:  # the estimate contradicts itself
            self._give_up()
            return
        inliers = self._observations.accept(frame, knot.state, knot.weights)
        if self._filter.history is not None:
            knot.label = Weighed(frame.observations, copied(self._observations), copied(self._process), self._scale,
                                 self._by_one)
        period_s = self._observations.periods_s[frame.camera]
        wrong = self._rejections.wrong(frame, inliers, distances, period_s, knot.state, self._scale[0])
        if wrong:
            inflated = self._filter.newest.covariance.copy()
            for part, factor in wrong:
                self._process.inflate(inflated, part, factor)
            turns = slice(MOTION + 3 * len(frame.seen), None)
            markers, place = self._markers, pose_matrix(knot.state)[:3, 3]
            own, knock = inflated[turns, turns], turns_covariance(
                place, markers.poses, markers.reference, np.full(len(markers.poses), TURN_SD_RAD))
            if len(wrong) >= KNOCKED and 2 * len(wrong) >= candidates and np.trace(own) < KNOCK_MOST * np.trace(knock):
                own += knock
            self._filter.restart(inflated)
        accepted = int(np.count_nonzero(inliers))
        self._life.observe(frame.t_ns, accepted=accepted > 0, plausible=bool(2 * accepted >= candidates))


class Rejections:
    """How often in a row each of C cameras has rejected each of M markers, and where it saw it last meanwhile."""

    def __init__(self, rig: RigArrays, markers: MarkerModel) -> None:
        shape = len(rig.cameras), len(markers.finger)
        self._rig, self._markers, self._counts = rig, markers, np.zeros(shape, np.int64)
        self._pixels, self._times = np.zeros((*shape, 2)), np.full(shape, NEVER, np.int64)

    def wrong(self, frame: MarkerFrame, accepted: Mask, distances: Array, period_s: float, state: Array,
              scale: float) -> list[tuple[slice, float]]:
        """The fingers, and the palm, whose marker one camera has rejected REJECTIONS times in a row: outliers do not
        last, but for things that no hand has there. All rejections of a landmark within the correlation time of its
        error count as one. `distances` (M,): squared Mahalanobis distances, 2 on average. `period_s`: between the
        camera's frames. `state`: of the hand, by the `accepted` ones; `scale`: its size over that of its file. Returns
        where they are in a pose, and the factors by which their covariance is too small."""
        rejected, observations = self._counts[frame.camera], frame.observations
        reported = ((observations.flags & int(MarkerFlag.LOST)) == 0) & np.isfinite(observations.pixels[:, 0])
        refused = reported & ~accepted
        rejected[accepted] = 0
        rejected[refused] += 1
        self._pixels[frame.camera, refused], self._times[frame.camera, refused] = frame.pixels[refused], frame.t_ns
        enough = REJECTIONS * np.where(self._markers.landmark, max(LASTING_S / period_s, 1.0), 1.0)
        often = np.flatnonzero((rejected >= enough) & (distances > GATE))
        found = []
        for m in often[self._may_be_there(often, frame, accepted, state, scale)] if len(often) else ():
            finger = self._markers.finger[m]
            angles = ANGLE_SLICES[finger]
            first = TANGENT.angles.start
            found.append((slice(first + angles.start, first + angles.stop) if finger >= 0 else TANGENT.palm,
                          0.5 * float(distances[m])))
        return found

    def _may_be_there(self, markers: Indices, frame: MarkerFrame, accepted: Mask, state: Array,
                      scale: float) -> Mask:
        """(K,) whether a hand in `state` may have each of `markers` (K,) where this camera sees it: a part of its ray
        is within reach of all accepted markers, and other cameras' rays do not meet it elsewhere."""
        dh, places = frame.markers.dh, np.empty((len(accepted), 3))
        forward_arrays(dh, pose_matrix(state), state[STATE.angles], empty_frames(dh), places)
        reach = scale * self._rig.reach[:, accepted]
        return np.array([self._is_in_reach(m, frame, places[accepted], reach[m]) for m in markers])

    def _is_in_reach(self, m: int, frame: MarkerFrame, others: Array, reach: Array) -> bool:
        """Whether marker m may be there, as far as it can be from `others` (K, 3) m by their `reach` (K,) m."""
        origin, along = self._ray(frame.camera, frame.pixels[m])
        apart = others - origin
        depths = apart @ along
        room = (reach + JUMP_FLOOR_M) ** 2 - (apart * apart).sum(axis=1) + depths**2
        if (room < 0.0).any():
            return False
        nearest = np.max(depths - np.sqrt(room), initial=0.0)
        farthest = np.min(depths + np.sqrt(room), initial=np.inf)
        for camera in range(len(self._counts)):
            if camera != frame.camera and abs(frame.t_ns - self._times[camera, m]) < PREDICTED_NS:
                other, direction = self._ray(camera, self._pixels[camera, m])
                across = along - (along @ direction) * direction
                sine_sq = across @ across
                depth = across @ (other - origin) / sine_sq
                slack = JUMP_FLOOR_M / math.sqrt(sine_sq)
                nearest, farthest = max(nearest, depth - slack), min(farthest, depth + slack)
        return bool(nearest <= farthest)

    def _ray(self, camera: int, pixel: Array) -> tuple[Array, Array]:
        """Origin m and unit direction, world, of a pixel's ray."""
        pose = self._rig.cameras[camera]
        x, y = undistort_points(pixel[None], self._rig.intrinsics[camera])[0]
        direction = np.array([x, y, 1.0]) @ pose[:, :3]
        return -pose[:, 3] @ pose[:, :3], direction / np.linalg.norm(direction)
