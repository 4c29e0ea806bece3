"""The figures of a rig, by the names that calibrations use, so that a result can stand beside what is in force."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from rhot_app.calibration.check.camera_calibration import calibration_text, offset_text
from rhot_app.calibration.report import Figure
from rhot_app.estimation.se3 import rotation_from_quaternion
from rhot_app.geometry.camera import PARAMETERS
from rhot_app.project import FilterSettings, Intrinsics, OneEuroSettings, Rig, RigNode, TrackerSettings

METHODS = {"fabrik": "FABRIK", "dls": "damped least squares", "lm": "Levenberg-Marquardt", "newton": "Newton",
           "svd": "singular values"}
"""Of inverse kinematics, where the rig file's word is short."""


def figures_of(rig: Rig) -> Iterator[Figure]:
    """Every figure of a rig."""
    yield from _cameras(rig)
    yield from _markers(rig)
    yield from _hand(rig)
    yield from _filters(rig.filters)
    depth = rig.depth
    yield Figure("distance from", "calibrated cameras" if depth.mode == "stereo" else "disparity alone")
    if depth.k is not None and depth.z is not None:
        yield Figure("k", 100.0 * depth.k, "cm", decimals=2)
        yield Figure("z", depth.z, decimals=4)
    yield Figure("tracker", tracker_text(rig.tracker))


def lens_figures(camera: str, lens: Intrinsics, std: Mapping[str, float] | None = None) -> Iterator[Figure]:
    """A camera's lens, and the standard deviations of its parameters where they are known."""
    of = f"{camera}: " if camera else ""

    def sd_of(*names: str) -> list[float] | None:
        return None if std is None else [std.get(name, np.nan) for name in names]

    yield Figure(f"{of}picture", f"{lens.width} × {lens.height} px")
    yield Figure(f"{of}focal length", (lens.fx, lens.fy), "px", sd_of("fx", "fy"), 1, "fx fy")
    yield Figure(f"{of}centre", (lens.cx, lens.cy), "px", sd_of("cx", "cy"), 1, "cx cy")
    yield Figure(f"{of}distortion", lens.distortion, "", sd_of(*PARAMETERS[4:4 + len(lens.distortion)]), 3,
                 "distortion")


def order_of_distortion(lens: Intrinsics) -> str:
    """A sentence: which coefficients a lens's distortion lists."""
    return f"Distortion is {', '.join(PARAMETERS[4:4 + len(lens.distortion)])} of OpenCV."


def place_figures(node: RigNode) -> Iterator[Figure]:
    """Where a camera stands and where it looks."""
    place = 1e3 * np.array(node.pose.translation_m) if node.pose_known else "not known"
    axis = rotation_from_quaternion(np.array(node.pose.rotation_wxyz))[:, 2] if node.pose_known else "not known"
    yield Figure(f"{node.name}: place", place, "mm", decimals=1)
    yield Figure(f"{node.name}: looks along", axis, decimals=3)


def distance_figure(first: str, second: str, distance_m: float | None, sd_m: float | None = None) -> Figure:
    """Between two cameras' centres."""
    return Figure(f"{first} to {second}: distance", "not known" if distance_m is None else 1e3 * distance_m, "mm",
                  None if sd_m is None else 1e3 * sd_m)


def tracker_text(settings: TrackerSettings) -> str:
    """One line, e.g. "estimator, full, anatomical limits, size estimated"."""
    if settings.kind == "classic":
        return "classic" if settings.ik == "fabrik" else \
            f"classic, {METHODS.get(settings.ik, settings.ik.replace('_', ' '))}"
    size = ", size estimated" if settings.float_scale else ""
    if settings.contours:
        observed = "paint and contours" if settings.observe == "both" else settings.observe.replace("_", " ")
        return f"estimator, {observed}{size}"
    landmarks = "landmarks, " if settings.landmarks else ""
    return f"estimator, {landmarks}{settings.variant}, {settings.limits} limits{size}"


def one_euro_text(settings: OneEuroSettings) -> str:
    """A filter's parameters."""
    return (f"{settings.min_cutoff_hz:.2f} Hz, beta {settings.beta:.4g}, "
            f"derivative {settings.derivative_cutoff_hz:.1f} Hz")


def _cameras(rig: Rig) -> Iterator[Figure]:
    for node in rig.nodes:
        yield from lens_figures(node.name, node.intrinsics)
        yield from place_figures(node)
        yield Figure(f"{node.name}: time offset", offset_text(node))
        yield Figure(f"{node.name}: address", f"{node.address}:{node.control_port}")
    for node in rig.nodes[1:]:
        yield distance_figure(rig.nodes[0].name, node.name, _distance_m(rig.nodes[0], node))
    yield Figure("cameras calibrated", calibration_text(rig))


def _distance_m(first: RigNode, second: RigNode) -> float | None:
    if not (first.pose_known and second.pose_known):
        return None
    return float(np.linalg.norm(np.subtract(second.pose.translation_m, first.pose.translation_m)))


def _markers(rig: Rig) -> Iterator[Figure]:
    for marker in rig.markers.markers:
        colour = marker.chroma
        yield Figure(f"{marker.id}: colour", f"{np.degrees(colour.hue_rad):.0f}° ± {colour.hue_tolerance_deg:.0f}°, "
                     f"at least {colour.magnitude_min:.0f}")


def _hand(rig: Rig) -> Iterator[Figure]:
    yield Figure("hand", f"{rig.hand.name or 'no name'}, {rig.hand.side}")
    for name, finger in rig.hand.fingers.items():
        yield Figure(f"{name}: bones", finger.bones_mm, "mm", decimals=1)
        yield Figure(f"{name}: base", finger.base_mm, "mm", decimals=1)
        yield Figure(f"{name}: marker", finger.marker_mm, "mm", decimals=1)


def _filters(filters: FilterSettings) -> Iterator[Figure]:
    yield Figure("filters", "on" if filters.enabled else "off")
    yield Figure("filter of pixels", one_euro_text(filters.pixel))
    yield Figure("filter of positions", one_euro_text(filters.position))
    for kind, own in (("pixels", filters.pixel_markers), ("positions", filters.position_markers)):
        for marker, settings in own.items():
            yield Figure(f"{marker}: filter of {kind}", one_euro_text(settings))
