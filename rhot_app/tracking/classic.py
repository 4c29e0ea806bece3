"""The thesis's tracker: pair, filter pixels, triangulate, filter positions, fit the palm, solve every finger."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.diagnostics import Diagnostics
from rhot_app.estimation.track import LOST_NS
from rhot_app.filters.one_euro import OneEuroFilter
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.places import with_markers
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES, FINGER_OF_ANGLE, JOINT_SLICES, JOINTS, HandPose
from rhot_app.hand.solvers.finger_ik import solve_fingers_arrays
from rhot_app.hand.solvers.methods import Method, make_problem, solve
from rhot_app.hand.solvers.palm_fit import TIPS_WITHOUT_WRIST, any_marker, fit_palm, track_arrays
from rhot_app.project import IkMethod, Rig
from rhot_app.state import UNESTIMATED, Condition, HandState, Knowledge
from rhot_app.tracking.association import MarkerAssociation
from rhot_app.tracking.locate import Places, Views, empty_places, locate_all, rig_table, turn_band
from rhot_app.tracking.pairing import Paired, Pairing
from rhot_app.tracking.rig_arrays import compile_rig, filter_settings
from rhot_app.tracking.tracker import CameraFrame, CameraObservations, HandFrame, Tracker
from rhot_app.tracking.trust import Targets, Verdicts, conclude, locate_inliers, no_tracks, no_verdicts, predict

Array = NDArray[np.float64]

LOST_S = 1e-9 * LOST_NS
"""A hand without any marker keeps its last pose this long, as a guess. Fingertips carry a hand whose wrist is out of
sight, but after this long the rest of it is a guess as well."""


class ClassicTracker(Tracker):
    """Implements `Tracker` for one rig. `solve` is due work; `ingest` only stores."""

    def __init__(self, rig: Rig) -> None:
        self.diagnostics = Diagnostics()
        self._rig, self._tracked_with = compile_rig(rig), rig.tracked_with
        cameras, markers = len(self._rig.camera_names), len(self._rig.marker_ids)
        self._pairing = Pairing(cameras, markers)
        self._association = MarkerAssociation(self._rig)
        self._hand = HandSolver(with_markers(build_model(rig.hand), rig.markers), rig.tracker.ik)
        pixel, position = filter_settings(rig)
        self._filtering = rig.filters.enabled
        self._pixel_filter = OneEuroFilter.from_settings([s for _ in range(cameras) for s in pixel for _ in range(2)])
        self._position_filter = OneEuroFilter.from_settings([s for s in position for _ in range(3)])
        self._turned_shapes = self._rig.shapes.copy()
        self._roles = np.array([self._rig.wrist, *self._rig.tips])
        self._sequence = 0
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states: a new session, or a clock was set."""
        self._pairing.reset()
        self._hand.reset()
        self._pixel_filter.reset()
        self._position_filter.reset()
        self._association.reset()
        self._tracks = no_tracks(len(self._rig.marker_ids))
        self._epoch_ns: int | None = None
        self._last_s = 0.0
        self._measured_s: float | None = None

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame's markers in; about 10 µs."""
        if isinstance(frame, CameraObservations) and self._tracked_with[frame.camera]:
            self._pairing.ingest(self._association.select(frame, *self._predicted(frame)))
        elif isinstance(frame, HandFrame):
            self.diagnostics.warn("Only the estimator (tracker.kind) uses observations of kinds that are added.")

    def _predicted(self, frame: CameraObservations) -> tuple[Array, Array] | tuple[()]:
        """Where the markers are when the row of the principal point is exposed; nothing where nobody asks."""
        if frame.further is None or self._epoch_ns is None:
            return ()
        row_ns = frame.row_time_ns * self._rig.intrinsics[frame.camera, 3]
        return predict(self._tracks, 1e-9 * (frame.t_row0_master_ns + row_ns - self._epoch_ns))

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first."""
        return tuple(self._pairing.newest_frames)

    def solve(self) -> HandState | None:
        """The state that is due, or None."""
        clock = _Stopwatch()
        paired = self._pairing.due()
        if paired is None:
            return None
        t_s = self._seconds(paired.t_ns)
        clock.lap("pair")
        raw, places, verdicts = self._locate(t_s, paired, clock)
        targets = Targets(np.empty((6, 3)), np.empty(6, np.uint8))
        knowledge = conclude(t_s, self._tracks, verdicts, self._roles, places, targets)
        measured = np.count_nonzero(knowledge == _MEASURED)
        if measured:
            self._measured_s = t_s
        hand = self._hand.solve(t_s, targets)
        clock.lap("solve")
        pixels, flags = self._pairing.last_seen()
        self._sequence += 1
        completed = paired.completed_by
        return HandState(
            sequence=self._sequence - 1, t_master_ns=paired.t_ns, t_receive_ns=completed.t_receive_ns,
            condition=self._condition(t_s, paired, measured == len(knowledge)),
            marker_ids=self._rig.marker_ids, marker_positions=places.positions, marker_raw_positions=raw,
            marker_covariances=places.covariances, marker_knowledge=knowledge, camera_names=self._rig.camera_names,
            camera_pixels=pixels, camera_flags=flags, joint_positions=hand.joint_positions,
            joint_knowledge=hand.joint_knowledge, fingertip_positions=hand.fingertip_positions, angles=hand.angles,
            angle_knowledge=hand.angle_knowledge, world_from_palm=hand.world_from_palm,
            palm_knowledge=hand.palm_knowledge, epipolar_error_px=places.errors, **UNESTIMATED,
            latency_s={"detect": completed.detect_s, "network": completed.network_s, **clock.laps})

    def _seconds(self, t_ns: int) -> float:
        """Time since the first state, s: small enough for floats to keep nanoseconds. A step back starts anew."""
        if self._epoch_ns is None:
            self._epoch_ns = t_ns
        t_s = 1e-9 * (t_ns - self._epoch_ns)
        if t_s < self._last_s:
            self._hand.reset()
            self._pixel_filter.reset()
            self._position_filter.reset()
            self._tracks = no_tracks(len(self._rig.marker_ids))
            self._measured_s = None
        self._last_s = t_s
        return t_s

    def _locate(self, t_s: float, paired: Paired, clock: _Stopwatch) -> tuple[Array, Places, Verdicts]:
        """Positions (M, 3) m of inliers, unfiltered; their pixels are filtered and located again, and then filtered."""
        shape = paired.flags.shape
        rig, verdicts = rig_table(self._rig, self._shapes()), no_verdicts(shape[1])
        views = Views(paired.pixels, paired.covariances, np.empty(shape, np.bool_))
        raw = empty_places(shape[1])
        locate_inliers(t_s, paired.flags, paired.live, views, rig, self._tracks, verdicts, raw)
        clock.lap("triangulate")
        if not self._filtering:
            return raw.positions, raw._replace(positions=raw.positions.copy()), verdicts
        if verdicts.restarted.any():
            self._pixel_filter.reset(np.tile(np.repeat(verdicts.restarted, 2), shape[0]))
            self._position_filter.reset(np.repeat(verdicts.restarted, 3))
        pixels = np.where(views.used[..., None], paired.pixels, np.nan)
        pixels = self._pixel_filter(t_s, pixels.reshape(-1)).reshape(pixels.shape)
        clock.lap("filter")
        filtered = empty_places(shape[1])
        locate_all(Views(pixels, paired.covariances, views.used), rig, filtered)
        clock.lap("triangulate")
        positions = self._position_filter(t_s, filtered.positions.reshape(-1)).reshape(-1, 3)
        verdicts.accepted[np.isnan(positions[:, 0])] = False
        clock.lap("filter")
        return raw.positions, raw._replace(positions=positions), verdicts

    def _shapes(self) -> Array:
        """The markers' bodies; a band lies as the hand's last pose says."""
        pose, band = self._hand.pose, self._rig.band_half_axes
        if pose is None or band is None:
            return self._rig.shapes
        turn_band(pose.world_from_palm, band, self._turned_shapes[self._rig.wrist])
        return self._turned_shapes

    def _condition(self, t_s: float, paired: Paired, all_measured: bool) -> Condition:
        if self._measured_s is None:
            return Condition.SEARCHING
        if np.count_nonzero(paired.live) < 2 or t_s - self._measured_s > LOST_S:
            return Condition.LOST
        return Condition.TRACKING if all_measured else Condition.PARTIAL


class _Stopwatch:
    """Adds up the time between laps by stage, s."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {"pair": 0.0, "triangulate": 0.0, "filter": 0.0, "solve": 0.0}
        self._since = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Charge the time since the last lap to `stage`."""
        now = time.perf_counter()
        self.laps[stage] += now - self._since
        self._since = now


# -- from marker positions to a hand -----------------------------------------------------------------------------------

Codes = NDArray[np.uint8]

_MEASURED, _INFERRED, _GUESSED = int(Knowledge.MEASURED), int(Knowledge.INFERRED), int(Knowledge.GUESSED)
_JOINTS_OF = np.array([(joints.start, joints.stop) for joints in JOINT_SLICES])
_ANGLES_OF = np.array([(angles.start, angles.stop) for angles in ANGLE_SLICES])

TARGET_SD_M = 1e-3
"""What a located marker is worth at working distance: a nearly stretched finger is not bent to meet noise."""


@dataclass(frozen=True, slots=True)
class SolvedHand:
    """A hand as `HandState` publishes it; NaN and UNKNOWN when there is none."""

    joint_positions: Array  # (21, 3) m
    joint_knowledge: Codes
    fingertip_positions: Array  # (5, 3) m
    angles: Array  # (21,) rad
    angle_knowledge: Codes
    world_from_palm: Array  # (4, 4)
    palm_knowledge: Knowledge


def no_hand(tips: Array) -> SolvedHand:
    """Nothing is known of the hand but where its markers `tips` (5, 3) m are, NaN where unknown."""
    return SolvedHand(np.full((len(JOINTS), 3), np.nan), np.full(len(JOINTS), Knowledge.UNKNOWN, np.uint8),
                      tips.copy(), np.full(len(ANGLES), np.nan),
                      np.full(len(ANGLES), Knowledge.UNKNOWN, np.uint8), np.full((4, 4), np.nan), Knowledge.UNKNOWN)


METHODS: dict[IkMethod, Method | None] = {
    "fabrik": None, "transpose": Method.TRANSPOSE, "pseudo_inverse": Method.PSEUDO_INVERSE, "svd": Method.SVD,
    "dls": Method.DAMPED, "newton": Method.NEWTON, "lm": Method.LEVENBERG, "closed_form": Method.CLOSED_FORM}
"""By `ik` of the rig's tracker settings; None: the solver of `rhot_app.hand.solvers.finger_ik`."""


