"""Trackers without markers on the twin's bare hand: the same sequences for each, judged by a truth that none can read.

A tracker sees the pictures, their times and the rig that a calibration gives it, and nothing else. Figures are of each
case over all seeds; docs/twin.md says what the cases are.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Protocol, cast

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rhot_app.barehand.start import START_SD, start_pose_file
from rhot_app.errors import TrackingError
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.hand.skeleton import HandPose
from rhot_app.progress import Progress, silent, within
from rhot_app.project import Rig
from rhot_app.simulator.bare_hand.sequence import (
    ENTRY_S,
    BareHandFrame,
    BareHandOptions,
    BareHandSequence,
    bare_hand_rig,
    bare_hand_sequence,
)
from rhot_app.state import HandState

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

MOTIONS: Final = ("rest", "wave", "grasp", "pinch", "fast", "spread")
SCALES: Final = (1.0, 0.88, 1.1)
"""Motions and sizes of hand that the seeds take in turn; odd seeds are right hands, even ones left."""

RATE_HZ: Final = 30.0
SETTLE_S: Final = 0.5
"""After its first good state a tracker settles for so long; what follows is judged."""

CONFUSED_M: Final = 0.02
"""Distance of neighbouring knuckles in the hand files: a hand that is farther off has fingers taken for others."""

WITHIN_3_SD: Final = float(chi2.ppf(0.9973, 3))
"""Squared Mahalanobis distance in three dimensions that holds as much probability as three sigma in one."""

LOSS_S: Final = (1.5, 2.0)
"""When cameras deliver no pictures, where a case says so."""

HOLDS_S: Final = 0.8
"""How long a hand holds the pose that it was shown. Chosen: a person holds still for a second when asked to."""

_OLD_NS = 1_000_000  # a state that is older than its newest picture by more says nothing of it
_OLD_LIVE_NS = round(2e9 / RATE_HZ)  # live, a state waits for the edges of all cameras, up to a period


class EvaluatedTracker(Protocol):
    """What is evaluated. One may also have ``start(pose, t_ns)``, for cases that give it a pose to begin with."""

    def step(self, images: Sequence[Picture | None], t_ns: Sequence[int]) -> HandState:
        """The hand after one picture (H, W, 3) uint8 RGB of each camera, None where it has none, of times ns. May raise
        TrackingError while it has found no hand."""
        ...


@dataclass(frozen=True)
class Case:
    """One way to film a hand and to begin. `start`: "pose": the tracker is given the true pose at first, "random":
    that pose with `START_SD`, "shown": a pose that the hand takes within `START_SD`, and holds for `HOLDS_S`. `lost`:
    cameras without pictures during `LOSS_S`; the case is then judged from there on. `cameras`: how many the rig has.
    `known_size`: the hand was measured. `live`: nodes search the pictures for the live tracker. Every case shows the
    background alone at first."""

    name: str
    options: BareHandOptions
    start: str = "pose"
    lost: tuple[int, ...] = ()
    cameras: int = 2
    known_size: bool = True
    live: bool = False


MakeTracker = Callable[[Rig, Case], EvaluatedTracker]
"""Makes a tracker for a rig, and for what a user would tell it of a case; never for what was drawn from the seed."""

_MISMATCH = BareHandOptions(length_sd=0.05, radius_sd=0.08, background="skin", sleeve=False, turn_deg=25.0,
                            enters_after_s=0.5, exposure_ms=10.0, exposure_steps=True, row_time_us=48.0,
                            camera_delay=0.4, calibration_deg=0.2, calibration_mm=1.0)
_MATCHED = BareHandOptions(forearm=False, enters_after_s=0.3)

CASES: Final = (
    Case("matched", _MATCHED),
    Case("mismatched, shown start", _MISMATCH, "shown", known_size=False),
    Case("mismatched, random start", _MISMATCH, "random", known_size=False),
    Case("one camera lost 0.5 s", _MATCHED, lost=(1,)),
    Case("both cameras lost 0.5 s", _MATCHED, lost=(0, 1)),
    Case("random start", _MATCHED, "random"),
    Case("one camera alone", _MATCHED, cameras=1),
    Case("live, matched", _MATCHED, "shown", live=True),
    Case("live, mismatched", _MISMATCH, "shown", known_size=False, live=True),
)


@dataclass(frozen=True)
class EvaluatedRun:
    """One seed of a case, by frame (F,): `joint_m` mean joint error, `angle_rad` mean angle error, `image_px` mean
    joint error in the first camera's picture, `within` share of joints within three sigma; NaN where there is no
    state. `exact_m` (F,): the mean error of joints whose image points are exact, triangulated with the calibration that
    the tracker is given; NaN before one camera. `step_s` (F,): time that a step took. `followed` (F,): a state that is
    not confused. `judged` (F,).
    `start_s`: from the first frame that shows the whole hand (or from the end of a loss) to the first good state, NaN:
    never."""

    seed: int
    motion: str
    joint_m: Array
    angle_rad: Array
    image_px: Array
    within: Array
    exact_m: Array
    step_s: Array
    followed: NDArray[np.bool_]
    judged: NDArray[np.bool_]
    start_s: float


def filmed(case: Case, seed: int, seconds: float, kept_in: Path | None) -> BareHandSequence:
    """The sequence of a case and a seed."""
    rig = bare_hand_rig("right" if seed % 2 else "left")
    rig = msgspec.structs.replace(rig, hand=scaled_hand(rig.hand, SCALES[seed % len(SCALES)]))
    options = replace(case.options, holds_s=HOLDS_S * (case.start == "shown"),
                      lost=tuple((camera, *LOSS_S) for camera in case.lost),
                      sleeve=case.options.forearm and seed % 3 == 0, facing="back" if seed % 4 == 0 else "palm")
    return bare_hand_sequence(rig, MOTIONS[seed % len(MOTIONS)], seconds, RATE_HZ, seed, options, kept_in)


def run_case(case: Case, make: MakeTracker, seeds: Iterable[int], seconds: float, kept_in: Path | None = None,
             progress: Progress = silent) -> list[EvaluatedRun]:
    """A tracker through every seed of a case. Raises SimulatorError."""
    chosen = list(seeds)
    runs = []
    for number, seed in enumerate(chosen):
        progress(f"{case.name}, seed {seed}", number / len(chosen))
        runs.append(run_sequence(case, filmed(case, seed, seconds, kept_in), make))
    return runs


def run_sequence(case: Case, sequence: BareHandSequence, make: MakeTracker) -> EvaluatedRun:
    """A tracker through one sequence."""
    given = msgspec.structs.replace(sequence.tracker_rig, nodes=sequence.tracker_rig.nodes[:case.cameras])
    if case.start == "shown":
        held = sequence.truth_at(round(1e9 * sequence.source.moves_s)).pose
        poses = (start_pose_file(_about(held, sequence.seed)),)
        given = msgspec.structs.replace(given, tracker=msgspec.structs.replace(given.tracker, start_poses=poses))
    tracker = make(given, case)
    states: list[HandState | None] = []
    frames: list[BareHandFrame] = []
    step_s: list[float] = []
    started = case.start == "shown"
    for frame in sequence.frames():
        if not started and frame.truth.in_view:
            cast(_Startable, tracker).start(_start(case, sequence.seed, frame), frame.t_ns[0])
            started = True
        images, t_ns = frame.images[:case.cameras], frame.t_ns[:case.cameras]
        begun = time.perf_counter()
        state = _stepped(tracker, images, t_ns, _OLD_LIVE_NS if case.live else _OLD_NS)
        step_s.append(time.perf_counter() - begun)
        states.append(state)
        frames.append(replace(frame, images=()))
    return _judged(case, sequence, frames, states, np.array(step_s))


class _Startable(Protocol):
    def start(self, pose: HandPose, t_ns: int) -> None: ...


def _stepped(tracker: EvaluatedTracker, images: Sequence[Picture | None], t_ns: Sequence[int], old_ns: int
             ) -> HandState | None:
    """The state, if it is not older than the newest picture by `old_ns`; None while there is no hand."""
    try:
        state = tracker.step(images, t_ns)
    except TrackingError:
        return None
    return state if state.tracked and state.t_master_ns >= max(t_ns) - old_ns else None


def _start(case: Case, seed: int, frame: BareHandFrame) -> HandPose:
    """What a tracker is told to begin with: the true pose, or one near it."""
    return frame.truth.pose if case.start == "pose" else _about(frame.truth.pose, seed)


def _about(pose: HandPose, seed: int) -> HandPose:
    """A pose drawn about another one, with START_SD."""
    rng = np.random.default_rng([seed, 0x57A])
    place, turn, angles = START_SD
    world = pose.world_from_palm.copy()
    world[:3, 3] += rng.normal(0.0, place, 3)
    world[:3, :3] = exp_so3(rng.normal(0.0, turn, 3)) @ world[:3, :3]
    return HandPose(world, pose.angles + rng.normal(0.0, angles, len(pose.angles)))


def _judged(case: Case, sequence: BareHandSequence, frames: Sequence[BareHandFrame],
            states: Sequence[HandState | None], step_s: Array) -> EvaluatedRun:
    camera = CameraModel.from_rig(sequence.rig.nodes[0].intrinsics, sequence.rig.nodes[0].pose)
    figures = np.full((len(frames), 4), np.nan)
    for k, state in enumerate(states):
        if state is None:
            continue
        truth = sequence.truth_at(state.t_master_ns)
        error = state.joint_positions - truth.joints
        pixels = camera.project(state.joint_positions) - camera.project(truth.joints)
        figures[k] = (np.nanmean(np.linalg.norm(error, axis=1)), np.nanmean(np.abs(state.angles - truth.angles)),
                      np.nanmean(np.linalg.norm(pixels, axis=1)), _within(error, state.joint_covariances))
    times_s = np.array([1e-9 * frame.truth.t_ns for frame in frames])
    in_view = np.array([frame.truth.in_view for frame in frames])
    off = figures[:, 2] * np.median(_metres_per_px(frames, camera)) if case.cameras == 1 else figures[:, 0]
    followed = np.nan_to_num(off, nan=np.inf) <= CONFUSED_M
    begin_s = LOSS_S[1] if case.lost else _first(times_s, in_view)
    good_s = _first(times_s, followed & in_view & (times_s >= begin_s))
    judged_s = LOSS_S[0] if case.lost else good_s + SETTLE_S
    judged = in_view & (times_s >= (judged_s if np.isfinite(judged_s) else begin_s + SETTLE_S))
    joint_m, angle_rad, image_px, consistent = figures.T
    return EvaluatedRun(sequence.seed, sequence.motion, joint_m, angle_rad, image_px, consistent,
                        np.array([_exact(sequence, case, frame) for frame in frames]), step_s, followed,
                        judged, good_s - begin_s)


def _exact(sequence: BareHandSequence, case: Case, frame: BareHandFrame) -> float:
    """Mean error, m, of the joints of a frame, seen exactly by the true cameras and triangulated by the tracker's."""
    if case.cameras < 2:
        return np.nan
    joints, rows = frame.truth.joints, []
    for true, given in zip(sequence.rig.nodes, sequence.tracker_rig.nodes, strict=True):
        pixels = CameraModel.from_rig(true.intrinsics, true.pose).project(joints)
        camera = CameraModel.from_rig(given.intrinsics, given.pose)
        matrix = camera.camera_from_world[:3]
        rows.append(camera.undistort(pixels)[:, :, None] * matrix[2] - matrix[:2])
    last = np.linalg.svd(np.concatenate(rows, axis=1))[2][:, 3]
    return float(np.mean(np.linalg.norm(last[:, :3] / last[:, 3:] - joints, axis=1)))


