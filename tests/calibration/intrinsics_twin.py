"""A synthetic camera before a board: its corners as they truly fall, with noise and a bent board where asked for."""

from __future__ import annotations

import numpy as np
from board_rendering import LENS, corners_px, pose
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board, Chessboard
from rhot_app.calibration.board.corners import BoardView, side_px

Array = NDArray[np.float64]

SIZE = (640, 480)
BOARD = Chessboard(9, 6, 0.030)


def twin_views(rng: np.random.Generator, *, count: int = 15, board: Board = BOARD, lens: Array = LENS,
               noise_px: float = 0.0, board_errors: Array | None = None, tilt: float = 0.4) -> list[BoardView]:
    """`count` views that lie wholly in the picture, as a person holds a board; `tilt` the SD of its angles, rad.

    `board_errors` (N, 3) m moves the corners on the board.
    """
    views: list[BoardView] = []
    for _ in range(100 * count):
        depth = rng.uniform(0.35, 0.75)
        place = (rng.uniform(-0.35, 0.35) * depth, rng.uniform(-0.28, 0.28) * depth, depth)
        camera_from_board = pose(tuple(rng.normal(0.0, tilt, 3)), place, board)
        pixels = corners_px(board, camera_from_board, lens, board_errors)
        if camera_from_board[2, 2] > 0.3 and (pixels > 2.0).all() and (pixels < np.array(SIZE) - 3.0).all():
            views.append(seen(pixels + rng.normal(0.0, noise_px, pixels.shape), board, f"view{len(views) + 1:02d}"))
        if len(views) == count:
            return views
    raise ValueError("the board does not fit into the picture")


def seen(pixels: Array, board: Board, source: str = "") -> BoardView:
    """The view of a whole board with corners at `pixels` (N, 2)."""
    sides = side_px(pixels.reshape(board.rows, board.cols, 2))
    return BoardView(pixels, np.arange(board.count), *SIZE, float(sides.min()), 1.0, source)
