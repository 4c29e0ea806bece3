"""The rows of the panels and of rig comparisons as text, with units and the right number of digits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import (
    KNOWN_EXACTLY,
    CalibrationAccuracy,
    calibration_text,
    offset_text,
)
from rhot_app.engine.status import NodeStatus
from rhot_app.estimation.se3 import rotation_from_quaternion
from rhot_app.project import FilterSettings, OneEuroSettings, Rig, RigNode
from rhot_app.state import HandState, Knowledge
from rhot_app.ui.models.meters import unused_frames
from rhot_app.ui.models.proposal import Row
from rhot_app.ui.models.words import KNOWLEDGE, NODES, Look, marker_look, settings_text

# -- standard deviation along the worst axis ---------------------------------------------------------------------------

Array = NDArray[np.float64]


def worst_sd(covariances: Array) -> Array:
    """Standard deviation (...,) along the worst axis of each covariance (..., 3, 3), in the root of its unit.

    NaN where the covariance is not known.
    """
    known = np.asarray(np.isfinite(covariances).all(axis=(-2, -1)))
    values = np.linalg.eigvalsh(np.where(known[..., None, None], covariances, 0.0))[..., -1]
    return np.asarray(np.where(known, np.sqrt(np.maximum(values, 0.0)), np.nan))


def total_sd(covariances: Array, positions: Array, by_calibration: CalibrationAccuracy) -> Array:
    """Standard deviation (...,) m of places (..., 3) m along the worst axis, the calibration's own included; NaN where
    either is not known."""
    return np.asarray(np.hypot(worst_sd(covariances), by_calibration.at(positions)))


def sd_number(sd_m: float) -> str:
    """In mm with two significant digits, e.g. "0.31", "2.4", "18"; "" when it is not known."""
    if not math.isfinite(sd_m):
        return ""
    sd_mm = 1e3 * sd_m
    return f"{sd_mm:.2f}" if sd_mm < 0.995 else f"{sd_mm:.1f}" if sd_mm < 9.95 else f"{sd_mm:.0f}"


def spread_number(total_m: float, own_m: float) -> str:
    """The standard deviation `total_m` in mm; where the calibration's part is unknown, that it is at least `own_m`,
    e.g. "≥ 0.31". "" where not even that is known."""
    own = sd_number(own_m)
    return sd_number(total_m) or (f"≥ {own}" if own else "")


def sd_text(sd_m: float) -> str:
    """E.g. "± 0.31 mm"; "" when it is not known."""
    number = sd_number(sd_m)
    return f"± {number} mm" if number else ""


# -- rows of the panels ------------------------------------------------------------------------------------------------

DASH = "–"


@dataclass(frozen=True, slots=True)
class NodeRow:
    """One node: its look and three short lines, and what the node itself says."""

    name: str
    look: Look
    rate: str
    losses: str
    clock: str
    message: str
    tooltip: str


_USUAL_LOSS = 0.01
"""A hand moves on by some millimetres in a frame: one in a hundred that is missing changes nothing to be seen."""

_UNUSED = {
    "lost": "never arrived: the network lost them",
    "time": "came too late: this computer or the network is busy",
    "kernel_overflow": "could not be read in time: this computer is busy",
    "marker_set": "of another marker set than the rig's",
    "no_landmarks": "landmarks, but no marker of the rig is one",
    "image_size": "of another picture size than the rig's",
    "foreign_node": "of another node",
    "duplicate": "came twice",
    "failed": "an observation kind failed over them",
    "tag": "not signed with the node's key",
    "untagged": "not signed",
}


def node_row(node: NodeStatus) -> NodeRow:
    """Text of one node's card."""
    look = NODES.get(node.state, Look(node.state, "octagon", "fault", "This state is not known to this version."))
    unused = unused_frames(node)
    count, total = sum(unused.values()), node.received + unused.get("lost", 0)
    losses = f"{count} frames unused" if count > _USUAL_LOSS * total else ""
    reasons = "".join(f"\n  {many} × {_UNUSED.get(reason, f'refused ({reason})')}"
                      for reason, many in sorted(unused.items()))
    tooltip = f"{look.meaning}\n{node.received} frames received." + (f"\nUnused:{reasons}" if reasons else "")
    return NodeRow(
        name=node.name, look=look, rate=f"{node.rate_hz:.0f} /s" if node.rate_hz > 0 else DASH, losses=losses,
        clock=clock_text(node), message=node.message,
        tooltip=tooltip + trust_text(node),
    )


