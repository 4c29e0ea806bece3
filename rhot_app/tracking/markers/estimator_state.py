"""What the estimator publishes: places with covariances, how each is known, and the cameras' own triangulation."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.track import NEVER
from rhot_app.geometry.camera import project_with_slope, scales_of
from rhot_app.hand.kinematics import point_covariances
from rhot_app.hand.landmarks import DISAGREEMENT_M
from rhot_app.hand.motion.hand_state import POSE, STATE, TANGENT
from rhot_app.hand.skeleton import FINGER_OF_ANGLE, FINGER_OF_JOINT, JOINTS, TIP_ROLES, WRIST_ROLE
from rhot_app.state import (
    INFERRED_M,
    INFERRED_RAD,
    MEASURED_M,
    MEASURED_RAD,
    Condition,
    HandState,
    Knowledge,
    no_hand,
)
from rhot_app.tracking.association import GATE
from rhot_app.tracking.locate import Views, empty_places, locate_all, rig_table, turn_band
from rhot_app.tracking.markers.marker_model import MarkerModel, project_marker, scaled_table
from rhot_app.tracking.markers.marker_residual import (
    CENTROID_KERNEL,
    SIZE_S,
    SIZE_SD,
    MarkerFrame,
    expected_turn,
    fill_centre,
    place_points,
)
from rhot_app.tracking.pairing import DOUBTFUL, SAME_FRAME_NS
from rhot_app.tracking.rig_arrays import RigArrays
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SIZE_FRAMES = 10
"""Frames in which a fingertip's size is learnt before it is used."""

SIZE_FLOOR = 0.005
"""Standard deviation of the logarithm of a fingertip's width by what the pose and the light change about it, at least
(`python benchmarks/marker_errors.py`)."""

_SIZE_MEMORY = 200  # frames over which a fingertip's size is averaged
_RECENT = 12
_PERIODS, _LEARN = 1.5, 0.1
_FRESH_NS = 60_000_000  # before a camera's second frame
_SLOWEST_NS = 400_000_000
_SLOWEST_CLEAR_NS = 150_000_000
_LOST = int(MarkerFlag.LOST)

_INLIER_WEIGHT = float(CENTROID_KERNEL.weights(np.array([GATE]), np.array([2]))[0])  # at the gate

_MEASURED, _INFERRED, _GUESSED = int(Knowledge.MEASURED), int(Knowledge.INFERRED), int(Knowledge.GUESSED)
_FIRST_TIP, _FIRST_MARKER = len(JOINTS), len(JOINTS) + len(TIP_ROLES)


ACCEPTED = np.dtype([("t_ns", "i8"), ("late_s", "f8"), ("pixel", "f8", 2), ("covariance", "f8", (2, 2)),
                     ("doubtful", "?")])
"""An inlier: master time of its frame, how much later its row was, px and px^2."""


LEARNT = np.dtype([("log_width", "f8"), ("variance", "f8"), ("frames", "f8")])
"""How wide a fingertip is: the mean of the logarithm, its variance, and of how many frames."""


