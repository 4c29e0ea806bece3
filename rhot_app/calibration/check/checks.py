"""Everything that can be wrong with a rig file and shows without a picture, for ``rhot check`` and before writing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import calibration_finding
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.geometry.camera import FARTHEST_DEG, CameraModel, is_wide, lens_parameters
from rhot_app.geometry.transforms import inverse
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.places import ROLES
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import OTHER_HAND, OneEuroSettings, Rig, RigNode, estimator_obstacle
from rhot_node.files import resource_path

# -- plausibility of cameras and lenses --------------------------------------------------------------------------------

Array = NDArray[np.float64]

WORKING_DISTANCES_M = (0.4, 0.6, 1.0)

_USUAL_VIEW_DEG = (25.0, 120.0)  # horizontal field of view: a tele lens to the widest of five coefficients
_POSSIBLE_VIEW_DEG = (8.0, 170.0)
_USUAL_OFFSET = 0.15  # of the picture's side, principal point from the middle
_USUAL_ASPECT = 0.05  # fx against fy: pixels are square
_GRID = 19
_TOGETHER_M = 0.005
NARROW_M, APART_M = 0.025, 3.0
"""Baselines with which cameras hardly see depth, and with which they are taken for a wrong unit."""
_GOOD_OVERLAP, _LEAST_OVERLAP = 0.5, 0.15
_STEEP_RAD = np.radians(70.0)


@dataclass(frozen=True, slots=True)
class LensFigures:
    """A lens in words of the shop: horizontal and vertical field of view, and the share of the picture that it can turn
    into directions."""

    name: str
    view_rad: tuple[float, float]
    usable: float


@dataclass(frozen=True, slots=True)
class PairGeometry:
    """Two cameras: `baseline_m` between their centres, `toe_in_rad` between their axes, and of the picture of each the
    share that the other sees too, the lesser of the two, at each of `WORKING_DISTANCES_M`."""

    first: str
    second: str
    baseline_m: float
    toe_in_rad: float
    overlap: tuple[float, ...]


def lens_figures(node: RigNode) -> LensFigures:
    """Fields of view, and how much of the picture has a direction."""
    model = _model(node)
    usable = np.isfinite(model.undistort(_grid(node))).all(axis=1)
    return LensFigures(node.name, model.field_of_view, float(np.mean(usable)))


def pair_geometry(first: RigNode, second: RigNode) -> PairGeometry:
    """How two cameras stand to each other."""
    a, b = _model(first), _model(second)
    cosine = float(np.clip(a.world_from_camera[:3, 2] @ b.world_from_camera[:3, 2], -1.0, 1.0))
    return PairGeometry(
        first.name, second.name, float(np.linalg.norm(a.centre - b.centre)), float(np.arccos(cosine)),
        tuple(min(_seen_too(first, second, z), _seen_too(second, first, z)) for z in WORKING_DISTANCES_M))


def lens_findings(node: RigNode, figures: LensFigures) -> list[Finding]:
    """Whether this can be a lens."""
    lens, name = node.intrinsics, node.name
    found = [_view_finding(node, figures)]
    aspect = abs(lens.fx / lens.fy - 1.0)
    if aspect > _USUAL_ASPECT:
        found.append(Finding("aspect", Grade.FAIR if aspect < 0.5 else Grade.POOR,
                             f"The focal lengths of {name} are {lens.fx:.0f} and {lens.fy:.0f} px, "
                             f"{100 * aspect:.0f} % apart.", "Pixels are square, unless the picture was stretched.",
                             _CALIBRATE))
    offset = max(abs(lens.cx / (lens.width - 1) - 0.5), abs(lens.cy / (lens.height - 1) - 0.5))
    if offset > _USUAL_OFFSET:
        found.append(Finding(
            "principal_point", Grade.POOR if offset > 0.5 else Grade.FAIR,
            f"The principal point of {name} is at ({lens.cx:.0f}, {lens.cy:.0f}) in a picture of "
            f"{lens.width}x{lens.height} px.", "It should be near the middle; the intrinsics may be of another picture "
            "size, or of views that were all alike.", _CALIBRATE))
    if figures.usable < 1.0:
        wide = is_wide(lens_parameters(lens))
        cause = ("The coefficients were fitted to views that do not reach the picture's corners" +
                 (f", or it is a fisheye lens that sees more than {FARTHEST_DEG:.0f} degrees aside." if wide else "."))
        found.append(Finding(
            "distortion", Grade.POOR if figures.usable < 0.95 else Grade.FAIR,
            f"The distortion of {name} turns over inside the picture: {100 * (1 - figures.usable):.0f} % of it has no "
            "direction.", cause, f"{_CALIBRATE} {_NARROWER}" if wide else _CALIBRATE))
    return [each for each in found if each is not None]


def pair_findings(rig: Rig, pairs: list[PairGeometry]) -> list[Finding]:
    """Whether the cameras stand where cameras can track together."""
    found = []
    for pair in pairs:
        both = f"{pair.first} and {pair.second}"
        if pair.baseline_m < _TOGETHER_M:
            found.append(Finding("coincident", Grade.POOR, f"{both} stand at the same place "
                                 f"({pair.baseline_m * 1e3:.0f} mm apart).", "Depth needs two places.", _STEREO))
        elif pair.baseline_m < NARROW_M:
            found.append(Finding("narrow", Grade.FAIR, f"{both} are only {pair.baseline_m * 1e3:.0f} mm apart.",
                                 "So near to each other they hardly see depth; or the board's squares were given too "
                                 "small.", "Measure from lens to lens. If that is right, put them 75 mm apart."))
        elif pair.baseline_m > APART_M:
            found.append(Finding("apart", Grade.POOR, f"{both} are {pair.baseline_m:.0f} m apart.",
                                 "A rig's translations are in metres: is the unit right (--unit, --square-mm)?",
                                 _STEREO))
    return [*found, *_overlap_findings(pairs), *_side_findings(rig)]


def all_pairs(rig: Rig) -> list[PairGeometry]:
    """The geometry of all pairs of cameras whose poses are known."""
    return [pair_geometry(a, b) for a, b in combinations([node for node in rig.nodes if node.pose_known], 2)]


_CALIBRATE = "Calibrate the intrinsics of this camera."
_NARROWER = "Use a lens of less than 150 degrees, or a mode of the camera that shows less."
_STEREO = "Run the stereo calibration."


def _view_finding(node: RigNode, figures: LensFigures) -> Finding | None:
    degrees = float(np.degrees(figures.view_rad[0]))
    wide = is_wide(lens_parameters(node.intrinsics))
    widest = (_POSSIBLE_VIEW_DEG if wide else _USUAL_VIEW_DEG)[1]
    if _USUAL_VIEW_DEG[0] <= degrees <= widest:
        return None
    as_pinhole = np.degrees(2.0 * np.arctan(0.5 * node.intrinsics.width / node.intrinsics.fx))
    possible = all(_POSSIBLE_VIEW_DEG[0] <= each <= _POSSIBLE_VIEW_DEG[1] for each in (degrees, as_pinhole))
    figure = (f"{node.name.capitalize()} sees {degrees:.0f} degrees across (f {node.intrinsics.fx:.0f} px, picture "
              f"{node.intrinsics.width} px wide).")
    if wide and degrees > widest:
        return Finding("field_of_view", Grade.POOR, figure, "It is a fisheye lens: the model of a lens ends "
                       f"{FARTHEST_DEG:.0f} degrees from the lens's axis.",
                       _NARROWER)
    return Finding("field_of_view", Grade.FAIR if possible else Grade.POOR, figure,
                   "The focal length may be of another picture size, or in millimetres.", _CALIBRATE)


def _overlap_findings(pairs: list[PairGeometry]) -> list[Finding]:
    """Each camera needs one other that sees the same hands; two on opposite sides need not see each other's."""
    found = []
    for name in {each for pair in pairs for each in (pair.first, pair.second)}:
        partners = [pair for pair in pairs if name in (pair.first, pair.second)]
        best = max(partners, key=lambda pair: max(pair.overlap))
        if max(best.overlap) >= _GOOD_OVERLAP:
            continue
        shares = ", ".join(f"{100 * share:.0f} % at {z:g} m"
                           for share, z in zip(best.overlap, WORKING_DISTANCES_M, strict=True))
        found.append(Finding(
            "overlap", Grade.POOR if max(best.overlap) < _LEAST_OVERLAP else Grade.FAIR,
            f"{best.first} and {best.second} see little together: {shares}.",
            "They look in different directions, or stand too far apart for this distance.",
            "Turn them towards each other, so that their pictures share at least half where the hand will be."))
    unique = {finding.figure: finding for finding in found}
    return list(unique.values())