def trust_text(node: NodeStatus) -> str:
    """A line about a node whose word cannot be trusted; nothing about one that is paired."""
    if node.text_datagrams:
        return "\nSends the thesis's text datagrams: untrusted."
    return "" if node.paired else "\nNot paired: untrusted; anybody on the network may steer it or speak in its place."


def clock_text(node: NodeStatus) -> str:
    """Bound of the clock offset, e.g. "clock ± 0.08 ms"; text nodes have no clock."""
    if node.text_datagrams:
        return "no clock (text)"
    if node.clock_bound_s is None:
        return "clock unknown"
    return f"clock ± {node.clock_bound_s * 1e3:.2f} ms"


@dataclass(frozen=True, slots=True)
class MarkerRow:
    """One marker: its state, how its position is known, and where it is."""

    name: str
    look: Look
    knowledge: Look
    position: str
    spread: str  # mm, one sigma along the worst axis; "≥ 0.31" for an unknown calibration, "" when not estimated
    detail: str


def marker_rows(state: HandState, by_calibration: CalibrationAccuracy = KNOWN_EXACTLY) -> list[MarkerRow]:
    """Rows of all markers, in the rig's order."""
    rows = []
    least = worst_sd(state.marker_covariances)
    estimated = np.isfinite(state.marker_positions).all(axis=1) & np.isfinite(least)
    spreads = total_sd(state.marker_covariances, state.marker_positions, by_calibration)
    for index, name in enumerate(state.marker_ids):
        known = KNOWLEDGE[Knowledge(int(state.marker_knowledge[index]))]
        spread = spread_number(float(spreads[index]), float(least[index]))
        rows.append(MarkerRow(name, marker_look(state, index), known, position_text(state.marker_positions[index]),
                              spread if estimated[index] else "",
                              marker_detail(state, index, by_calibration)))
    return rows


def position_text(position: np.ndarray) -> str:
    """Rig-frame position in mm, e.g. "12, -40, 603 mm"."""
    if not np.isfinite(position).all():
        return DASH
    return ", ".join(f"{value * 1e3:.0f}" for value in position) + " mm"


def marker_detail(state: HandState, marker: int, by_calibration: CalibrationAccuracy = KNOWN_EXACTLY) -> str:
    """Tooltip of one marker: position, its standard deviation per axis, epipolar error."""
    lines = [f"x, y, z: {position_text(state.marker_positions[marker])}"]
    variances = np.diagonal(state.marker_covariances[marker])
    if np.isfinite(variances).all() and (variances >= 0).all():
        more = float(by_calibration.at(state.marker_positions[marker])) if by_calibration.known else 0.0
        lines.append("± " + ", ".join(f"{math.hypot(math.sqrt(v), more) * 1e3:.2f}" for v in variances)
                     + " mm (one sigma)" + (f", {1e3 * more:.2f} mm of it by the calibration" if more > 0.0 else ""))
    if not by_calibration.known:
        lines.append(f"At least: {by_calibration.reason[:1].lower()}{by_calibration.reason[1:]}")
    if np.isfinite(state.epipolar_error_px[marker]):
        lines.append(f"epipolar error {state.epipolar_error_px[marker]:.2f} px")
    return "\n".join(lines)


def angle_text(angle_rad: float, sd_rad: float = math.nan) -> str:
    """Angle in whole degrees with its sign, e.g. "-12°", and with its standard deviation, e.g. "-12 ±3°"."""
    if not math.isfinite(angle_rad):
        return DASH
    spread = f" ±{max(round(math.degrees(sd_rad)), 1)}" if math.isfinite(sd_rad) else ""
    return f"{round(math.degrees(angle_rad))}{spread}°"


def palm_text(state: HandState, by_calibration: CalibrationAccuracy = KNOWN_EXACTLY) -> str:
    """How well the palm is known, e.g. "± 0.40 mm, ± 1.2°", worst axes; "" when that is not known."""
    place = sd_text(float(total_sd(state.palm_covariance[:3, :3], state.world_from_palm[:3, 3], by_calibration)))
    turn = math.degrees(float(worst_sd(state.palm_covariance[3:, 3:])))
    return f"{place}, ± {turn:.1f}°" if place and math.isfinite(turn) else ""


