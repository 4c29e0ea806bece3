"""The board's corners as a solved rig triangulates them, their errors, and the test of given lenses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import pose_view
from rhot_app.calibration.bundle.adjustment import adjust
from rhot_app.calibration.bundle.model import BundleState
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.stereo.adjust import StereoSolution
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.geometry.camera import intrinsics_row, undistort_with_slope
from rhot_app.geometry.triangulate import Rays, triangulate

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Squares:
    """Sides of the triangulated squares.

    `mean_m` from whole rows and columns of corners, because noise lengthens every single side; `std_m` the standard
    deviation of `count` single sides; `flatness_m` the rms distance of the corners from the plane of their board, of
    which the noise of the corners in the pictures explains `flatness_by_noise_m`.
    """

    mean_m: float
    std_m: float
    count: int
    flatness_m: float
    flatness_by_noise_m: float


def locate(pixels: Array, state: BundleState) -> Array:
    """Points (N, 3) m in the world from raw px (C, N, 2), NaN where a camera does not see one; NaN if not located."""
    return locate_with_covariance(pixels, state)[0]


def locate_with_covariance(pixels: Array, state: BundleState) -> tuple[Array, Array]:
    """`locate`, and the points' covariances (N, 3, 3) m^2 for noise of 1 px per axis in every camera."""
    cameras = np.ascontiguousarray(state.camera_from_world[:, :3, :])
    rays, by_pixel = (np.stack(each, axis=1) for each in zip(
        *(undistort_with_slope(np.ascontiguousarray(each), intrinsics_row(lens))
          for each, lens in zip(pixels, state.lenses, strict=True)), strict=True))
    spread = by_pixel @ by_pixel.transpose(0, 1, 3, 2)
    points, covariances = np.full((pixels.shape[1], 3), np.nan), np.full((pixels.shape[1], 3, 3), np.nan)
    every = np.ones(len(cameras), bool)
    for i in range(len(points)):
        triangulate(Rays(rays[i], spread[i], by_pixel[i]), cameras, every, points[i], covariances[i])
    return points, covariances


def measure_squares(used: Sequence[Sequence[BoardView | None]], board: Board, state: BundleState,
                    noise_px: float) -> Squares:
    """The board of every shot, `used` [shot][camera], located by the cameras alone and held against its geometry.

    `noise_px` of the corners per axis.
    """
    sides, spans, off, expected = [np.empty(0)], [(0.0, 0.0)], [np.empty(0)], [np.empty(0)]
    drawn = board.object_points().reshape(board.rows, board.cols, 3) / board.square_m
    drawn_lines = (*drawn, *drawn.transpose(1, 0, 2))
    for those in used:
        pixels = np.full((len(those), board.count, 2), np.nan)
        for camera, view in enumerate(those):
            if view is not None:
                pixels[camera, view.ids] = view.pixels
        points, covariances = locate_with_covariance(pixels, state)
        grid = points.reshape(board.rows, board.cols, 3)
        lines = (*grid, *grid.transpose(1, 0, 2))
        for line, of in zip(lines, drawn_lines, strict=True):
            sides.append(np.linalg.norm(np.diff(line, axis=0), axis=1) / np.linalg.norm(np.diff(of, axis=0), axis=1))
            spans.append(_span(line, of))
        distances, normal = _off_plane(points)
        off.append(distances)
        expected.append(noise_px**2 * np.einsum("i,nij,j->n", normal, covariances, normal))
    length, squares = np.sum(spans, axis=0)
    every = np.concatenate(sides)
    every = every[np.isfinite(every)]
    return Squares(float(length / squares) if squares else float("nan"), float(np.std(every)), len(every),
                   float(np.sqrt(np.nanmean(np.square(np.concatenate(off))))),
                   float(np.sqrt(np.nanmean(np.concatenate(expected)))))