def _side_findings(rig: Rig) -> list[Finding]:
    nodes = {node.name.lower(): node for node in rig.nodes if node.pose_known}
    if "left" not in nodes or "right" not in nodes:
        return []
    left, right = _model(nodes["left"]), _model(nodes["right"])
    x, y, z = (inverse(left.world_from_camera) @ right.world_from_camera)[:3, 3]
    if abs(x) <= max(abs(y), abs(z)) or x > 0.0:
        return []
    return [Finding("swapped", Grade.POOR, f"Right stands {-x * 1e3:.0f} mm to the left of left.",
                    "The cameras are swapped, or were calibrated from mirrored pictures.",
                    "Run the stereo calibration again, with the pictures of each camera under its own name.")]


def _seen_too(first: RigNode, second: RigNode, distance_m: float) -> float:
    """The share of the first camera's picture that, `distance_m` in front of it, lies in the second one's."""
    rays = _model(first).undistort(_grid(first))
    rays = rays[np.isfinite(rays).all(axis=1)]
    local = np.column_stack([rays, np.ones(len(rays))]) * distance_m
    world = local @ _model(first).world_from_camera[:3, :3].T + _model(first).centre
    pixels = _model(second).project(world)
    inside = ((pixels >= -0.5) & (pixels <= np.array([second.intrinsics.width, second.intrinsics.height]) - 0.5))
    return float(np.mean(inside.all(axis=1))) if len(rays) else 0.0