def short_name(marker: str) -> str:
    """Marker id as people say it: "thumb_tip" is "thumb tip"."""
    return marker.replace("_", " ")


def bytes_text(count: int) -> str:
    """File size for people, e.g. "3.2 MB"."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.1f} {unit}"
    return f"{count} B"


# -- comparison of two rigs --------------------------------------------------------------------------------------------

Figures = dict[str, str]


def rig_rows(before: Rig, after: Rig) -> tuple[Row, ...]:
    """Every figure in which the two differ, in the order of the rig file; a figure that one lacks is a dash."""
    old, new = figures(before), figures(after)
    names = [*new, *(name for name in old if name not in new)]
    rows = (Row(name, old.get(name, "–"), new.get(name, "–")) for name in names)
    return tuple(row for row in rows if row.changed)


def figures(rig: Rig) -> Figures:
    """Every figure of a rig by its name."""
    return dict([*_cameras(rig), *_markers(rig), *_hand(rig), *_filters(rig.filters), *_solving(rig)])


def lens_figures(node: RigNode) -> Figures:
    """A camera's lens."""
    lens = node.intrinsics
    return {f"{node.name}: picture": f"{lens.width} × {lens.height} px",
            f"{node.name}: focal length": f"{lens.fx:.1f}, {lens.fy:.1f} px",
            f"{node.name}: centre": f"{lens.cx:.1f}, {lens.cy:.1f} px",
            f"{node.name}: distortion": ", ".join(f"{k:z.3f}" for k in lens.distortion)}


def place_figures(node: RigNode) -> Figures:
    """Where a camera stands and where it looks."""
    if not node.pose_known:
        return {f"{node.name}: place": "not known", f"{node.name}: looks along": "not known"}
    x, y, z = (1e3 * metres for metres in node.pose.translation_m)
    axis = rotation_from_quaternion(np.array(node.pose.rotation_wxyz))[:, 2]
    return {f"{node.name}: place": f"{x:z.1f}, {y:z.1f}, {z:z.1f} mm",
            f"{node.name}: looks along": ", ".join(f"{part:z.3f}" for part in axis)}


def _cameras(rig: Rig) -> Iterator[tuple[str, str]]:
    for node in rig.nodes:
        yield from lens_figures(node).items()
        yield from place_figures(node).items()
        yield f"{node.name}: time offset", offset_text(node)
        yield f"{node.name}: address", f"{node.address}:{node.control_port}"
    yield "cameras calibrated", calibration_text(rig)


def _markers(rig: Rig) -> Iterator[tuple[str, str]]:
    for marker in rig.markers.markers:
        colour = marker.chroma
        yield f"{marker.id}: colour", (f"{np.degrees(colour.hue_rad):.0f}° ± {colour.hue_tolerance_deg:.0f}°, at least "
                                       f"{colour.magnitude_min:.0f}")


def _hand(rig: Rig) -> Iterator[tuple[str, str]]:
    yield "hand", f"{rig.hand.name or 'no name'}, {rig.hand.side}"
    for name, finger in rig.hand.fingers.items():
        yield f"{name}: bones", ", ".join(f"{bone:.1f}" for bone in finger.bones_mm) + " mm"
        yield f"{name}: base", ", ".join(f"{part:.1f}" for part in finger.base_mm) + " mm"
        yield f"{name}: marker", f"{finger.marker_mm:.1f} mm"


def _filters(filters: FilterSettings) -> Iterator[tuple[str, str]]:
    yield "filters", "on" if filters.enabled else "off"
    yield "filter of pixels", one_euro_text(filters.pixel)
    yield "filter of positions", one_euro_text(filters.position)
    for kind, own in (("pixels", filters.pixel_markers), ("positions", filters.position_markers)):
        for marker, settings in own.items():
            yield f"{marker}: filter of {kind}", one_euro_text(settings)


def _solving(rig: Rig) -> Iterator[tuple[str, str]]:
    depth = rig.depth
    law = f", D = {depth.k:.4g} |x|^{depth.z:.3f}" if depth.k is not None and depth.z is not None else ""
    yield "depth", f"{depth.mode}{law}"
    yield "tracker", settings_text(rig.tracker)


def one_euro_text(settings: OneEuroSettings) -> str:
    """A filter's parameters."""
    return (f"{settings.min_cutoff_hz:.2f} Hz, beta {settings.beta:.4g}, "
            f"derivative {settings.derivative_cutoff_hz:.1f} Hz")