def epipolar_px(used: Sequence[Sequence[BoardView | None]], state: BundleState, first: int, second: int) -> float:
    """Rms distance in px between a corner and the epipolar line of its partner in the other camera, both ways; NaN
    without shared views."""
    second_from_first = state.camera_from_world[second] @ np.linalg.inv(state.camera_from_world[first])
    x, y, z = second_from_first[:3, 3]
    essential = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ second_from_first[:3, :3]
    squares = []
    for those in used:
        a, b = those[first], those[second]
        if a is None or b is None:
            continue
        _, in_a, in_b = np.intersect1d(a.ids, b.ids, return_indices=True)
        (left, by_left), (right, by_right) = (_homogeneous(view.pixels[those], state.lenses[camera])
                                              for view, those, camera in ((a, in_a, first), (b, in_b, second)))
        algebraic = np.sum(right * (left @ essential.T), axis=1)
        for line, by_pixel in ((left @ essential.T, by_right), (right @ essential, by_left)):
            slope = np.einsum("ni,nij->nj", line[:, :2], by_pixel)
            squares.append((algebraic / np.linalg.norm(slope, axis=1)) ** 2)
    return float(np.sqrt(np.nanmean(np.concatenate(squares)))) if squares else float("nan")


def _span(line: Array, drawn: Array) -> tuple[float, float]:
    """Distance in m between the first and the last located corner of a line (N, 3), and how many squares that is on the
    board, by its corners `drawn` (N, 3) in squares."""
    located = np.flatnonzero(np.isfinite(line).all(axis=1))
    if len(located) < 2:
        return 0.0, 0.0
    first, last = located[0], located[-1]
    return float(np.linalg.norm(line[last] - line[first])), float(np.linalg.norm(drawn[last] - drawn[first]))


def _homogeneous(pixels: Array, lens: Array) -> tuple[Array, Array]:
    rays, by_pixel = undistort_with_slope(np.ascontiguousarray(pixels), intrinsics_row(lens))
    return np.column_stack([rays, np.ones(len(rays))]), by_pixel


def _off_plane(points: Array) -> tuple[Array, Array]:
    """Distances of `points` (N, 3) from their plane and its normal (3,); NaN for fewer than four located ones."""
    located = points[np.isfinite(points).all(axis=1)]
    if len(located) < 4:
        return np.full(len(points), np.nan), np.full(3, np.nan)
    middle = located.mean(axis=0)
    normal = np.linalg.svd(located - middle, full_matrices=False)[2][2]
    return np.asarray((points - middle) @ normal), normal


# -- test of given lenses ----------------------------------------------------------------------------------------------
# A lens is not symmetric, so it tells mirrored and swapped pictures.
# The principal point stands tens of pixels off the middle. Corners of mirrored pictures fit the mirrored lens better
# than the given one, and pictures of the other camera fit the other camera's lens better.

_CLEARLY = 1.15  # another lens leaves this many times less error
_MOSTLY = 0.7  # of the views
_SUSPECT_PX = 0.15  # below this a given lens is good enough whatever a free one would do
_BETTER = 0.7  # a free lens leaves less than this share of the given one's error


@dataclass(frozen=True, slots=True)
class LensEvidence:
    """What the given lenses say about the pictures: of which cameras they look `mirrored`, and whether the first two
    cameras' pictures fit each other's lens (`swapped`)."""

    mirrored: tuple[bool, ...]
    swapped: bool

    @property
    def all_mirrored(self) -> bool:
        """Whether every camera's pictures look mirrored."""
        return bool(self.mirrored) and all(self.mirrored)


