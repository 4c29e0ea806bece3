"""Bone lengths and marker places from a minute of free movement: chooses the method, solves, reports, judges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand import bones_judgement
from rhot_app.calibration.hand.bones_collector import rigid_pairs
from rhot_app.calibration.hand.bones_result import (
    BoneLength,
    BonesResult,
    Known,
    bone_lengths,
    bone_name,
    finger_reaches,
    marker_spots,
    rigid_distances,
)
from rhot_app.calibration.hand.bundle_model import POSE, Poses, expected, in_segments
from rhot_app.calibration.hand.fit import fit_hand
from rhot_app.calibration.hand.landmark_bones import are_landmarks, measure_bones
from rhot_app.calibration.hand.marker_places import DISTAL, MarkerTracks
from rhot_app.calibration.hand.shape import BONE_COUNT, HandUnknowns
from rhot_app.calibration.time.tracks import smooth
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import ANGLE_SLICES, FINGERS
from rhot_app.progress import Progress, silent

Array = NDArray[np.float64]


def solve_bones(tracks: MarkerTracks, base: HandAnatomy, *, progress: Progress = silent) -> BonesResult:
    """The hand that wore these markers. `base` gives side, name, limits, and the proportions to begin from.

    Landmarks of all joints show every bone by itself. Markers whose coordinates outnumber a pose's unknowns show single
    bones; fewer show size and reaches. Raises
    CalibrationError when the recording holds no hand at all.
    """
    if len(tracks.times_s) < 2:
        raise CalibrationError("the recording is empty: no instant shows the markers.")
    if are_landmarks(tracks):
        return measure_bones(tracks, base)
    if 3 * len(tracks.places) > POSE:
        return _by_movement(tracks, base, progress)
    return _by_reach(tracks, base, progress)


def _by_movement(tracks: MarkerTracks, base: HandAnatomy, progress: Progress) -> BonesResult:
    fit = fit_hand(tracks, base, progress=progress)
    unknowns, bundle = fit.unknowns, fit.bundle
    bones = bone_lengths(unknowns, bundle.vector, fit.covariance)
    reaches, size, size_std = finger_reaches(unknowns, bundle.vector, fit.covariance)
    pairs = rigid_pairs(tracks.positions, fit.raw_noise_m)
    error_mm = 1e3 * fit.model_error_m
    local = in_segments(unknowns, bundle.vector, bundle.poses, bundle.residuals)
    spots = marker_spots(unknowns, bundle.vector, fit.covariance)
    findings = [
        *bones_judgement.misplaced_findings(bundle.residuals, tracks.places),
        *bones_judgement.order_findings(spots, bones),
        *bones_judgement.length_findings(tracks.duration_s),
        *bones_judgement.side_findings(base.side, fit.other_side_cost),
        *bones_judgement.stillness_findings(bundle.poses.angles),
        *bones_judgement.slip_findings(tracks),
        *bones_judgement.drift_findings(tracks.times_s[fit.instants], local, tracks.places, fit.model_error_m),
        *bones_judgement.rigid_findings(pairs, tracks),
        *bones_judgement.error_findings(error_mm),
        *bones_judgement.bone_findings(bones),
        *bones_judgement.palm_findings(tracks.places),
        *bones_judgement.plausibility_findings(bones, size * 1e3 * unknowns.prior.mean[:BONE_COUNT])]
    return BonesResult(
        hand=unknowns.anatomy(bundle.vector), method="movement", size=size, size_std=size_std,
        bones=bones, reaches=reaches, markers=spots,
        rigid=rigid_distances(pairs, unknowns), residual_mm=_rms_mm(bundle.residuals),
        noise_mm=1e3 * fit.raw_noise_m, error_mm=error_mm, seconds=tracks.duration_s, instants=len(fit.instants),
        verdict=judge(f"{_count(bones)}; the hand is {100 * size:.1f} % of the base hand; beyond their noise the "
                      f"markers are {error_mm:.1f} mm off.", findings))


def _by_reach(tracks: MarkerTracks, base: HandAnatomy, progress: Progress) -> BonesResult:
    fit = fit_reach(tracks, base, progress=progress)
    bones = bone_lengths(fit.unknowns, fit.vector, fit.covariance)
    reaches, size, size_std = finger_reaches(fit.unknowns, fit.vector, fit.covariance)
    findings = [*bones_judgement.length_findings(tracks.duration_s),
                *bones_judgement.bending_findings(fit.reach_m, fit.bending_m),
                *bones_judgement.few_marker_findings(len(tracks.places))]
    return BonesResult(
        hand=fit.unknowns.anatomy(fit.vector), method="reach", size=size, size_std=size_std, bones=bones,
        reaches=reaches, markers=(), rigid=(), residual_mm=None, noise_mm=1e3 * fit.raw_noise_m,
        error_mm=None, seconds=tracks.duration_s, instants=len(tracks.times_s),
        verdict=judge(f"the hand is {100 * size:.1f} % of the base hand, to {100 * size_std:.1f} %; single bones "
                      "are not observed.", findings))


def _rms_mm(residuals: Array) -> float:
    return 1e3 * float(np.sqrt(np.nanmean(np.square(residuals))))


def _count(bones: tuple[BoneLength, ...]) -> str:
    """How many bones are known how: "12 of 15 bones are observed, 2 in part, 1 not at all"."""
    observed, partly, unseen = (sum(bone.known is known for bone in bones)
                                for known in (Known.OBSERVED, Known.PARTLY, Known.PRIOR))
    if observed == len(bones):
        return f"all {observed} bones are observed"
    if unseen == len(bones):
        return "no bone is observed by itself"
    parts = [f"{observed} of {len(bones)} bones are observed" if observed else "no bone is observed fully"]
    parts += [f"{partly} in part"] if partly else []
    parts += [f"{unseen} not at all"] if unseen else []
    return ", ".join(parts)


# -- what six markers can tell of a hand -------------------------------------------------------------------------------

STRETCH_LOSS = (0.005, 0.01)
"""By which part the farthest tip falls short of the straight finger, and the scatter of that: nobody stretches a finger
to the last degree, and 8 degrees in every joint cost one hundredth."""

_QUANTILE = 99.5  # of the distances: the last few are mistakes
_LEAST_SAMPLES = 100
_STEP_M = 1e-4


@dataclass(frozen=True, slots=True)
class ReachFit:
    """`vector` (G,) and `covariance` of the unknowns after the reaches were seen; per finger the `reach_m` (5,) from
    the wrist to its marker, NaN where there is none, and how much shorter it gets when bent, `bending_m` (5,)."""

    unknowns: HandUnknowns
    vector: Array
    covariance: Array
    reach_m: Array
    bending_m: Array
    raw_noise_m: float


def fit_reach(tracks: MarkerTracks, base: HandAnatomy, *, progress: Progress = silent) -> ReachFit:
    """Size and reaches from a wrist marker and fingertips. Raises CalibrationError without them."""
    wrist = next((k for k, place in enumerate(tracks.places) if place.on_palm), None)
    if wrist is None:
        raise CalibrationError("no marker shows the palm or the wrist, so nothing can be said of any finger's length.")
    progress("measuring how far the fingers reach", 0.0)
    smoothed = smooth(tracks.times_s, tracks.positions)
    reach, bending, columns = np.full(5, np.nan), np.full(5, np.nan), np.full(5, -1)
    for k, place in enumerate(tracks.places):
        if place.segment != DISTAL:
            continue
        distance = np.linalg.norm(smoothed.positions[:, k] - smoothed.positions[:, wrist], axis=1)
        distance = distance[np.isfinite(distance)]
        if len(distance) >= _LEAST_SAMPLES:
            near, far = np.percentile(distance, [100.0 - _QUANTILE, _QUANTILE])
            reach[place.finger], bending[place.finger], columns[place.finger] = far, far - near, k
    if np.isnan(reach).all():
        raise CalibrationError(f"no fingertip is seen together with {tracks.places[wrist].name} in at least "
                               f"{_LEAST_SAMPLES} instants. Record a minute with the whole hand in sight.")
    unknowns = HandUnknowns(base, tracks.places)
    vector, covariance = _condition(unknowns, reach, columns, wrist, progress)
    return ReachFit(unknowns, vector, covariance, reach, bending, smoothed.raw_noise_m)


def _condition(unknowns: HandUnknowns, reach: Array, columns: NDArray[np.int64], wrist: int,
               progress: Progress) -> tuple[Array, Array]:
    """The prior given the reaches; twice, since a reach is not quite linear in the lengths."""
    prior = unknowns.prior
    seen = np.flatnonzero(np.isfinite(reach))
    vector, covariance = prior.mean, prior.covariance
    stretched = [_stretched_angles(unknowns, vector, int(columns[finger]), wrist, int(finger)) for finger in seen]
    for turn in range(2):
        progress("measuring how far the fingers reach", 0.3 + 0.3 * turn)
        poses = Poses(np.tile(np.eye(4), (len(seen), 1, 1)), np.array(stretched))

        def reaches(vector: Array, poses: Poses = poses) -> Array:
            points = expected(unknowns, vector, poses)
            rows = np.arange(len(seen))
            return np.asarray(np.linalg.norm(points[rows, columns[seen]] - points[rows, wrist], axis=1))

        at = reaches(vector)
        slope = np.array([(reaches(vector + step) - at) / _STEP_M for step in _STEP_M * np.eye(unknowns.size)]).T
        straight = reach[seen] * (1.0 + STRETCH_LOSS[0])
        noise = np.diag((STRETCH_LOSS[1] * straight) ** 2)
        gain = prior.covariance @ slope.T @ np.linalg.inv(slope @ prior.covariance @ slope.T + noise)
        vector = prior.mean + gain @ (straight - at - slope @ (prior.mean - vector))
        covariance = prior.covariance - gain @ slope @ prior.covariance
    return vector, covariance


def _stretched_angles(unknowns: HandUnknowns, vector: Array, marker: int, wrist: int, finger: int) -> Array:
    """(21,) rad: of a grid of poses the one in which this finger's marker is farthest from the wrist marker."""
    limits = unknowns.limits[ANGLE_SLICES[finger]]
    # Only the first two joints turn the finger as a whole; those behind are straight, at zero, when it is longest.
    count = 2 if FINGERS[finger] != "thumb" else 5
    grids = [np.unique(np.clip(np.append(np.linspace(low, high, 7), 0.0), low, high)) for low, high in limits[:count]]
    grid = np.array(list(product(*grids)))
    angles = np.zeros((len(grid), 21))
    angles[:, ANGLE_SLICES[finger].start:ANGLE_SLICES[finger].start + count] = grid
    points = expected(unknowns, vector, Poses(np.tile(np.eye(4), (len(grid), 1, 1)), angles))
    return np.asarray(angles[int(np.argmax(np.linalg.norm(points[:, marker] - points[:, wrist], axis=1)))])


