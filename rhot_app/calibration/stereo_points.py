"""What the cameras of a solved rig make of the board: its corners in space, and how far they are from its geometry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import Board
from rhot_app.calibration.bundle_model import BundleState
from rhot_app.calibration.corners import BoardView
from rhot_app.geometry.camera import undistort_points
from rhot_app.geometry.triangulate import triangulate

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Squares:
    """Sides of the triangulated squares: their `mean_m` and standard deviation `std_m` over `count` sides; `flatness_m`
    the rms distance of the corners from the plane of their board."""

    mean_m: float
    std_m: float
    count: int
    flatness_m: float


def locate(pixels: Array, state: BundleState) -> Array:
    """Points (N, 3) m in the world from raw px (C, N, 2), NaN where a camera does not see one; NaN if not located."""
    cameras = np.ascontiguousarray(state.camera_from_world[:, :3, :])
    focal = np.ascontiguousarray(state.lenses[:, :2])
    rays = np.stack([undistort_points(np.ascontiguousarray(each), lens)
                     for each, lens in zip(pixels, state.lenses, strict=True)])
    spread = np.array([np.diag(1.0 / each**2) for each in focal])
    points, covariance = np.full((pixels.shape[1], 3), np.nan), np.empty((3, 3))
    every = np.ones(len(cameras), bool)
    for i in range(len(points)):
        triangulate(np.ascontiguousarray(rays[:, i]), spread, cameras, focal, every, points[i], covariance)
    return points


def board_grids(used: Sequence[Sequence[BoardView | None]], board: Board, state: BundleState) -> Array:
    """(S, rows, cols, 3) m, the corners of the board of every shot in the world, located by the cameras alone."""
    grids = []
    for those in used:
        pixels = np.full((len(those), board.count, 2), np.nan)
        for camera, view in enumerate(those):
            if view is not None:
                pixels[camera, view.ids] = view.pixels
        grids.append(locate(pixels, state).reshape(board.rows, board.cols, 3))
    return np.array(grids)


def measure_squares(grids: Array) -> Squares:
    """Sides and flatness of located boards (S, rows, cols, 3) m."""
    across = np.linalg.norm(np.diff(grids, axis=2), axis=3).ravel()
    down = np.linalg.norm(np.diff(grids, axis=1), axis=3).ravel()
    sides = np.concatenate([across, down])
    sides = sides[np.isfinite(sides)]
    off = np.concatenate([_off_plane(grid.reshape(-1, 3)) for grid in grids])
    if not len(sides):
        return Squares(float("nan"), float("nan"), 0, float("nan"))
    return Squares(float(np.mean(sides)), float(np.std(sides)), len(sides), float(np.sqrt(np.mean(off**2))))


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


def _homogeneous(pixels: Array, lens: Array) -> Array:
    rays = undistort_points(np.ascontiguousarray(pixels), lens)
    return np.column_stack([rays, np.ones(len(rays))])


def _off_plane(points: Array) -> Array:
    """Distances of the finite ones of `points` (N, 3) from their plane; none for fewer than four."""
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 4:
        return np.empty(0)
    centred = points - points.mean(axis=0)
    return np.asarray(centred @ np.linalg.svd(centred, full_matrices=False)[2][2])
