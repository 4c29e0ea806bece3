"""Real human motion for the twin: the hand model fitted frame by frame to a recording's landmarks.

The recorded person's hand is not our model's; what is wanted is how it moves. The fit need not be exact, the twin's
truth is the fitted hand.
"""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from rhot_app.errors import RecordingError, SimulatorError
from rhot_app.estimation.se3 import skew
from rhot_app.hand.kinematics import TWIST, forward, jacobian
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS, HandPose
from rhot_app.recording.qualisys import read_qualisys
from rhot_app.simulator.scene.motion import FACING, WRIST_BELOW_CENTRE_M, Motion, Sway, SwayCurve
from rhot_node.files import read_table

# Read here: Qualisys TSV exports (optical markers on fingertips and finger middles, a triad on the back of the hand)
# and Leap Motion CSV exports (joint positions). Millimetres in the files, metres from here on.

Array = NDArray[np.float64]

TRIAD = ("hand_top", "hand_left", "hand_right")
"""Markers on the back of the hand; where on it, nobody measured."""

_TIP_FRACTION = 0.75  # of the distal bone: a tip marker is glued to the nail
_LEAP_FINGERS = ("thumb", "index", "middle", "ring", "pinky")
_LEAP_JOINTS = ("mcp", "pip", "dip", "tip")
"""Four per finger, as here; Leap gives the thumb a metacarpal of no length, so that its "mcp" is the root."""


@dataclass(frozen=True, slots=True)
class Landmarks:
    """N frames of L landmarks on a hand and R rigid points on its back, world of the recorder, m; NaN = missing.

    Landmark l lies between joints `ends[l]` at `fraction[l]` of the way. Where the rigid points sit on the palm is
    unknown. `times_s` (N,), `points` (N, L, 3), `rigid` (N, R, 3), `ends` (L, 2), `fraction` (L,).
    """

    times_s: Array
    points: Array
    rigid: Array
    ends: NDArray[np.int64]
    fraction: Array


def read_landmarks(path: Path, model: HandModel) -> Landmarks:
    """Landmarks of a recording; `model` tells where along a finger a marker must sit. Raises SimulatorError."""
    try:
        landmarks = _qualisys(path, model) if path.suffix.lower() == ".tsv" else _leap(read_table(path).decode())
    except (OSError, UnicodeDecodeError, RecordingError) as exc:
        raise SimulatorError(f"{path}: cannot be read as a recording ({exc}).") from exc
    except (ValueError, IndexError, KeyError, csv.Error) as exc:
        raise SimulatorError(f"{path}: not a recording this program knows ({exc}). It reads Qualisys .tsv exports with "
                             "finger and hand markers, and Leap Motion .csv exports with joint positions.") from exc
    if len(landmarks.times_s) < 2 or not (np.isfinite(landmarks.points).all(axis=2).sum(axis=1) >= 4).any():
        raise SimulatorError(f"{path}: no frame of the recording has four finger landmarks; there is no hand to fit.")
    return landmarks


def _qualisys(path: Path, model: HandModel) -> Landmarks:
    tracks = read_qualisys(path)

    def of(name: str) -> Array:
        if name not in tracks.names:
            raise ValueError(f"it has no marker {name!r}")
        return np.asarray(tracks.positions[:, tracks.names.index(name)])

    chosen, ends, fractions = [], [], []
    for finger, name in enumerate(FINGERS):
        tip, middle = of(f"{name}_tip"), of(f"{name}_middle")
        reach = np.nanpercentile(np.linalg.norm(tip - middle, axis=1), 90.0)
        # The middle marker sits on the bone before the last one or two: the thumb has one bone less.
        bone = 1 if name == "thumb" else 0
        between = model.bones[finger, bone + 1:2].sum() + _TIP_FRACTION * model.bones[finger, 2]
        base = 1 + 4 * finger
        chosen += [tip, middle]
        ends += [(base + 2, base + 3), (base + bone, base + bone + 1)]
        # Stretched out, tip to middle spans what is left of the marker's own bone and all that follows.
        fractions += [_TIP_FRACTION, float(np.clip(1.0 - (reach - between) / model.bones[finger, bone], 0.05, 1.0))]
    rigid = np.stack([of(name) for name in TRIAD], axis=1)
    return Landmarks(tracks.times_s, np.stack(chosen, axis=1), rigid, np.array(ends), np.array(fractions))


