"""The thesis's tracker: pair, filter pixels, triangulate, filter positions, fit the palm, solve every finger."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.diagnostics import Diagnostics
from rhot_app.estimation.track import LOST_NS
from rhot_app.filters.one_euro import OneEuroFilter
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import forward_arrays
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.places import with_markers
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES, FINGER_OF_ANGLE, JOINT_SLICES, JOINTS, HandPose
from rhot_app.hand.solvers.finger_ik import FABRIK_ITERATIONS, TOLERANCE, solve_fingers_arrays
from rhot_app.hand.solvers.methods import Method, solve
from rhot_app.hand.solvers.palm_fit import TIPS_WITHOUT_WRIST, any_marker, fit_palm, track_arrays
from rhot_app.hand.solvers.problem import make_problem
from rhot_app.project import IkMethod, Rig
from rhot_app.state import UNESTIMATED, Condition, HandState, Knowledge
from rhot_app.tracking import locate, trust
from rhot_app.tracking.association import MarkerAssociation
from rhot_app.tracking.locate import LocateArrays
from rhot_app.tracking.pairing import Paired, Pairing
from rhot_app.tracking.rig_arrays import compile_rig, filter_settings
from rhot_app.tracking.tracker import CameraFrame, CameraObservations, Tracker

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
        self._sequence = 0
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states: a new session, or a clock was set."""
        self._pairing.reset()
        self._hand.reset()
        self._pixel_filter.reset()
        self._position_filter.reset()
        self._association.reset()
        self._memory = trust.empty_memory(len(self._rig.marker_ids))
        self._confirmed = np.zeros(len(self._rig.marker_ids), np.bool_)
        self._anchors = np.full((len(self._rig.marker_ids), 3), np.nan)
        self._epoch_ns: int | None = None
        self._last_s = 0.0
        self._measured_s: float | None = None
        self._all_measured = False

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame's markers in; about 10 µs."""
        if isinstance(frame, CameraObservations) and self._tracked_with[frame.camera]:
            self._pairing.ingest(self._association.select(frame))

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
        markers = self._locate(t_s, paired, clock)
        self._association.update(paired.t_ns, np.where(self._confirmed[:, None], markers.raw, np.nan))
        hand = self._solve_hand(t_s, markers)
        clock.lap("solve")
        return self._state(t_s, paired, markers, hand, clock)

    def _seconds(self, t_ns: int) -> float:
        """Time since the first state, s: small enough for floats to keep nanoseconds. A step back starts anew."""
        if self._epoch_ns is None:
            self._epoch_ns = t_ns
        t_s = 1e-9 * (t_ns - self._epoch_ns)
        if t_s < self._last_s:
            self._hand.reset()
            self._pixel_filter.reset()
            self._position_filter.reset()
            self._memory[:] = np.nan
            self._confirmed[:] = False
            self._measured_s = None
        self._last_s = t_s
        return t_s

    def _locate(self, t_s: float, paired: Paired, clock: _Stopwatch) -> LocateArrays:
        """Raw positions decide which markers are accepted; their pixels are filtered and located again."""
        rig, shapes = self._rig, self._shapes()
        markers = LocateArrays(len(rig.cameras), len(rig.marker_ids))
        locate.locate_raw(t_s, paired.flags, paired.live, paired.pixels, paired.covariances, rig.intrinsics,
                          rig.cameras, shapes, rig.law, rig.reach, self._memory, self._confirmed,
                          markers.used, markers.doubtful, markers.accepted, markers.restarted, markers.raw,
                          markers.covariances, markers.errors)
        clock.lap("triangulate")
        if not self._filtering:
            markers.positions[:] = markers.raw
            return markers
        pixel, position = self._pixel_filter, self._position_filter
        pixels = np.empty_like(paired.pixels)
        locate.filter_pixels(t_s, markers.used, markers.restarted, paired.pixels, pixel.parameters, pixel.state,
                             position.state, pixel.gap_s, pixels)
        clock.lap("filter")
        locate.locate_filtered(pixels, paired.covariances, markers.used, rig.intrinsics, rig.cameras,
                               shapes, rig.law, markers.positions)
        clock.lap("triangulate")
        locate.filter_positions(t_s, markers.positions, position.parameters, position.state, position.gap_s,
                                markers.accepted)
        clock.lap("filter")
        return markers

    def _shapes(self) -> Array:
        """The markers' bodies; a band lies as the hand's last pose says."""
        pose, band = self._hand.pose, self._rig.band_half_axes
        if pose is None or band is None:
            return self._rig.shapes
        locate.turn_band(pose.world_from_palm, band, self._turned_shapes[self._rig.wrist])
        return self._turned_shapes

    def _solve_hand(self, t_s: float, markers: LocateArrays) -> SolvedHand:
        """Say how each marker is known, those out of sight too, and solve the hand that wears them."""
        rig = self._rig
        wrist, tips, tip_knowledge = np.empty(3), np.empty((5, 3)), np.empty(5, np.uint8)
        measured, wrist_knowledge = locate.conclude(
            t_s, self._memory, markers.accepted, markers.doubtful, self._anchors, markers.positions,
            markers.covariances, markers.knowledge, rig.wrist, rig.tips, wrist, tips, tip_knowledge)
        if measured:
            self._measured_s = t_s
        self._all_measured = measured == len(markers.knowledge)
        return self._hand.solve(t_s, wrist, tips, wrist_knowledge, tip_knowledge)

    def _condition(self, t_s: float, paired: Paired) -> Condition:
        if self._measured_s is None:
            return Condition.SEARCHING
        if np.count_nonzero(paired.live) < 2 or t_s - self._measured_s > LOST_S:
            return Condition.LOST
        return Condition.TRACKING if self._all_measured else Condition.PARTIAL

    def _state(self, t_s: float, paired: Paired, markers: LocateArrays, hand: SolvedHand,
               clock: _Stopwatch) -> HandState:
        pixels, flags = self._pairing.last_seen()
        self._sequence += 1
        completed = paired.completed_by
        return HandState(
            sequence=self._sequence - 1,
            t_master_ns=paired.t_ns,
            t_receive_ns=completed.t_receive_ns,
            condition=self._condition(t_s, paired),
            marker_ids=self._rig.marker_ids,
            marker_positions=markers.positions,
            marker_raw_positions=markers.raw,
            marker_covariances=markers.covariances,
            marker_knowledge=markers.knowledge,
            camera_names=self._rig.camera_names,
            camera_pixels=pixels,
            camera_flags=flags,
            joint_positions=hand.joint_positions,
            joint_knowledge=hand.joint_knowledge,
            fingertip_positions=hand.fingertip_positions,
            angles=hand.angles,
            angle_knowledge=hand.angle_knowledge,
            world_from_palm=hand.world_from_palm,
            palm_knowledge=hand.palm_knowledge,
            epipolar_error_px=markers.errors,
            **UNESTIMATED,
            latency_s={"detect": completed.detect_s, "network": completed.network_s, **clock.laps},
        )


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

