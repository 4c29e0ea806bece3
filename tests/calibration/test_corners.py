"""Corners found in rendered pictures, held against where they truly are; and how long a live picture takes."""

from __future__ import annotations

import time
from dataclasses import replace

import cv2
import numpy as np
import pytest
from board_rendering import LENS, Photo, corners_px, pose, take
from patience import quickest
from stereo_pictures import NUMBERS, needs_pictures, picture

from rhot_app.calibration.board.boards import Board, CharucoBoard, Chessboard
from rhot_app.calibration.board.corners import detect
from rhot_app.calibration.board.size_check import why_missing

BOARD = Chessboard(9, 6, 0.03)
TURN = (0.3, -0.35, 0.15)


def photo(board: Board, square_px: float, blur_px: float = 0.7, turn: tuple[float, float, float] = TURN,
          seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A picture of the board with squares of about `square_px`, and (N, 2) px where its corners are."""
    depth = LENS[0] * board.square_m / square_px
    camera_from_board = pose(turn, (0.02 * depth, -0.03 * depth, depth), board)
    return take(board, camera_from_board, Photo(blur_px=blur_px, noise=3.0, oversampling=3), seed), corners_px(
        board, camera_from_board, LENS)


def off(view, truth: np.ndarray) -> np.ndarray:
    """(N,) px."""
    return np.linalg.norm(view.pixels - truth[view.ids], axis=1)


@pytest.mark.parametrize(("square_px", "blur_px", "limit_px"), [(30, 0.7, 0.03), (14, 1.0, 0.04), (7, 0.6, 0.06)])
def test_corners_are_found_to_a_few_hundredths_of_a_pixel(square_px: float, blur_px: float, limit_px: float) -> None:
    image, truth = photo(BOARD, square_px, blur_px)
    view = detect(image, BOARD)
    assert view is not None and len(view.ids) == 54
    assert np.sqrt(np.mean(off(view, truth) ** 2)) < limit_px
    assert off(view, truth).max() < 4 * limit_px
    assert view.blur_px == pytest.approx(blur_px, abs=0.15)
    assert view.square_px == pytest.approx(square_px, rel=0.35)


def test_the_usual_window_is_a_trap_on_small_squares() -> None:
    image, truth = photo(BOARD, 12, 0.7)
    view = detect(image, BOARD)
    assert view is not None
    usual = view.pixels.astype(np.float32).reshape(-1, 1, 2).copy()
    cv2.cornerSubPix(image, usual, (11, 11), (-1, -1), (3, 60, 1e-3))
    usual = usual[:, 0]
    assert np.sqrt(np.mean(np.sum((usual - truth) ** 2, axis=1))) > 10 * np.sqrt(np.mean(off(view, truth) ** 2))


def test_counting_begins_at_the_black_end_however_the_board_is_held() -> None:
    for roll in (0.0, 1.4, 3.0, -1.7):
        image, truth = photo(BOARD, 26, turn=(0.2, 0.1, roll))
        view = detect(image, BOARD)
        assert view is not None
        assert off(view, truth).max() < 0.3, f"counted from another end at {roll} rad"


def test_a_board_that_is_its_own_half_turn_is_counted_from_the_upper_left() -> None:
    board = Chessboard(8, 6, 0.03)
    image, truth = photo(board, 26, turn=(0.1, 0.2, 3.1))
    view = detect(image, board)
    assert view is not None
    assert off(view, truth[::-1]).max() < 0.3
    assert off(view.turned(board), truth).max() < 0.3


@pytest.mark.parametrize("board", [CharucoBoard(10, 7, 0.03, 0.022), CharucoBoard(8, 6, 0.03, 0.022, "DICT_5X5_100"),
                                   CharucoBoard(8, 6, 0.03, 0.022, "DICT_5X5_100", legacy=True)],
                         ids=lambda board: board.text)
def test_charuco_corners_of_both_layouts(board: CharucoBoard) -> None:
    image, truth = photo(board, 34)
    view = detect(image, board)
    assert view is not None and len(view.ids) >= 0.9 * board.count
    assert np.sqrt(np.mean(off(view, truth) ** 2)) < 0.06


def test_part_of_a_charuco_board_is_enough() -> None:
    board = CharucoBoard(10, 7, 0.03, 0.022)
    image, truth = photo(board, 34)
    image[:, 330:] = 128
    view = detect(image, board)
    assert view is not None and 10 < len(view.ids) < board.count
    assert off(view, truth).max() < 0.3
    assert np.isnan(view.grid(board)).any()


@pytest.mark.parametrize(("turned", "centre_m"), [((0.04, 0.09, -0.199), (0.1463, 0.0238, 0.3936)),
                                                  ((-0.165, -0.352, -0.245), (-0.1917, 0.1626, 0.5276))])
def test_a_board_beyond_the_rim_is_not_counted_a_line_too_far(turned: tuple[float, float, float],
                                                             centre_m: tuple[float, float, float]) -> None:
    """The search continues a grid past the rim: with a corner or two missing on one side it may do so on the other."""
    board = Chessboard(8, 6, 0.030)
    where = pose(turned, centre_m, board)
    lens = (535.0, 536.07, 324.5, 235.5, -0.28, 0.09, 0.001, -0.0005, 0.0)
    truth = corners_px(board, where, lens)
    assert np.sum((truth < 0.0) | (truth > np.array([639.0, 479.0]))) > 0
    view = detect(take(board, where, Photo(lens=lens)), board)
    assert view is None or np.abs(view.pixels - truth[view.ids]).max() < 0.5


def test_why_a_charuco_board_was_not_found() -> None:
    board = CharucoBoard(8, 6, 0.03, 0.022, "DICT_5X5_100")
    image, _ = photo(board, 34)
    old = replace(board, legacy=True)
    assert detect(image, old) is None
    assert "layout is today's" in why_missing(image, old)
    flipped = np.ascontiguousarray(image[:, ::-1])
    assert detect(flipped, board) is None
    assert "mirrored" in why_missing(flipped, board)
    assert "squares counted" in why_missing(image, replace(board, squares_x=12, squares_y=11))
    assert "wrong dictionary" in why_missing(image, replace(board, dictionary="DICT_6X6_100"))


def test_a_charuco_board_in_negative_is_found_at_the_same_corners() -> None:
    board = CharucoBoard(8, 6, 0.03, 0.022)
    image, truth = photo(board, 34)
    view = detect(255 - image, board, thorough=False)
    assert view is not None and len(view.ids) == board.count and off(view, truth).max() < 0.1
    assert "squares counted" in why_missing(255 - image, replace(board, squares_x=12, squares_y=8))


@pytest.mark.filterwarnings("error")
def test_a_far_charuco_board_is_read_or_called_too_small() -> None:
    board = CharucoBoard(10, 7, 0.025, 0.01875)
    image, truth = photo(board, 17.0)
    view = detect(image, board)
    assert view is not None and len(view.ids) > 20 and off(view, truth).max() < 0.3
    far, _ = photo(board, 8.0)
    for picture_or_negative in (far, 255 - far):
        assert detect(picture_or_negative, board) is None
        assert "markers have" in (why := why_missing(picture_or_negative, board)) and "too small" in why


def test_a_charuco_board_of_which_little_is_seen_is_called_hidden() -> None:
    board = CharucoBoard(10, 7, 0.03, 0.022)
    image, _ = photo(board, 34, turn=(0.0, 0.0, 0.0))
    image[:, 290:] = 128
    image[180:] = 128
    assert "hidden" in why_missing(image, board)


@pytest.mark.parametrize("shape", [(1, 1), (10, 400), (480, 640), (480, 640, 3)])
def test_pictures_without_a_board_are_no_trouble(shape: tuple[int, ...]) -> None:
    for image in (np.zeros(shape, np.uint8), np.full(shape, 255, np.uint8)):
        assert detect(image, BOARD) is None
        assert detect(image, CharucoBoard(8, 6, 0.03, 0.022)) is None


@needs_pictures
def test_why_a_chessboard_was_not_found() -> None:
    gray = picture("left", 1)
    assert "seems to have 9x6" in why_missing(gray, Chessboard(12, 9, 0.03))
    cut = why_missing(gray[:, :330], BOARD)  # OpenCV sees a smaller board in some runs, and none in most
    assert "all of them must be visible" in cut or "part of the board is hidden" in cut
    assert "one brightness" in why_missing(np.full_like(gray, 3), BOARD)


@needs_pictures
def test_a_live_picture_costs_little_of_a_thorough_search() -> None:
    """Against what a thorough search costs in the same run: how fast the machine is must not matter."""
    boards = [picture("left", number) for number in NUMBERS[:3]]
    desks = [np.ascontiguousarray(np.vstack([gray[240:], gray[:240]])[:, ::-1]) for gray in boards]
    assert all(detect(image, BOARD, thorough=False) is not None for image in boards)
    assert all(detect(image, BOARD, thorough=False) is None for image in desks)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        thorough = quickest(lambda: detect(desks[0], BOARD), times=2, clock=time.process_time)
        found, missed = (np.median([quickest(lambda image=image: detect(image, BOARD, thorough=False), times=3,
                                             clock=time.process_time) for image in images])
                         for images in (boards, desks))
    finally:
        cv2.setNumThreads(threads)
    assert missed < 0.12 * thorough  # 0.055 where it was measured
    assert found < 0.12 * thorough
