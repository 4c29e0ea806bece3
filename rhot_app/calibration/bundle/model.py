"""What a bundle adjustment is about: cameras, boards, corners in pictures, and the projection with all its derivatives.

Everything is vectorised over the corners; poses turn by left-multiplied rotation vectors (R <- exp(d) R), so that no
parameter has a singularity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import LENS, linearise_lenses, own_parameters

Array = NDArray[np.float64]
Index = NDArray[np.intp]

TWIST = 6
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

    `lenses` (C, 12) px and OpenCV's distortion, `camera_from_world` (C, 4, 4) and `world_from_board` (S, 4, 4), one per
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
    by the board's pose (M, 2, 6), by the lens (M, 2, 12) and by the corner's place on the board (M, 2, 3)."""

    residuals: Array
    by_camera: Array
    by_board: Array
    by_lens: Array
    by_point: Array


def residuals(state: BundleState, seen: Observations) -> Array:
    """Seen minus expected (M, 2) px; NaN for a corner at or behind its camera's plane."""
    local = _local(state, seen)[1]
    ahead = np.where(local[:, 2] > 0.0, local[:, 2], np.nan)
    return np.asarray(seen.pixels - linearise_lenses(local[:, :2] / ahead[:, None], state.lenses[seen.camera])[0])


def linearise(state: BundleState, seen: Observations) -> Linearised:
    """Residuals and derivatives at `state`."""
    turned, local = _local(state, seen)
    depth = np.where(local[:, 2] > 0.0, local[:, 2], np.nan)
    rays = local[:, :2] / depth[:, None]
    pixels, by_ray, by_lens = linearise_lenses(rays, state.lenses[seen.camera])
    by_local = np.empty((len(seen), 2, 3))
    by_local[:, :, :2] = by_ray / depth[:, None, None]
    by_local[:, :, 2] = -np.einsum("mij,mj->mi", by_local[:, :, :2], rays)
    camera = state.camera_from_world[seen.camera]
    world_rotated = local - camera[:, :3, 3]
    by_world = by_local @ camera[:, :3, :3]
    return Linearised(
        residuals=seen.pixels - pixels,
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


def _times_skew(rows: Array, vectors: Array) -> Array:
    """rows (M, 2, 3) times the cross-product matrix of each vector (M, 3): row x vector, by the triple product."""
    return np.cross(rows, vectors[:, None, :])


# -- parameter vector and sparse Jacobian ------------------------------------------------------------------------------
# Order: the free lens parameters camera by camera, the poses of all cameras but the first, the poses of all boards, and
# the board's own errors corner by corner where they are estimated. The first camera stays where it is: it is the gauge.

@dataclass(frozen=True, slots=True)
class LensFreedom:
    """How one camera's lens may change: by `basis` (12, K) times K unknowns; K = 0 keeps it.

    `prior_mean` and `prior_std` (12,): what is known beforehand; an infinite std says nothing.
    """

    basis: Array
    prior_mean: Array
    prior_std: Array

    @classmethod
    def fixed(cls) -> LensFreedom:
        """A lens that is known."""
        return cls(np.zeros((LENS, 0)), np.zeros(LENS), np.full(LENS, np.inf))

    @classmethod
    def free(cls, mean: Array, std: Array | None = None, *, only: NDArray[np.bool_] | None = None,
             square_pixels: bool = False) -> LensFreedom:
        """Everything that a lens of the kind of `mean` has, or `only` (12,) these parameters; with `square_pixels` fx
        and fy change as one."""
        basis = np.eye(LENS)[:, own_parameters(mean) if only is None else only]
        if square_pixels:
            basis = np.column_stack([basis[:, 0] + basis[:, 1], basis[:, 2:]])
        return cls(basis, mean, np.full(LENS, np.inf) if std is None else std)


@dataclass(frozen=True, slots=True)
class BoardFreedom:
    """How far the board's `count` corners may be from where they were drawn: standard deviations (3,) m along its x, y
    and z. Boards are printed, glued and bent to some tenth of a millimetre, far more than a corner is seen to."""

    count: int
    std_m: Array


class Layout:
    """Where each unknown stands; turns derivatives into the sparse Jacobian, and a step into the next state."""

    def __init__(self, lenses: Sequence[LensFreedom], shots: int, seen: Observations,
                 errors: BoardFreedom | None = None) -> None:
        self.lenses = tuple(lenses)
        self.board_errors = errors
        widths = [lens.basis.shape[1] for lens in lenses]
        self.lens_at = np.concatenate([[0], np.cumsum(widths)]).astype(np.intp)
        self.camera_at = int(self.lens_at[-1])
        self.board_at = self.camera_at + TWIST * (len(lenses) - 1)
        self.errors_at = self.board_at + TWIST * shots
        self.size = self.errors_at + (POINT * errors.count if errors is not None else 0)
        self._seen = seen

    def lens(self, camera: int) -> slice:
        """Where the free lens parameters of a camera stand."""
        return slice(int(self.lens_at[camera]), int(self.lens_at[camera + 1]))

    def camera(self, camera: int) -> slice:
        """Where the pose of a camera stands; empty for the first."""
        start = self.camera_at + TWIST * (camera - 1)
        return slice(start, start + TWIST) if camera else slice(self.camera_at, self.camera_at)

    def board(self, shot: int) -> slice:
        """Where the pose of the board in a shot stands."""
        start = self.board_at + TWIST * shot
        return slice(start, start + TWIST)

    @property
    def errors(self) -> slice:
        """Where the board's own errors stand, x, y, z of each corner in turn; empty when they are not estimated."""
        return slice(self.errors_at, self.size)

    def jacobian(self, line: Linearised) -> Any:
        """Derivatives of what is expected, (2M, size), as a sparse matrix; rows x, y of each corner in turn."""
        seen = self._seen
        blocks = []
        for camera, lens in enumerate(self.lenses):
            mine = np.flatnonzero(seen.camera == camera)
            blocks.append(_entries(mine, np.full(len(mine), self.lens(camera).start), line.by_lens[mine] @ lens.basis))
        moving = np.flatnonzero(seen.camera > 0)
        blocks.append(_entries(moving, self.camera_at + TWIST * (seen.camera[moving] - 1), line.by_camera[moving]))
        blocks.append(_entries(np.arange(len(seen)), self.board_at + TWIST * seen.shot, line.by_board))
        if self.board_errors is not None:
            assert seen.corner is not None
            blocks.append(_entries(np.arange(len(seen)), self.errors_at + POINT * seen.corner, line.by_point))
        rows, columns, values = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        return sparse.csr_matrix((values, (rows, columns)), shape=(2 * len(seen), self.size))

    def prior(self, state: BundleState) -> tuple[Any, Array]:
        """What is known beforehand, in standard deviations: its sparse Jacobian (P, size), and how far the prior's mean
        is from `state` (P,); zero where nothing is known."""
        blocks = [lens.basis / lens.prior_std[:, None] for lens in self.lenses]
        off = [np.where(np.isfinite(lens.prior_std), lens.prior_mean - now, 0.0) / lens.prior_std
               for lens, now in zip(self.lenses, state.lenses, strict=True)]
        rows = sparse.csr_matrix(sparse.block_diag(blocks))
        rows.resize(LENS * len(blocks), self.size)
        if self.board_errors is not None:
            assert state.board_errors is not None
            certainty = 1.0 / np.tile(self.board_errors.std_m, self.board_errors.count)
            count = len(certainty)
            place = (np.arange(count), np.arange(self.errors_at, self.size))
            rows = sparse.vstack([rows, sparse.csr_matrix((certainty, place), shape=(count, self.size))]).tocsr()
            off.append(-state.board_errors.ravel() * certainty)
        return rows, np.concatenate(off)

    def moved(self, state: BundleState, step: Array) -> BundleState:
        """`state` changed by `step` (size,)."""
        lenses = state.lenses.copy()
        for camera, lens in enumerate(self.lenses):
            lenses[camera] += lens.basis @ step[self.lens(camera)]
        cameras, boards = state.camera_from_world.copy(), state.world_from_board.copy()
        for camera in range(1, len(cameras)):
            _move(cameras[camera], step[self.camera(camera)])
        for shot in range(len(boards)):
            _move(boards[shot], step[self.board(shot)])
        errors = state.board_errors
        if self.board_errors is not None and errors is not None:
            errors = errors + step[self.errors].reshape(-1, POINT)
        return BundleState(lenses, cameras, boards, errors)


def _move(pose: Array, step: Array) -> None:
    pose[:3, :3] = exp_so3(step[:3]) @ pose[:3, :3]
    pose[:3, 3] += step[3:]


def _entries(corners: Index, start: Index, block: Array) -> tuple[Index, Index, Array]:
    """Rows, columns and values of a block (m, 2, K) of `corners` (m,) whose first columns are `start` (m,)."""
    row = 2 * corners[:, None, None] + np.arange(2)[None, :, None]
    column = start[:, None, None] + np.arange(block.shape[2])
    return np.broadcast_to(row, block.shape).ravel(), np.broadcast_to(column, block.shape).ravel(), block.ravel()