class RecentObservations:
    """The last accepted observation of each of M markers by each of C cameras, `accepted` (C, M), and the cameras'
    frames. `newest`: each camera's newest frame."""

    def __init__(self, rig: RigArrays, markers: MarkerModel) -> None:
        self._shape = len(rig.camera_names), len(rig.marker_ids)
        self._markers = markers
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        cameras, markers = shape = self._shape
        self.accepted = np.zeros(shape, ACCEPTED)
        self.accepted["t_ns"], self.accepted["covariance"] = NEVER, np.eye(2)
        self.fresh_ns, self.periods_s = np.full(cameras, _FRESH_NS), [1e-9 * _FRESH_NS / _PERIODS] * cameras
        self._paced = [False] * cameras
        self.newest: list[CameraObservations | None] = [None] * cameras
        self.pixels, self.flags = np.full((*shape, 2), np.nan), np.full(shape, _LOST, np.uint16)
        self._frames: list[MarkerFrame] = []
        self._learnt = np.zeros(markers, LEARNT)
        self._learnt["variance"] = SIZE_SD**2

    @property
    def shortest_period_s(self) -> float:
        """Frame period of the quickest camera, s."""
        return min((period for period, frame in zip(self.periods_s, self.newest, strict=True) if frame is not None),
                   default=1e-9 * _FRESH_NS)

    def enter(self, frame: MarkerFrame) -> bool:
        """Take a frame in; False when it came before. Markers and landmarks of one image come apart."""
        observations = frame.observations
        camera, begin = observations.camera, observations.t_row0_master_ns
        if any(other.camera == camera and abs(other.observations.t_row0_master_ns - begin) < SAME_FRAME_NS
               and ((other.seen & frame.seen).any() or not frame.seen.any()) for other in self._frames):
            return False
        self._frames = [*self._frames[1 - _RECENT:], frame]
        last = self.newest[camera]
        since = begin - last.t_row0_master_ns if last is not None else _SLOWEST_NS
        if since > 0 or since < -_SLOWEST_NS:
            if 0 < since < _SLOWEST_NS:
                share = _LEARN if self._paced[camera] else 1.0
                self._paced[camera] = True
                self.periods_s[camera] += share * (1e-9 * since - self.periods_s[camera])
                self.fresh_ns[camera] = round(1e9 * _PERIODS * self.periods_s[camera])
            self.newest[camera] = observations
            self.pixels[camera], self.flags[camera] = observations.pixels, observations.flags
        return True

    def recent(self, since_ns: int) -> list[MarkerFrame]:
        """The frames of the last moments that are not earlier than `since_ns`, in the order of time."""
        return sorted((frame for frame in self._frames if frame.t_ns >= since_ns), key=lambda frame: frame.t_ns)

    def note_sizes(self, frame: MarkerFrame, state: Array) -> None:
        """Learn how wide each fingertip is, and how much that varies, while another camera sees it too. The frame uses
        it for the others. A fingertip that looks smaller is partly hidden, and its centroid is less certain."""
        widths, since_ns = frame.widths(state), frame.t_ns - 2 * int(self.fresh_ns.max())
        frame.covariances = frame.covariances.copy()
        frame.log_width, frame.size_sd = np.full(len(widths), np.nan), np.empty(len(widths))
        correlated = max(SIZE_S / self.periods_s[frame.camera], 1.0)  # frames that count as one observation
        _learn(widths, self.accepted, frame.camera, since_ns, correlated, frame.observed, self._learnt)

    def accept(self, frame: MarkerFrame, state: Array, weights: Array) -> Mask:
        """Note the observations of a frame, after which the hand is in `state`; returns which are inliers (M,)."""
        return np.asarray(_accept(frame.observed, frame.t_ns, frame.expected(state), weights,
                                  self.accepted[frame.camera]))