class HandSolver:
    """Keeps the last pose: the next one starts from it, and what the markers leave open stays as it was.

    The model's marker centres are those of the fingertips' paint (`rhot_app.hand.places.with_markers`)."""

    def __init__(self, model: HandModel, ik: IkMethod = "fabrik") -> None:
        self._model, self._method = model, METHODS[ik]
        self._arrays = _HandArrays(model.dh, model.limits, model.pose_prior.mean, model.pose_prior.information,
                                   model.mirror, model.base, model.base_rotation, model.chain, model.chain_bend)
        self.pose: HandPose | None = None
        self._palm: HandPose | None = None  # the last palm fit, whose own angles start the next one
        self._solved_s = 0.0
        self._wrist_s: float | None = None  # when the wrist was last located

    def reset(self) -> None:
        """Forget the pose."""
        self.pose = self._palm = self._wrist_s = None

    def solve(self, t_s: float, targets: Targets) -> SolvedHand:
        """The hand whose wrist and finger markers are at `targets`."""
        wrist, tips = targets.positions[0], targets.positions[1:]
        located = np.isfinite(targets.positions[:, 0])
        lost = self._wrist_s is None or t_s - self._wrist_s > LOST_S
        # What the tips alone made of the palm meanwhile may be far off: begin anew with the wrist.
        if self.pose is not None and (t_s - self._solved_s > LOST_S or (located[0] and lost)):
            self.reset()
        if located[0]:
            self._wrist_s = t_s
        palm, dt_s = self._palm, t_s - self._solved_s
        if palm is None:  # a cold start, from many poses: it takes milliseconds, once
            fit = fit_palm(self._model, wrist, tips, None, 0.0)
            if fit is None:
                return no_hand(tips)
            palm, dt_s = fit.pose, 0.0
        placed = bool(located[0] or (not lost and np.count_nonzero(located) >= TIPS_WITHOUT_WRIST))
        last = palm if self.pose is None else self.pose
        fitted, pose = _copy(palm), _copy(last)
        points, known = np.empty((len(JOINTS) + 5, 3)), _Known(*np.empty((2, len(ANGLES)), np.uint8))
        # One call of compiled code: between two frames the interpreter's own code and data leave the caches.
        if follow(self._arrays, targets, dt_s, self.pose is not None, placed, _Poses(*fitted, *pose), points, known):
            if self._method is not None:
                bent = solve(self._method, make_problem(self._model, HandPose(pose[0], last.angles), tips)).angles
                chosen = located[1:][FINGER_OF_ANGLE]
                pose[1][chosen] = bent[chosen]
                forward_arrays(self._model.dh, *pose, empty_frames(self._model.dh), points)
            self._palm, self.pose, self._solved_s = HandPose(*fitted), HandPose(*pose), t_s
        return SolvedHand(points[:len(JOINTS)], known.joints, points[len(JOINTS):], pose[1], known.angles, pose[0],
                          Knowledge.GUESSED)


