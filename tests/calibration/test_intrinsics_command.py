"""``rhot calibrate intrinsics`` from pictures to a file, a rig and JSON; mistakes are sentences and write nothing."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from stereo_pictures import FOLDER, needs_pictures

from rhot_app.__main__ import main
from rhot_app.calibration.lens.intrinsics import load_intrinsics
from rhot_app.errors import CalibrationError
from rhot_app.project import load_rig
from rhot_app.rig_history import versions
from rhot_node.files import resource_path

USED = (1, 2, 3, 5, 6, 7, 11)


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    """Some left pictures, one of them cut off."""
    for number in USED:
        shutil.copy(FOLDER / f"left{number:02d}.jpg", tmp_path)
    (tmp_path / "left08.jpg").write_bytes((FOLDER / "left08.jpg").read_bytes()[:5000])
    return tmp_path


def intrinsics(folder: Path, *more: str, board: str = "9x6") -> int:
    images = str(folder / "left*.jpg")
    return main(["calibrate", "intrinsics", "--images", images, "--board", board, "--square-mm", "30", *more])


@needs_pictures
def test_pictures_to_a_file_and_a_rig(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, rig = pictures / "left.json", pictures / "rig.json"
    shutil.copy(resource_path("rigs", "two_pis.json"), rig)
    code = intrinsics(pictures, "--square-pixels", "--out", str(out), "--rig", str(rig), "--node", "left", "--json")
    answer = json.loads(capsys.readouterr().out)
    assert code == 0
    assert answer["fx"] == answer["fy"] == pytest.approx(534.4, abs=1.5)
    assert answer["size"] == [640, 480] and len(answer["distortion"]) == 5 and answer["rms_px"] < 0.1
    assert answer["views_used"] == len(USED) == len(answer["views"])
    (rejected,) = answer["views_rejected"]
    assert rejected["name"] == "left08.jpg" and "cut off" in rejected["reason"]
    assert {"fx", "k3"} <= set(answer["std"]) and answer["grade"] == "fair" and "few_views" in str(answer["findings"])
    assert answer["warnings"] and answer["verdict"].startswith("Usable")

    written = load_intrinsics(out)
    assert (written.fx, written.distortion) == (answer["fx"], tuple(answer["distortion"]))
    assert written.lens.std is not None and written.board is not None and written.board.size == (9, 6)
    assert written.intrinsics.width == 640
    (left,) = [node for node in load_rig(rig).nodes if node.name == "left"]
    assert left.intrinsics.fx == answer["fx"]
    assert [version.replaced_by for version in versions(rig)] == ["intrinsics of left"]


@needs_pictures
def test_a_board_of_another_size_writes_nothing(pictures: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = pictures / "left.json"
    assert intrinsics(pictures, "--out", str(out), board="8x6") == 2
    printed = capsys.readouterr()
    assert "--board 9x6" in printed.out and "nothing was written" in printed.err
    assert not out.exists()


@pytest.mark.parametrize(("arguments", "message"), [
    (("--node", "left"), "belong together"), (("--rig", "RIG", "--node", "middle"), "has no camera 'middle'"),
    (("--rig", "nowhere.json", "--node", "left"), "nowhere.json"), (("--marker-mm", "40"), "do not go into"),
    (("--board", "9"), "9x6 for nine by six")])
def test_a_mistake_is_a_sentence(tmp_path: Path, arguments: tuple[str, ...], message: str,
                                 capsys: pytest.CaptureFixture[str]) -> None:
    rig = str(resource_path("rigs", "two_pis.json"))
    assert intrinsics(tmp_path, *(rig if each == "RIG" else each for each in arguments)) == 2
    assert message in capsys.readouterr().err


def test_no_pictures_is_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert intrinsics(tmp_path) == 2
    assert "No file matches" in capsys.readouterr().err


GOOD = {"format": "rhot-intrinsics", "version": 1, "size": [640, 480], "fx": 500.0, "fy": 500.0, "cx": 320.0,
        "cy": 240.0}


def test_a_file_by_hand_is_read(tmp_path: Path) -> None:
    path = tmp_path / "lens.json"
    path.write_text(json.dumps(GOOD))
    read = load_intrinsics(path)
    assert read.lens.std is None and read.lens.size == (640, 480) and read.lens.lens[8] == 0.0


@pytest.mark.parametrize(("change", "message"), [
    ({"format": "rhot-rig"}, "not a \"rhot-intrinsics\" file"), ({"version": 2}, "version 2"), ({"fx": -1.0}, "fx"),
    ({"fz": 1.0}, "fz"), ({"std": {"f": 1.0}}, "std names 'f'"), ({"distortion": [0.1]}, "distortion"),
    ({"size": [640, "tall"]}, "size")])
def test_wrong_files_are_named(tmp_path: Path, change: dict, message: str) -> None:
    path = tmp_path / "lens.json"
    path.write_text(json.dumps(GOOD | change))
    with pytest.raises(CalibrationError, match=message) as caught:
        load_intrinsics(path)
    assert str(path) in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="no such file"):
        load_intrinsics(tmp_path / "none.json")
