"""Where the board may be, seen by one camera alone: a plane has two poses that look nearly alike, and both are kept.

Two cameras together, or the other shots, tell which of them is right (Schweighofer and Pinz 2006; Collins and Bartoli
2014, IPPE).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.geometry.camera import undistort_points
from rhot_app.geometry.transforms import apply, exp_so3, rigid

Array = NDArray[np.float64]

_MOST_DEGRADED = 4.0  # a second pose whose error is this many times the first one's is no candidate


@dataclass(frozen=True, slots=True)
class PosedView:
    """One board view with the poses that explain it.

    `view` with the corners that the lens can see; `points` (N, 3) m on the board and `rays` (N, 2) their undistorted
    normalised coordinates; `focal_px` turns normalised distances into pixels. `camera_from_board` (K, 4, 4) m, best
    first, with `rms_px` (K,). `half_turn` (4, 4) takes the board to itself, counted from its other end; None where the
    colours tell the ends apart.
    """

    view: BoardView
    points: Array
    rays: Array
    focal_px: float
    camera_from_board: Array
    rms_px: Array
    half_turn: Array | None = None

    def off(self, camera_from_board: Array) -> float:
        """Rms distance in px between the corners seen and the board at this pose, counted from the end that fits."""
        if self.half_turn is None:
            return self._off(camera_from_board)
        return min(self._off(camera_from_board), self._off(camera_from_board @ self.half_turn))

    def turned(self, camera_from_board: Array) -> bool:
        """Whether at this pose the corners were counted from the board's other end."""
        return self.half_turn is not None and (
            self._off(camera_from_board @ self.half_turn) < self._off(camera_from_board))

    @property
    def every_pose(self) -> Array:
        """(K', 4, 4) m, the poses counted from either end."""
        if self.half_turn is None:
            return self.camera_from_board
        return np.concatenate([self.camera_from_board, self.camera_from_board @ self.half_turn])

    def _off(self, camera_from_board: Array) -> float:
        local = apply(camera_from_board, self.points)
        if not np.all(local[:, 2] > 0.0):
            return float("inf")
        off = local[:, :2] / local[:, 2:] - self.rays
        return float(self.focal_px * np.sqrt(np.mean(np.sum(off**2, axis=1))))


def pose_view(view: BoardView, board: Board, lens: Array) -> PosedView | None:
    """All poses of the board that explain a view; None when the lens cannot see where the corners are.

    `lens` (9,): fx, fy, cx, cy, k1, k2, p1, p2, k3.
    """
    rays = undistort_points(np.ascontiguousarray(view.pixels), lens)
    seen = np.isfinite(rays).all(axis=1)
    if np.count_nonzero(seen) < 4:
        return None
    view, rays = replace(view, pixels=view.pixels[seen], ids=view.ids[seen]), np.ascontiguousarray(rays[seen])
    points = view.object_points(board)
    focal = float(np.sqrt(lens[0] * lens[1]))
    poses, errors = _planar_poses(points, rays)
    if not len(poses):
        return None
    return PosedView(view, points, rays, focal, poses, focal * errors, None if board.one_way_up else _half_turn(board))


def _planar_poses(points: Array, rays: Array) -> tuple[Array, Array]:
    """Up to two poses (K, 4, 4) of a plane and their rms error (K,) in normalised units, best first."""
    identity = np.eye(3)
    count, turns, shifts, _ = cv2.solvePnPGeneric(points, rays, identity, None, flags=cv2.SOLVEPNP_IPPE)
    poses, errors = [], []
    for turn, shift in zip(turns[:count], shifts[:count], strict=True):
        turn, shift = cv2.solvePnPRefineLM(points, rays, identity, None, turn.copy(), shift.copy())
        pose = rigid(exp_so3(turn.ravel()), shift.ravel())
        local = apply(pose, points)
        if np.all(local[:, 2] > 0.0):
            poses.append(pose)
            errors.append(float(np.sqrt(np.mean(np.sum((local[:, :2] / local[:, 2:] - rays) ** 2, axis=1)))))
    order = [i for i in np.argsort(errors) if errors[i] <= _MOST_DEGRADED * min(errors) + 1e-12]
    return np.array([poses[i] for i in order]).reshape(-1, 4, 4), np.array([errors[i] for i in order])


def _half_turn(board: Board) -> Array:
    """board_from_board (4, 4): corner (row, col) to the one as far from the other end."""
    span = board.object_points()[-1]
    return rigid(np.diag([-1.0, -1.0, 1.0]), span)
