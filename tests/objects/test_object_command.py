"""``rhot object``: the pose in rendered images of a rig, and every mistake as a sentence with exit code 2."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from object_scenes import CUBE, wide_cameras
from tag_pictures import render

from rhot_app.__main__ import main
from rhot_app.estimation.se3 import exp_so3, log_so3, rotation_from_quaternion
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.object_file import ObjectMarker, ObjectModel, save_object
from rhot_app.project import Rig, load_rig, save_rig
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.files import resource_path

POSE = rigid(exp_so3([0.5, 0.35, 0.1]) @ exp_so3([np.pi, 0.0, 0.0]), [0.03, -0.02, 0.6])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An object, a rig of the twin's two cameras, and an image of each."""
    found, rng = tmp_path_factory.mktemp("object"), np.random.default_rng(1)
    scene = make_scene(twin_defaults(), 1)
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    nodes = tuple(msgspec.structs.replace(node, name=name, intrinsics=scene.intrinsics, pose=pose)
                  for node, name, pose in zip(rig.nodes, ("left", "right"), scene.poses, strict=True))
    save_rig(found / "rig.json", msgspec.structs.replace(rig, nodes=nodes))
    assert isinstance(rig, Rig)
    save_object(found / "cube.json", CUBE)
    for camera, name in zip(wide_cameras(), ("left", "right"), strict=True):
        cv2.imwrite(str(found / f"{name}.png"), render(CUBE, POSE, camera, rng))
    cv2.imwrite(str(found / "empty.png"), np.full((480, 640), 90, np.uint8))
    cv2.imwrite(str(found / "small.png"), np.full((48, 64), 90, np.uint8))
    (found / "text.png").write_text("no image")
    markers = tuple(ObjectMarker(name, place) for name, place in (
        ("red", (0.0, 0.0, 0.0)), ("green", (50.0, 0.0, 0.0)), ("blue", (0.0, 40.0, 0.0))))
    save_object(found / "painted.json", ObjectModel("painted", markers=markers))
    return found


def test_the_pose_in_images_is_that_of_the_picture(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["object", str(folder / "cube.json"), "--rig", str(folder / "rig.json"), "--json", "--images",
                 f"left={folder / 'left.png'}", f"right={folder / 'right.png'}"]) == 0
    fields = json.loads(capsys.readouterr().out)
    error = np.array(fields["translation_m"]) - POSE[:3, 3]
    turn = log_so3(rotation_from_quaternion(fields["rotation_wxyz"]) @ POSE[:3, :3].T)
    assert fields["validity"] == "tracked" and fields["points"] >= 12
    assert np.linalg.norm(error) < 1e-3 and np.degrees(np.linalg.norm(turn)) < 0.5
    assert np.linalg.norm(error) < 4.0 * np.linalg.norm(fields["translation_sd_m"])
    assert main(["object", str(folder / "cube.json"), "--rig", str(folder / "rig.json"), "--images",
                 f"left={folder / 'left.png'}"]) == 0
    assert "tracked" in capsys.readouterr().out


def test_a_file_alone_is_checked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["object", str(folder / "cube.json")]) == 0
    assert capsys.readouterr().out == "cube: 6 fiducials, 0 markers\n"


@pytest.mark.parametrize(("arguments", "says"), [
    (["nowhere.json"], "no such file"),
    (["rig.json"], 'not a "rhot-object" file'),
    (["cube.json", "--images", "left={}/left.png"], "--rig"),
    (["cube.json", "--rig", "{}/rig.json", "--images", "top={}/left.png"], "no camera 'top'"),
    (["cube.json", "--rig", "{}/rig.json", "--images", "left.png"], "CAMERA=IMAGE"),
    (["cube.json", "--rig", "{}/rig.json", "--images", "left={}/gone.png"], "cannot be read"),
    (["cube.json", "--rig", "{}/rig.json", "--images", "left={}/text.png"], "not a picture"),
    (["cube.json", "--rig", "{}/rig.json", "--images", "left={}/small.png"], "64 x 48 px"),
    (["cube.json", "--rig", "{}/rig.json", "--images", "left={}/empty.png"], "no tag of 'cube'"),
    (["cube.json", "--rig", "{}/rig.json", "--images", "left={}/left.png", "left={}/left.png"], "twice"),
    (["painted.json", "--rig", "{}/rig.json", "--images", "left={}/left.png"], "colour markers only"),
])
def test_mistakes_are_sentences(folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str],
                                says: str) -> None:
    file, *others = arguments
    assert main(["object", str(folder / file), *(one.replace("{}", str(folder)) for one in others)]) == 2
    shown = capsys.readouterr()
    assert says in shown.err and not shown.out
