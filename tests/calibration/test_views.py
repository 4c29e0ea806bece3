"""Pictures from files: everything that is wrong with some of them is named, and the rest is used."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from stereo_pictures import BOARD, FOLDER, needs_pictures

from rhot_app.calibration.board.boards import Chessboard
from rhot_app.calibration.lens.views import in_natural_order, matching_files, read_views
from rhot_app.errors import CalibrationError

pytestmark = needs_pictures


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Five left pictures."""
    for number in (1, 3, 4, 9, 12):
        shutil.copy(FOLDER / f"left{number:02d}.jpg", tmp_path / f"left{number}.jpg")
    return tmp_path


def test_files_come_in_the_order_of_their_numbers(folder: Path) -> None:
    assert [path.name for path in matching_files(str(folder / "left*.jpg"))] == [
        "left1.jpg", "left3.jpg", "left4.jpg", "left9.jpg", "left12.jpg"]
    assert [path.name for path in in_natural_order([Path("p10"), Path("p9"), Path("p1")])] == ["p1", "p9", "p10"]
    assert matching_files(str(folder / "right*.jpg")) == []
    assert len(matching_files(str(folder / "left1.jpg"))) == 1


def test_good_pictures_make_views(folder: Path) -> None:
    read = read_views(matching_files(str(folder / "*.jpg")), BOARD)
    assert [view.source for view in read.views] == ["left1.jpg", "left3.jpg", "left4.jpg", "left9.jpg", "left12.jpg"]
    assert read.dropped == () and read.size is None


def test_an_orientation_in_a_file_turns_nothing(folder: Path) -> None:
    files = matching_files(str(folder / "*.jpg"))
    before = read_views(files, BOARD)
    for path, orientation in zip(files, (6, 3, 8), strict=False):
        about = b"Exif\0\0II*\0" + struct.pack("<IHHHIHHI", 8, 1, 274, 3, 1, orientation, 0, 0)
        data = path.read_bytes()
        path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(about) + 2) + about + data[2:])
    after = read_views(files, BOARD)
    assert after.dropped == () and len(after.views) == len(files)
    for one, other in zip(before.views, after.views, strict=True):
        assert one.size == other.size and np.array_equal(one.pixels, other.pixels)


def cut_off(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:9000])


def scrambled(path: Path) -> None:
    path.write_bytes(bytes(range(256)) * 30)


def half_size(path: Path) -> None:
    cv2.imwrite(str(path), cv2.resize(cv2.imread(str(path)), (320, 240)))


def covered(path: Path) -> None:
    image = cv2.imread(str(path))
    image[:, 300:400] = 90
    cv2.imwrite(str(path), image)


@pytest.mark.parametrize(("spoil", "reason", "code"), [
    (cut_off, "cut off", "file"), (scrambled, "not a picture", "file"),
    (lambda path: path.write_bytes(b""), "is empty", "file"),
    (half_size, "is 320x240 px, the others are 640x480", "file"), (covered, "no board with 9x6", "no_board"),
    (lambda path: cv2.imwrite(str(path), np.full((480, 640), 7, np.uint8)), "one brightness", "no_board")])
def test_one_bad_picture_is_named_and_left_out(folder: Path, spoil: Callable, reason: str, code: str) -> None:
    spoil(folder / "left4.jpg")
    read = read_views(matching_files(str(folder / "*.jpg")), BOARD)
    assert len(read.views) == 4
    (dropped,) = read.dropped
    assert dropped.name == "left4.jpg" and reason in dropped.reason and dropped.code == code


def test_a_larger_board_than_said_is_noticed(folder: Path) -> None:
    read = read_views(matching_files(str(folder / "*.jpg")), Chessboard(8, 6, 0.03))
    assert read.size is not None and "--board 9x6" in read.size.remedy


def test_a_smaller_board_than_said_is_named(folder: Path) -> None:
    with pytest.raises(CalibrationError, match=r"no picture shows the board.*seems to have 9x6"):
        read_views(matching_files(str(folder / "left1.jpg")), Chessboard(10, 7, 0.03))


def test_nothing_to_read(folder: Path) -> None:
    with pytest.raises(CalibrationError, match="There are no pictures"):
        read_views([], BOARD)
    for path in folder.glob("*.jpg"):
        scrambled(path)
    with pytest.raises(CalibrationError, match=r"none of 5 files can be used; left1\.jpg is not a picture"):
        read_views(matching_files(str(folder / "*.jpg")), BOARD)
    with pytest.raises(CalibrationError, match=r"nowhere\.jpg cannot be read \(No such file"):
        read_views([folder / "nowhere.jpg"], BOARD)


def test_reading_can_be_stopped(folder: Path) -> None:
    def stop(text: str, fraction: float) -> None:
        if fraction > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        read_views(matching_files(str(folder / "*.jpg")), BOARD, progress=stop)
