"""What the cameras of a solved rig make of the board: its corners in space, and how far they are from its geometry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.stereo.bundle_model import BundleState
from rhot_app.geometry.camera import undistort_points
from rhot_app.geometry.triangulate import triangulate

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
    focal = np.ascontiguousarray(state.lenses[:, :2])
    rays = np.stack([undistort_points(np.ascontiguousarray(each), lens)
                     for each, lens in zip(pixels, state.lenses, strict=True)])
    spread = np.array([np.diag(1.0 / each**2) for each in focal])
    points, covariances = np.full((pixels.shape[1], 3), np.nan), np.full((pixels.shape[1], 3, 3), np.nan)
    every = np.ones(len(cameras), bool)
    for i in range(len(points)):
        triangulate(np.ascontiguousarray(rays[:, i]), spread, cameras, focal, every, points[i], covariances[i])
    return points, covariances


def measure_squares(used: Sequence[Sequence[BoardView | None]], board: Board, state: BundleState,
                    noise_px: float) -> Squares:
    """The board of every shot, `used` [shot][camera], located by the cameras alone and held against its geometry.

    `noise_px` of the corners per axis.
    """
    sides, spans, off, expected = [np.empty(0)], [(0.0, 0)], [np.empty(0)], [np.empty(0)]
    for those in used:
        pixels = np.full((len(those), board.count, 2), np.nan)
        for camera, view in enumerate(those):
            if view is not None:
                pixels[camera, view.ids] = view.pixels
        points, covariances = locate_with_covariance(pixels, state)
        grid = points.reshape(board.rows, board.cols, 3)
        lines = (*grid, *grid.transpose(1, 0, 2))
        sides += [np.linalg.norm(np.diff(line, axis=0), axis=1) for line in lines]
        spans += [_span(line) for line in lines]
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
    without shared views. In undistorted pixels: normalised coordinates times the focal length."""
    second_from_first = state.camera_from_world[second] @ np.linalg.inv(state.camera_from_world[first])
    x, y, z = second_from_first[:3, 3]
    essential = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ second_from_first[:3, :3]
    squares = []
    for those in used:
        a, b = those[first], those[second]
        if a is None or b is None:
            continue
        _, in_a, in_b = np.intersect1d(a.ids, b.ids, return_indices=True)
        left, right = (_homogeneous(view.pixels[those], state.lenses[camera])
                       for view, those, camera in ((a, in_a, first), (b, in_b, second)))
        algebraic = np.sum(right * (left @ essential.T), axis=1)
        for line, camera in ((left @ essential.T, second), (right @ essential, first)):
            distance = algebraic / np.linalg.norm(line[:, :2] / state.lenses[camera, :2], axis=1)
            squares.append(distance**2)
    return float(np.sqrt(np.nanmean(np.concatenate(squares)))) if squares else float("nan")


def _span(line: Array) -> tuple[float, int]:
    """Distance in m between the first and the last located corner of a line (N, 3), and how many squares that is."""
    located = np.flatnonzero(np.isfinite(line).all(axis=1))
    if len(located) < 2:
        return 0.0, 0
    return float(np.linalg.norm(line[located[-1]] - line[located[0]])), int(located[-1] - located[0])


def _homogeneous(pixels: Array, lens: Array) -> Array:
    rays = undistort_points(np.ascontiguousarray(pixels), lens)
    return np.column_stack([rays, np.ones(len(rays))])


def _off_plane(points: Array) -> tuple[Array, Array]:
    """Distances of `points` (N, 3) from their plane and its normal (3,); NaN for fewer than four located ones."""
    located = points[np.isfinite(points).all(axis=1)]
    if len(located) < 4:
        return np.full(len(points), np.nan), np.full(3, np.nan)
    middle = located.mean(axis=0)
    normal = np.linalg.svd(located - middle, full_matrices=False)[2][2]
    return np.asarray((points - middle) @ normal), normal
