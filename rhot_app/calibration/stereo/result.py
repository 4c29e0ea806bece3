"""The result of a stereo calibration: every figure that a page, a JSON object or a check needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.poses import BoardErrors
from rhot_app.calibration.board.shared_views import Dropped
from rhot_app.calibration.bundle.adjustment import Bundle
from rhot_app.calibration.bundle.model import (
    TWIST,
    BundleState,
    Layout,
    LensFreedom,
    Observations,
    linearise,
    residuals,
)
from rhot_app.calibration.bundle.robust_error import error_inflation, tilt_spread
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.lens.intrinsics_checks import WORKING_DISTANCE_M
from rhot_app.calibration.stereo.adjust import StereoSolution, view_rms
from rhot_app.calibration.stereo.points import Squares, epipolar_px, locate, measure_squares
from rhot_app.calibration.stereo.ruler import RulerResult
from rhot_app.calibration.stereo.start import WorldFrame
from rhot_app.calibration.verdict import Verdict
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.camera import LENS
from rhot_app.geometry.transforms import inverse

Array = NDArray[np.float64]

MARKER_NOISE_PX = 0.1
"""Of a marker's position in a picture, per axis, for the part of the error that is not the calibration's."""


@dataclass(frozen=True, slots=True)
class CameraFigures:
    """One camera: `lens` (12,) and its standard deviations, `size` of its pictures, rms of its corners in px."""

    name: str
    size: tuple[int, int]
    lens: Array
    lens_std: Array
    rms_px: float


@dataclass(frozen=True, slots=True)
class PairFigures:
    """A camera seen from the first one.

    `second_from_first` (4, 4) takes points of the first camera's frame to the second's, as R and T of OpenCV's
    stereoCalibrate: a second camera 75 mm to the right has T = (-75, 0, 0) mm. `rotation_rad` (3,) is its rotation
    vector and `translation_m` (3,) its T, each with standard deviations. `epipolar_px` is NaN without shared shots.
    """

    first: str
    second: str
    second_from_first: Array
    rotation_rad: Array
    rotation_std_rad: Array
    translation_m: Array
    translation_std_m: Array
    epipolar_px: float
    shared: int

    @property
    def baseline_m(self) -> float:
        """Distance between the two cameras' centres."""
        return float(np.linalg.norm(self.translation_m))

    @property
    def baseline_std_m(self) -> float:
        """Its standard deviation, by those of the parts of T."""
        return float(np.linalg.norm(self.translation_m * self.translation_std_m) / self.baseline_m)


@dataclass(frozen=True, slots=True)
class ShotFigures:
    """One shot: its name and the rms of its corners in px per camera, NaN where a camera was not used."""

    name: str
    rms_px: Array


@dataclass(frozen=True, slots=True)
class StereoFigures:
    """All figures of a solved rig. `rms_px` of all corners; `error_m` expected in space at
    `WORKING_DISTANCE_M`: by the calibration, and by `MARKER_NOISE_PX` in the pictures. `tilt_rad` the largest angle
    between two boards; `error_inflation` of the shots, 1 where independent corner errors explain all: it is in all
    standard deviations; `board_errors` how far the board is from its drawing, None when the pictures show nothing;
    `lengths` which second known length was held against the board's squares."""

    state: BundleState
    board: Board
    cameras: tuple[CameraFigures, ...]
    pairs: tuple[PairFigures, ...]
    shots: tuple[ShotFigures, ...]
    rms_px: float
    noise_px: float
    squares: Squares
    error_m: tuple[float, float]
    tilt_rad: float
    error_inflation: float
    board_errors: BoardErrors | None = None
    ruler: RulerResult | None = None
    lengths: Literal["skipped", "baseline", "ruler"] = "skipped"

    @property
    def world_from_camera(self) -> Array:
        """(C, 4, 4) m; the world is the first camera."""
        return np.array([inverse(pose) for pose in self.state.camera_from_world])


@dataclass(frozen=True, slots=True)
class StereoResult:
    """What came of a stereo calibration.

    `figures` are None when the cameras could not be put together; `dropped` shots with reasons; `summary` the sentence
    with the main figures, for whoever adds findings of their own to the `verdict`; `table` the frame of the table
    that the board lies on, where it was seen there.
    """

    cameras: tuple[str, ...]
    figures: StereoFigures | None
    dropped: tuple[Dropped, ...]
    summary: str
    verdict: Verdict
    table: WorldFrame | None = None


