"""Where the board may be, seen by one camera alone: a plane has two poses that look nearly alike, and both are kept.

Two cameras together, or the other shots, tell which of them is right (Schweighofer and Pinz 2006; Collins and Bartoli
2014, IPPE).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.bundle.adjustment import Bundle, adjust
from rhot_app.calibration.bundle.model import POINT, BoardFreedom, LensFreedom, Observations
from rhot_app.estimation.quantiles import f_tail
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import lens_rays
from rhot_app.geometry.transforms import apply, rigid
from rhot_app.progress import Progress, silent

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
    """All poses of the board that explain a view; None when the lens (12,) cannot see where the corners are."""
    rays = lens_rays(view.pixels, lens)
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


# -- the board's own shape ---------------------------------------------------------------------------------------------
# Printed, glued or bent boards are off by about 0.1 mm. Their errors are estimated with the lens.
# On the real images of the tests the corners of one hand-glued board are off by 0.09 mm; taken as drawn it leaves
# 0.16 px of rms and pulls the focal length by more than its stated error, with its own shape 0.06 px are left, and
# both cameras find the same shape to 0.02 mm (Strobl and Hirzinger 2011, "More accurate pinhole camera calibration
# with imperfect planar target"). How large the errors are is itself taken from the pictures, so that few views of a
# good board do not bend it: the variances follow from the evidence (MacKay 1992, "Bayesian interpolation").

FEWEST_VIEWS = 5
MOST_CORNERS = 400
"""Of a board: its errors are three unknowns a corner, and the solve grows with their cube."""

_CHANCE = 1e-3  # of taking a perfect board for an imperfect one
_FIRST_GUESS = 0.005  # of a square's side: SD of the errors along x, y and z before the pictures say
_LEAST = 1e-5  # of a square's side
_ROUNDS = 6
_SETTLED = 0.1
_EXACT_PX = 2e-3  # computed corners, not seen ones


@dataclass(frozen=True, slots=True)
class BoardErrors:
    """What the pictures say about the board: `places` (N, 3) m, how far each corner is from where it was drawn, and the
    standard deviations in and across the board's plane, m."""

    places: Array
    in_plane_m: float
    across_m: float

    @property
    def freedom(self) -> BoardFreedom:
        """The same board's freedom in another adjustment."""
        return BoardFreedom(len(self.places), np.array([self.in_plane_m, self.in_plane_m, self.across_m]))


def find_board_errors(plain: Bundle, seen: Observations, lenses: Sequence[LensFreedom], count: int, side_m: float, *,
                      progress: Progress = silent) -> tuple[Bundle, BoardErrors | None]:
    """Adjust again with the board's `count` corners free to be off; `plain` is the adjustment without.

    `side_m` of a square. Returns `plain` and None when a perfect board explains the pictures as well, or there are too
    few to tell.
    """
    if len(plain.state.world_from_board) < FEWEST_VIEWS or count > MOST_CORNERS or plain.noise_px < _EXACT_PX:
        return plain, None
    spread = np.full(POINT, _FIRST_GUESS * side_m)
    state = plain.state
    for number in range(_ROUNDS):
        bundle = adjust(state, seen, lenses, board_errors=BoardFreedom(count, spread), progress=progress)
        if not number and not _better(plain, bundle, len(seen)):
            return plain, None
        state = bundle.state
        before, spread = spread, np.maximum(_evidence(bundle, spread), _LEAST * side_m)
        if np.all(np.abs(spread - before) < _SETTLED * before):
            break
    assert state.board_errors is not None
    return bundle, BoardErrors(state.board_errors, float(before[0]), float(before[2]))


def _better(plain: Bundle, bent: Bundle, corners: int) -> bool:
    """F-test: whether the residuals shrink by more than as many free numbers shrink them by chance."""
    more = bent.determined - plain.determined
    left = 2 * corners - bent.determined
    if more <= 1 or left <= 1:
        return False
    before = plain.noise_px**2 * (2 * corners - plain.determined)
    after = bent.noise_px**2 * left
    ratio = (before - after) / more / max(after / left, 1e-300)
    return bool(f_tail(ratio, more, left) < _CHANCE)


def _evidence(bundle: Bundle, spread: Array) -> Array:
    """The standard deviations (3,) that make the pictures most likely: x and y alike, z apart."""
    assert bundle.state.board_errors is not None
    certainty = np.diag(bundle.covariance)[bundle.layout.errors].reshape(-1, POINT)
    determined = np.maximum(1.0 - certainty / spread**2, 0.0).sum(axis=0)  # numbers the pictures determine, per axis
    squares = np.square(bundle.state.board_errors).sum(axis=0)
    in_plane = np.sqrt((squares[0] + squares[1]) / max(determined[0] + determined[1], 1e-9))
    across = np.sqrt(squares[2] / max(determined[2], 1e-9))
    return np.array([in_plane, in_plane, across])