class EstimatorStates:
    """Makes states of estimates. `turns` (C,): the `expected_turn` of the last one."""

    def __init__(self, rig: RigArrays, markers: MarkerModel, observations: RecentObservations) -> None:
        self._rig, self._markers, self._observations = rig, markers, observations
        one, other = markers.model.dh, markers.dh
        self._file_size = self._dh = one._replace(point_row=np.concatenate([one.point_row, other.point_row]),
                                point_offset=np.concatenate([one.point_offset, other.point_offset]))
        self._tips = np.array([markers.marker_of(role) for role in TIP_ROLES])
        self._wrist = markers.marker_of(WRIST_ROLE)
        self._shapes = rig.shapes.copy()
        self._scale, self._scale_sd = 1.0, 0.0
        self.turns = markers.turn_sd

    def resize(self, scale: float, sd: float) -> None:
        """Describe a hand `scale` times as large as its file says, with a standard deviation of the logarithm."""
        self._dh, self._scale, self._scale_sd = scaled_table(self._file_size, scale), scale, sd

    def describe(self, t_ns: int, state: Array, covariance: Array, sequence: int, newest: CameraObservations,
                 begun: float, *, by_one: bool = False) -> HandState:
        """The state of master time `t_ns`; work on it began at `begun`, s of `time.perf_counter`. `by_one`: one camera
        alone has found the hand, so it is as far as a hand of the file's size is."""
        solved, rig, observations, m = time.perf_counter(), self._rig, self._observations, self._markers
        self.turns = expected_turn(state, covariance, m.arrays)
        state = state.copy()
        state[STATE.angles] = np.minimum(np.maximum(state[STATE.angles], m.limits[:, 0]), m.limits[:, 1])
        count = len(rig.marker_ids)
        last, age = observations.accepted, np.abs(t_ns - observations.accepted["t_ns"])
        fresh = age <= observations.fresh_ns[:, None]
        clear = fresh & ~last["doubtful"] & (observations.fresh_ns[:, None] <= _SLOWEST_CLEAR_NS)
        shown = np.count_nonzero(clear, axis=0) >= 2
        raw = empty_places(count)
        markers, joints, angles = np.empty(count, np.uint8), np.empty(21, np.uint8), np.empty(21, np.uint8)
        angle_sd = np.empty(21)
        late_s = np.where(fresh, 1e-9 * (last["t_ns"] - t_ns) + last["late_s"], 0.0)
        points, covariances, motion_sd, aligned = _place(state, covariance, self._dh, m.arrays, last["pixel"], late_s)
        if rig.band_half_axes is not None:
            world = pose_matrix(state)
            turn_band(world, rig.band_half_axes, self._shapes[rig.wrist])
        used = fresh & (np.count_nonzero(fresh, axis=0) > 1)
        locate_all(Views(aligned, last["covariance"], used), rig_table(rig, self._shapes), raw)
        if by_one:
            covariance = covariance.copy()
            seeing = int(np.argmax(last["t_ns"].max(axis=1)))
            self._doubt_distance(seeing, points, covariances, state, covariance)
        palm = _conclude(covariance, covariances, shown, m.finger, markers, joints, angles, angle_sd)
        # two frames may be missing, but not of most markers: without any, a fast hand is centimetres off
        in_sight = (not by_one
                    and (np.count_nonzero(age <= 2 * observations.fresh_ns[:, None], axis=0) > 1).all()
                    and np.mean(np.count_nonzero(fresh, axis=0) > 1) > 0.5
                    and np.mean(markers < _GUESSED) > 0.5
                    and not self._contradicted(points[_FIRST_MARKER:], aligned, fresh))
        world, deviation = pose_matrix(state), np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return HandState(
            sequence=sequence, t_master_ns=t_ns, t_receive_ns=newest.t_receive_ns,
            condition=Condition.TRACKING if in_sight else Condition.PARTIAL,
            marker_ids=rig.marker_ids, marker_positions=points[_FIRST_MARKER:], marker_raw_positions=raw.positions,
            marker_covariances=covariances[_FIRST_MARKER:], marker_knowledge=markers,
            camera_names=rig.camera_names, camera_pixels=observations.pixels.copy(),
            camera_flags=observations.flags.copy(),
            joint_positions=points[:_FIRST_TIP], joint_knowledge=joints,
            fingertip_positions=points[_FIRST_TIP:_FIRST_MARKER], angles=state[STATE.angles].copy(),
            angle_knowledge=angles, world_from_palm=world, palm_knowledge=Knowledge(palm), epipolar_error_px=raw.errors,
            joint_covariances=covariances[:_FIRST_TIP], angle_sd=angle_sd,
            fingertip_covariances=covariances[_FIRST_TIP:_FIRST_MARKER],
            palm_covariance=covariance[TANGENT.palm, TANGENT.palm].copy(), velocity=state[STATE.velocity].copy(),
            acceleration=state[STATE.acceleration].copy(), velocity_sd=deviation[TANGENT.velocity],
            acceleration_sd=deviation[TANGENT.acceleration], joint_velocity_sd=motion_sd[0],
            joint_acceleration_sd=motion_sd[1], hand_scale=self._scale,
            hand_scale_sd=self._scale_sd,
            latency_s=_latency(newest, solved - begun, time.perf_counter() - solved))

    def _doubt_distance(self, camera: int, points: Array, covariances: Array, state: Array, covariance: Array) -> None:
        """Add what `camera` cannot show: hand and distance may be larger or smaller together, about its centre."""
        variance = (self._scale_sd if self._scale_sd > 0.0 else self._markers.size_sd) ** 2
        centre = self._rig.cameras[camera, :, :3].T @ -self._rig.cameras[camera, :, 3]
        away = points - centre
        covariances += variance * away[:, :, None] * away[:, None, :]
        palm = state[STATE.palm].reshape(3, 4)[:, 3] - centre
        covariance[:3, :3] += variance * np.outer(palm, palm)

    def _contradicted(self, points: Array, aligned: Array, fresh: Mask) -> bool:
        """Whether the landmarks that are seen (C, M) say that the hand whose markers are at `points` (M, 3) m is not
        theirs: the rig, its times or the bones are wrong. `aligned` (C, M, 2) px: brought to the state's time."""
        errors_m = [np.zeros(0)]
        for camera, seen in enumerate(fresh & self._markers.landmark):
            if seen.any():
                expected, slopes = project_with_slope(points[seen], self._rig.cameras[camera],
                                                      self._rig.intrinsics[camera])
                errors_m.append(np.linalg.norm(aligned[camera, seen] - expected, axis=1) / scales_of(slopes))
        known = np.concatenate(errors_m)
        known = known[np.isfinite(known)]
        return bool(len(known)) and float(np.median(known)) > DISAGREEMENT_M

    def none(self, sequence: int, condition: Condition, newest: CameraObservations, begun: float) -> HandState:
        """No hand: what the cameras see is all there is."""
        return replace(
            no_hand(newest.t_row0_master_ns, condition, self._rig.camera_names, markers=self._rig.marker_ids),
            sequence=sequence, t_receive_ns=newest.t_receive_ns, camera_pixels=self._observations.pixels.copy(),
            camera_flags=self._observations.flags.copy(), hand_scale=self._scale, hand_scale_sd=self._scale_sd,
            latency_s=_latency(newest, time.perf_counter() - begun))


