"""What an alignment is worth: which motion was missing, standard deviations, and the verdict in words."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge, told_apart
from rhot_app.objects.alignment.fit import (
    LASTING_M,
    OFFSET,
    POINT,
    ROTATION,
    SEARCH_S,
    STEP_S,
    AlignmentFit,
    OffsetSearch,
    align,
)
from rhot_app.objects.alignment.motion_stream import MotionStream

Array = NDArray[np.float64]

FAIR_M, POOR_M = 2e-3, 5e-3
"""m: requirement. A grasp is recognised to some millimetres; 5 mm is half the breadth of a fingertip."""

REACH_M = 0.3
"""m: half the width of a hand's working volume; a rotation error counts as its displacement there."""

FAST_M_S = 1.0
"""m/s: a fast hand; an error of the time offset counts as its displacement at this speed."""

FAIR_INLIERS, POOR_INLIERS = 0.8, 0.5
FAIR_SCALE, POOR_SCALE = 0.02, 0.1
"""Deviation of the foreign scale from 1. 2 % are 6 mm over REACH_M; units differ by 10 or more."""

FAIR_RIVAL, POOR_RIVAL = 1.5, 1.15
"""Median residual of another time offset over that of the best one, as of the time calibration."""

RIVAL_S = 0.15
"""s: offsets nearer than this are the same minimum: a quarter period of 1.5 Hz, where most of a hand's motion is."""

SHORT_S = 8.0


@dataclass(frozen=True, slots=True)
class Coverage:
    """How much the motion shows.

    `turn` (3,): by how much the device turned, ascending: root of the eigenvalues of I - M'M of its mean rotation M.
    The first is that about the second axis and determines tracker_from_body; all are 0 without rotation. For small
    rotations rad. `spread_m` (3,) m, descending: standard deviations of the body's place along its principal axes.
    `speed_m_s`: its rms speed.
    """

    turn: Array
    spread_m: Array
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class AlignmentSolution:
    """A solved alignment with its coverage and verdict.

    `covariance` (n, n) in the order of `alignment.fit.TRANSLATION`, by noise and by errors that last. Of it
    `place_sd_m`: of a position in the middle of the motion; `rotation_sd_rad`; `point_sd_m`: of tracker_from_body;
    `offset_sd_s`. `scale`: size of the foreign world in the rig's metres.
    """

    fit: AlignmentFit
    coverage: Coverage
    covariance: Array
    place_sd_m: float
    rotation_sd_rad: float
    point_sd_m: float
    offset_sd_s: float
    scale: float
    verdict: Verdict


def calibrate_alignment(foreign: MotionStream, rig: MotionStream, search_s: float = SEARCH_S,
                        progress: Callable[[str, float], None] = lambda text, part: None) -> AlignmentSolution:
    """Align two streams and judge the result. Raises CalibrationError as `align` does."""
    fit, search = align(foreign, rig, search_s, progress)
    progress("alignment", 1.0)
    return judge_alignment(fit, search)


def judge_alignment(fit: AlignmentFit, search: OffsetSearch) -> AlignmentSolution:
    """The report on a fit and the search that it began with."""
    coverage, covariance = coverage_of(fit), fit.covariance + fit.lasting
    place, turn, point, offset = (math.sqrt(max(float(np.trace(block)), 0.0)) for block in (
        fit.centre_covariance, covariance[ROTATION, ROTATION], covariance[POINT, POINT], covariance[OFFSET, OFFSET]))
    findings = [*_match(fit, search), *_rotation(coverage), *_translation(coverage), *_time(coverage, offset),
                *_search(search, fit)]
    if not findings:
        findings += _statistics(place, turn, point)
    if fit.duration_s < SHORT_S:
        findings.append(Finding("short", Grade.FAIR, f"The recording is {fit.duration_s:.0f} s long.", "",
                                "Record 20 s."))
    summary = (f"positions of the other tracker are known in the rig to ±{1e3 * place:.2f} mm and "
               f"±{math.degrees(turn):.3f} degrees, its clock to ±{1e3 * offset:.2f} ms; {1e3 * fit.rms_m:.2f} mm rms "
               f"remain, {100 * fit.inlier_ratio:.0f} % of the samples agree.")
    return AlignmentSolution(fit, coverage, covariance, place, turn, point, offset, search.scale,
                           judge(summary, findings))


def coverage_of(fit: AlignmentFit) -> Coverage:
    """The motion that the inliers show."""
    return coverage_of_motion(fit.device[fit.inlier], fit.places[fit.inlier], fit.velocity[fit.inlier])


def coverage_of_motion(device: Array, places: Array, velocity: Array) -> Coverage:
    """The motion of rotations (N, 3, 3) of the device, and of places (M, 3) m and velocities (M, 3) m/s of the body."""
    mean = device.mean(axis=0)
    turn = np.sqrt(np.maximum(np.linalg.eigvalsh(np.eye(3) - mean.T @ mean), 0.0))
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(places.T)), 0.0))[::-1]
    speed = float(np.sqrt(np.mean(np.sum(velocity**2, axis=1))))
    return Coverage(turn, spread, speed)


def _grade(error_m: float) -> Grade | None:
    return None if error_m <= FAIR_M else Grade.FAIR if error_m <= POOR_M else Grade.POOR


