"""Two rigs side by side in figures for people: mm, degrees, milliseconds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rhot_app.calibration.lens.camera_calibration import calibration_text
from rhot_app.geometry.transforms import rotation_from_quaternion
from rhot_app.project import FilterSettings, OneEuroSettings, Rig, RigNode
from rhot_app.ui.models.tracker_words import settings_text
from rhot_app.ui.wizards.models.proposal import Row

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
            f"{node.name}: distortion": ", ".join(f"{k:.3f}" for k in lens.distortion)}


def place_figures(node: RigNode) -> Figures:
    """Where a camera stands and where it looks."""
    x, y, z = (1e3 * metres for metres in node.pose.translation_m)
    axis = rotation_from_quaternion(np.array(node.pose.rotation_wxyz))[:, 2]
    return {f"{node.name}: place": f"{x:.1f}, {y:.1f}, {z:.1f} mm",
            f"{node.name}: looks along": ", ".join(f"{part:.3f}" for part in axis)}


def _cameras(rig: Rig) -> Iterator[tuple[str, str]]:
    for node in rig.nodes:
        yield from lens_figures(node).items()
        yield from place_figures(node).items()
        yield f"{node.name}: time offset", f"{1e3 * node.time_offset_s:.2f} ms"
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