def _latency(newest: CameraObservations, filter_s: float, solve_s: float = 0.0) -> dict[str, float]:
    return {"detect": newest.detect_s, "network": newest.network_s, "pair": 0.0, "triangulate": 0.0,
            "filter": filter_s, "solve": solve_s}


@njit(cache=True)
def _learn(widths, accepted, camera, since_ns, correlated, observed, learnt):
    """Learn from `widths` (M,), NaN for none, of markers that another camera has seen since `since_ns`, and widen the
    covariances of those that are narrower than known; fill the `log_width` of the others, and all `size_sd`."""
    for m in range(widths.shape[0]):
        one = learnt[m]
        observed.size_sd[m] = math.sqrt((one.variance + SIZE_FLOOR**2) * correlated)
        if math.isnan(widths[m]):
            continue
        wider, known, both = widths[m] - one.log_width, one.frames >= SIZE_FRAMES, False
        for other in range(accepted.shape[0]):
            both |= other != camera and accepted[other, m].t_ns > since_ns
        if not both:
            observed.log_width[m] = one.log_width if known else math.nan
            continue
        if known and wider < -SIZE_SD:  # a cap of the disc is hidden; its centroid moves so far, in any direction
            for i in range(2):
                observed.covariances[m, i, i] += 0.5 * (wider * observed.diameters[m]) ** 2
        one.frames = min(one.frames + 1.0, _SIZE_MEMORY)
        one.log_width += wider / one.frames
        if one.frames > 1.0:
            one.variance += (wider * wider - one.variance) / one.frames


@njit(cache=True)
def _accept(observed, t_ns, expected, weights, accepted):
    """Take one camera's inliers over into its row (M,) of what is `accepted`; returns which they are. `weights` begin
    with those of the markers that are seen."""
    inlier = np.zeros(len(observed.seen), np.bool_)
    for k, m in enumerate(np.flatnonzero(observed.seen)):
        inlier[m] = weights[k] > _INLIER_WEIGHT and not math.isnan(expected[m, 0])
        one = accepted[m]
        if inlier[m] and t_ns >= one.t_ns:
            one.t_ns, one.late_s, one.doubtful = t_ns, observed.late_s[m], (observed.flags[m] & DOUBTFUL) != 0
            one.pixel[:], one.covariance[:] = observed.pixels[m], observed.covariances[m]
    return inlier


