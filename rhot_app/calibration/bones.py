"""Bone lengths and marker places from a minute of free movement: chooses the method, solves, reports, judges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration import bones_judgement as judgement
from rhot_app.calibration.bones_report import (
    BoneLength,
    BonesReport,
    Known,
    bone_lengths,
    finger_reaches,
    marker_spots,
    rigid_distances,
)
from rhot_app.calibration.hand_bundle_model import POSE, in_segments
from rhot_app.calibration.hand_fit import fit_hand
from rhot_app.calibration.hand_reach import fit_reach
from rhot_app.calibration.hand_shape import BONE_COUNT
from rhot_app.calibration.marker_places import MarkerTracks
from rhot_app.calibration.rigid_segments import rigid_pairs
from rhot_app.calibration.verdict import judge
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.progress import Progress, silent

Array = NDArray[np.float64]


def solve_bones(tracks: MarkerTracks, base: HandAnatomy, *, progress: Progress = silent) -> BonesReport:
    """The hand that wore these markers. `base` gives side, name, limits, and the proportions to begin from.

    Markers whose coordinates outnumber a pose's unknowns show single bones; fewer show size and reaches. Raises
    CalibrationError when the recording holds no hand at all.
    """
    if len(tracks.times_s) < 2:
        raise CalibrationError("the recording is empty: no instant shows the markers.")
    if 3 * len(tracks.places) > POSE:
        return _by_movement(tracks, base, progress)
    return _by_reach(tracks, base, progress)


def _by_movement(tracks: MarkerTracks, base: HandAnatomy, progress: Progress) -> BonesReport:
    fit = fit_hand(tracks, base, progress=progress)
    unknowns, bundle = fit.unknowns, fit.bundle
    bones = bone_lengths(unknowns, bundle.vector, fit.covariance)
    reaches, size, size_std = finger_reaches(unknowns, bundle.vector, fit.covariance)
    pairs = rigid_pairs(tracks.positions, fit.raw_noise_m)
    error_mm = 1e3 * fit.model_error_m
    local = in_segments(unknowns, bundle.vector, bundle.poses, bundle.residuals)
    spots = marker_spots(unknowns, bundle.vector, fit.covariance)
    findings = [
        *judgement.misplaced_findings(bundle.residuals, tracks.places), *judgement.order_findings(spots, bones),
        *judgement.length_findings(tracks.duration_s), *judgement.side_findings(base.side, fit.other_side_cost),
        *judgement.stillness_findings(bundle.poses.angles), *judgement.slip_findings(tracks),
        *judgement.drift_findings(tracks.times_s[fit.instants], local, tracks.places,
                                   fit.model_error_m),
        *judgement.rigid_findings(pairs, tracks), *judgement.error_findings(error_mm),
        *judgement.bone_findings(bones), *judgement.palm_findings(tracks.places),
        *judgement.plausibility_findings(bones, size * 1e3 * unknowns.prior.mean[:BONE_COUNT])]
    return BonesReport(
        hand=unknowns.anatomy(bundle.vector), method="movement", size=size, size_std=size_std,
        bones=bones, reaches=reaches, markers=spots,
        rigid=rigid_distances(pairs, unknowns), residual_mm=_rms_mm(bundle.residuals),
        noise_mm=1e3 * fit.raw_noise_m, error_mm=error_mm, seconds=tracks.duration_s, instants=len(fit.instants),
        verdict=judge(f"{_count(bones)}; the hand is {100 * size:.1f} % of the base hand; beyond their noise the "
                      f"markers are {error_mm:.1f} mm off.", findings))


def _by_reach(tracks: MarkerTracks, base: HandAnatomy, progress: Progress) -> BonesReport:
    fit = fit_reach(tracks, base, progress=progress)
    bones = bone_lengths(fit.unknowns, fit.vector, fit.covariance)
    reaches, size, size_std = finger_reaches(fit.unknowns, fit.vector, fit.covariance)
    findings = [*judgement.length_findings(tracks.duration_s), *judgement.bending_findings(fit.reach_m, fit.bending_m),
                *judgement.few_marker_findings(len(tracks.places))]
    return BonesReport(
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