def _grid(node: RigNode) -> Array:
    """(N, 2) px over the whole picture, its border included."""
    u, v = np.meshgrid(np.linspace(0, node.intrinsics.width - 1, _GRID),
                       np.linspace(0, node.intrinsics.height - 1, _GRID))
    return np.column_stack([u.ravel(), v.ravel()])


def _model(node: RigNode) -> CameraModel:
    return CameraModel.from_rig(node.intrinsics, node.pose)


# -- the result of ``rhot check`` --------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class RigCheck:
    """What a rig file amounts to; lenses and pairs are empty where distance comes from disparity alone."""

    lenses: tuple[LensFigures, ...]
    pairs: tuple[PairGeometry, ...]
    verdict: Verdict


def check_rig(rig: Rig) -> RigCheck:
    """Check a whole rig."""
    calibrated = rig.depth.mode == "stereo"
    lenses = tuple(lens_figures(node) for node in rig.nodes) if calibrated else ()
    pairs = tuple(all_pairs(rig)) if calibrated else ()
    findings = [*_camera_findings(rig, lenses, pairs), *marker_findings(rig), *hand_findings(rig),
                *filter_findings(rig), *link_findings(rig), *_tracker_findings(rig), *object_findings(rig)]
    if len(rig.nodes) < 2:
        findings.append(Finding("one_camera", Grade.FAIR, "The rig has one camera.", "Depth needs two.",
                                "Add a second node."))
    return RigCheck(lenses, pairs, judge(_summary(rig, findings), findings))


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


# -- plausibility of markers, hand, filters, ports and times -----------------------------------------------------------

_USUAL_BONE = (0.6, 1.5)  # of the shipped adult hand's; wider than four standard deviations
_POSSIBLE_BONE = (0.3, 2.2)
_USUAL_CUTOFF_HZ = (0.05, 30.0)
_LONG_OFFSET_S = 0.1
_FREE_PORTS = 1024


def marker_findings(rig: Rig) -> list[Finding]:
    """Pairs of markers whose hues lie so near that each one's range reaches the other's middle. The colours of
    landmarks are for the screen only."""
    close, painted = [], [marker for marker in rig.markers.markers if marker.shape != "landmark"]
    for a, b in combinations(painted, 2):
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


# -- size of an object's tags in the images ----------------------------------------------------------------------------

LEAST_TAG_PX = 20.0
"""px: smaller tags are seldom found, and their pose is poorly known (`tests/objects/test_tag_detector.py`)."""


def object_findings(rig: Rig) -> list[Finding]:
    """Tags that are too small for the cameras, and meshes that are not there."""
    distance_m = 0.6 if rig.calibration is None else rig.calibration.distance_m
    focal_px = max(min(node.intrinsics.fx, node.intrinsics.fy) for node in rig.nodes)
    found = []
    for one, model in zip([one for one in rig.objects if one.model is not None], rig.models, strict=True):
        small = [tag for tag in model.fiducials if focal_px * 1e-3 * tag.size_mm / distance_m < LEAST_TAG_PX]
        if small:
            width_px = focal_px * 1e-3 * small[0].size_mm / distance_m
            found.append(Finding(
                "small_tag", Grade.FAIR,
                f"Tag {small[0].id} of the object {model.name} is {small[0].size_mm:g} mm wide, which is "
                f"{width_px:.0f} px at {distance_m:g} m.", f"Tags under {LEAST_TAG_PX:g} px are seldom found.",
                f"Print it {LEAST_TAG_PX / focal_px * distance_m * 1e3:.0f} mm wide or larger, or correct size_mm in "
                f"{one.file}."))
        if model.mesh is not None and one.folder is not None and not (one.folder / model.mesh.file).is_file():
            found.append(Finding(
                "mesh", Grade.FAIR if model.shape is not None else Grade.POOR,
                f"The mesh {model.mesh.file} of the object {model.name} is not in {one.folder}.", "",
                f"Put it there, or take it out of {one.file}."))
    return found
