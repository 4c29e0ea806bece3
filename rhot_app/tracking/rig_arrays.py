"""The rig compiled to the arrays that the tracker's inner loops work on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, ball
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import build_model
from rhot_app.hand.places import ROLES, farthest_apart, place_of
from rhot_app.hand.skeleton import TIP_ROLES, WRIST_ROLE
from rhot_app.project import OTHER_HAND, FilterSettings, OneEuroSettings, Rig
from rhot_node.markers import FLAT_PATCHES, Marker

# -- positions without calibration (RHOT 6.5.2) ------------------------------------------------------------------------
# Distance from disparity, the rest from the view angle.
# For users without a board. The cameras are taken as equal and parallel; what they are not makes the distances wrong by
# some percent everywhere, which the covariances say. Lenses, poses and the markers' bodies are not looked at, and rows
# that disagree are no outlier: nobody aligned the cameras.

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ERROR_BY_THEORY, ERROR_BY_LAW = 0.05, 0.02
"""Standard deviation of a distance as a part of it: in the thesis's table, by eq. 6.12 and by the power law."""

LEAST_PX = 1.0
"""Less disparity says nothing: a pixel of it is tens of metres away."""


def disparity_law(rig: Rig) -> Array:
    """The rig's `depth` for `locate_by_disparity`: baseline m, focal length px, image centre (2) px, k, z, relative
    error (7,); empty (0,) when the rig finds distances by stereo."""
    depth = rig.depth
    if depth.mode != "disparity":
        return np.empty(0)
    lens = rig.nodes[0].intrinsics
    focal = 0.5 * lens.width / math.tan(0.5 * math.radians(depth.view_angle_deg))
    k, z, error = depth.baseline_m * focal, -1.0, ERROR_BY_THEORY
    if depth.k is not None and depth.z is not None:
        k, z, error = depth.k, depth.z, ERROR_BY_LAW
    return np.array([depth.baseline_m, focal, 0.5 * (lens.width - 1), 0.5 * (lens.height - 1), k, z, error])


@njit(cache=True)
def locate_by_disparity(pixels: Array, covariances: Array, used: Mask, law: Array, positions: Array,
                        position_covariances: Array, errors: Array) -> None:
    """Locate M markers from two cameras, the left one first (or the right one: the magnitude counts).

    Arguments as of `locate.locate_all`, `law` as of `disparity_law`. World frame: the left camera, x right, y down,
    z away. A marker that is not `used` (2, M) by both, or has too little disparity, is NaN; `errors` are always NaN:
    without a calibration nothing says how near rays should meet.
    """
    focal, z = law[1], law[5]
    jacobian = np.empty((3, 4))  # of the position by both cameras' x and y
    ray = np.empty(3)
    for m in range(pixels.shape[1]):
        errors[m] = math.nan
        positions[m] = math.nan
        position_covariances[m] = math.nan
        disparity = pixels[0, m, 0] - pixels[1, m, 0]
        if not (used[0, m] and used[1, m] and abs(disparity) > LEAST_PX):
            used[:, m] = False
            continue
        depth = law[4] * abs(disparity) ** z
        ray[0] = (0.5 * (pixels[0, m, 0] + pixels[1, m, 0]) - law[2]) / focal
        ray[1] = (0.5 * (pixels[0, m, 1] + pixels[1, m, 1]) - law[3]) / focal
        ray[2] = 1.0
        steepness = z * depth / disparity
        for i in range(3):
            positions[m, i] = depth * ray[i]
            jacobian[i, 0], jacobian[i, 2] = steepness * ray[i], -steepness * ray[i]
            jacobian[i, 1], jacobian[i, 3] = 0.0, 0.0
        positions[m, 0] += 0.5 * law[0]
        for camera in range(2):
            jacobian[0, 2 * camera] += 0.5 * depth / focal
            jacobian[1, 2 * camera + 1] += 0.5 * depth / focal
        for i in range(3):
            for j in range(3):
                total = (law[6] * depth) ** 2 * ray[i] * ray[j]
                for camera in range(2):
                    for a in range(2):
                        for b in range(2):
                            total += (jacobian[i, 2 * camera + a] * covariances[camera, m, a, b]
                                      * jacobian[j, 2 * camera + b])
                position_covariances[m, i, j] = total


# -- the rig as arrays -------------------------------------------------------------------------------------------------

_ROUND = ("sphere", "capsule", "band")