_INFERRED, _GUESSED = int(Knowledge.INFERRED), int(Knowledge.GUESSED)
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
        self.pose: HandPose | None = None
        self._palm: HandPose | None = None  # the last palm fit, whose own angles start the next one
        self._solved_s = 0.0
        self._wrist_s: float | None = None  # when the wrist was last located

    def reset(self) -> None:
        """Forget the pose."""
        self.pose = self._palm = self._wrist_s = None

    def solve(self, t_s: float, wrist: Array, tips: Array, wrist_knowledge: int, tip_knowledge: Codes) -> SolvedHand:
        """The hand whose wrist and finger markers are at `wrist` (3,) and `tips` (5, 3), m; NaN where unknown."""
        wrist_seen = bool(np.isfinite(wrist[0]))
        lost = self._wrist_s is None or t_s - self._wrist_s > LOST_S
        # What the tips alone made of the palm meanwhile may be far off: begin anew with the wrist.
        if self.pose is not None and (t_s - self._solved_s > LOST_S or (wrist_seen and lost)):
            self.reset()
        if wrist_seen:
            self._wrist_s = t_s
        palm, dt_s = self._palm, t_s - self._solved_s
        if palm is None:  # a cold start, from many poses: it takes milliseconds, once
            fit = fit_palm(self._model, wrist, tips, None, 0.0)
            if fit is None:
                return no_hand(tips)
            palm, dt_s = fit.pose, 0.0
        placed = wrist_seen or (not lost and int(np.count_nonzero(np.isfinite(tips[:, 0]))) >= TIPS_WITHOUT_WRIST)
        return self._follow(t_s, wrist, tips, wrist_knowledge, tip_knowledge, palm, dt_s, placed)

    def _follow(self, t_s: float, wrist: Array, tips: Array, wrist_knowledge: int, tip_knowledge: Codes,
                palm: HandPose, dt_s: float, placed: bool) -> SolvedHand:
        """One call of compiled code: between two frames the interpreter's own code and data leave the caches."""
        model, prior = self._model, self._model.pose_prior
        last = palm if self.pose is None else self.pose
        palm_world, palm_angles = palm.world_from_palm.copy(), palm.angles.copy()
        world, angles = last.world_from_palm.copy(), last.angles.copy()
        points = np.empty((len(JOINTS) + 5, 3))
        joints, known = np.empty(len(JOINTS), np.uint8), np.empty(len(ANGLES), np.uint8)
        solved = follow(model.dh, model.limits, prior.mean, prior.information, model.mirror, model.base,
                        model.base_rotation, model.chain, model.chain_bend, wrist, tips, wrist_knowledge, tip_knowledge,
                        dt_s, self.pose is not None, placed, palm_world, palm_angles, world, angles, points, joints,
                        known)
        if solved and self._method is not None:
            located = np.isfinite(tips[:, 0])
            bent = solve(self._method, make_problem(model, HandPose(world, last.angles), tips)).angles
            angles[located[FINGER_OF_ANGLE]] = bent[located[FINGER_OF_ANGLE]]
            forward_arrays(model.dh, world, angles, np.empty((model.dh.parent.shape[0], 3, 4)), points)
        if solved:
            self._palm, self.pose, self._solved_s = HandPose(palm_world, palm_angles), HandPose(world, angles), t_s
        return SolvedHand(points[:len(JOINTS)], joints, points[len(JOINTS):], angles, known, world, Knowledge.GUESSED)