def _within(error: Array, covariances: Array) -> float:
    """Share of joints whose error (21, 3) m lies within three sigma of its covariance (21, 3, 3); NaN without one."""
    known = np.isfinite(covariances).all(axis=(1, 2)) & np.isfinite(error).all(axis=1)
    if not known.any():
        return np.nan
    whitened = np.linalg.solve(covariances[known] + 1e-12 * np.eye(3), error[known, :, None])[..., 0]
    return float(np.mean(np.einsum("ji,ji->j", error[known], whitened) <= WITHIN_3_SD))


def _metres_per_px(frames: Sequence[BareHandFrame], camera: CameraModel) -> Array:
    """(F,) how long a pixel is at the hand."""
    return 1.0 / camera.pixels_per_metre(np.array([frame.truth.joints[0] for frame in frames]))


def _first(times_s: Array, true: NDArray[np.bool_]) -> float:
    return float(times_s[np.argmax(true)]) if true.any() else np.nan


Figures = dict[str, float | None]


def figures_of(runs: Sequence[EvaluatedRun]) -> Figures:
    """Over all judged frames of all seeds; the worst seed is that of the largest mean. Lost frames are those without a
    state, or with a confused one. Keys end in their unit; None where there is nothing to say."""
    figures: Figures = {}
    for key, field, scale in (("joint_mm", "joint_m", 1e3), ("angle_deg", "angle_rad", 180.0 / np.pi),
                              ("image_px", "image_px", 1.0)):
        each = [scale * getattr(run, field)[run.judged] for run in runs]
        every = np.concatenate(each)
        every = every[np.isfinite(every)]
        means = [float(np.nanmean(one)) for one in each if np.isfinite(one).any()]
        figures |= {f"{key}_median": _or_none(np.median, every), f"{key}_p95": _or_none(_p95, every),
                    f"{key}_worst_seed": max(means) if means else None}
    steps = np.concatenate([run.step_s[np.isfinite(run.joint_m)] for run in runs])
    consistent = np.concatenate([run.within[run.judged] for run in runs])
    lost = np.concatenate([~run.followed[run.judged] for run in runs])
    starts = np.array([run.start_s for run in runs])
    exact = np.concatenate([1e3 * run.exact_m[run.judged] for run in runs])
    return figures | {
        "exact_mm_median": _or_none(np.median, exact[np.isfinite(exact)]),
        "rate_hz_median": 1.0 / float(np.median(steps)) if len(steps) else None,
        "step_ms_p99": 1e3 * float(np.percentile(steps, 99.0)) if len(steps) else None,
        "within_3_sd": _or_none(np.mean, consistent[np.isfinite(consistent)]),
        "lost_part": _or_none(np.mean, lost.astype(np.float64)),
        "started": float(np.isfinite(starts).sum()), "seeds": float(len(runs)),
        "start_s_median": _or_none(np.median, starts[np.isfinite(starts)]),
        "start_s_worst": _or_none(np.max, starts[np.isfinite(starts)])}


def _or_none(what: Callable[[Array], object], values: Array) -> float | None:
    return float(cast(float, what(values))) if len(values) else None


def _p95(values: Array) -> float:
    return float(np.percentile(values, 95.0))


def evaluate_bare_hand(make: MakeTracker, seeds: Iterable[int], seconds: float, kept_in: Path | None,
                       cases: Sequence[Case] = CASES, progress: Progress = silent
                       ) -> Iterator[tuple[Case, list[EvaluatedRun]]]:
    """Case by case, all seeds of it. A first sequence is run before anything is timed, so that all is compiled."""
    chosen = list(seeds)
    for case in (cases[0], *cases):
        if case.start != "shown":
            run_sequence(case, filmed(case, chosen[0], min(seconds, 0.5 + ENTRY_S), kept_in), make)
            break
    for number, case in enumerate(cases):
        yield case, run_case(case, make, chosen, seconds, kept_in,
                             within(progress, number / len(cases), (number + 1) / len(cases)))
