"""A rig compiled to what the filter and its marker residuals need."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RigError
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.limits import NaturalPose
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.places import KNUCKLE_ROLES, Place, place_of, with_markers
from rhot_app.hand.skeleton import ANGLE_SLICES, FLEXIONS, TIP_ROLES, WRIST_ROLE
from rhot_app.hand.variants import VariantName, limit_set, make_variant
from rhot_app.project import Rig
from rhot_app.tracking.kalman.estimate import ANGLES, POSE
from rhot_app.tracking.kalman.forgetting import WIDEST
from rhot_app.tracking.kalman.habits import Habits
from rhot_app.tracking.kalman.markers import ONE_SIDED, Cameras, Outfit, Worn, outfit_of
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.rig_arrays import band_axes
from rhot_node.markers import FLAT_PATCHES, Marker, MarkerSet

Array = NDArray[np.float64]

PLACE_SD_M = {"capsule": 0.12e-3, "sphere": 0.3e-3, "disc": 0.5e-3, "band": 0.4e-3, "blob": 3e-3}
"""How far a marker's seen middle lies from where the hand file has it, by its shape, as the filter takes it: paint, its
shading, and the skin under it. A blob is paint on a knuckle that nobody measured."""

PAINT_SD_M = {"capsule": 0.03e-3, "band": 0.3e-3}
"""The same without its shading, as it is told (`known.py`), of shapes that were measured."""

LASTING_BAND, LASTING_OTHERS = 0.8, 0.2
"""Of the standard deviation that nodes state, so much is an error of one camera that lasts, as it is told: nearly all
of what a band's outline is off, and of a fingertip's, of which little shows, enough to make half a millimetre of
distance for as long as the hand rests (`python benchmarks/sight_errors.py`)."""

FINGERS_TOGETHER, THUMB_WITH_FINGERS = 0.8, 0.5
"""Correlation of how fingers begin to bend: most of what hands do in daily life is one movement of all of them
(Santello et al. 1998, Todorov and Ghahramani 2004)."""

ALIKE_SD_RAD = np.radians(20.0)
"""How much more one finger bends in a joint than its neighbour; one out of sight is looked for beside the others."""

_COUPLED_SD_RAD = np.radians(0.02)


@dataclass(frozen=True, slots=True)
class Wearing:
    """`natural`: what is believed of any hand's angles, `habits`: of one that is not seen; `roles` (M,) of the markers,
    `places` (M,) where they ride, `bias_variance` (M,) m^2 of their places, `paint_variance` (M,) m^2 of them as it is
    told, infinite where nobody knows, `lasting` (M,) the parts of stated standard deviations that last. `outfit` is
    `shared` with compiled functions."""

    model: HandModel
    worn: Worn
    cameras: Cameras
    natural: NaturalPose
    habits: Habits
    limits: Array  # (21, 2) rad
    roles: tuple[str, ...]
    places: tuple[Place, ...]
    bias_variance: Array
    paint_variance: Array
    lasting: Array
    outfit: Outfit = field(init=False)
    shared: Share = field(init=False)

    def __post_init__(self) -> None:
        outfit = outfit_of(self.worn, self.cameras, self.bias_variance)
        object.__setattr__(self, "outfit", outfit)
        object.__setattr__(self, "shared", Share(outfit))

    def marker_of(self, role: str) -> int:
        """The index of the marker with a role, -1 without."""
        return self.roles.index(role) if role in self.roles else -1


def compile_wearing(rig: Rig) -> Wearing:
    """The arrays of a validated rig. Raises RigError when a marker has no place on the hand, or another one's."""
    worn_by: dict[str | None, str] = {}
    for marker in rig.markers.markers:
        if marker.role is not None and marker.role in worn_by:
            raise RigError(f"markers {worn_by[marker.role]!r} and {marker.id!r} both have the role {marker.role!r}; "
                           "give each a place of its own.")
        worn_by[marker.role] = marker.id
    model = with_markers(build_model(rig.hand), rig.markers)
    natural = natural_of(model, rig.tracker.variant)
    places = tuple(place_of(marker, model) for marker in rig.markers.markers)
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    worn = Worn(points_on(model.dh, places), np.array([place.finger for place in places], dtype=np.int64),
                half_axes_of(rig.markers, model),
                np.array([marker.role in KNUCKLE_ROLES and marker.shape == "blob" for marker in rig.markers.markers]),
                np.array([_slenderness(marker, model) for marker in rig.markers.markers]))
    return Wearing(
        model, worn,
        Cameras(np.array([camera.camera_from_world[:3] for camera in models]),
                np.array([camera.intrinsics for camera in models])),
        natural, habits_of(model, natural), limit_set(model, rig.tracker.limits),
        tuple(marker.role or "" for marker in rig.markers.markers), places,
        np.array([PLACE_SD_M[marker.shape] ** 2 for marker in rig.markers.markers]),
        np.array([PAINT_SD_M.get(marker.shape, math.inf) ** 2 for marker in rig.markers.markers]),
        np.array([LASTING_BAND if marker.shape == "band" else LASTING_OTHERS for marker in rig.markers.markers]))


