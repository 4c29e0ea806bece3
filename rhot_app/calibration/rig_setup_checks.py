"""What a rig file says about markers, hand, filters, ports and times, held against what can be."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import OneEuroSettings, Rig
from rhot_node.files import resource_path

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
