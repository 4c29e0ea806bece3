"""The painted part of a fingertip: its extent on the last segment's surface, and its middle.

The last segment is a capsule (`rhot_app.hand.shape`). A point of its surface has three coordinates in the frame of the
bone's end: `along` the bone (0 at the end of the tip, negative towards the joint), `across` (positive towards the
thumb's side of a right hand) and `up`, out of the back of the finger.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.model import HandModel
from rhot_node.markers import FLAT_PATCHES, Marker, Patch

Array = NDArray[np.float64]

NAIL_LENGTH_MM, NAIL_EDGE_MM = 11.0, 3.0
"""Length of a painted fingernail where the marker set gives none, and its distance from the end of the tip, mm. The
nail follows the curve of the tip to where it is no longer visible from straight above."""

NAIL_BREADTH = 0.65
"""A nail's breadth as a share of its fingertip's: 11 mm of an index finger's 17."""

NAIL_CORNERS, DOT_CORNERS = 4.0, 2.0
"""Exponents p of the outline |x / a|^p + |y / b|^p = 1: a rectangle with round corners, an ellipse."""

DOT_MM, RING_MM = 8.0, 10.0
"""A dot's diameter and a ring's length where the marker set gives none, mm."""

_GRID = 40  # points per axis of the integration over a patch: its middle is exact to some micrometres


@dataclass(frozen=True, slots=True)
class PaintedPatch:
    """The painted part of a fingertip, m.

    `middle` and `half` length along the bone; `half_across` and `corners`, the exponent of the outline, of a flat
    patch. `side`: +1 on the back (nail), -1 on the palmar side (pulp), 0 all round.
    """

    middle: float
    half: float
    half_across: float
    corners: float
    side: float


def segment_axis(model: HandModel, finger: int) -> tuple[float, float]:
    """Middle of the axis of the last segment's capsule, along the bone from its end, and half the axis' length, m.

    It is the capsule of `shape.segments`.
    """
    behind = float(model.bones[finger, 2] - model.marker[finger])
    return -behind, max(behind - float(model.radii[finger, 2]), 0.0)


def patch_of(marker: Marker, model: HandModel, finger: int) -> PaintedPatch | None:
    """The painted part of a finger's last segment; None when all of it is painted."""
    if marker.patch == "segment":
        return None
    half = 0.5e-3 * (marker.length_mm or _LENGTHS_MM[marker.patch])
    if marker.patch == "nail":
        return PaintedPatch(-1e-3 * NAIL_EDGE_MM - half, half, NAIL_BREADTH * float(model.radii[finger, 2]),
                            NAIL_CORNERS, 1.0)
    middle, _ = segment_axis(model, finger)
    if marker.patch == "pulp":
        return PaintedPatch(middle, half, half, DOT_CORNERS, -1.0)
    return PaintedPatch(middle, half, 0.0, DOT_CORNERS, 0.0)


_LENGTHS_MM: dict[Patch, float] = {"nail": NAIL_LENGTH_MM, "pulp": DOT_MM, "ring": RING_MM}


def paint_middle(marker: Marker, model: HandModel, finger: int) -> tuple[float, float]:
    """The marker's position on a finger's last segment, m: along the bone from its end, and up, out of the back.

    Paint all round has its position on the bone's axis. A nail or a dot has it in the plane of the patch's rim, under
    the skin, because the image of a patch is the area within the image of its rim. Its centroid is therefore that of
    the rim's plane, from whichever side the whole patch is visible.

    Let z be the height of the skin over the patch, and (v, 0, 1) a line of sight. The centroid lies at
    mean((x - v z) (1 - v z_x)) / mean(1 - v z_x). To first order in v that is the image of a point at mean(x) and at
    the height mean(z) + cov(x, z_x). The heights of the skin's two directions are averaged.
    """
    along, half_axis = segment_axis(model, finger)
    patch = patch_of(marker, model, finger)
    if patch is None or marker.patch not in FLAT_PATCHES:
        return along, 0.0
    steps = (2.0 * np.arange(_GRID) + 1.0) / _GRID - 1.0
    x, y = np.meshgrid(patch.middle + patch.half * steps, patch.half_across * steps, indexing="ij")
    beyond = np.sign(x - along) * np.maximum(np.abs(x - along) - half_axis, 0.0)  # 0 on the capsule's straight part
    height2 = float(model.radii[finger, 2]) ** 2 - beyond**2 - y**2
    inside = (np.abs(steps[:, None]) ** patch.corners + np.abs(steps) ** patch.corners <= 1.0) & (height2 > 0.0)
    if not inside.any():  # the patch lies beyond the segment
        return along, 0.0
    x, y, beyond, z = x[inside], y[inside], beyond[inside], np.sqrt(height2[inside])
    bulge = 0.5 * (np.mean((x - x.mean()) * beyond / z) + np.mean((y - y.mean()) * y / z))
    return float(x.mean()), patch.side * float(z.mean() - bulge)


def gap_middle(marker: Marker, mirror: float) -> float:
    """Angle about the bone of the middle of a marker's gap, rad: 0 is up, out of the back, pi/2 is `across`.

    `mirror`: +1 of a right hand, -1 of a left one, whose thumb is on the other side.
    """
    return {"dorsal": 0.0, "radial": 0.5 * math.pi * mirror, "palmar": math.pi,
            "ulnar": -0.5 * math.pi * mirror}[marker.gap_side]