def figures_of(solution: StereoSolution, lenses: Sequence[LensStart], names: Sequence[str]) -> StereoFigures:
    """The figures of a solution; `names` of all shots."""
    bundle, state = solution.bundle, solution.bundle.state
    sure = certainty(bundle, solution.seen, lenses)
    distances = np.linalg.norm(bundle.residuals, axis=1)
    cameras = tuple(
        CameraFigures(name, lens.size, state.lenses[i], sure.lens_std(i), _rms(distances[solution.seen.camera == i]))
        for i, (name, lens) in enumerate(zip(solution.cameras, lenses, strict=True)))
    pairs = []
    for i in range(1, len(solution.cameras)):
        pose, covariance = state.camera_from_world[i], sure.pose_covariance(i)
        pairs.append(PairFigures(
            solution.cameras[0], solution.cameras[i], pose, log_so3(pose[:3, :3]),
            sure.rotation_vector_std(i, pose[:3, :3]), pose[:3, 3], np.sqrt(np.diag(covariance)[3:]),
            epipolar_px(solution.views, state, 0, i),
            sum(those[0] is not None and those[i] is not None for those in solution.views)))
    shots = tuple(ShotFigures(names[shot], rms)
                  for shot, rms in zip(solution.shots, view_rms(solution), strict=True))
    return StereoFigures(
        state, solution.board, cameras, tuple(pairs), shots, _rms(distances), bundle.noise_px,
        measure_squares(solution.views, solution.board, state, bundle.noise_px),
        expected_error(state, sure, WORKING_DISTANCE_M, MARKER_NOISE_PX), tilt_spread(state.world_from_board),
        sure.error_inflation, solution.board_errors)


def _rms(distances: Array) -> float:
    return float(np.sqrt(np.mean(np.square(distances))))


# -- how certain a solved rig is ---------------------------------------------------------------------------------------

_STEP = 1e-2  # standard deviations: small enough to be linear, large enough for differences
_TURN = 1e-6  # rad


@dataclass(frozen=True, slots=True)
class Certainty:
    """Covariance over all cameras: `factor` (C * 18, K), whose product with its transpose is the covariance of each
    camera's lens (12) and pose (6: rotation and translation of camera_from_world), camera by camera. In it is how much
    the shots disagree, `error_inflation` times what independent corner errors explain."""

    factor: Array
    error_inflation: float

    def lens_std(self, camera: int) -> Array:
        """(12,) standard deviations of a lens."""
        return np.asarray(np.linalg.norm(self._rows(camera)[:LENS], axis=1))

    def pose_covariance(self, camera: int) -> Array:
        """(6, 6) of camera_from_world: rotation turned from the left, rad, and translation, m."""
        rows = self._rows(camera)[LENS:]
        return np.asarray(rows @ rows.T)

    def rotation_vector_std(self, camera: int, rotation: Array) -> Array:
        """(3,) rad, standard deviations of the rotation vector of `rotation` (3, 3), the camera's."""
        base = log_so3(rotation)
        slope = np.column_stack([(log_so3(exp_so3(_TURN * axis) @ rotation) - base) / _TURN for axis in np.eye(3)])
        return np.asarray(np.sqrt(np.diag(slope @ self.pose_covariance(camera)[:3, :3] @ slope.T)))

    def _rows(self, camera: int) -> Array:
        start = camera * (LENS + TWIST)
        return self.factor[start:start + LENS + TWIST]


def certainty(bundle: Bundle, seen: Observations, lenses: Sequence[LensStart]) -> Certainty:
    """The certainty of a bundle whose lenses began as `lenses`.

    The unknowns follow the errors of kept lenses as the normal equations say: consider analysis (Bierman 1977).
    """
    layout = bundle.layout
    count = layout.board_at
    values, vectors = np.linalg.eigh(bundle.covariance[:count, :count])
    given = _given_errors(bundle, lenses)
    shared = _in_pictures(bundle, seen, given)
    apart = error_inflation(bundle, seen, shared)
    own = vectors * np.sqrt(np.maximum(values, 0.0)) * apart
    considered = -bundle.covariance @ (bundle.layout.jacobian(linearise(bundle.state, seen)).T @ shared
                                       / max(bundle.noise_px, 1e-12) ** 2)
    columns = np.hstack([own, considered[:count]])
    rows = []
    for camera, freedom in enumerate(layout.lenses):
        of_given = np.hstack([np.zeros((LENS, own.shape[1])), given[camera * LENS:(camera + 1) * LENS]])
        rows.append(freedom.basis @ columns[layout.lens(camera)] + of_given)
        rows.append(columns[layout.camera(camera)] if camera else np.zeros((TWIST, columns.shape[1])))
    return Certainty(np.vstack(rows), apart)


