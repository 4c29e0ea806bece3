"""``rhot calibrate stereo`` on real pictures: a rig is written when it may be used, and never otherwise."""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import pytest
from stereo_pictures import FOLDER, needs_pictures, picture

from rhot_app import rig_history
from rhot_app.__main__ import main
from rhot_app.calibration.board.boards import STANDARD_BOARD, AprilGrid, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.commands.arguments import add_board_arguments, board_of, described_board
from rhot_app.errors import CalibrationError
from rhot_app.project import load_rig, save_rig
from rhot_node.files import resource_path

pytestmark = needs_pictures

BOARD = ("--board", "9x6", "--square-mm", "30")


def copied(folder: Path, pairs: int) -> Path:
    for number in range(1, 1 + pairs):
        for camera in ("left", "right"):
            shutil.copy(FOLDER / f"{camera}{number:02d}.jpg", folder)
    return folder


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    """Five pairs, to be spoilt."""
    return copied(tmp_path, 5)


def stereo(folder: Path, *more: str, left: str = "left*", right: str = "right*") -> int:
    return main(["calibrate", "stereo", "--left", f"{folder}/{left}", "--right", f"{folder}/{right}", *BOARD, *more])


def told(folder: Path, capsys: pytest.CaptureFixture[str], *more: str, code: int = 0) -> dict[str, Any]:
    capsys.readouterr()
    assert stereo(folder, *more, "--json") == code
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def test_all_pairs_make_a_rig(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "rig.json"
    answer = told(FOLDER, capsys, "--out", str(out), "--baseline-mm", "100")
    assert answer["rms_px"] <= 0.45
    assert answer["translation_mm"] == pytest.approx([-99.8, 1.1, 0.1], abs=0.6)
    assert answer["square_mm_triangulated"] == pytest.approx(30.0, abs=0.1)
    assert answer["baseline_mm"] == pytest.approx(99.8, abs=0.6)
    assert answer["rotation_rad"] == pytest.approx([0.0067, 0.0045, -0.0035], abs=0.003)
    assert answer["views_used"] == 14
    assert answer["views_rejected"] == []
    assert answer["grade"] == "good"
    assert answer["cameras"][0]["fx"] == pytest.approx(535.0, abs=3.0)
    left, right = load_rig(out).nodes
    assert right.pose.translation_m[0] == pytest.approx(0.0998, abs=6e-4)
    assert (left.intrinsics.fx, left.intrinsics.width) == (pytest.approx(answer["cameras"][0]["fx"]), 640)
    record = load_rig(out).calibration
    assert record is not None and (record.method, record.lengths) == ("board", "baseline")
    assert record.error_m == pytest.approx(1e-3 * answer["expected_error_mm"]["by_calibration"])
    assert main(["check", str(out)]) == 0


def test_without_a_second_length_the_rig_says_that_none_was_checked(pictures: Path,
                                                                    capsys: pytest.CaptureFixture[str]) -> None:
    out = pictures / "rig.json"
    assert stereo(pictures, "--out", str(out)) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("Usable, not good") and "Lengths were never checked against a ruler." in printed
    record = load_rig(out).calibration
    assert record is not None and record.lengths == "skipped"
    assert main(["check", str(out)]) == 0
    assert "Lengths were never checked against a ruler." in capsys.readouterr().out


def test_the_board_is_the_one_of_rhot_target_where_nobody_names_another() -> None:
    parser = argparse.ArgumentParser()
    add_board_arguments(parser)
    assert board_of(parser.parse_args([])) == STANDARD_BOARD
    assert board_of(parser.parse_args(["--square-mm", "24.6"])).square_m == pytest.approx(0.0246)
    assert board_of(parser.parse_args(["--board", "marker_mm=20"])) == CharucoBoard(10, 7, 0.025, 0.02)


@pytest.mark.parametrize(("text", "board"), [
    ("charuco", CharucoBoard(10, 7, 0.025, 0.75 * 0.025)), ("8x5", Chessboard(8, 5, 0.025)),
    ("9,6", Chessboard(9, 6, 0.025)), ("charuco, 9, 6,marker_mm=15", CharucoBoard(9, 6, 0.025, 0.015)),
    ("marker_mm=15,9,6", CharucoBoard(9, 6, 0.025, 0.015)), ("circles,4x9", CircleGrid(4, 9, 0.025)),
    ("", STANDARD_BOARD),
    ("charuco, 8x5, marker_mm=15, dictionary=DICT_5X5_100, legacy",
     CharucoBoard(8, 5, 0.025, 0.015, "DICT_5X5_100", True)),
    ("aprilgrid,6x6,tag_spacing=0.2", AprilGrid(6, 6, 0.025, 0.2))])
def test_a_board_is_written_in_parts(text: str, board: object) -> None:
    assert described_board(text, 25.0) == board


@pytest.mark.parametrize(("text", "said"), [
    ("chess", "'chess' is no part of a board"), ("charuco,8x5,9x6", "'9x6' is no part"),
    ("charuco,8xx5", "two numbers"),
    ("charuco,marker_mm=x", "marker_mm=x is not a finite number"), ("charuco,colour=red", "'colour=red' is no part"),
    ("chessboard,legacy", "belong to a ChArUco board"), ("charuco,tag_spacing=0.3", "belongs to an AprilGrid"),
    ("charuco,dictionary=NONE", "no marker dictionary")])
def test_a_board_that_cannot_be_is_refused(text: str, said: str) -> None:
    with pytest.raises(CalibrationError, match=said):
        described_board(text, None)


def test_a_rig_that_was_there_is_kept_and_nothing_else_in_it_changes(pictures: Path) -> None:
    out = pictures / "rig.json"
    before = msgspec.structs.replace(load_rig(resource_path("rigs", "two_pis.json")), name="bench")
    before = msgspec.structs.replace(before, nodes=(before.nodes[0], msgspec.structs.replace(
        before.nodes[1], pose_known=False)))
    save_rig(out, before)
    assert stereo(pictures, "--out", str(out)) == 0
    after = load_rig(out)
    assert after.name == "bench"
    assert after.hand == before.hand
    assert after.nodes[0].address == before.nodes[0].address
    assert after.nodes[1].pose != before.nodes[1].pose and after.nodes[1].pose_known
    (version,) = rig_history.versions(out)
    assert version.replaced_by == "stereo calibration"
    assert main(["history", str(out), "--restore", "1"]) == 0
    assert load_rig(out) == before


def test_a_lie_writes_nothing(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = pictures / "rig.json"
    assert stereo(pictures, "--out", str(out), left="right*", right="left*") == 2
    assert "the pictures of left come from the camera on the right" in capsys.readouterr().err
    assert stereo(pictures, "--out", str(out), "--baseline-mm", "75") == 2
    assert "by hand 75.0 mm" in capsys.readouterr().err
    assert not out.exists()


def test_a_smaller_board_than_the_real_one_is_refused(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = told(pictures, capsys, "--board", "8x6", code=2)
    assert "board_size" in {finding["code"] for finding in answer["findings"]}
    assert answer["written"] is None


def test_mirrored_files_are_refused(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in range(1, 6):
        cv2.imwrite(str(pictures / f"right{number:02d}.jpg"), picture("right", number)[:, ::-1],
                    [cv2.IMWRITE_JPEG_QUALITY, 98])
    answer = told(pictures, capsys, code=2)
    assert [finding["code"] for finding in answer["findings"]] == ["mirrored"]
    assert answer["rms_px"] is None


def test_broken_files_are_left_out_with_a_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pictures = copied(tmp_path, 8)
    whole = (pictures / "right03.jpg").read_bytes()
    (pictures / "right03.jpg").write_bytes(whole[:len(whole) // 3])
    (pictures / "left04.jpg").write_text("this is no picture")
    cv2.imwrite(str(pictures / "left05.jpg"), picture("left", 5)[:240, :320])
    (pictures / "right06.jpg").unlink()
    answer = told(pictures, capsys)
    assert answer["views_used"] == 4
    assert {each["name"]: each["code"] for each in answer["views_rejected"]} == {
        "right03.jpg": "file", "left04.jpg": "file", "left05.jpg": "no_board", "left06.jpg": "no_partner"}
    assert answer["grade"] == "fair"
    assert answer["translation_mm"] == pytest.approx([-99.8, 1.1, 0.1], abs=1.0)


def test_a_picture_of_another_size_is_left_out(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite(str(pictures / "left05.jpg"), cv2.resize(picture("left", 5), (960, 720)))
    (rejected,) = told(pictures, capsys)["views_rejected"]
    assert rejected["name"] == "left05.jpg"
    assert rejected["reason"] == "is 960x720 px, the others are 640x480"


MISTAKES: list[tuple[tuple[str, ...], str]] = [
    (("--board", "nine by six"), "'nine by six' is no part of a board"),
    (("--ruler-mm", "240"), "ends in the pictures of two cameras"),
    (("--ruler-mm", "240", "--ruler", "left=1,2,3", "--ruler", "right=1,2,3,4"), "--ruler left=1,2,3"),
    (("--left", "nowhere/*.jpg"), "left: no file matches"),
    (("--camera", "third"), "write it as NAME=PATTERN"),
    (("--table-image", "third=x.jpg"), "there are no pictures of 'third'"),
    (("--left-intrinsics", "nowhere.json"), "nowhere.json"),
    (("--rig-from", "nowhere.json"), "nowhere.json: no such file"),
    (("--board", "12x11"), "left: no picture shows the board"),
]


@pytest.mark.parametrize(("arguments", "message"), MISTAKES)
def test_a_mistake_is_a_sentence(tmp_path: Path, arguments: tuple[str, ...], message: str,
                                 capsys: pytest.CaptureFixture[str]) -> None:
    assert stereo(copied(tmp_path, 1), *arguments) == 2
    assert message in capsys.readouterr().err


def test_a_folder_that_is_not_there_is_named_before_the_work(tmp_path: Path,
                                                             capsys: pytest.CaptureFixture[str]) -> None:
    out, table, rig = tmp_path / "no" / "rig.json", tmp_path / "t.csv", tmp_path / "r.json"
    table.touch()
    rig.touch()
    for kind in (["stereo", "--left", "a*", "--right", "b*", "--board", "9x6", "--square-mm", "30"],
                 ["intrinsics", "--images", "a*", "--board", "9x6", "--square-mm", "30"],
                 ["depth", "--table", str(table), "--rig", str(rig)]):
        assert main(["calibrate", *kind, "--out", str(out)]) == 2
        assert f"there is no folder {out.parent}" in capsys.readouterr().err
    assert not out.parent.exists()


def test_a_camera_that_the_rig_does_not_have_is_named(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--camera", f"a={pictures}/left*", "--camera", f"b={pictures}/right*"]
    assert main(["calibrate", "stereo", *arguments, *BOARD]) == 2
    assert 'the rig "two Pis" has no camera called a or b; it has left, right' in capsys.readouterr().err


def test_a_rig_on_the_table_has_z_up(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Picture pair 1 stands in for the board on the table."""
    out = pictures / "rig.json"
    answer = told(pictures, capsys, "--out", str(out), "--table-image", f"left={pictures}/left01.jpg",
                  "--table-image", f"right={pictures}/right01.jpg")
    rig = load_rig(out)
    assert rig.up == "z"
    heights = [node.pose.translation_m[2] for node in rig.nodes]
    assert min(heights) > 0.1
    assert [camera["height_mm"] for camera in answer["table"]["cameras"]] == pytest.approx(
        [height * 1e3 for height in heights])
    baseline = np.subtract(rig.nodes[0].pose.translation_m, rig.nodes[1].pose.translation_m)
    assert np.linalg.norm(baseline) * 1e3 == pytest.approx(answer["baseline_mm"])


def test_a_square_size_of_another_unit_is_refused(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = told(pictures, capsys, "--square-mm", "3", code=2)
    assert "scale" in [finding["code"] for finding in wrong["findings"] if finding["grade"] == "poor"]


def test_a_ruler_catches_a_wrong_square(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The ends of 240 mm, two corners of the board eight squares apart, as a person reads them off pair 3."""
    ruler = ("--ruler-mm", "240", "--ruler", "left=277,72,604,168", "--ruler", "right=133,90,448,175")
    wrong = told(pictures, capsys, *ruler, "--square-mm", "33", code=2)
    assert [finding["code"] for finding in wrong["findings"] if finding["grade"] == "poor"] == ["square_size"]
    assert "about 30." in wrong["findings"][0]["cause"] or "about 29." in wrong["findings"][0]["cause"]
    assert told(pictures, capsys, *ruler)["ruler_mm"]["measured"] == pytest.approx(240.0, abs=3.0)