@njit(cache=True)
def follow(dh: DhArrays, limits: Array, mean: Array, information: Array, mirror: float, base: Array,
           base_rotation: Array, chain: Array, bends: Array, wrist: Array, tips: Array, wrist_knowledge: int,
           tip_knowledge: Codes, dt_s: float, warm: bool, placed: bool, palm_world: Array, palm_angles: Array,
           world: Array, angles: Array, points: Array, joint_knowledge: Codes, angle_knowledge: Codes) -> bool:
    """Palm fit, fingers, forward kinematics and knowledge of the next hand; returns whether it was solved.

    `palm_world` (4, 4) and `palm_angles` (21,): the palm fit `dt_s` seconds ago when `warm`, else this instant's,
    which stays. `world` (4, 4) and `angles` (21,): the last pose, kept when no marker is known. All four are updated;
    `points` (26, 3) m, `joint_knowledge` (21,) and `angle_knowledge` (21,) are filled. `placed`: the palm's place is
    known, so that what follows from it is inferred.
    """
    solved = not warm
    if warm and any_marker(wrist, tips):
        track_arrays(dh, limits, mean, information, wrist, tips, dt_s, palm_world, palm_angles)
        solved = True
    if solved:
        world[:], angles[:] = palm_world, palm_angles
        solve_fingers_arrays(angles, world, mirror, base, base_rotation, chain, bends, limits, tips, mean,
                             information, TOLERANCE, int(FABRIK_ITERATIONS), TARGET_SD_M, np.empty(5),
                             np.empty(5, np.int64), np.empty(5, np.uint8))
    forward_arrays(dh, world, angles, np.empty((dh.parent.shape[0], 3, 4)), points)
    _know(wrist_knowledge, tip_knowledge, solved and placed, joint_knowledge, angle_knowledge)
    return solved


@njit(cache=True)
def _know(wrist: int, tips: Codes, placed: bool, joints: Codes, angles: Codes) -> None:
    """Fill the knowledge of (21,) joints and (21,) angles.

    A finger whose marker was located is inferred from it through the bones, the others keep their last angles: a
    guess, and so is everything when the palm is not `placed`. The palm's rotation is always a guess with one wrist
    marker, and says so itself (`palm_knowledge`).
    """
    joints[:], angles[:] = _GUESSED, _GUESSED
    if not placed:
        return
    if wrist <= _INFERRED:
        joints[0] = wrist
    for finger in range(5):
        if tips[finger] <= _INFERRED:
            joints[_JOINTS_OF[finger, 0]:_JOINTS_OF[finger, 1]] = _INFERRED
            angles[_ANGLES_OF[finger, 0]:_ANGLES_OF[finger, 1]] = _INFERRED
