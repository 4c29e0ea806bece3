"""The rows of the panels as text, with units and the right number of digits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import (
    KNOWN_EXACTLY,
    CalibrationAccuracy,
)
from rhot_app.engine.status import NodeStatus
from rhot_app.state import HandState, Knowledge
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.meters import unused_frames
from rhot_app.ui.models.words import KNOWLEDGE, NAMES, NODES, UNKNOWN_STATE, Look, marker_look

# -- standard deviation along the worst axis ---------------------------------------------------------------------------

Array = NDArray[np.float64]


def worst_sd(covariances: Array) -> Array:
    """Standard deviation (...,) along the worst axis of each covariance (..., 3, 3), in the root of its unit.

    NaN where the covariance is not known.
    """
    known = np.asarray(np.isfinite(covariances).all(axis=(-2, -1)))
    values = np.linalg.eigvalsh(np.where(known[..., None, None], covariances, 0.0))[..., -1]
    return np.asarray(np.where(known, np.sqrt(np.maximum(values, 0.0)), np.nan))


def total_sd(covariances: Array, by_calibration: CalibrationAccuracy) -> Array:
    """Standard deviation (...,) m of places along the worst axis, the calibration's own included, as it is in
    `covariances` (..., 3, 3) where it is known; NaN where either is not known."""
    return worst_sd(covariances) if by_calibration.known else np.full(covariances.shape[:-2], np.nan)


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
    "lost": tr_noop("never arrived: the network lost them"),
    "time": tr_noop("came too late: this computer or the network is busy"),
    "kernel_overflow": tr_noop("could not be read in time: this computer is busy"),
    "marker_set": tr_noop("of another marker set than the rig's"),
    "no_landmarks": tr_noop("landmarks, but no marker of the rig is one"),
    "image_size": tr_noop("of another picture size than the rig's"),
    "foreign_node": tr_noop("of another node"),
    "duplicate": tr_noop("came twice"),
    "failed": tr_noop("an observation kind failed over them"),
    "tag": tr_noop("not signed with the node's key"),
    "untagged": tr_noop("not signed"),
}


def node_row(node: NodeStatus) -> NodeRow:
    """Text of one node's card."""
    look = NODES.get(node.state, Look(node.state, "octagon", "fault", UNKNOWN_STATE))
    unused = unused_frames(node)
    count, total = sum(unused.values()), node.received + unused.get("lost", 0)
    losses = tr("{n} frame unused", "{n} frames unused", count) if count > _USUAL_LOSS * total else ""
    lines = [tr(look.meaning), tr("{n} frame received.", "{n} frames received.", node.received)]
    if unused:
        lines += [tr("Unused:"), *(f"  {many} × {_unused_text(reason)}" for reason, many in sorted(unused.items()))]
    return NodeRow(
        name=node.name, look=look, rate=f"{node.rate_hz:.0f} /s" if node.rate_hz > 0 else DASH, losses=losses,
        clock=clock_text(node), message=node.message,
        tooltip="\n".join(filter(None, (*lines, trust_text(node)))),
    )


def _unused_text(reason: str) -> str:
    return tr(_UNUSED[reason]) if reason in _UNUSED else tr("refused ({reason})", reason=reason)


def trust_text(node: NodeStatus) -> str:
    """A line about a node whose word cannot be trusted; nothing about one that is paired."""
    if node.text_datagrams:
        return tr("Sends the thesis's text datagrams: untrusted.")
    return "" if node.paired else tr("Not paired: untrusted; anybody on the network may steer it or speak in its "
                                     "place.")


def clock_text(node: NodeStatus) -> str:
    """Bound of the clock offset, e.g. "clock ± 0.08 ms"; text nodes have no clock."""
    if node.text_datagrams:
        return tr("no clock (text)")
    if node.clock_bound_s is None:
        return tr("clock unknown")
    return tr("clock ± {bound:.2f} ms", bound=1e3 * node.clock_bound_s)


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
    spreads = total_sd(state.marker_covariances, by_calibration)
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
        spread = ", ".join(f"{math.sqrt(v) * 1e3:.2f}" for v in variances)
        lines.append(tr("± {spread} mm (one sigma)", spread=spread))
    if not by_calibration.known:
        reason = by_calibration.reason
        lines.append(tr("At least: {reason}", reason=reason[:1].lower() + reason[1:]))
    if np.isfinite(state.epipolar_error_px[marker]):
        lines.append(tr("epipolar error {error:.2f} px", error=state.epipolar_error_px[marker]))
    return "\n".join(lines)


def angle_text(angle_rad: float, sd_rad: float = math.nan) -> str:
    """Angle in whole degrees with its sign, e.g. "-12°", and with its standard deviation, e.g. "-12 ±3°"."""
    if not math.isfinite(angle_rad):
        return DASH
    spread = f" ±{max(round(math.degrees(sd_rad)), 1)}" if math.isfinite(sd_rad) else ""
    return f"{round(math.degrees(angle_rad))}{spread}°"


def palm_text(state: HandState, by_calibration: CalibrationAccuracy = KNOWN_EXACTLY) -> str:
    """How well the palm is known, e.g. "± 0.40 mm, ± 1.2°", worst axes; "" when that is not known."""
    place = sd_text(float(total_sd(state.palm_covariance[:3, :3], by_calibration)))
    turn = math.degrees(float(worst_sd(state.palm_covariance[3:, 3:])))
    return f"{place}, ± {turn:.1f}°" if place and math.isfinite(turn) else ""


def marker_name(marker: str) -> str:
    """Marker id as people say it: "thumb_tip" is "thumb tip". Names of the shipped sets are translated, others stay."""
    name = marker.replace("_", " ")
    return tr(name) if name in NAMES else name


def bytes_text(count: int) -> str:
    """File size for people, e.g. "3.2 MB"."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.1f} {unit}"
    return f"{count} B"