@dataclass(frozen=True, slots=True)
class RigArrays:
    """C cameras, M markers. Read-only.

    `cameras` (C, 3, 4) camera_from_world m; `intrinsics` (C, 13) as `CameraModel`.
    `shapes` (M, 3, 3) m^2: the markers' bodies as far as known without the hand's pose, zero for flat ones. `tips`
    (5,): marker index of each finger's tip, -1 without one; `wrist`: the same for the wrist. `band_half_axes`
    (3,) m along the palm's x, y, z; None when the wrist wears no band. `law` (7,): how distance follows from
    disparity (`disparity_law`), empty when markers are triangulated. `reach` (M, M) m: the greatest
    distance of two markers of the hand, infinite where either is not on the hand.
    """

    camera_names: tuple[str, ...]
    marker_ids: tuple[str, ...]
    cameras: Array
    intrinsics: Array
    shapes: Array
    tips: NDArray[np.int64]
    wrist: int
    band_half_axes: Array | None
    law: Array
    reach: Array


def rigs_of_hands(rig: Rig) -> list[tuple[Rig, NDArray[np.intp]]]:
    """The rig as if each of its one or two hands were alone, with the numbers of that hand's markers, which those of
    objects are not. The filters are not an estimator's."""
    rig, own = without_objects(rig)
    if rig.other_hand is None:
        return [(rig, own)]
    found, poses = [], rig.tracker.start_poses
    for number, (hand, wanted) in enumerate(((rig.hand, False), (rig.other_hand, True))):
        columns = np.flatnonzero([(one.role or "").startswith(OTHER_HAND) == wanted for one in rig.markers.markers])
        alone = tuple(msgspec.structs.replace(one, role=(one.role or "").removeprefix(OTHER_HAND) or None)
                      for one in (rig.markers.markers[m] for m in columns))
        markers = msgspec.structs.replace(rig.markers, markers=alone)
        tracker = msgspec.structs.replace(rig.tracker, start_poses=poses[number:number + 1])
        found.append((msgspec.structs.replace(rig, markers=markers, hand=hand, other_hand=None, tracker=tracker,
                                              filters=FilterSettings()), own[columns]))
    return found


def without_objects(rig: Rig) -> tuple[Rig, NDArray[np.intp]]:
    """The rig without objects and their markers, and the numbers of the markers that remain."""
    taken = {marker.marker for model in rig.models for marker in model.markers}
    own = np.flatnonzero([marker.id not in taken for marker in rig.markers.markers])
    if not rig.objects or not len(own):
        return rig, own
    chosen = msgspec.structs.replace(rig.markers, markers=tuple(rig.markers.markers[m] for m in own))
    filters = FilterSettings() if taken else rig.filters
    return msgspec.structs.replace(rig, objects=(), markers=chosen, filters=filters), own


def compile_rig(rig: Rig) -> RigArrays:
    """The arrays of a validated rig."""
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    markers = rig.markers.markers
    roles = [marker.role for marker in markers]
    wrist = roles.index(WRIST_ROLE) if WRIST_ROLE in roles else -1
    return RigArrays(
        camera_names=tuple(node.name for node in rig.nodes),
        marker_ids=rig.markers.ids,
        cameras=np.array([model.camera_from_world[:3] for model in models]),
        intrinsics=np.array([model.intrinsics for model in models]),
        shapes=np.array([_shape(marker) for marker in markers]),
        tips=np.array([roles.index(role) if role in roles else -1 for role in TIP_ROLES], dtype=np.int64),
        wrist=wrist,
        band_half_axes=band_axes(markers[wrist], rig.hand) if wrist >= 0 and markers[wrist].shape == "band" else None,
        law=disparity_law(rig),
        reach=_reach(rig),
    )


def filter_settings(rig: Rig) -> tuple[list[OneEuroSettings], list[OneEuroSettings]]:
    """Per marker, in the rig's order: settings before depth (pixels) and after depth (metres)."""
    chosen = rig.filters
    return ([chosen.pixel_markers.get(name, chosen.pixel) for name in rig.markers.ids],
            [chosen.position_markers.get(name, chosen.position) for name in rig.markers.ids])


def _reach(rig: Rig) -> Array:
    markers = rig.markers.markers
    reach = np.full((len(markers), len(markers)), np.inf)
    own = [m for m, marker in enumerate(markers) if marker.role in ROLES]
    if own:
        model = build_model(rig.hand)
        reach[np.ix_(own, own)] = farthest_apart(model, [place_of(markers[m], model) for m in own])
    return reach


def _shape(marker: Marker) -> Array:
    flat = marker.shape not in _ROUND or marker.patch in FLAT_PATCHES  # the centroid of a flat patch is its position
    return ball(1e-3 * marker.radius_mm if marker.radius_mm and not flat else 0.0)


def band_axes(marker: Marker, hand: HandAnatomy) -> Array:
    """The band goes round the wrist: as flat as the anatomy says, as thick in the mean as the marker says."""
    flat = 0.5e-3 * np.array([hand.wrist_breadth_mm, hand.wrist_thickness_mm])
    scale = 1e-3 * marker.radius_mm / flat.mean() if marker.radius_mm else 1.0
    return np.array([0.5e-3 * (marker.length_mm or 0.0), *(scale * flat)])