def _rotation(coverage: Coverage) -> list[Finding]:
    """A lasting error e displaces the point on the device by e / turn."""
    grade = _grade(LASTING_M / max(float(coverage.turn[0]), 1e-9))
    if grade is None:
        return []
    enough = LASTING_M / FAIR_M
    if coverage.turn[2] < enough:
        return [Finding("no_rotation", grade, "The tracker turned by "
                        f"{told_apart(math.degrees(coverage.turn[2]), math.degrees(enough), 1)} degrees rms only; "
                        f"{math.degrees(enough):.1f} are needed about two axes.",
                        "A parallel translation does not show where the fingertip sits on the tracker.",
                        "Turn the tracker about two axes while you move it.")]
    return [Finding("one_axis", grade, f"The tracker turned by {math.degrees(coverage.turn[2]):.1f} degrees rms about "
                    f"one axis, but by {told_apart(math.degrees(coverage.turn[0]), math.degrees(enough), 1)} about "
                    f"any other; {math.degrees(enough):.1f} are needed.",
                    "Rotation about one axis does not show how far along it the fingertip sits.",
                    "Turn the tracker about a second axis as well.")]


def _translation(coverage: Coverage) -> list[Finding]:
    """A lasting error e turns the alignment by e / spread; about the longest axis by e over that of the other two."""
    grade = _grade(LASTING_M * REACH_M / max(float(np.linalg.norm(coverage.spread_m[1:])), 1e-9))
    enough = LASTING_M * REACH_M / FAIR_M
    spreads = ", ".join(f"{1e3 * spread:.0f}" for spread in coverage.spread_m)
    if grade is not None:
        return [Finding("one_direction", grade, f"The fingertip moved by {spreads} mm rms along its three axes; "
                        f"{1e3 * enough:.0f} mm are needed across the longest.", "Motion along one line does not show "
                        "how the other world is turned about it.", "Move up and down, left and right, near and far.")]
    if coverage.spread_m[2] < LASTING_M * REACH_M / POOR_M:
        return [Finding("planar", Grade.FAIR, f"The fingertip moved by {spreads} mm rms along its three axes.",
                        "Motion within a plane does not show errors of the rig across it.",
                        "Move along the third axis as well.")]
    return []


def _time(coverage: Coverage, offset_sd_s: float) -> list[Finding]:
    """A lasting error e shifts the offset by e / speed."""
    total = max(offset_sd_s, LASTING_M / max(coverage.speed_m_s, 1e-9))
    grade = _grade(total * FAST_M_S)
    if grade is None:
        return []
    return [Finding("slow", grade, f"The time offset is known to ±{1e3 * total:.1f} ms only: the rms speed was "
                    f"{1e3 * coverage.speed_m_s:.0f} mm/s.", "Slow motion shows little of a delay.",
                    f"Move faster: {1e3 * LASTING_M * FAST_M_S / FAIR_M:.0f} mm/s rms, such as 20 cm once a second.")]


def _match(fit: AlignmentFit, search: OffsetSearch) -> list[Finding]:
    """Whether the two streams are of one rigid thing, in the same units."""
    found = []
    scale = abs(search.scale - 1.0)
    if scale > FAIR_SCALE and fit.places.std(axis=0).max() > LASTING_M / FAIR_SCALE:
        found.append(Finding("scale", Grade.POOR if scale > POOR_SCALE else Grade.FAIR, "The other tracker's world is "
                             f"{search.scale:.4g} times as large as the rig's.",
                             "Its positions are not in metres, or the rig's stereo calibration has a wrong scale.",
                             "Give metres, or calibrate the stereo geometry with a measured board."))
    grade = _grade(fit.rms_m)
    share = fit.inlier_ratio
    if share < FAIR_INLIERS:
        grade = Grade.POOR if share < POOR_INLIERS else grade or Grade.FAIR
    if grade is not None:
        found.append(Finding("not_rigid", grade, f"The streams differ by {1e3 * fit.rms_m:.1f} mm rms, and "
                             f"{100 * share:.0f} % of the samples agree.",
                             "The fingertip moved on the tracker, the two are of different motions, their clocks "
                             "differ by more than was searched, or one tracker often fails.",
                             "Tie the tracker firmly to the finger or tag, and record both on one clock."))
    return found


def _search(search: OffsetSearch, fit: AlignmentFit) -> list[Finding]:
    best = int(np.argmin(search.median_m))
    usable = np.flatnonzero(np.isfinite(search.median_m))
    if best in (usable[0], usable[-1]):
        return [Finding("edge", Grade.POOR, f"The best time offset, {1e3 * search.offsets_s[best]:+.0f} ms, lies at "
                        "the edge of what was searched.", "The true one may lie beyond.",
                        "Search further, or give both times on one clock.")]
    inner = search.median_m[1:-1]
    minima = 1 + np.flatnonzero((inner <= search.median_m[:-2]) & (inner <= search.median_m[2:]))
    others = search.median_m[[k for k in minima if abs(search.offsets_s[k] - fit.offset_s) > RIVAL_S + STEP_S]]
    rival = float(others.min(initial=math.inf)) / max(float(search.median_m[best]), 1e-9)
    if rival >= FAIR_RIVAL:
        return []
    return [Finding("ambiguous", Grade.POOR if rival < POOR_RIVAL else Grade.FAIR,
                    f"Another time offset fits nearly as well ({rival:.2f} times the residual).",
                    "The motion repeats itself too evenly, or is too slow.", "Move irregularly: change speed and "
                    "place.")]


def _statistics(place_sd_m: float, rotation_sd_rad: float, point_sd_m: float) -> list[Finding]:
    worst = max(place_sd_m, rotation_sd_rad * REACH_M, point_sd_m)
    grade = _grade(worst)
    if grade is None:
        return []
    return [Finding("uncertain", grade, f"The alignment is known to ±{1e3 * worst:.1f} mm only, within "
                    f"{1e3 * REACH_M:.0f} mm.", "The streams are noisy or short.", "Record 20 s or more.")]
