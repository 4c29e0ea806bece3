"""What a running rig's figures mean: which calibration is stale, in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rhot_app.calibration.verdict import Finding, Grade

FAIR_ERROR_PX, POOR_ERROR_PX = 0.5, 1.5
"""Median reprojection error (rms over cameras; half the distance of a pair's epipolar lines). A calibrated rig has 0.1
to 0.3; markers are refused from 2.5 on."""

RIGID_PART, RIGID_M = 0.03, 3e-3
"""How far the distance of two markers on one bone may change, and at least."""

REACH_PART = 0.05
"""By how much a tip may be further from the wrist than all bones in a row."""

WEAK_QUALITY = 0.45
"""A marker as plain as it should be has 0.8 to 1."""

DOUBLED_PART = 0.3

Mender = Literal["lens", "stereo", "time", "bones", "colours"]
"""The calibration that mends a finding, named as its wizard; `lens` is ``rhot calibrate intrinsics``."""


@dataclass(frozen=True, slots=True)
class HealthFinding:
    """A finding and the calibration that mends it."""

    mender: Mender
    finding: Finding


@dataclass(frozen=True, slots=True)
class RigidDrift:
    """Two markers on one bone: their distance in the run's first seconds, and now, m."""

    markers: tuple[str, str]
    learnt_m: float
    now_m: float


@dataclass(frozen=True, slots=True)
class Reach:
    """How far a fingertip's marker was from the wrist (95th percentile), and the sum of the bones between, m."""

    marker: str
    seen_m: float
    longest_m: float


@dataclass(frozen=True, slots=True)
class Sighting:
    """A marker in one camera: median quality of plain sights, and the part of all sights in which another blob of its
    colour was as likely; NaN where seen too seldom."""

    camera: str
    marker: str
    quality: float
    ambiguous: float


@dataclass(frozen=True, slots=True)
class HealthFigures:
    """Twenty seconds. `errors_px`: median reprojection error of all, of slow and of fast markers, NaN unknown."""

    errors_px: tuple[float, float, float]
    rigid: tuple[RigidDrift, ...]
    reaches: tuple[Reach, ...]
    sightings: tuple[Sighting, ...]


def findings_of(figures: HealthFigures) -> tuple[HealthFinding, ...]:
    """All findings, the gravest first. Comparisons with what is not known are false, and so say nothing."""
    geometry = _geometry(figures)
    found = [*geometry, *_rigid(figures), *([] if geometry else _reach(figures)), *_weak(figures), *_doubled(figures)]
    return tuple(sorted(found, key=lambda one: -one.finding.grade.rank))


def _geometry(figures: HealthFigures) -> list[HealthFinding]:
    error, slow, fast = figures.errors_px
    if slow < FAIR_ERROR_PX < fast and fast > 2.0 * slow:
        return [HealthFinding("time", Finding(
            "late_camera", Grade.FAIR, f"Rays of fast markers miss each other by {fast:.1f} px, of slow ones by "
            f"{slow:.1f} px only.", "One camera's times are off.",
            "Calibrate the cameras' times with a waving hand (Calibrate menu)."))]
    if not error > FAIR_ERROR_PX:
        return []
    return [HealthFinding("stereo", Finding(
        "stale_geometry", Grade.POOR if error > POOR_ERROR_PX else Grade.FAIR,
        f"The cameras' rays miss each other by {error:.1f} px.",
        "The stereo calibration is stale: a camera was moved or turned, or its lens refocused.",
        "Put the cameras together again with a board (Calibrate menu)."))]


def _rigid(figures: HealthFigures) -> list[HealthFinding]:
    worst = max(figures.rigid, key=lambda one: abs(one.now_m - one.learnt_m), default=None)
    if worst is None or abs(worst.now_m - worst.learnt_m) <= max(RIGID_PART * worst.learnt_m, RIGID_M):
        return []
    figure = (f"{' and '.join(worst.markers)} sit on one bone; they were {1e3 * worst.learnt_m:.1f} mm apart and are "
              f"{1e3 * worst.now_m:.1f} mm now.")
    return [HealthFinding("bones", Finding(
        "rigid_drift", Grade.FAIR, figure, "A marker slipped, or a camera was moved.",
        "Press the markers on and measure the hand again (Calibrate menu)."))]


def _reach(figures: HealthFigures) -> list[HealthFinding]:
    far = [one for one in figures.reaches if one.seen_m > (1.0 + REACH_PART) * one.longest_m]
    if not far:
        return []
    worst = max(far, key=lambda one: one.seen_m / one.longest_m)
    figure = (f"{worst.marker} was {1e3 * worst.seen_m:.0f} mm from the wrist, but the bones between are only "
              f"{1e3 * worst.longest_m:.0f} mm long in all.")
    cause = "It sits elsewhere than the rig says, something else has its colour, or a camera was turned."
    if len(far) > 1:
        cause = "This hand is larger than the hand file says, or the rig's cameras stand further apart than it says."
    return [HealthFinding("bones", Finding("reach", Grade.FAIR, figure, cause, "Measure this hand (Calibrate menu)."))]


def _weak(figures: HealthFigures) -> list[HealthFinding]:
    weak = [one for one in figures.sightings if one.quality < WEAK_QUALITY]
    if not weak:
        return []
    worst = min(weak, key=lambda one: one.quality)
    names = ", ".join(dict.fromkeys(one.marker for one in weak))
    return [HealthFinding("colours", Finding(
        "weak_colour", Grade.FAIR, f"The colour of {names} is hardly told from its surroundings (quality "
        f"{worst.quality:.2f} in camera {worst.camera}).", "The light has changed, or the paint is dirty.",
        "Give more light, or learn the colours again (Calibrate menu)."))]


def _doubled(figures: HealthFigures) -> list[HealthFinding]:
    worst = max((one for one in figures.sightings if one.ambiguous > DOUBLED_PART), key=lambda one: one.ambiguous,
                default=None)
    if worst is None:
        return []
    return [HealthFinding("colours", Finding(
        "doubled_colour", Grade.FAIR, f"In {100 * worst.ambiguous:.0f} % of its pictures camera {worst.camera} sees "
        f"something else in the colour of {worst.marker}.", "",
        "Take it out of the picture, or choose another paint (Calibrate menu)."))]