def _given_errors(bundle: Bundle, lenses: Sequence[LensStart]) -> Array:
    """(12C, K), one column of one standard deviation for each parameter of a lens that was kept, where it is known."""
    std = np.zeros(LENS * len(lenses))
    for camera, lens in enumerate(lenses):
        if bundle.layout.lenses[camera].basis.shape[1] == 0 and lens.std is not None:
            std[camera * LENS:(camera + 1) * LENS] = lens.std
    return np.diag(std)[:, std > 0.0]


def _in_pictures(bundle: Bundle, seen: Observations, given: Array) -> Array:
    """(2M, K) px, how far such errors of kept lenses move the corners."""
    if not given.shape[1]:
        return np.zeros((2 * len(seen), 0))
    every = Layout([LensFreedom.free(lens, only=np.ones(LENS, bool)) for lens in bundle.state.lenses],
                   len(bundle.state.world_from_board), seen)
    return np.asarray(every.jacobian(linearise(bundle.state, seen))[:, :every.camera_at] @ given)


def expected_error(state: BundleState, sure: Certainty, distance_m: float, noise_px: float) -> tuple[float, float]:
    """Rms error in m of points about `distance_m` in front of the cameras: (by the calibration, by `noise_px` of a
    marker's position in each picture).

    The points stand on a 3 x 3 grid across the middle of the first camera's picture, and count where two cameras see
    them; NaN when they see none. Every parameter is moved by what it is uncertain, and the same pixels triangulated.
    """
    points = _in_front(state, distance_m)
    pixels = _pixels(points, state)
    base = locate(pixels, state)
    good = np.isfinite(base).all(axis=1)
    if not np.any(good):
        return float("nan"), float("nan")
    by_rig = np.zeros(np.count_nonzero(good))
    for column in sure.factor.T:
        moved = locate(pixels, _moved(state, column * _STEP))
        by_rig += np.sum(np.square((moved - base)[good] / _STEP), axis=1)
    by_noise = np.zeros_like(by_rig)
    for camera in range(len(pixels)):
        for axis in range(2):
            shifted = pixels.copy()
            shifted[camera, :, axis] += 0.01
            by_noise += np.sum(np.square((locate(shifted, state) - base)[good] * noise_px / 0.01), axis=1)
    return float(np.sqrt(np.mean(by_rig))), float(np.sqrt(np.mean(by_noise)))


def _in_front(state: BundleState, distance: float) -> Array:
    """(9, 3) m world points about the rig's middle line, at `distance` from the middle of the cameras."""
    world_from_camera = np.linalg.inv(state.camera_from_world)
    axes = world_from_camera[:, :3, 2].sum(axis=0)
    forward = axes / np.linalg.norm(axes)
    middle = world_from_camera[:, :3, 3].mean(axis=0) + distance * forward
    right = np.cross(world_from_camera[0, :3, 1], forward)
    across = 0.15 * distance * right / np.linalg.norm(right)
    down = np.cross(forward, across)
    return np.array([middle + i * across + j * down for i in (-1, 0, 1) for j in (-1, 0, 1)])


def _pixels(points: Array, state: BundleState) -> Array:
    """(C, N, 2) px of world points, NaN behind a camera or outside the picture that its principal point suggests."""
    count, cameras = len(points), len(state.lenses)
    seen = Observations(np.repeat(np.arange(cameras), count), np.zeros(cameras * count, np.intp),
                        np.tile(points, (cameras, 1)), np.zeros((cameras * count, 2)))
    still = BundleState(state.lenses, state.camera_from_world, np.eye(4)[None])
    pixels = -residuals(still, seen).reshape(cameras, count, 2)
    outside = (pixels < 0.0) | (pixels > 2.0 * state.lenses[:, None, 2:4])
    pixels[outside.any(axis=2)] = np.nan
    return pixels


def _moved(state: BundleState, change: Array) -> BundleState:
    """`state` with each camera's lens and pose changed by `change` (C * 18,)."""
    parts = change.reshape(len(state.lenses), LENS + TWIST)
    poses = state.camera_from_world.copy()
    for pose, part in zip(poses, parts, strict=True):
        pose[:3, :3] = exp_so3(part[LENS:LENS + 3]) @ pose[:3, :3]
        pose[:3, 3] += part[LENS + 3:]
    return BundleState(state.lenses + parts[:, :LENS], poses, state.world_from_board)
