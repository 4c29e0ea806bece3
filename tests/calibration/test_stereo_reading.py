"""Reading the pictures of several cameras: what is wrong with all of one camera's is said at once."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_app.calibration.board.boards import CharucoBoard
from rhot_app.calibration.stereo.reading import read_shared, read_view
from rhot_app.errors import CalibrationError

BOARD = CharucoBoard(8, 6, 0.03, 0.022)


def pictures(folder: Path, camera: str, *, mirrored: bool = False) -> list[Path]:
    """Three pictures of the board, seen face on, larger each time."""
    files = []
    for number in range(3):
        width = 480 + 40 * number
        sheet = BOARD.opencv().generateImage((width, width * 3 // 4), marginSize=20)
        picture = np.full((480, 640), 255, np.uint8)
        rows, cols = min(sheet.shape[0], 480), min(sheet.shape[1], 640)
        picture[:rows, :cols] = sheet[:rows, :cols]
        files.append(folder / f"{camera}{number}.png")
        cv2.imwrite(str(files[-1]), picture[:, ::-1] if mirrored else picture)
    return files


def test_shots_hold_what_each_camera_saw(tmp_path: Path) -> None:
    right = pictures(tmp_path, "right")
    right[1].write_text("no picture")
    read = read_shared({"left": pictures(tmp_path, "left"), "right": right}, BOARD)
    assert [shot.seen_by for shot in read.views.shots] == [(0, 1), (0,), (0, 1)]
    assert [(each.name, each.code) for each in read.dropped] == [("right1.png", "file")]
    assert read.size is None


def test_a_mirrored_charuco_board_is_named_with_its_camera(tmp_path: Path) -> None:
    files = {"left": pictures(tmp_path, "left"), "right": pictures(tmp_path, "right", mirrored=True)}
    with pytest.raises(CalibrationError, match=r"right: no picture shows the board.* the picture is mirrored"):
        read_shared(files, BOARD)


def test_a_single_picture_says_what_is_wrong_with_it(tmp_path: Path) -> None:
    (mirrored, *_) = pictures(tmp_path, "left", mirrored=True)
    with pytest.raises(CalibrationError, match=r"left0.png: the picture is mirrored"):
        read_view(mirrored, BOARD)
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_view(tmp_path / "none.png", BOARD)