def _leap(text: str) -> Landmarks:
    rows = list(csv.DictReader(text.splitlines()))
    hands = Counter(row["hand_id"] for row in rows)
    rows = [row for row in rows if row["hand_id"] == hands.most_common(1)[0][0]]
    times = np.array([float(row["t"]) for row in rows])
    points = np.array([[[float(row[f"{finger}_{joint}_{axis}"] or "nan") for axis in "xyz"]
                        for finger in _LEAP_FINGERS for joint in _LEAP_JOINTS] for row in rows])
    later = np.concatenate([[True], times[1:] > np.maximum.accumulate(times)[:-1]])
    joints = np.arange(1, len(JOINTS))
    return Landmarks(times[later] - times[0], 1e-3 * points[later], np.empty((int(later.sum()), 0, 3)),
                     np.stack([joints, joints], axis=1), np.zeros(len(joints)))


LANDMARK_SD_M = 3e-3
RIGID_SD_M = 2e-3
STEP_SD = np.concatenate([np.full(3, 10e-3), np.full(3, 0.1), np.full(len(ANGLES), 0.15)])
"""How far a pose may stray from the frame before it without paying, m and rad: carries missing markers over."""

SMOOTH_HZ = 12.0
"""No hand moves faster than this; what is above is noise of recorder and fit."""

_START_ITERATIONS, _ITERATIONS, _ROUNDS = 40, 4, 4
_ROUND_FRAMES = 60


@dataclass(frozen=True, slots=True)
class FittedPoses:
    """(N, 4, 4) world_from_palm, (N, 21) angles rad, and the rms distance of all seen landmarks from the hand, m."""

    world_from_palm: Array
    angles: Array
    rms_m: float


def recorded_motion(path: Path, model: HandModel, centre: Array) -> Motion:
    """The motion of a recording, turned and moved so that its mean pose faces the cameras at `centre` (3,) m.

    Raises SimulatorError when the file is not a recording.
    """
    landmarks = read_landmarks(path, model)
    fit = fit_poses(landmarks, model)
    rotations = Rotation.from_matrix(fit.world_from_palm[:, :3, :3])
    turn = Rotation.from_matrix(FACING) * rotations.mean().inv()
    middles = (fit.world_from_palm @ np.array([WRIST_BELOW_CENTRE_M, 0.0, 0.0, 1.0]))[:, :3]
    wrists = turn.apply(fit.world_from_palm[:, :3, 3] - middles.mean(axis=0))
    turned = (turn * rotations * Rotation.from_matrix(FACING).inv()).as_rotvec()
    values = np.concatenate([wrists, turned, fit.angles], axis=1)
    return Motion(path.stem, float(landmarks.times_s[-1]), False, _smooth_curve(landmarks.times_s, values), centre,
                  model.limits, SwayCurve(Sway(), 0))


def _smooth_curve(times_s: Array, values: Array) -> CubicSpline:
    """The values on an even grid of the same mean rate, low-pass filtered without delay, as a C2 curve."""
    even = np.linspace(times_s[0], times_s[-1], len(times_s))
    rate_hz = (len(even) - 1) / (even[-1] - even[0])
    values = CubicSpline(times_s, values)(even)
    if rate_hz > 2.5 * SMOOTH_HZ and len(even) > 30:
        values = sosfiltfilt(butter(2, SMOOTH_HZ, fs=rate_hz, output="sos"), values, axis=0)
    return CubicSpline(even, values)


def fit_poses(landmarks: Landmarks, model: HandModel) -> FittedPoses:
    """Fit the hand to every frame. Where the rigid points sit on the palm is found in turn with the poses."""
    start = _start_pose(landmarks, model)
    palm_points = np.full((landmarks.rigid.shape[1], 3), np.nan)
    rounds = np.linspace(0, len(landmarks.times_s) - 1, min(_ROUND_FRAMES, len(landmarks.times_s))).astype(int)
    if len(palm_points):
        for _ in range(_ROUNDS):
            poses = _fit_frames(landmarks, model, start, palm_points, rounds, _START_ITERATIONS)
            seen = [np.linalg.inv(t) @ np.vstack([landmarks.rigid[k].T, np.ones(len(palm_points))])
                    for k, (t, _) in zip(rounds, poses, strict=True)]
            palm_points = np.nanmean([points[:3].T for points in seen], axis=0)
    poses = _fit_frames(landmarks, model, start, palm_points, np.arange(len(landmarks.times_s)), _ITERATIONS)
    transforms, angles = np.array([t for t, _ in poses]), np.array([a for _, a in poses])
    errors = [np.linalg.norm(_landmark_points(model, HandPose(t, a), landmarks) - seen, axis=1)
              for t, a, seen in zip(transforms, angles, landmarks.points, strict=True)]
    return FittedPoses(transforms, angles, float(np.sqrt(np.nanmean(np.square(errors)))))


