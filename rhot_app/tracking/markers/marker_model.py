"""The markers of a rig as the estimator measures them: where they ride on the hand, and what cameras see of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import calibration_error
from rhot_app.errors import RigError
from rhot_app.geometry.camera import NEAREST_M, CameraModel, camera_coordinates, project_ray_with_slope
from rhot_app.geometry.turns import HELD_SD_RAD, TURN_S
from rhot_app.hand.anatomy import is_shipped
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.landmarks import ANATOMY_SD_M, LASTING_S
from rhot_app.hand.limits import PosePrior
from rhot_app.hand.model import HandModel, VariantName, build_model, limit_set, make_variant, with_locked
from rhot_app.hand.motion.hand_process import BIAS_S, FASTEST, PALM_SPREAD, SLOWEST, HandProcess
from rhot_app.hand.places import Place, place_of, with_markers
from rhot_app.hand.skeleton import TIP_ROLES, WRIST_ROLE
from rhot_app.project import Rig
from rhot_app.tracking.rig_arrays import band_axes
from rhot_node.markers import FLAT_PATCHES, Marker

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

PAINT_SD_M = {"capsule": 0.12e-3, "sphere": 0.3e-3, "disc": 0.5e-3, "band": 0.4e-3, "blob": 3e-3,
              "landmark": ANATOMY_SD_M}
"""m: standard deviation of a marker's centre about the place that the hand file gives it, by its shape: paint, its
shading and the skin under it (`python benchmarks/marker_errors.py`). A blob is paint that nobody measured. For a
landmark see `hand.landmarks`."""

LASTING_PX = 0.01
"""px: standard deviation of the error of one camera's centroids that lasts (`python benchmarks/marker_errors.py`)."""

TURN_SD_RAD = 1e-3
"""rad: by how much a camera may be turned against the reference, beside what its rig says, if the rig does not say how
well it was calibrated, and after a knock: half a pixel of a lens of 530 px. If cameras are believed exactly, a hand at
rest follows now the one, now the other, and shakes (`python benchmarks/trackers.py --only turned`)."""

DRIFT_SD_RAD = 7e-4
"""rad: how far a camera turns on its mount within TURN_S, and so since it was calibrated. A bracket of PLA (7e-5 1/K,
data sheet) whose sides differ by 10 K turns so far."""

_COUPLED_SD_RAD = math.radians(0.02)  # as good as exact


USUAL_SIZE_SD = 0.1
"""How far hands are from the size in their file, before anything is seen: standard deviation of the logarithm."""

LEAST_SIZE_SD = 0.015
"""No size is known better: bones of hands of one length scatter by 3 to 8 %, so hands differ in proportion, and the one
size is a mean over fifteen bones."""


class MarkerArrays(NamedTuple):
    """What compiled functions take of a `MarkerModel`."""

    dh: DhArrays
    half_axes: Array
    slender: Array
    paint_variance: Array
    landmark: NDArray[np.bool_]
    poses: Array
    intrinsics: Array
    reference: int
    turn_sd: Array


@dataclass(frozen=True, slots=True)
class MarkerModel:
    """M markers on a hand before C cameras. Read-only.

    `dh`: the hand's table with one point per marker. `finger` (M,): the finger, -1 on the palm. `half_axes` (M, 3) m of
    their bodies along the palm's axes, zero for flat ones. `slender` (M,): visible area of a fingertip from its side
    over that from its end, less 1; negative where the size says nothing of the distance. `paint_variance` (M,) m^2.
    `landmark` (M,) bool: landmarks, which err as `hand.landmarks` says.
    `size_sd`: of the logarithm of the hand's size before anything of it is seen.
    `poses` (C, 3, 4) camera_from_world, m; `intrinsics` (C, 13) as `CameraModel`. `reference`: the first camera that is
    tracked with, against which the others may be turned; `turn_sd` (C,) rad: by how much. `limits` (21, 2) rad.
    """

    model: HandModel
    dh: DhArrays
    finger: Indices
    half_axes: Array
    slender: Array
    paint_variance: Array
    landmark: NDArray[np.bool_]
    poses: Array
    intrinsics: Array
    pose_prior: PosePrior
    limits: Array
    roles: tuple[str, ...]
    places: tuple[Place, ...]
    size_sd: float
    reference: int
    turn_sd: Array

    @property
    def arrays(self) -> MarkerArrays:
        """What compiled functions take of it."""
        return MarkerArrays(self.dh, self.half_axes, self.slender, self.paint_variance, self.landmark, self.poses,
                            self.intrinsics, self.reference, self.turn_sd)

    def scaled(self, factor: float) -> MarkerModel:
        """The markers on a hand `factor` times as large."""
        return replace(self, dh=scaled_table(self.dh, factor))

    def process(self) -> HandProcess:
        """How the hand moves, with the rates of recorded hands; paint biases are 0 until `set_lasting`."""
        covariance = np.asarray(np.linalg.inv(self.pose_prior.information), dtype=np.float64)
        return HandProcess(self.dh, self.limits, self.pose_prior.mean, covariance, PALM_SPREAD, SLOWEST, FASTEST,
                           np.zeros((len(self.lasting_s), 3, 3)), self.lasting_s)

    @property
    def lasting_s(self) -> Array:
        """(M + C - 1,) s: correlation times of the errors that last, of the markers and of the cameras' turns."""
        return np.concatenate([np.where(self.landmark, LASTING_S, BIAS_S), np.full(len(self.poses) - 1, TURN_S)])

    def marker_of(self, role: str) -> int:
        """The index of the marker with a role, -1 without."""
        return self.roles.index(role) if role in self.roles else -1