def points_on(dh: DhArrays, places: tuple[Place, ...]) -> DhArrays:
    """The same table with the places as its points."""
    return dh._replace(point_row=np.array([place.row for place in places], dtype=np.int64),
                       point_offset=np.array([place.point for place in places]).reshape(-1, 3))


def half_axes_of(markers: MarkerSet, model: HandModel) -> Array:
    """(M, 3) m: half axes of the markers' bodies along the palm's axes."""
    return np.array([_half_axes(marker, model) for marker in markers.markers])


def _half_axes(marker: Marker, model: HandModel) -> Array:
    if marker.shape == "band" and marker.role == WRIST_ROLE:
        return band_axes(marker, model.anatomy)
    flat = marker.shape not in ("sphere", "capsule", "band") or marker.patch in FLAT_PATCHES
    radius = 1e-3 * marker.radius_mm if marker.radius_mm and not flat else 0.0
    return np.full(3, radius)


def _slenderness(marker: Marker, model: HandModel) -> float:
    """As `Worn.slender`. The area of a capsule with ends of radius r, l apart, is pi r^2 + 2 r l sin(angle of view)."""
    if marker.patch in FLAT_PATCHES or marker.gap_deg > 0.0:
        return ONE_SIDED
    if marker.role not in TIP_ROLES or marker.shape not in ("capsule", "sphere") or marker.patch != "segment":
        return -1.0
    if marker.shape == "sphere":
        return 0.0
    finger = TIP_ROLES.index(marker.role)
    radius = float(model.radii[finger, 2])
    apart = 2.0 * max(float(model.bones[finger, 2] - model.marker[finger]) - radius, 0.0)
    return 2.0 * apart / (math.pi * radius)


def natural_of(model: HandModel, variant: VariantName) -> NaturalPose:
    """The natural pose with the variant's couplings, these as good as exactly."""
    chosen = make_variant(variant, model.anatomy.couplings)
    basis = chosen.basis
    bound = (np.eye(len(basis)) - basis @ np.linalg.pinv(basis)) / _COUPLED_SD_RAD
    bound = bound[np.abs(bound).max(axis=1) > 1e-9]
    return model.natural.and_also(bound, bound @ chosen.mean)


def habits_of(model: HandModel, natural: NaturalPose) -> Habits:
    """What is believed of the angles of a hand that is not seen: `natural`, and neighbours that bend alike."""
    alike = _neighbours()
    mean, information, rows, values = natural.and_also(alike, np.zeros(len(alike)))
    usual = np.diag([WIDEST**2] * POSE)
    usual[ANGLES:, ANGLES:] = np.linalg.inv(information)
    return Habits(rows, values, mean, information, usual, _together(model), _stiff(model))


def _neighbours() -> Array:
    """(6, 21) MCP and PIP joints of neighbouring fingers bend alike, in standard deviations."""
    rows = []
    for one, other in pairwise(FLEXIONS[1:]):
        for joint in range(2):
            rows.append(np.zeros(ANGLE_SLICES[-1].stop))
            rows[-1][one[joint]], rows[-1][other[joint]] = 1.0 / ALIKE_SD_RAD, -1.0 / ALIKE_SD_RAD
    return np.array(rows)


def _together(model: HandModel) -> Array:
    """(27, 27) as in `Habits`: within a finger as the natural pose says, fingers by what they bend most in common, the
    palm's axes each on its own."""
    natural = np.linalg.inv(model.natural.information)
    together = np.eye(POSE)
    bends = np.zeros((len(ANGLE_SLICES), POSE))
    for finger, columns in enumerate(ANGLE_SLICES):
        block = natural[columns, columns]
        block = block / block.diagonal().max()
        rows = slice(ANGLES + columns.start, ANGLES + columns.stop)
        together[rows, rows] = block
        values, vectors = np.linalg.eigh(block)
        bends[finger, rows] = vectors[:, -1] * np.sqrt(values[-1]) * np.sign(vectors[:, -1].sum())
    for one in range(len(bends)):
        for other in range(len(bends)):
            if one != other:
                share = THUMB_WITH_FINGERS if 0 in (one, other) else FINGERS_TOGETHER
                together += share * np.outer(bends[one], bends[other])
    return together


def _stiff(model: HandModel) -> Array:
    """(R, 27) as in `Habits`."""
    natural = np.sqrt(np.linalg.inv(model.natural.information).diagonal())
    rows = []
    for columns, flexions in zip(ANGLE_SLICES, FLEXIONS, strict=True):
        free = np.zeros((2, POSE))
        free[0, ANGLES + columns.start] = 1.0
        for angle in flexions:
            free[1, ANGLES + angle] = natural[angle]
        part = slice(ANGLES + columns.start, ANGLES + columns.stop)
        held = np.linalg.svd(free[:, part])[2][2:]
        for row in held:
            rows.append(np.zeros(POSE))
            rows[-1][part] = row
    return np.array(rows)
