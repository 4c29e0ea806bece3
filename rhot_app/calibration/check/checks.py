"""Everything that can be wrong with a rig file and shows without a picture, for ``rhot check`` and before writing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rhot_app.calibration.check.camera_checks import (
    LensFigures,
    PairGeometry,
    all_pairs,
    lens_figures,
    lens_findings,
    pair_findings,
)
from rhot_app.calibration.lens.camera_calibration import calibration_finding
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.places import ROLES
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import OTHER_HAND, OneEuroSettings, Rig, estimator_obstacle
from rhot_node.files import resource_path


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


# -- what a rig file says about markers, hand, filters, ports and times, held against what can be ----------------------

_USUAL_BONE = (0.6, 1.5)  # of the shipped adult hand's; wider than four standard deviations
_POSSIBLE_BONE = (0.3, 2.2)
_USUAL_CUTOFF_HZ = (0.05, 30.0)
_LONG_OFFSET_S = 0.1
_FREE_PORTS = 1024


def marker_findings(rig: Rig) -> list[Finding]:
    """Pairs of markers whose hues lie so near that each one's range reaches the other's middle."""
    close = []
    for a, b in combinations(rig.markers.markers, 2):
        apart = abs((np.degrees(a.chroma.hue_rad - b.chroma.hue_rad) + 180.0) % 360.0 - 180.0)
        if apart < max(a.chroma.hue_tolerance_deg, b.chroma.hue_tolerance_deg):
            close.append(f"{a.id} and {b.id} ({apart:.0f} degrees of hue)")
    if not close:
        return []
    return [Finding("colours", Grade.FAIR, f"Markers have nearly the same colour: {', '.join(close)}.",
                    "One will be taken for the other.", "Paint one in another colour, or narrow the hue tolerances.")]


def hand_findings(rig: Rig) -> list[Finding]:
    """Bones that no hand has."""
    adult = load_hand(resource_path("hands", "right.json"))
    odd, impossible = [], False
    for finger in FINGERS:
        for bone, mean in zip(rig.hand.fingers[finger].bones_mm, adult.fingers[finger].bones_mm, strict=True):
            ratio = bone / mean
            if not _USUAL_BONE[0] <= ratio <= _USUAL_BONE[1]:
                odd.append(f"{finger} {bone:.0f} mm (adults: {mean:.0f})")
                impossible = impossible or not _POSSIBLE_BONE[0] <= ratio <= _POSSIBLE_BONE[1]
    if not odd:
        return []
    return [Finding("hand", Grade.POOR if impossible else Grade.FAIR, f"Unusual bones: {', '.join(odd)}.",
                    "Lengths are in millimetres from joint to joint.", "Measure the hand again.")]


def filter_findings(rig: Rig) -> list[Finding]:
    """Filters that let everything through, or nothing."""
    filters, found = rig.filters, []
    named = {"pixel": filters.pixel, "position": filters.position,
             **{f"pixel of {k}": v for k, v in filters.pixel_markers.items()},
             **{f"position of {k}": v for k, v in filters.position_markers.items()}}
    for name, settings in named.items():
        if not _USUAL_CUTOFF_HZ[0] <= settings.min_cutoff_hz <= _USUAL_CUTOFF_HZ[1]:
            effect = "hardly smooths" if settings.min_cutoff_hz > 1.0 else "lags by seconds"
            found.append(Finding("filter", Grade.FAIR, f"The filter for {name} has a minimum cutoff of "
                                 f"{settings.min_cutoff_hz:g} Hz.", f"It {effect}.", _TUNE))
        elif settings.beta == 0.0 and _slow(settings):
            found.append(Finding("filter", Grade.FAIR, f"The filter for {name} has beta 0 and a minimum cutoff of "
                                 f"{settings.min_cutoff_hz:g} Hz.", "It lags behind fast movements.", _TUNE))
    return found


def link_findings(rig: Rig) -> list[Finding]:
    """Ports that two nodes share, that need rights or that nobody knows, and time offsets that cannot be."""
    found, used = [], dict[tuple[str, int, bool], str]()
    for node in rig.nodes:
        for what in ("udp_port", "control_port", "preview_port", "pairing_port"):
            port = getattr(node, what)
            place, label = (node.address, port, what == "udp_port"), f"{node.name}'s {what}"
            if place in used:
                found.append(Finding("ports", Grade.POOR, f"{label} is {node.address}:{port}, and so is {used[place]}.",
                                     "Only one of them can be there.", "Give every node its own address or ports."))
            used[place] = label
            if 0 < port < _FREE_PORTS:
                found.append(Finding("ports", Grade.FAIR, f"{label} is {port}.",
                                     "Ports below 1024 need special rights.", "Use one above 1024."))
        if node.text_datagrams and node.data_port == 0:
            found.append(Finding("ports", Grade.POOR, f"{node.name} sends text datagrams, and its data_port is 0.",
                                 "A program that sends text cannot be told which port was free.",
                                 "Choose a data_port, and send there."))
        if abs(node.time_offset_s) > _LONG_OFFSET_S:
            found.append(Finding("time", Grade.FAIR, f"{node.name}'s time offset is {node.time_offset_s * 1e3:.0f} ms.",
                                 "Cameras are late by some tens of milliseconds.", "Run the time calibration again."))
    return found


_TUNE = "Tune the filters."


def _slow(settings: OneEuroSettings) -> bool:
    return settings.min_cutoff_hz < 5.0
