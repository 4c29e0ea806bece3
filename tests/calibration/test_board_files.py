"""Boards as Kalibr, caliscope and anipose state them: the board that is searched for; others are refused."""

from __future__ import annotations

from pathlib import Path

import cv2
import pytest
from board_rendering import Photo, pose, take

from rhot_app.__main__ import main
from rhot_app.calibration.board.boards import AprilGrid, Board, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.exchange.boards import read_board
from rhot_app.errors import CalibrationError

CHECKERBOARD = """target_type: 'checkerboard' #gridtype
targetCols: 6               #number of internal chessboard corners
targetRows: 7               #number of internal chessboard corners
rowSpacingMeters: 0.06      #size of one chessboard square [m]
colSpacingMeters: 0.06      #size of one chessboard square [m]
"""
"""ethz-asl/kalibr, the wiki's page "calibration targets", BSD-3-Clause."""

APRILGRID = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n"

CIRCLEGRID = """target_type: 'circlegrid' #gridtype
targetCols: 6               #number of circles (cols)
targetRows: 7               #number of circles (rows)
spacingMeters: 0.02         #distance between circles [m]
asymmetricGrid: True        #use asymmetric grid (opencv) [bool]
"""
"""Both from the same page of Kalibr's wiki."""

ANIPOSE = """nesting = 1
[calibration]
animal_calibration = false
board_type = "charuco"
board_size = [10, 7]
board_marker_bits = 4
board_marker_dict_number = 50
board_marker_length = 18.75 # mm
board_square_side_length = 25 # If charuco or checkerboard, square side length mm
"""
"""lambdaloop/anipose, docs, config.toml, BSD-2-Clause."""

CHARUCO = """columns = 4
rows = 5
board_height = 11.0
board_width = 8.5
dictionary = "DICT_4X4_50"
units = "inch"
aruco_scale = 0.75
square_size_overide_cm = 5.4
inverted = true
"""
"""mprib/caliscope, tests/reference/2d_data/charuco.toml, BSD-2-Clause."""


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize(("name", "text", "board"), [
    ("target.yaml", CHECKERBOARD, Chessboard(6, 7, 0.06)),
    ("target.yaml", APRILGRID, AprilGrid(6, 6, 0.088, 0.3)),
    ("target.yaml", CIRCLEGRID, CircleGrid(6, 7, 0.02)),
    ("config.toml", ANIPOSE, CharucoBoard(10, 7, 0.025, 0.01875)),
    ("config.toml", ANIPOSE.replace("charuco", "checkerboard"), Chessboard(10, 7, 0.025)),
    ("charuco.toml", CHARUCO, CharucoBoard(4, 5, 0.054, 0.0405)),
    ("config.toml", "fps = 6\n[charuco]\n" + CHARUCO + "legacy_pattern = true\n",
     CharucoBoard(4, 5, 0.054, 0.0405, legacy=True)),
    ("paper.toml", CHARUCO.replace("square_size_overide_cm = 5.4\n", ""), CharucoBoard(4, 5, 0.053975, 0.04048125)),
])
def test_a_published_board_is_the_one_that_it_says(tmp_path: Path, name: str, text: str, board: Board) -> None:
    found = read_board(written(tmp_path, name, text))
    assert type(found) is type(board)
    for field in board.__slots__:
        value = getattr(board, field)
        assert getattr(found, field) == (pytest.approx(value) if isinstance(value, float) else value), field


@pytest.mark.parametrize(("name", "text", "words"), [
    ("a.yaml", APRILGRID.replace("aprilgrid", "assembly"), "assembly"),
    ("a.yaml", APRILGRID.replace("tagSize: 0.088\n", ""), "tagSize is missing"),
    ("a.yaml", APRILGRID.replace("0.3", "26"), "spacing of 26"),
    ("a.yaml", APRILGRID.replace("tagCols: 6", "tagCols: 60"), "60x6 tags is not possible"),
    ("a.yaml", CIRCLEGRID.replace("True", "False"), "same turned"),
    ("a.toml", ANIPOSE.replace("charuco", "aruco"), "aruco"),
    ("a.toml", ANIPOSE.replace("[10, 7]", "[10.5, 7]"), "board_size"),
    ("a.toml", ANIPOSE.replace("= 4", "= 3"), "DICT_3X3_50"),
    ("a.yaml", CHECKERBOARD.replace("rowSpacingMeters: 0.06", "rowSpacingMeters: 0.05"), "60 x 50 mm"),
    ("a.yaml", CHECKERBOARD.replace("targetCols: 6", "targetCols: 6.5"), "targetCols"),
    ("a.yaml", CHECKERBOARD.replace("0.06", ".nan"), "finite"),
    ("a.yaml", CHECKERBOARD.replace("0.06", "60"), "not possible"),
    ("a.yaml", "rows: 6\n", "target_type"),
    ("a.toml", CHARUCO.replace("DICT_4X4_50", "DICT_4X4_5"), "dictionary"),
    ("a.toml", CHARUCO.replace("square_size_overide_cm = 5.4", "square_size_overide_cm = []"), "0 numbers"),
    ("a.toml", CHARUCO.replace("square_size_overide_cm = 5.4", "").replace("rows = 5", "rows = 0"), "not possible"),
])
def test_another_board_is_refused_by_name(tmp_path: Path, name: str, text: str, words: str) -> None:
    with pytest.raises(CalibrationError, match=words):
        read_board(written(tmp_path, name, text))


def test_the_commands_search_the_board_of_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    board = read_board(written(tmp_path, "target.yaml", CHECKERBOARD))
    for k, turn in enumerate(((0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (-0.3, 0.1, 0.0))):
        picture = take(board, pose(turn, (0.0, 0.0, 0.9), board), Photo(oversampling=2), seed=k)
        cv2.imwrite(str(tmp_path / f"left{k}.png"), picture)
    words = ["calibrate", "intrinsics", "--images", str(tmp_path / "left*.png"), "--board"]
    main([*words, str(tmp_path / "target.yaml"), "--json"])
    assert '"views_used": 3' in capsys.readouterr().out
    assert main([*words, str(tmp_path / "target.yaml"), "--square-mm", "60"]) == 2
    assert "--square-mm" in capsys.readouterr().err
    assert main([*words, str(tmp_path / "none.yaml")]) == 2
    assert "none.yaml" in capsys.readouterr().err
