"""The rig compiled to the arrays that the tracker's inner loops work on."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.silhouette import ball
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import build_model
from rhot_app.hand.places import ROLES, farthest_apart, place_of
from rhot_app.hand.skeleton import TIP_ROLES, WRIST_ROLE
from rhot_app.project import OTHER_HAND, FilterSettings, OneEuroSettings, Rig
from rhot_app.tracking.estimate import disparity_law
from rhot_node.markers import FLAT_PATCHES, Marker

Array = NDArray[np.float64]

_ROUND = ("sphere", "capsule", "band")


@dataclass(frozen=True, slots=True)
class RigArrays:
    """C cameras, M markers. Read-only.

    `cameras` (C, 3, 4) camera_from_world m; `intrinsics` (C, 9) as `CameraModel`; `focal` (C, 2) px.
    `shapes` (M, 3, 3) m^2: the markers' bodies as far as known without the hand's pose, zero for flat ones. `tips`
    (5,): marker index of each finger's tip, -1 without one; `wrist`: the same for the wrist. `band_half_axes`
    (3,) m along the palm's x, y, z; None when the wrist wears no band. `law` (7,): how distance follows from
    disparity (`estimate.disparity_law`), empty when markers are triangulated. `reach` (M, M) m: the greatest
    distance of two markers of the hand, infinite where either is not on the hand.
    """

    camera_names: tuple[str, ...]
    marker_ids: tuple[str, ...]
    cameras: Array
    intrinsics: Array
    focal: Array
    shapes: Array
    tips: NDArray[np.int64]
    wrist: int
    band_half_axes: Array | None
    law: Array
    reach: Array


def rigs_of_hands(rig: Rig) -> list[tuple[Rig, NDArray[np.intp]]]:
    """The rig as if each of its one or two hands were alone, with the numbers of that hand's markers. The filters are
    not an estimator's."""
    if rig.other_hand is None:
        return [(rig, np.arange(len(rig.markers.markers)))]
    found = []
    for hand, wanted in ((rig.hand, False), (rig.other_hand, True)):
        columns = np.flatnonzero([(one.role or "").startswith(OTHER_HAND) == wanted for one in rig.markers.markers])
        alone = tuple(msgspec.structs.replace(one, role=(one.role or "").removeprefix(OTHER_HAND) or None)
                      for one in (rig.markers.markers[m] for m in columns))
        markers = msgspec.structs.replace(rig.markers, markers=alone)
        found.append((msgspec.structs.replace(rig, markers=markers, hand=hand, other_hand=None,
                                              filters=FilterSettings()), columns))
    return found


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
        focal=np.array([model.intrinsics[:2] for model in models]),
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