def lens_evidence(solution: StereoSolution, lenses: Sequence[LensStart | None]) -> LensEvidence:
    """Try the mirrored and the other camera's lens on every view.

    `lenses` that were calibrated apart from these views, None where there is none: that camera says nothing.
    """
    views = [[those[camera] for those in solution.views if those[camera] is not None]
             for camera in range(len(lenses))]
    mirrored = tuple(lens is not None and _fits_better(seen, solution.board, lens, lens.mirrored()) for seen, lens
                     in zip(views, lenses, strict=True))
    known = [lens for lens in lenses if lens is not None]
    pair = len(lenses) == len(known) == 2 and known[0].size == known[1].size
    swapped = pair and all(_fits_better(views[i], solution.board, known[i], known[1 - i]) for i in (0, 1))
    return LensEvidence(mirrored, swapped)


def mismatch_finding(solution: StereoSolution, lenses: Sequence[LensStart]) -> Finding | None:
    """Whether lenses estimated afresh from these pictures fit far better than the given ones, and whose those are."""
    fixed = [lens for lens, freedom in zip(lenses, solution.bundle.layout.lenses, strict=True)
             if freedom.basis.shape[1] == 0]
    rms = _rms(solution.bundle.residuals)
    if not fixed or rms < _SUSPECT_PX:
        return None
    free = [LensStart(lens.lens, lens.size, None, "views").freedom(refine=True) for lens in lenses]
    fresh = adjust(solution.bundle.state, solution.seen, free)
    better = _rms(fresh.residuals)
    if better > _BETTER * rms:
        return None
    return _of_another_camera(solution, lenses, fresh.state.lenses) or Finding(
        "lens", Grade.POOR if rms > 1.0 else Grade.FAIR,
        f"With the given intrinsics the corners are {rms:.2f} px off, with fresh ones {better:.2f} px.",
        "The intrinsics are of another camera, another focus or zoom, another picture size or mode.",
        "Calibrate the intrinsics of this camera again, or leave them out and let these pictures find them.")


def _of_another_camera(solution: StereoSolution, lenses: Sequence[LensStart], fresh: Array) -> Finding | None:
    """Whether a kept lens fits another camera's pictures as that one's own does; `fresh` (C, 12) fit each camera's."""
    views = [[those[camera] for those in solution.views] for camera in range(len(lenses))]
    own = [_rms(_errors(seen, solution.board, lens)[:, None]) for seen, lens in zip(views, fresh, strict=True)]
    for camera, freedom in enumerate(solution.bundle.layout.lenses):
        if freedom.basis.shape[1]:
            continue
        here, *there = (_rms(_errors(views[i], solution.board, lenses[camera].lens)[:, None]) / own[i]
                        for i in (camera, *(other for other in range(len(lenses)) if other != camera)))
        others = [name for name in solution.cameras if name != solution.cameras[camera]]
        if here > _CLEARLY and min(there) < _CLEARLY:
            name, other = solution.cameras[camera], others[int(np.argmin(there))]
            return Finding(
                "lenses_swapped", Grade.POOR,
                f"The intrinsics given for {name} fit the pictures of {other}; in those of {name} they leave "
                f"{here:.1f} times the error of its own lens.",
                f"The file is that of {other}, or the pictures of {name} are.",
                f"Give the file of {name}, or none: these pictures show the intrinsics, too.")
    return None


def _fits_better(views: Sequence[BoardView | None], board: Board, lens: LensStart, other: LensStart) -> bool:
    if np.allclose(lens.lens, other.lens):
        return False
    own, others = (_errors(views, board, each.lens) for each in (lens, other))
    return bool(_rms(own[:, None]) > _CLEARLY * _rms(others[:, None]) and np.mean(others < own) >= _MOSTLY)


def _errors(views: Sequence[BoardView | None], board: Board, lens: Array) -> Array:
    """(V,) px, error of the best pose of the board in every view."""
    posed = [pose_view(view, board, lens) for view in views if view is not None]
    return np.array([np.inf if each is None else each.rms_px[0] for each in posed])


def _rms(off: Array) -> float:
    """Rms distance of residuals (M, K)."""
    return float(np.sqrt(np.mean(np.sum(np.square(off), axis=1))))