def _landmark_points(model: HandModel, pose: HandPose, landmarks: Landmarks) -> Array:
    joints = forward(model, pose).joints
    part = landmarks.fraction[:, None]
    return (1.0 - part) * joints[landmarks.ends[:, 0]] + part * joints[landmarks.ends[:, 1]]


def _start_pose(landmarks: Landmarks, model: HandModel) -> HandPose:
    """A relaxed hand laid over the first frame with enough landmarks (least squares, Kabsch)."""
    seen = np.asarray(np.isfinite(landmarks.points).all(axis=2))
    frame = int(np.argmax(seen.sum(axis=1) >= min(8, seen.sum(axis=1).max())))
    relaxed = HandPose(np.eye(4), np.clip(model.pose_prior.mean, model.limits[:, 0], model.limits[:, 1]))
    source = _landmark_points(model, relaxed, landmarks)[seen[frame]]
    target = landmarks.points[frame][seen[frame]]
    rotation, _ = Rotation.align_vectors(target - target.mean(axis=0), source - source.mean(axis=0))
    world_from_palm = np.eye(4)
    world_from_palm[:3, :3] = rotation.as_matrix()
    world_from_palm[:3, 3] = target.mean(axis=0) - rotation.apply(source.mean(axis=0))
    return HandPose(world_from_palm, relaxed.angles)


def _fit_frames(landmarks: Landmarks, model: HandModel, start: HandPose, palm_points: Array,
                frames: NDArray[np.int64], iterations: int) -> list[tuple[Array, Array]]:
    poses = []
    pose, first = start, True
    for frame in frames:
        pose = _fit_frame(model, landmarks, int(frame), pose, palm_points, _START_ITERATIONS if first else iterations,
                          free=first)
        first = False
        poses.append((pose.world_from_palm, pose.angles))
    return poses


def _fit_frame(model: HandModel, landmarks: Landmarks, frame: int, before: HandPose, palm_points: Array,
               iterations: int, *, free: bool) -> HandPose:
    """Gauss-Newton on palm twist and angles with natural pose and the frame before as priors."""
    seen = np.flatnonzero(np.isfinite(landmarks.points[frame]).all(axis=1))
    rigid = np.flatnonzero(np.isfinite(landmarks.rigid[frame]).all(axis=1) & np.isfinite(palm_points).all(axis=1))
    part = landmarks.fraction[seen, None, None]
    transform, angles = before.world_from_palm.copy(), before.angles.copy()
    moved = np.zeros(TWIST + len(ANGLES))
    step_information = np.zeros_like(STEP_SD) if free else STEP_SD**-2
    for _ in range(iterations):
        pose = HandPose(transform, angles)
        turn = jacobian(model, pose)
        rows = (1.0 - part) * turn[landmarks.ends[seen, 0]] + part * turn[landmarks.ends[seen, 1]]
        error = landmarks.points[frame, seen] - _landmark_points(model, pose, landmarks)[seen]
        a, b = rows.reshape(-1, rows.shape[2]) / LANDMARK_SD_M, error.ravel() / LANDMARK_SD_M
        information = a.T @ a + np.diag(step_information + 1e-6)
        gradient = a.T @ b - step_information * moved
        for k in rigid:
            lever = transform[:3, :3] @ palm_points[k]
            rigid_rows = np.hstack([np.eye(3), -skew(lever)]) / RIGID_SD_M
            gap = (landmarks.rigid[frame, k] - transform[:3, 3] - lever) / RIGID_SD_M
            information[:TWIST, :TWIST] += rigid_rows.T @ rigid_rows
            gradient[:TWIST] += rigid_rows.T @ gap
        information[TWIST:, TWIST:] += model.pose_prior.information
        gradient[TWIST:] += model.pose_prior.information @ (model.pose_prior.mean - angles)
        step = np.linalg.solve(information, gradient)
        step *= min(1.0, 0.3 / np.abs(step[3:]).max())
        transform = transform.copy()
        transform[:3, :3] = Rotation.from_rotvec(step[3:6]).as_matrix() @ transform[:3, :3]
        transform[:3, 3] += step[:3]
        clipped = np.clip(angles + step[TWIST:], model.limits[:, 0], model.limits[:, 1])
        moved[:TWIST] += step[:TWIST]
        moved[TWIST:] += clipped - angles
        angles = clipped
    return HandPose(transform, angles)