class _HandArrays(NamedTuple):
    """Of `HandModel` and its pose prior."""

    dh: DhArrays
    limits: Array
    mean: Array
    information: Array
    mirror: float
    base: Array
    base_rotation: Array
    chain: Array
    chain_bend: Array


class _Poses(NamedTuple):
    """`palm_world` (4, 4) and `palm_angles` (21,): the palm fit; `world` and `angles`: the hand."""

    palm_world: Array
    palm_angles: Array
    world: Array
    angles: Array


class _Known(NamedTuple):
    """Knowledge of (21,) joints and (21,) angles."""

    joints: Codes
    angles: Codes


def _copy(pose: HandPose) -> tuple[Array, Array]:
    return pose.world_from_palm.copy(), pose.angles.copy()


@njit(cache=True)
def follow(hand: _HandArrays, targets: Targets, dt_s: float, warm: bool, placed: bool, poses: _Poses, points: Array,
           known: _Known) -> bool:
    """Palm fit, fingers, forward kinematics and knowledge of the next hand; returns whether it was solved.

    `poses`, updated: the palm fit `dt_s` seconds ago when `warm`, else this instant's, which stays; the last pose, kept
    when no marker is known. `points` (26, 3) m and `known` are filled. `placed`: the palm's place is known, so that
    what follows from it is inferred.
    """
    wrist, tips, world, angles = targets.positions[0], targets.positions[1:], poses.world, poses.angles
    solved = not warm
    if warm and any_marker(wrist, tips):
        track_arrays(hand.dh, hand.limits, hand.mean, hand.information, wrist, tips, dt_s, poses.palm_world,
                     poses.palm_angles)
        solved = True
    if solved:
        world[:], angles[:] = poses.palm_world, poses.palm_angles
        solve_fingers_arrays(angles, world, hand.mirror, hand.base, hand.base_rotation, hand.chain, hand.chain_bend,
                             hand.limits, tips, hand.mean, hand.information, TARGET_SD_M, np.empty(5),
                             np.empty(5, np.int64), np.empty(5, np.uint8))
    forward_arrays(hand.dh, world, angles, np.empty((hand.dh.parent.shape[0], 3, 4)), points)
    _know(targets.knowledge, solved and placed, known)
    return solved


@njit(cache=True)
def _know(targets: Codes, placed: bool, known: _Known) -> None:
    """A finger whose marker was located is inferred from it through the bones, the others keep their last angles: a
    guess, and so is everything when the palm is not `placed`. The palm's rotation is always a guess with one wrist
    marker, and says so itself (`palm_knowledge`).
    """
    known.joints[:], known.angles[:] = _GUESSED, _GUESSED
    if not placed:
        return
    if targets[0] <= _INFERRED:
        known.joints[0] = targets[0]
    for finger in range(5):
        if targets[1 + finger] <= _INFERRED:
            known.joints[_JOINTS_OF[finger, 0]:_JOINTS_OF[finger, 1]] = _INFERRED
            known.angles[_ANGLES_OF[finger, 0]:_ANGLES_OF[finger, 1]] = _INFERRED