# -- bone lengths entered by hand --------------------------------------------------------------------------------------

RULER_SD_MM = 1.5
"""How well a bone is measured from joint to joint with a ruler."""

UNUSUAL, IMPOSSIBLE = 3.0, 6.0
"""Standard deviations from what is usual in a hand of the size that the other bones show."""

BONE_NAMES: tuple[str, ...] = tuple(bone_name(k // 3, k % 3) for k in range(BONE_COUNT))
_CENTIMETRES = (1.0, 12.0)  # a length in this range is likely to be one of centimetres


def enter_bones(base: HandAnatomy, lengths_mm: Mapping[str, float]) -> BonesResult:
    """The hand `base` with some of its bones, named as "index.proximal", replaced. Markers keep their part of the bone.

    Raises CalibrationError when there is no such bone, or a length is not a number of millimetres at all.
    """
    for name, value in lengths_mm.items():
        if name not in BONE_NAMES:
            raise CalibrationError(f"there is no bone {name!r}; they are {', '.join(BONE_NAMES)}.")
        if not 0.0 < value <= 400.0:
            raise CalibrationError(f"{name}: {value:g} mm cannot be the length of a bone.")
    hand = _with_lengths(base, lengths_mm)
    unknowns = HandUnknowns(base, ())
    entered = HandUnknowns(hand, ())
    covariance = _after_measuring(unknowns, lengths_mm)
    bones = tuple(
        bone if bone.name not in lengths_mm else
        BoneLength(bone.name, bone.length_mm, RULER_SD_MM, bone.usual_std_mm, Known.ENTERED)
        for bone in bone_lengths(entered, entered.prior.mean, covariance))
    reaches, _, _ = finger_reaches(entered, entered.prior.mean, covariance)
    _, size, size_std = finger_reaches(unknowns, entered.prior.mean, covariance)
    findings = [finding for name, value in lengths_mm.items()
                if (finding := _judge_length(unknowns, lengths_mm, name, value)) is not None]
    return BonesResult(
        hand=hand, method="entered", size=size, size_std=size_std, bones=bones, reaches=reaches, markers=(), rigid=(),
        residual_mm=None, noise_mm=0.0, error_mm=None, seconds=0.0, instants=0,
        verdict=judge(f"{len(lengths_mm)} of {BONE_COUNT} bones entered.", findings))


def _with_lengths(base: HandAnatomy, lengths_mm: Mapping[str, float]) -> HandAnatomy:
    fingers = dict(base.fingers)
    for finger, name in enumerate(FINGERS):
        old = base.fingers[name]
        bones = tuple(float(lengths_mm.get(bone_name(finger, k), length)) for k, length in enumerate(old.bones_mm))
        marker = old.marker_mm / old.bones_mm[2] * bones[2]
        fingers[name] = msgspec.structs.replace(old, bones_mm=(bones[0], bones[1], bones[2]),
                                                marker_mm=round(marker, 2), bones_sd_mm=None, radii_sd_mm=None)
    return msgspec.structs.replace(base, fingers=fingers)


def _after_measuring(unknowns: HandUnknowns, lengths_mm: Mapping[str, float]) -> Array:
    """Covariance of the unknowns once these bones were measured."""
    rows = [BONE_NAMES.index(name) for name in lengths_mm]
    covariance = unknowns.prior.covariance
    if not rows:
        return covariance
    noise = (1e-3 * RULER_SD_MM) ** 2 * np.eye(len(rows))
    gain = covariance[:, rows] @ np.linalg.inv(covariance[np.ix_(rows, rows)] + noise)
    return np.asarray(covariance - gain @ covariance[rows])


def _judge_length(unknowns: HandUnknowns, lengths_mm: Mapping[str, float], name: str, value: float) -> Finding | None:
    """What the other lengths that were entered say of this one."""
    prior, own = unknowns.prior, BONE_NAMES.index(name)
    others = [BONE_NAMES.index(other) for other in lengths_mm if other != name]
    mean, variance = prior.mean[own], prior.covariance[own, own]
    if others:
        seen = 1e-3 * np.array([lengths_mm[BONE_NAMES[k]] for k in others])
        noise = (1e-3 * RULER_SD_MM) ** 2 * np.eye(len(others))
        gain = prior.covariance[own, others] @ np.linalg.inv(prior.covariance[np.ix_(others, others)] + noise)
        mean, variance = mean + gain @ (seen - prior.mean[others]), variance - gain @ prior.covariance[others, own]
    usual, scatter = 1e3 * float(mean), 1e3 * float(np.sqrt(variance)) + RULER_SD_MM
    off = abs(value - usual) / scatter
    if off < UNUSUAL:
        return None
    centimetres = _CENTIMETRES[0] < value < _CENTIMETRES[1] and abs(10.0 * value - usual) < UNUSUAL * scatter
    return Finding(
        "implausible_bone", Grade.POOR if off > IMPOSSIBLE or centimetres else Grade.FAIR,
        f"{name} is entered as {value:g} mm; {usual:.0f} ± {scatter:.0f} mm is usual with the other lengths.",
        "It looks like centimetres." if centimetres else "Another bone was measured, or the hand is unusual.",
        f"Enter {10.0 * value:g}." if centimetres else "Measure again, from the middle of one joint to the next.")
