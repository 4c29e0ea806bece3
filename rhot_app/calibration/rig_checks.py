"""Everything that can be wrong with a rig file and shows without a picture, for ``rhot check`` and before writing."""

from __future__ import annotations

from dataclasses import dataclass

from rhot_app.calibration.camera_calibration import calibration_finding
from rhot_app.calibration.rig_camera_checks import (
    LensFigures,
    PairGeometry,
    all_pairs,
    lens_figures,
    lens_findings,
    pair_findings,
)
from rhot_app.calibration.rig_setup_checks import filter_findings, hand_findings, link_findings, marker_findings
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.hand.places import ROLES
from rhot_app.project import OTHER_HAND, Rig, estimator_obstacle


@dataclass(frozen=True, slots=True)
class RigReport:
    """What a rig file amounts to; lenses and pairs are empty where distance comes from disparity alone."""

    lenses: tuple[LensFigures, ...]
    pairs: tuple[PairGeometry, ...]
    verdict: Verdict


def check_rig(rig: Rig) -> RigReport:
    """Check a whole rig."""
    calibrated = rig.depth.mode == "stereo"
    lenses = tuple(lens_figures(node) for node in rig.nodes) if calibrated else ()
    pairs = tuple(all_pairs(rig)) if calibrated else ()
    findings = [*_camera_findings(rig, lenses, pairs), *marker_findings(rig), *hand_findings(rig),
                *filter_findings(rig), *link_findings(rig), *_tracker_findings(rig)]
    if len(rig.nodes) < 2:
        findings.append(Finding("one_camera", Grade.FAIR, "The rig has one camera.", "Depth needs two.",
                                "Add a second node."))
    return RigReport(lenses, pairs, judge(_summary(rig, findings), findings))


def check_cameras(rig: Rig) -> list[Finding]:
    """The findings about lenses and places of the cameras only."""
    return _camera_findings(rig, tuple(lens_figures(node) for node in rig.nodes), tuple(all_pairs(rig)))


def _camera_findings(rig: Rig, lenses: tuple[LensFigures, ...], pairs: tuple[PairGeometry, ...]) -> list[Finding]:
    """Where distance comes from disparity alone, no lens and no place is looked at, and that is said."""
    by_lens = [finding for node, figures in zip(rig.nodes, lenses, strict=False)
               for finding in lens_findings(node, figures)]
    found = calibration_finding(rig)
    return [*([found.finding] if found is not None else []), *by_lens,
            *(pair_findings(rig, list(pairs)) if lenses else [])]


def _tracker_findings(rig: Rig) -> list[Finding]:
    if rig.tracker.kind == "classic":
        return []
    obstacle = estimator_obstacle(rig)
    if obstacle is not None:
        return [Finding("tracker", Grade.POOR, obstacle.why, remedy=obstacle.remedy)]
    homeless = [marker.id for marker in rig.markers.markers
                if (marker.role or "").removeprefix(OTHER_HAND) not in ROLES]
    return [Finding("tracker", Grade.POOR, f"The estimator needs a place on the hand for marker {name}.",
                    remedy="Give it a role, or use the classic tracker (tracker.kind).") for name in homeless]


def _summary(rig: Rig, findings: list[Finding]) -> str:
    wrong = sum(finding.grade is not Grade.GOOD for finding in findings)
    cameras = "1 camera" if len(rig.nodes) == 1 else f"{len(rig.nodes)} cameras"
    things = {0: "nothing is wrong", 1: "one thing to look at"}.get(wrong, f"{wrong} things to look at")
    return f"{rig.name}, {cameras}: {things}."
