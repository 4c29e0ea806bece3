"""Boards as printed geometry, and impossible ones refused with a sentence."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.calibration.board.boards import CharucoBoard, Chessboard, parse_size
from rhot_app.errors import CalibrationError


def test_corners_are_numbered_row_by_row_on_a_plane() -> None:
    points = Chessboard(9, 6, 0.03).object_points()
    assert points.shape == (54, 3)
    np.testing.assert_allclose(points[10], [0.03, 0.03, 0.0])
    np.testing.assert_allclose(points[-1], [8 * 0.03, 5 * 0.03, 0.0])


def test_the_outline_is_one_square_beyond_the_corners() -> None:
    outline = Chessboard(4, 3, 0.01).outline()
    np.testing.assert_allclose(outline[:, :2], [[-0.01, -0.01], [0.04, -0.01], [0.04, 0.03], [-0.01, 0.03]])


def test_charuco_corners_are_opencvs_but_for_the_origin() -> None:
    board = CharucoBoard(8, 6, 0.03, 0.022)
    theirs = np.asarray(board.opencv().getChessboardCorners())
    np.testing.assert_allclose(board.object_points(), theirs - theirs[0], atol=1e-7)
    assert board.count == 35


@pytest.mark.parametrize(("cols", "rows", "one_way"), [(9, 6, True), (6, 9, True), (8, 6, False), (7, 7, False)])
def test_colours_tell_the_ends_apart_only_of_an_odd_and_an_even_side(cols: int, rows: int, one_way: bool) -> None:
    assert Chessboard(cols, rows, 0.03).one_way_up is one_way


@pytest.mark.parametrize("text", ["9x6", "9X6", " 9 x 6 ", "9,6"])
def test_sizes_are_read(text: str) -> None:
    assert parse_size(text) == (9, 6)


@pytest.mark.parametrize("text", ["", "9", "9x", "nine by six", "9x6x3", "-9x6"])
def test_other_text_is_no_size(text: str) -> None:
    with pytest.raises(CalibrationError, match="9x6 for nine by six"):
        parse_size(text)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Chessboard(2, 6, 0.03), "3 to 60"),
    (lambda: Chessboard(9, 6, 30.0), "millimetres"),
    (lambda: Chessboard(9, 6, float("nan")), "millimetres"),
    (lambda: CharucoBoard(8, 6, 0.03, 0.03), "do not go into"),
    (lambda: CharucoBoard(8, 6, 0.03, 0.022, "DICT_9X9"), "no marker dictionary"),
    (lambda: CharucoBoard(8, 6, 0.03, 0.022, "CORNER_REFINE_NONE"), "no marker dictionary"),
    (lambda: CharucoBoard(14, 14, 0.03, 0.022), "has 50 markers"),
])
def test_impossible_boards_are_refused(make, message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        make()