@njit(cache=True)
def _place(state, covariance, dh, markers, observed, late_s):
    """Points (26 + M, 3) m with their covariances, (2, 21) m/s and m/s^2: standard deviations of the joints' velocities
    and accelerations, and (C, M, 2) px: each camera's last `observed` (C, M, 2) pixel of a marker, `late_s` (C, M)
    after the state's instant, carried there by the hand's motion alone."""
    world, _, points, jacobian = place_points(state, dh)
    own, scratch, motion_sd = np.arange(POSE), np.empty((_FIRST_TIP, 3, 3)), np.empty((2, _FIRST_TIP))
    covariances, aligned = np.empty((points.shape[0], 3, 3)), np.empty(observed.shape)
    point_covariances(jacobian, own, covariance, covariances)
    for order in range(2):
        point_covariances(jacobian[:_FIRST_TIP], own + POSE * (order + 1), covariance, scratch)
        for p in range(_FIRST_TIP):
            motion_sd[order, p] = _sd(scratch[p])
    place, then, slope = np.empty(2), np.empty(2), np.empty((2, 3))
    centre = np.empty(3)
    for camera in range(observed.shape[0]):
        pose, intrinsics = markers.poses[camera], markers.intrinsics[camera]
        for m in range(observed.shape[1]):
            point, by_pose, body = points[_FIRST_MARKER + m], jacobian[_FIRST_MARKER + m], markers.half_axes[m]
            fill_centre(state, m, late_s[camera, m], point, by_pose, centre)
            there = project_marker(centre, world, body, pose, intrinsics, then, slope)
            fill_centre(state, m, 0.0, point, by_pose, centre)
            there &= project_marker(centre, world, body, pose, intrinsics, place, slope)
            for i in range(2):
                aligned[camera, m, i] = observed[camera, m, i] + place[i] - then[i] if there else math.nan
    return points, covariances, motion_sd, aligned


@njit(cache=True)
def _conclude(covariance, covariances, shown, finger, markers, joints, angles, angle_sd):
    """How each value is known; returns that of the palm.

    What is measured, the images alone determine; what they determine through the pose prior is inferred. A fingertip
    needs its marker, an inner joint two markers on its finger, the palm's rotation three on the palm, an angle two on
    its finger beside those.
    """
    count = np.zeros(6, np.int64)  # markers measured on the palm, then on each finger
    for m in range(finger.shape[0]):
        markers[m] = _know(_sd(covariances[_FIRST_MARKER + m]), shown[m], MEASURED_M, INFERRED_M)
        count[finger[m] + 1] += markers[m] == _MEASURED
    turn = count[0] >= 3
    for joint in range(21):
        needed = 2 if FINGER_OF_JOINT[joint] >= 0 and (joint - 1) % 4 < 3 else 1
        joints[joint] = _know(_sd(covariances[joint]), count[FINGER_OF_JOINT[joint] + 1] >= needed, MEASURED_M,
                              INFERRED_M)
    for angle in range(21):
        angle_sd[angle] = math.sqrt(max(covariance[6 + angle, 6 + angle], 0.0))
        angles[angle] = _know(angle_sd[angle], turn and count[FINGER_OF_ANGLE[angle] + 1] >= 2, MEASURED_RAD,
                              INFERRED_RAD)
    return _know(_sd(covariance[3:6, 3:6]), turn, MEASURED_RAD, INFERRED_RAD)


@njit(cache=True)
def _know(sd, shown, measured, inferred):
    if sd <= measured and shown:
        return _MEASURED
    return _INFERRED if sd <= inferred else _GUESSED


@njit(cache=True)
def _sd(covariance):
    return math.sqrt(max(covariance[0, 0] + covariance[1, 1] + covariance[2, 2], 0.0))