def compile_markers(rig: Rig) -> MarkerModel:
    """The arrays of a validated rig. Raises RigError when a marker has no place on the hand, or another one's."""
    worn_by: dict[str | None, str] = {}
    for marker in rig.markers.markers:
        if marker.role is not None and marker.role in worn_by:
            raise RigError(f"markers {worn_by[marker.role]!r} and {marker.id!r} both have the role {marker.role!r}; "
                           "give each a place of its own.")
        worn_by[marker.role] = marker.id
    model = with_markers(with_locked(build_model(rig.hand), rig.tracker.locked_deg), rig.markers)
    places = tuple(place_of(marker, model) for marker in rig.markers.markers)
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    reference = rig.tracked_with.index(True)
    return MarkerModel(
        model, points_on(model.dh, places), np.array([place.finger for place in places], dtype=np.int64),
        np.array([_half_axes(marker, model) for marker in rig.markers.markers]),
        np.array([_slenderness(marker, model) for marker in rig.markers.markers]),
        np.array([PAINT_SD_M[marker.shape] ** 2 for marker in rig.markers.markers]),
        np.array([marker.shape == "landmark" for marker in rig.markers.markers]),
        np.array([camera.camera_from_world[:3] for camera in cameras]),
        np.array([camera.intrinsics for camera in cameras]),
        pose_prior_of(model, rig.tracker.variant), limit_set(model, rig.tracker.limits),
        tuple(marker.role or "" for marker in rig.markers.markers), places,
        USUAL_SIZE_SD if is_shipped(rig.hand) else LEAST_SIZE_SD, reference, turn_sds(rig, reference))


def turn_sds(rig: Rig, reference: int) -> Array:
    """(C,) rad: standard deviations of the cameras' turns against that of `reference`, beside what the rig says. Those
    of a calibrated rig are of the calibration and of what may have happened since, to a simulated one nothing."""
    error, exact = calibration_error(rig), rig.calibration is not None and rig.calibration.method == "exact"
    if not error.known or rig.depth.mode == "disparity":
        return np.full(len(rig.nodes), TURN_SD_RAD)
    centres = np.array([node.pose.translation_m for node in rig.nodes])
    drift = 0.0 if exact else DRIFT_SD_RAD
    return np.maximum(np.hypot(error.turn(np.linalg.norm(centres - centres[reference], axis=1)), drift), HELD_SD_RAD)


def scaled_table(dh: DhArrays, factor: float) -> DhArrays:
    """The table with all lengths times `factor`."""
    return dh._replace(a=factor * dh.a, d=factor * dh.d, point_offset=factor * dh.point_offset)


def points_on(dh: DhArrays, places: tuple[Place, ...]) -> DhArrays:
    """The same table with the places as its points."""
    return dh._replace(point_row=np.array([place.row for place in places], dtype=np.int64),
                       point_offset=np.array([place.point for place in places]).reshape(-1, 3))


def _half_axes(marker: Marker, model: HandModel) -> Array:
    if marker.shape == "band" and marker.role == WRIST_ROLE:
        return band_axes(marker, model.anatomy)
    flat = marker.shape not in ("sphere", "capsule", "band") or marker.patch in FLAT_PATCHES
    return np.full(3, 1e-3 * marker.radius_mm if marker.radius_mm and not flat else 0.0)


def _slenderness(marker: Marker, model: HandModel) -> float:
    """The area of a capsule with ends of radius r, l apart, is pi r^2 + 2 r l sin(angle of view)."""
    if (marker.role not in TIP_ROLES or marker.shape not in ("capsule", "sphere") or marker.patch != "segment"
            or marker.gap_deg > 0.0):
        return -1.0
    if marker.shape == "sphere":
        return 0.0
    finger = TIP_ROLES.index(marker.role)
    radius = float(model.radii[finger, 2])
    apart = 2.0 * max(float(model.bones[finger, 2] - model.marker[finger]) - radius, 0.0)
    return 2.0 * apart / (math.pi * radius)


def pose_prior_of(model: HandModel, variant: VariantName) -> PosePrior:
    """The pose prior with the variant's couplings, these as good as exactly."""
    chosen = make_variant(variant, model.anatomy.couplings)
    basis = chosen.basis
    bound = (np.eye(len(basis)) - basis @ np.linalg.pinv(basis)) / _COUPLED_SD_RAD
    bound = bound[np.abs(bound).max(axis=1) > 1e-9]
    return model.pose_prior.with_terms(bound, bound @ chosen.mean)


@njit(cache=True)
def project_marker(point, world, half_axes, camera, intrinsics, pixel, slope):
    """Where the silhouette of a marker at `point` (3,) has its centre: `pixel` (2,) px and `slope` (2, 3) px/m.

    `world` (3, 4): the palm's pose, along whose axes the body lies. False when the camera cannot see it.
    `geometry.camera` has the formula; its slope is that of a point.
    """
    x, y, z = camera_coordinates(camera, point[0], point[1], point[2])
    if not z > NEAREST_M:
        return False
    xz, yz, zz = 0.0, 0.0, 0.0
    if half_axes[0] > 0.0:
        for axis in range(3):
            a, b, c = 0.0, 0.0, 0.0
            for k in range(3):
                a += camera[0, k] * world[k, axis]
                b += camera[1, k] * world[k, axis]
                c += camera[2, k] * world[k, axis]
            variance = half_axes[axis] * half_axes[axis]
            xz += variance * a * c
            yz += variance * b * c
            zz += variance * c * c
    square = z * z - zz
    return project_ray_with_slope((x * z - xz) / square, (y * z - yz) / square, z, camera, intrinsics, pixel, slope)
