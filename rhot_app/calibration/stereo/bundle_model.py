"""What a bundle adjustment is about: cameras, boards, corners in pictures, and the projection with all its derivatives.

Everything is vectorised over the corners; poses turn by left-multiplied rotation vectors (R <- exp(d) R), so that no
parameter has a singularity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]

LENS = 9
"""Parameters of a camera's lens: fx, fy, cx, cy, k1, k2, p1, p2, k3."""
POSE = 6
"""Parameters of a pose's change: rotation vector (rad), translation (m)."""
POINT = 3
"""Parameters of a corner's place on the board, m."""


@dataclass(frozen=True, slots=True)
class Observations:
    """M corners seen.

    `camera` (M,) and `shot` (M,) say by which camera in which shot, `points` (M, 3) m where the corner is on the board,
    `pixels` (M, 2) raw px where it was seen; `corner` (M,) which corner of the board it is, needed only where the
    board's own errors are estimated.
    """

    camera: Index
    shot: Index
    points: Array
    pixels: Array
    corner: Index | None = None

    def __len__(self) -> int:
        return len(self.camera)

    def only(self, kept: NDArray[np.bool_]) -> Observations:
        """The observations for which `kept` (M,) is true."""
        return Observations(self.camera[kept], self.shot[kept], self.points[kept], self.pixels[kept],
                            None if self.corner is None else self.corner[kept])


@dataclass(frozen=True, slots=True)
class BundleState:
    """All that is estimated.

    `lenses` (C, 9) px and OpenCV's distortion, `camera_from_world` (C, 4, 4) and `world_from_board` (S, 4, 4), one per
    shot, m; `board_errors` (N, 3) m, how far each of the board's corners is from where it should be, None where the
    board is taken as drawn.
    """

    lenses: Array
    camera_from_world: Array
    world_from_board: Array
    board_errors: Array | None = None


@dataclass(frozen=True, slots=True)
class Linearised:
    """Residuals seen minus expected (M, 2) px, and the derivatives of what is expected: by the camera's pose (M, 2, 6),
    by the board's pose (M, 2, 6), by the lens (M, 2, 9) and by the corner's place on the board (M, 2, 3)."""

    residuals: Array
    by_camera: Array
    by_board: Array
    by_lens: Array
    by_point: Array


def residuals(state: BundleState, seen: Observations) -> Array:
    """Seen minus expected (M, 2) px; NaN for a corner at or behind its camera's plane."""
    return seen.pixels - _expected(_local(state, seen)[1], state.lenses[seen.camera])


def linearise(state: BundleState, seen: Observations) -> Linearised:
    """Residuals and derivatives at `state`."""
    turned, local = _local(state, seen)
    lens = state.lenses[seen.camera]
    depth = local[:, 2]
    x, y = local[:, 0] / depth, local[:, 1] / depth
    by_lens, by_ray = _lens_derivatives(x, y, lens)
    by_local = np.empty((len(seen), 2, 3))
    by_local[:, :, :2] = by_ray / depth[:, None, None]
    by_local[:, :, 2] = -(by_ray[:, :, 0] * (x / depth)[:, None] + by_ray[:, :, 1] * (y / depth)[:, None])
    camera = state.camera_from_world[seen.camera]
    world_rotated = local - camera[:, :3, 3]
    by_world = by_local @ camera[:, :3, :3]
    return Linearised(
        residuals=seen.pixels - _expected(local, lens),
        by_camera=np.concatenate([-_times_skew(by_local, world_rotated), by_local], axis=2),
        by_board=np.concatenate([-_times_skew(by_world, turned), by_world], axis=2),
        by_lens=by_lens,
        by_point=by_world @ state.world_from_board[seen.shot][:, :3, :3])


def _local(state: BundleState, seen: Observations) -> tuple[Array, Array]:
    """The corners turned into the world's axes about their board's origin, and in their camera's frame; (M, 3) each."""
    board, points = state.world_from_board[seen.shot], seen.points
    if state.board_errors is not None:
        points = points + state.board_errors[seen.corner]
    turned = np.einsum("mij,mj->mi", board[:, :3, :3], points)
    camera = state.camera_from_world[seen.camera]
    return turned, np.einsum("mij,mj->mi", camera[:, :3, :3], turned + board[:, :3, 3]) + camera[:, :3, 3]


def _expected(local: Array, lens: Array) -> Array:
    depth = np.where(local[:, 2] > 0.0, local[:, 2], np.nan)
    x, y = local[:, 0] / depth, local[:, 1] / depth
    xd, yd = _distorted(x, y, lens)
    return np.stack([lens[:, 0] * xd + lens[:, 2], lens[:, 1] * yd + lens[:, 3]], axis=1)


def _distorted(x: Array, y: Array, lens: Array) -> tuple[Array, Array]:
    k1, k2, p1, p2, k3 = lens[:, 4:].T
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y)


def _lens_derivatives(x: Array, y: Array, lens: Array) -> tuple[Array, Array]:
    """Derivatives of the pixel by the lens (M, 2, 9) and by the normalised coordinates (M, 2, 2)."""
    fx, fy = lens[:, 0], lens[:, 1]
    k1, k2, p1, p2, k3 = lens[:, 4:].T
    xd, yd = _distorted(x, y, lens)
    r2 = x * x + y * y
    by_lens = np.zeros((len(x), 2, LENS))
    by_lens[:, 0, 0], by_lens[:, 1, 1] = xd, yd
    by_lens[:, 0, 2] = by_lens[:, 1, 3] = 1.0
    for column, power in ((4, r2), (5, r2 * r2), (8, r2 * r2 * r2)):
        by_lens[:, 0, column], by_lens[:, 1, column] = fx * x * power, fy * y * power
    by_lens[:, 0, 6], by_lens[:, 1, 6] = fx * 2.0 * x * y, fy * (r2 + 2.0 * y * y)
    by_lens[:, 0, 7], by_lens[:, 1, 7] = fx * (r2 + 2.0 * x * x), fy * 2.0 * x * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))  # d radial / dx = slope * x
    cross = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    by_ray = np.empty((len(x), 2, 2))
    by_ray[:, 0, 0] = fx * (radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x)
    by_ray[:, 0, 1], by_ray[:, 1, 0] = fx * cross, fy * cross
    by_ray[:, 1, 1] = fy * (radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x)
    return by_lens, by_ray


def _times_skew(rows: Array, vectors: Array) -> Array:
    """rows (M, 2, 3) times the cross-product matrix of each vector (M, 3): row x vector, by the triple product."""
    return np.cross(rows, vectors[:, None, :])
