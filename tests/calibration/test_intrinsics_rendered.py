"""The whole way: rendered pictures of a board, corners, lens; the truth lies where the standard deviations say."""

from __future__ import annotations

import numpy as np
import pytest
from board_rendering import LENS, Photo, corners_px, pose, take

from rhot_app.calibration.board.boards import AprilGrid, Board, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.board.corners import BoardView, detect
from rhot_app.calibration.lens.intrinsics import solve
from rhot_app.calibration.verdict import Grade

PHOTO = Photo(blur_px=0.8, noise=3.0, oversampling=3)


def photographed(board: Board, count: int, seed: int) -> list[BoardView]:
    """Views of `count` pictures; a board lies wholly in each, unless its markers tell which part of it is seen."""
    random = np.random.default_rng(seed)
    views: list[BoardView] = []
    while len(views) < count:
        depth = random.uniform(0.4, 0.7)
        place = (random.uniform(-0.3, 0.3) * depth, random.uniform(-0.22, 0.22) * depth, depth)
        camera_from_board = pose(tuple(random.normal(0.0, 0.35, 3)), place, board)
        pixels = corners_px(board, camera_from_board, LENS)
        inside = ((pixels > 8.0) & (pixels < [631.0, 471.0])).all(axis=1)
        least = 0.7 if isinstance(board, CharucoBoard | AprilGrid) else 1.0
        if camera_from_board[2, 2] < 0.4 or inside.mean() < least:
            continue
        view = detect(take(board, camera_from_board, PHOTO, seed=len(views)), board, source=f"{len(views)}")
        assert view is not None
        views.append(view)
    return views


@pytest.mark.parametrize("board", [Chessboard(9, 6, 0.03), CharucoBoard(10, 7, 0.03, 0.022),
                                   AprilGrid(6, 4, 0.036, 0.3), CircleGrid(4, 11, 0.02)],
                         ids=["plain", "charuco", "aprilgrid", "circles"])
def test_pictures_give_the_lens_back(board: Board) -> None:
    report = solve(photographed(board, 11, seed=2), board)
    assert np.all(np.abs(report.lens - LENS) <= 3.5 * report.std)
    assert report.std[0] < 0.3 and report.rms_px < 0.05
    assert report.verdict.grade is Grade.GOOD, report.verdict
