"""``rhot calibrate import`` and ``export``: a rig goes out and comes back; mistakes are sentences and write nothing."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from published_cameras import (
    ANIPOSE,
    CALISCOPE,
    KALIBR_CHAIN,
    KALIBR_PINHOLES,
    OPENCV_CAMERA,
    OPENCV_PAIR,
    ROS_CAMERA,
)

from rhot_app.__main__ import main
from rhot_app.calibration.exchange.formats import FORMATS
from rhot_app.calibration.lens.intrinsics import load_intrinsics
from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import CameraCalibration, CameraPose, Rig, load_rig, save_rig
from rhot_app.rig_history import versions
from rhot_node.files import resource_path

SIDE_BY_SIDE = OPENCV_PAIR.replace("2.9589439552724328e-01, -1.0354662043042675e+00", "-0.17, -0.11"
                                   ) + "R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
"""The first lens as published folds back within the picture."""


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """A rig of two cameras that are turned and distorted."""
    path, base = tmp_path / "desk.json", load_rig(resource_path("rigs", "two_pis.json"))
    turn = tuple(map(float, quaternion_from_rotation(exp_so3([0.02, -0.1, 0.01]))))
    nodes = [msgspec.structs.replace(
        node, pose=CameraPose(turn if k else (1.0, 0.0, 0.0, 0.0), (0.08 * k, 0.001 * k, 0.0)),
        intrinsics=msgspec.structs.replace(node.intrinsics, cx=node.intrinsics.cx + 3.25,
                                           distortion=(-0.11, 0.02, 1e-4, -2e-4, 0.0)))
        for k, node in enumerate(base.nodes)]
    save_rig(path, msgspec.structs.replace(base, nodes=tuple(nodes), calibration=CameraCalibration("board", "ruler")))
    return path


def test_a_file_becomes_a_rig_of_these_cameras(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, out = tmp_path / "calibration.toml", tmp_path / "films.json"
    source.write_text(ANIPOSE)
    assert main(["calibrate", "import", str(source), "--unit", "mm", "--out", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    made = load_rig(out)
    assert [node.name for node in made.nodes] == ["cam088", "cam091", "cam581", "cam592"]
    assert answer["format"] == "anipose" and [each["theirs"] for each in answer["cameras"]] == [
        node.name for node in made.nodes]
    assert made.nodes[0].pose == CameraPose() and made.calibration is None and made.up == "-y"
    baseline = np.linalg.norm(made.nodes[1].pose.translation_m)
    assert baseline == pytest.approx(1.5, abs=0.2) and answer["cameras"][1]["translation_mm"][2] > 1000.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_pair_of_opencvs_may_stand_in_any_order_and_its_rig_passes_the_check(
        side: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its file has no names; which camera stands to the left is nothing that it says."""
    source, out = tmp_path / "pair.yml", tmp_path / "pair.json"
    matrix = np.array([[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]])
    lens = np.array([[0.05, -0.1, 1e-3, 1e-3, 0.0]])
    file = cv2.FileStorage(str(source), cv2.FILE_STORAGE_WRITE)
    for key, value in (("M1", matrix), ("D1", lens), ("M2", matrix), ("D2", lens), ("R", np.eye(3)),
                       ("T", np.array([[side * 100.0], [0.5], [0.2]]))):
        file.write(key, value)
    file.release()
    assert main(["calibrate", "import", str(source), "--unit", "mm", "--size", "640x480", "--out", str(out)]) == 0
    capsys.readouterr()
    main(["check", "--rig", str(out), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert not [one for one in said["warnings"] if "port" in one or "left" in one], said["warnings"]
    assert said["grade"] != "poor" and len({node.udp_port for node in load_rig(out).nodes}) == 2


@pytest.mark.parametrize("form", FORMATS)
def test_a_rig_comes_back_as_it_went_out(rig: Path, tmp_path: Path, form: str,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    out, back = tmp_path / f"out{FORMATS[form].suffix}", tmp_path / "back.json"
    unit = [] if FORMATS[form].states_unit else ["--unit", "mm"]
    assert main(["calibrate", "export", "--rig", str(rig), "--format", form, *unit, "--out", str(out)]) == 0
    files = [str(out)] if out.is_file() else sorted(map(str, out.iterdir()))
    assert len(files) == (2 if form == "ros" else 1)
    assert main(["calibrate", "import", *files, *unit, "--rig-from", str(rig), "--out", str(back)]) == 0
    before, after = load_rig(rig), load_rig(back)
    assert after.calibration is None and after.markers == before.markers
    points = np.random.default_rng(1).uniform((-0.1, -0.1, 0.4), (0.1, 0.1, 0.8), (100, 3))
    for mine, theirs in zip(before.nodes, after.nodes, strict=True):
        assert theirs.name == mine.name
        pixels = [CameraModel.from_rig(node.intrinsics, node.pose).project(points) for node in (mine, theirs)]
        assert np.abs(pixels[1] - pixels[0]).max() < 1e-9
    assert "Calibrated: with a board" in capsys.readouterr().out


def test_a_lens_alone_leaves_the_poses_and_says_that_they_are_outdated(rig: Path, tmp_path: Path) -> None:
    source = tmp_path / "left.yml"
    source.write_text(OPENCV_CAMERA)
    before, lens = load_rig(rig), tmp_path / "lens.json"
    assert main(["calibrate", "import", str(source), "--intrinsics", str(lens), "--out", str(rig)]) == 0
    after = load_rig(rig)
    assert [node.pose for node in after.nodes] == [node.pose for node in before.nodes]
    assert after.nodes[0].intrinsics.fx == load_intrinsics(lens).fx == 535.91573396163199
    assert after.nodes[1] == before.nodes[1] and after.calibration is not None
    assert after.calibration.method == "outdated" and len(versions(rig)) == 1


def test_other_cameras_of_the_rig_move_along_with_the_first(rig: Path, tmp_path: Path) -> None:
    """Caliscope's cameras 1 and 2 become right and a third one; left stays where it was beside right."""
    source, base = tmp_path / "camera_array.toml", load_rig(rig)
    source.write_text(CALISCOPE)
    third = msgspec.structs.replace(base.nodes[1], name="third", node_id=9)
    save_rig(rig, msgspec.structs.replace(base, nodes=(*base.nodes, third)))
    assert main(["calibrate", "import", str(source), "--camera", "right=cam_1", "--camera", "third=cam_2",
                 "--rig-from", str(rig), "--out", str(tmp_path / "new.json")]) == 0
    after = load_rig(tmp_path / "new.json")
    before, models = ([CameraModel.from_rig(node.intrinsics, node.pose) for node in one.nodes] for one in (base, after))
    assert np.allclose(models[1].world_from_camera, np.eye(4), atol=1e-12)
    assert np.allclose(models[0].world_from_camera, before[1].camera_from_world @ before[0].world_from_camera)


@pytest.mark.parametrize(("unit", "baseline_mm", "hint"), [("mm", 75.0, ""), ("cm", 750.0, ""), ("m", 75e3, "mm")])
def test_what_a_unit_implies_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str], unit: str, baseline_mm: float,
                                     hint: str) -> None:
    """Nothing tells millimetres from centimetres but a person who knows how far the cameras are apart."""
    source = tmp_path / "pair.yml"
    source.write_text(SIDE_BY_SIDE + "T: [-74.94, -3, 0]\n")
    words = ["calibrate", "import", str(source), "--size", "640x480", "--unit", unit]
    code = main(words)
    told = capsys.readouterr()
    assert (code, "--unit mm" in told.err) == ((0, False) if not hint else (2, True))
    if hint:
        return
    assert f"cam1 to cam2: {baseline_mm:.1f} mm" in told.out
    assert f"cam2 stands {baseline_mm / 25:.0f} mm lower than cam1" in told.out
    assert main([*words, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["baselines_mm"][0]["baseline_mm"] == pytest.approx(baseline_mm, rel=1e-4)
    assert said["cameras"][1]["height_mm"] == pytest.approx(-baseline_mm / 25, rel=1e-3)


def test_a_baseline_of_a_few_millimetres_names_the_unit_that_would_fit(tmp_path: Path,
                                                                     capsys: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / "pair.yml"
    source.write_text(SIDE_BY_SIDE + "T: [-0.075, 0, 0]\n")
    main(["calibrate", "import", str(source), "--size", "640x480", "--unit", "cm", "--json"])
    said = json.loads(capsys.readouterr().out)
    assert any("With --unit m they are 75 mm apart" in warning for warning in said["warnings"])


def test_the_files_world_can_be_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, out = tmp_path / "camera_array.toml", tmp_path / "rig.json"
    source.write_text(CALISCOPE)
    assert main(["calibrate", "import", str(source), "--keep-world", "--out", str(out)]) == 0
    made: Rig = load_rig(out)
    said = capsys.readouterr().out
    assert made.up == "z" and f"cam_0: {1e3 * made.nodes[0].pose.translation_m[2]:.0f} mm above" in said
    camera = CameraModel.from_rig(made.nodes[0].intrinsics, made.nodes[0].pose)
    assert np.allclose(camera.camera_from_world[:3, 3], (0.05666886720753522, 0.0029046886409570417,
                                                         0.8981482977014373), atol=1e-12)


def refused(arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    code = main(["calibrate", *arguments])
    said = capsys.readouterr().err
    assert code == 2 and {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    return said


def test_what_cannot_be_imported_leaves_everything_as_it_was(rig: Path, tmp_path: Path,
                                                             capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in (("a.toml", ANIPOSE), ("k.yaml", KALIBR_CHAIN), ("o.yml", OPENCV_CAMERA), ("r.yaml", ROS_CAMERA)):
        (tmp_path / name).write_text(text)
    where = ["--out", str(rig)]
    anipose = ["import", str(tmp_path / "a.toml")]
    for unit in ("m", "cm"):
        assert "With --unit mm" in refused([*anipose, "--unit", unit, "--out", str(tmp_path / "n.json")], tmp_path,
                                           capsys)
    (tmp_path / "k2.yaml").write_text(KALIBR_PINHOLES.replace("-0.11003785", "-110.03785"))
    assert "numbers are mm, they are 110" in refused(
        ["import", str(tmp_path / "k2.yaml"), "--out", str(tmp_path / "n.json")], tmp_path, capsys)
    assert "--camera" in refused([*anipose, "--unit", "mm", *where], tmp_path, capsys)
    assert "--camera" in refused([*anipose, "--unit", "mm", "--camera", "left=cam000", *where], tmp_path, capsys)
    assert "omni" in refused(["import", str(tmp_path / "k.yaml"), *where], tmp_path, capsys)
    assert "--camera" in refused(["import", str(tmp_path / "r.yaml"), "--rig-from", str(rig), *where], tmp_path, capsys)
    assert "640x480" in refused(["import", str(tmp_path / "o.yml"), "--size", "64x48", *where], tmp_path, capsys)
    assert "one lens" in refused([*anipose, "--unit", "mm", "--intrinsics", str(tmp_path / "i.json")], tmp_path, capsys)


def test_what_cannot_be_exported_is_said(rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, export = tmp_path / "out.yml", ["export", "--rig", str(rig)]
    to = ["--out", str(out)]
    assert "--unit" in refused([*export, "--format", "opencv", *to], tmp_path, capsys)
    assert "metres" in refused([*export, "--format", "kalibr", "--unit", "mm", *to], tmp_path, capsys)
    assert "left, right" in refused([*export, "--format", "kalibr", "--camera", "middle", *to], tmp_path, capsys)
    out.write_text("mine")
    assert "--force" in refused([*export, "--format", "kalibr", *to], tmp_path, capsys)
    assert "folder" in refused([*export, "--format", "ros", *to], tmp_path, capsys)
    assert main(["calibrate", *export, "--format", "ros", "--camera", "right", "--force", *to]) == 0
    assert "camera_name" in out.read_text()
