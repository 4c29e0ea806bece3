"""Two cameras whose lenses are exactly equidistant, r = f theta, before a board: corners and pictures."""

from __future__ import annotations

import numpy as np
from board_rendering import Photo, take
from intrinsics_twin import BOARD, SIZE, seen
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView, detect
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import rigid

Array = NDArray[np.float64]

CENTRE = np.array([319.5, 239.5])
RIGHT_FROM_LEFT = rigid(np.eye(3), [-0.075, 0.0, 0.0])
_RIM_PX = 6.0  # of the picture, where no corner is
_MOST_RAD = np.radians(88.0)  # from the axis


def focal_px(across_deg: float, width: int = SIZE[0]) -> float:
    """Focal length of a lens that sees this angle across."""
    return width / float(np.radians(across_deg))


def project(points: Array, focal: float) -> Array:
    """(N, 2) px of points (N, 3) m in the camera's frame."""
    radius = np.linalg.norm(points[:, :2], axis=1)
    angle = np.arctan2(radius, points[:, 2])
    return points[:, :2] * (focal * angle / np.maximum(radius, 1e-12))[:, None] + CENTRE


def wide_views(rng: np.random.Generator, focal: float, *, count: int = 15, noise_px: float = 0.05, board: Board = BOARD,
               pictures: bool = False) -> SharedViews:
    """`count` shots all over the left camera's picture; a board that leaves a picture is not in it. Corners with noise
    or, of `pictures`, as they are found."""
    shots: list[BoardShot] = []
    while len(shots) < count:
        left_from_board = _held(rng, focal, board)
        views = tuple(_view(rng, pose, focal, noise_px, board, pictures)
                      for pose in (left_from_board, RIGHT_FROM_LEFT @ left_from_board))
        if views[0] is not None:
            shots.append(BoardShot(f"{len(shots):02d}", views))
    return SharedViews(("left", "right"), board, tuple(shots))


def _held(rng: np.random.Generator, focal: float, board: Board) -> Array:
    """A board that looks at the camera, tilted, in the direction of a pixel anywhere in the picture."""
    offset = rng.uniform([0.0, 0.0], SIZE) - CENTRE
    angle, around = np.hypot(*offset) / focal, np.arctan2(offset[1], offset[0])
    towards = np.array([np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)])
    axis = np.cross([0.0, 0.0, 1.0], towards)
    rotation = exp_so3(angle * axis / max(np.linalg.norm(axis), 1e-12)) @ exp_so3(rng.normal(0.0, 0.35, 3))
    return rigid(rotation, rng.uniform(0.25, 0.5) * towards - rotation @ board.object_points().mean(axis=0))


def _view(rng: np.random.Generator, pose: Array, focal: float, noise_px: float, board: Board,
          picture: bool) -> BoardView | None:
    points = board.object_points() @ pose[:3, :3].T + pose[:3, 3]
    pixels = project(points, focal)
    beyond = np.arctan2(np.linalg.norm(points[:, :2], axis=1), points[:, 2]).max() > _MOST_RAD
    inside = (pixels > _RIM_PX).all() and (pixels < np.array(SIZE) - _RIM_PX).all()
    if beyond or pose[:3, 2] @ pose[:3, 3] <= 0.0 or not inside:
        return None
    if not picture:
        return seen(pixels + rng.normal(0.0, noise_px, pixels.shape), board)
    photo = Photo(lens=(focal, focal, *CENTRE), equidistant=True, noise=1.5, oversampling=3)
    return detect(take(board, pose, photo, seed=int(rng.integers(1 << 30))), board)
