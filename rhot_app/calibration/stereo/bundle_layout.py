"""The unknowns of a bundle adjustment in one vector: which are free, where each stands, the sparse Jacobian.

Order: the free lens parameters camera by camera, the poses of all cameras but the first, the poses of all boards, and
the board's own errors corner by corner where they are estimated. The first camera stays where it is: it is the gauge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sparse

from rhot_app.calibration.stereo.bundle_model import (
    LENS,
    POINT,
    POSE,
    Array,
    BundleState,
    Index,
    Linearised,
    Observations,
)
from rhot_app.geometry.transforms import exp_so3


@dataclass(frozen=True, slots=True)
class LensFreedom:
    """How one camera's lens may change: by `basis` (9, K) times K unknowns; K = 0 keeps it.

    `prior_mean` and `prior_std` (9,): what is known beforehand; an infinite std says nothing.
    """

    basis: Array
    prior_mean: Array
    prior_std: Array

    @classmethod
    def fixed(cls) -> LensFreedom:
        """A lens that is known."""
        return cls(np.zeros((LENS, 0)), np.zeros(LENS), np.full(LENS, np.inf))

    @classmethod
    def free(cls, parameters: Sequence[bool], mean: Array, std: Array | None = None, *,
             square_pixels: bool = False) -> LensFreedom:
        """`parameters` (9,) says which are free; with `square_pixels` fx and fy change as one."""
        basis = np.eye(LENS)[:, list(parameters)]
        if square_pixels and parameters[0] and parameters[1]:
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
        self.board_at = self.camera_at + POSE * (len(lenses) - 1)
        self.errors_at = self.board_at + POSE * shots
        self.size = self.errors_at + (POINT * errors.count if errors is not None else 0)
        self._seen = seen

    def lens(self, camera: int) -> slice:
        """Where the free lens parameters of a camera stand."""
        return slice(int(self.lens_at[camera]), int(self.lens_at[camera + 1]))

    def camera(self, camera: int) -> slice:
        """Where the pose of a camera stands; empty for the first."""
        start = self.camera_at + POSE * (camera - 1)
        return slice(start, start + POSE) if camera else slice(self.camera_at, self.camera_at)

    def board(self, shot: int) -> slice:
        """Where the pose of the board in a shot stands."""
        start = self.board_at + POSE * shot
        return slice(start, start + POSE)

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
        blocks.append(_entries(moving, self.camera_at + POSE * (seen.camera[moving] - 1), line.by_camera[moving]))
        blocks.append(_entries(np.arange(len(seen)), self.board_at + POSE * seen.shot, line.by_board))
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
