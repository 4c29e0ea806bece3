"""The report of a stereo calibration: every figure that a page, a JSON object or a check needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import Board
from rhot_app.calibration.board_errors import BoardErrors
from rhot_app.calibration.bundle_model import BundleState
from rhot_app.calibration.lens_certainty import WORKING_DISTANCE_M
from rhot_app.calibration.lens_start import LensStart
from rhot_app.calibration.misfits import tilt_spread
from rhot_app.calibration.ruler import RulerResult
from rhot_app.calibration.stereo_adjust import StereoSolution, view_rms
from rhot_app.calibration.stereo_certainty import certainty, expected_error
from rhot_app.calibration.stereo_points import Squares, epipolar_px, measure_squares
from rhot_app.calibration.stereo_views import Dropped
from rhot_app.calibration.verdict import Verdict
from rhot_app.geometry.transforms import inverse, log_so3

Array = NDArray[np.float64]

MARKER_NOISE_PX = 0.1
"""Of a marker's position in a picture, per axis, for the part of the error that is not the calibration's."""


@dataclass(frozen=True, slots=True)
class CameraFigures:
    """One camera: `lens` (9,) and its standard deviations, `size` of its pictures, rms of its corners in px."""

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


@dataclass(frozen=True, slots=True)
class ShotFigures:
    """One shot: its name and the rms of its corners in px per camera, NaN where a camera was not used."""

    name: str
    rms_px: Array


@dataclass(frozen=True, slots=True)
class StereoFigures:
    """All figures of a solved rig. `distances_px` (M,) of all corners; `error_m` expected in space at
    `WORKING_DISTANCE_M`: by the calibration, and by `MARKER_NOISE_PX` in the pictures. `tilt_rad` the largest angle
    between two boards; `disagreement` of the shots, 1 where independent corner errors explain all: it is in all
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
    disagreement: float
    board_errors: BoardErrors | None = None
    ruler: RulerResult | None = None
    lengths: Literal["skipped", "baseline", "ruler"] = "skipped"

    @property
    def world_from_camera(self) -> Array:
        """(C, 4, 4) m; the world is the first camera."""
        return np.array([inverse(pose) for pose in self.state.camera_from_world])


@dataclass(frozen=True, slots=True)
class StereoReport:
    """What came of a stereo calibration.

    `figures` are None when the cameras could not be put together; `dropped` shots with reasons; `summary` the sentence
    with the main figures, for whoever adds findings of their own to the `verdict`.
    """

    cameras: tuple[str, ...]
    figures: StereoFigures | None
    dropped: tuple[Dropped, ...]
    summary: str
    verdict: Verdict


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
        sure.disagreement, solution.board_errors)


def _rms(distances: Array) -> float:
    return float(np.sqrt(np.mean(np.square(distances))))
