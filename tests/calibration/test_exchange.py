"""Calibrations of other programs: what their files mean is proved on published ones, and all formats go out and back.

Points are projected by OpenCV with the numbers of the source, and by the camera that was read.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from published_cameras import (
    ANIPOSE,
    CALISCOPE,
    CALISCOPE_PIXELS,
    KALIBR_CHAIN,
    KALIBR_PINHOLES,
    OPENCV_CAMERA,
    OPENCV_PAIR,
    ROS_CAMERA,
    ROS_PAIR,
)

from rhot_app.calibration.commands.arguments import FORMAT_NAMES
from rhot_app.calibration.exchange.formats import FORMATS, read_files
from rhot_app.calibration.exchange.records import ForeignCamera, Stated
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import CameraModel, intrinsics_row, lens_parameters
from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.project import Intrinsics

Array = NDArray[np.float64]
Written = Callable[..., list[Path]]

CLOSE_PX = 1e-9


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """Writes texts as files of one ending."""
    def write(suffix: str, *texts: str) -> list[Path]:
        paths = [tmp_path / f"file{k}{suffix}" for k in range(len(texts))]
        for path, text in zip(paths, texts, strict=True):
            path.write_text(text)
        return paths
    return write


def model_of(camera: ForeignCamera) -> CameraModel:
    pose = np.eye(4) if camera.camera_from_world is None else camera.camera_from_world
    return CameraModel(camera.lens.width, camera.lens.height, intrinsics_row(lens_parameters(camera.lens)),
                       inverse(pose), pose)


def points_before(camera: ForeignCamera, distance: float = 1.0, count: int = 100) -> Array:
    """(N, 3) m, world, of which the camera sees all."""
    rng = np.random.default_rng(3)
    half = 0.3 * min(camera.lens.width / camera.lens.fx, camera.lens.height / camera.lens.fy)
    local = rng.uniform((-half, -half, 0.7), (half, half, 1.3), (count, 3)) * distance
    pose = np.eye(4) if camera.camera_from_world is None else camera.camera_from_world
    return (local - pose[:3, 3]) @ pose[:3, :3]


def assert_projects(camera: ForeignCamera, matrix: Sequence[Sequence[float]], distortion: Sequence[float],
                    rotation: Sequence[float] = (0.0, 0.0, 0.0), translation: Sequence[float] = (0.0, 0.0, 0.0),
                    unit_m: float = 1.0) -> None:
    """100 points where OpenCV projects them with the source's own numbers."""
    points = points_before(camera)
    theirs, _ = cv2.projectPoints(points / unit_m, np.array(rotation), np.array(translation), np.array(matrix),
                                  np.array(distortion))
    assert np.abs(model_of(camera).project(points) - theirs[:, 0]).max() < CLOSE_PX


def test_the_commands_name_every_format() -> None:
    assert tuple(FORMATS) == FORMAT_NAMES


# -- published files ---------------------------------------------------------------------------------------------------

def test_opencvs_sample_of_one_camera(written: Written) -> None:
    paths = written(".yml", OPENCV_CAMERA)
    name, (camera,) = read_files(paths, Stated())
    assert (name, camera.camera_from_world, camera.lens.width) == ("opencv", None, 640)
    stored = cv2.FileStorage(str(paths[0]), cv2.FILE_STORAGE_READ)
    assert_projects(camera, stored.getNode("camera_matrix").mat(), stored.getNode("distortion_coefficients").mat())


def test_opencvs_sample_of_a_pair_with_the_extrinsics_that_opencv_writes(written: Written, tmp_path: Path) -> None:
    """R and T as stereoCalibrate gives them take the left camera's coordinates to the right one's."""
    (intrinsics,) = written(".yml", OPENCV_PAIR)
    rotation, shift = exp_so3([0.01, -0.02, 0.03]), np.array([[-4.1], [0.05], [0.02]])
    out = cv2.FileStorage(str(tmp_path / "extrinsics.yml"), cv2.FILE_STORAGE_WRITE)
    out.write("R", rotation)
    out.write("T", shift)
    out.release()
    name, (left, right) = read_files([intrinsics, tmp_path / "extrinsics.yml"], Stated((640, 480), 0.025))
    theirs = cv2.FileStorage(str(intrinsics), cv2.FILE_STORAGE_READ)
    assert name == "opencv" and np.array_equal(left.camera_from_world, np.eye(4))
    assert_projects(left, theirs.getNode("M1").mat(), theirs.getNode("D1").mat())
    assert_projects(right, theirs.getNode("M2").mat(), theirs.getNode("D2").mat(),
                    cv2.Rodrigues(rotation)[0].ravel(), shift.ravel(), 0.025)


def test_ros_sample(written: Written) -> None:
    name, (camera,) = read_files(written(".yaml", ROS_CAMERA), Stated())
    stated = yaml.safe_load(ROS_CAMERA)
    assert (name, camera.name) == ("ros", "08144361026320a0")
    assert_projects(camera, np.reshape(stated["camera_matrix"]["data"], (3, 3)).tolist(),
                    stated["distortion_coefficients"]["data"])


def test_a_ros_pair_stands_as_opencvs_rectification_says(written: Written) -> None:
    """camera_calibration writes what cv2.stereoRectify gives: pixels of a point agree in the rectified rows."""
    size, matrix = (640, 480), np.array([[535.9, 0.0, 342.3], [0.0, 535.9, 235.6], [0.0, 0.0, 1.0]])
    distortion, rotation, shift = np.array([-0.27, 0.05, 1e-3, -3e-4, 0.0]), exp_so3([0.02, 0.05, -0.01]), np.array(
        [-0.12, 0.003, 0.001])
    r1, r2, p1, p2, *_ = cv2.stereoRectify(matrix, distortion, matrix, distortion, size, rotation, shift)
    texts = [yaml.safe_dump({"image_width": 640, "image_height": 480, "camera_name": f"narrow_stereo/{name}",
                             "distortion_model": "plumb_bob", **{key: {
                                 "rows": value.shape[0], "cols": value.shape[1], "data": value.ravel().tolist()}
                                 for key, value in (("camera_matrix", matrix), ("rectification_matrix", r),
                                                    ("projection_matrix", p),
                                                    ("distortion_coefficients", distortion[None]))}})
             for name, r, p in (("left", r1, p1), ("right", r2, p2))]
    _, (left, right) = read_files(written(".yaml", *texts), Stated())
    assert left.camera_from_world is not None and right.camera_from_world is not None
    second_from_first = right.camera_from_world @ inverse(left.camera_from_world)
    assert np.allclose(second_from_first, rigid(rotation, shift), atol=1e-12)
    point = points_before(left, 0.8)
    rows = [cv2.undistortPoints(model_of(camera).project(point)[:, None], matrix, distortion, R=r, P=p)[:, 0, 1]
            for camera, r, p in ((left, r1, p1), (right, r2, p2))]
    assert np.allclose(*rows, atol=1e-3)  # OpenCV's iteration ends there
    with pytest.raises(CalibrationError, match="second camera"):
        read_files(written(".yaml", texts[1]), Stated())


def test_a_published_ros_pair_is_what_opencv_rectifies_like_that(written: Written) -> None:
    """From the poses that are read cv2.stereoRectify makes the published R of both cameras, and P's shift. Transposed,
    or with the other sign of the shift, it makes others."""
    _, (left, right) = read_files(written(".yaml", *ROS_PAIR), Stated())
    stated = [yaml.safe_load(text) for text in ROS_PAIR]
    k, d, r, p = ([np.reshape(one[key]["data"], shape) for one in stated] for key, shape in (
        ("camera_matrix", (3, 3)), ("distortion_coefficients", (-1,)), ("rectification_matrix", (3, 3)),
        ("projection_matrix", (3, 4))))
    assert left.camera_from_world is not None and right.camera_from_world is not None
    right_from_left = right.camera_from_world @ inverse(left.camera_from_world)
    r1, r2, p1, p2, *_ = cv2.stereoRectify(k[0], d[0], k[1], d[1], (640, 480), right_from_left[:3, :3],
                                           right_from_left[:3, 3])
    assert np.allclose(r1, r[0], atol=1e-8) and np.allclose(r2, r[1], atol=1e-8)
    assert p2[0, 3] / p2[0, 0] == pytest.approx(p[1][0, 3] / p[1][0, 0]) == pytest.approx(-0.0896949)
    for camera, matrix, lens, turn, shift in zip((left, right), k, d, r, (0.0, p[1][0, 3] / p[1][0, 0]), strict=True):
        assert_projects(camera, matrix.tolist(), lens.tolist(), cv2.Rodrigues(turn.T)[0].ravel(),
                        turn.T @ np.array([shift, 0.0, 0.0]))
    assert p1[0, 3] == 0.0


def test_kalibrs_chain_agrees_with_where_the_imu_is(written: Written) -> None:
    """Each camera of the published example also states the pose of one IMU, in the other direction it would be
    220 mm off."""
    name, (first, second) = read_files(written(".yaml", KALIBR_PINHOLES), Stated())
    assert (name, first.name, second.name) == ("kalibr", "cam0", "cam1")
    stated = yaml.safe_load(KALIBR_CHAIN)
    imu = [np.array(stated[key]["T_cam_imu"]) for key in ("cam0", "cam1")]
    assert first.camera_from_world is not None and second.camera_from_world is not None
    assert np.allclose(second.camera_from_world @ inverse(first.camera_from_world) @ imu[0], imu[1], atol=1e-6)
    stated["cam1"]["intrinsics"] = stated["cam1"]["intrinsics"][1:]  # of the pinhole that replaces the omni lens
    for camera, key in ((first, "cam0"), (second, "cam1")):
        fx, fy, cx, cy = stated[key]["intrinsics"]
        pose = np.array(stated[key].get("T_cn_cnm1", np.eye(4)))
        assert_projects(camera, [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], stated[key]["distortion_coeffs"],
                        cv2.Rodrigues(pose[:3, :3])[0].ravel(), pose[:3, 3])


def test_an_anipose_file_projects_as_opencv_does_with_its_numbers(written: Written) -> None:
    name, cameras = read_files(written(".toml", ANIPOSE), Stated(unit_m=1e-3))
    assert (name, [camera.name for camera in cameras]) == ("anipose", ["cam088", "cam091", "cam581", "cam592"])
    for camera, stated in zip(cameras, list(tomllib.loads(ANIPOSE).values())[:-1], strict=True):
        assert_projects(camera, stated["matrix"], stated["distortions"], stated["rotation"], stated["translation"],
                        1e-3)


def test_one_corner_that_three_cameras_of_caliscope_saw_is_one_point(written: Written) -> None:
    """With poses in the other direction its images miss by hundreds of pixels."""
    name, cameras = read_files(written(".toml", CALISCOPE), Stated())
    assert (name, [camera.name for camera in cameras]) == ("caliscope", ["cam_0", "cam_1", "cam_2"])
    for camera, stated in zip(cameras, tomllib.loads(CALISCOPE)["cameras"].values(), strict=True):
        assert_projects(camera, stated["matrix"], stated["distortions"], stated["rotation"], stated["translation"])
    models = [model_of(camera) for camera in cameras]
    rays = np.array([model.undistort(np.array([pixel]))[0]
                     for model, pixel in zip(models, CALISCOPE_PIXELS, strict=True)])
    rows = np.concatenate([ray[:, None] * model.camera_from_world[2] - model.camera_from_world[:2]
                           for ray, model in zip(rays, models, strict=True)])
    point = np.linalg.svd(rows)[2][-1]
    off = [np.linalg.norm(model.project(point[None, :3] / point[3])[0] - pixel)
           for model, pixel in zip(models, CALISCOPE_PIXELS, strict=True)]
    assert max(off) < 0.5


# -- out and back ------------------------------------------------------------------------------------------------------

def cameras_for(form: str, numbers: Sequence[float], wide: bool) -> list[ForeignCamera]:
    """As many cameras as a format holds, up to three."""
    few = form == "kalibr"
    distortion = (-0.2 + 0.1 * numbers[0], 0.05 * numbers[1], 1e-3 * numbers[2], 1e-3 * numbers[3],
                  0.0 if few else 0.02 * numbers[4])
    if wide and not few:
        distortion += (0.1 + 0.05 * numbers[0], 0.02, 1e-3 * numbers[1])
    lens = Intrinsics(640, 480, 500.0 + 50.0 * numbers[0], 505.0, 319.5 + numbers[1], 239.5 - numbers[2], distortion)
    poses = [rigid(exp_so3(0.3 * np.array(numbers[:3])), numbers[3:6]),
             rigid(exp_so3([0.02 * numbers[0], 0.3, 0.01]), (-0.3, 0.02 * numbers[3], 0.05)),
             rigid(exp_so3([0.0, 0.5, 0.1 * numbers[5]]), (0.4, 0.1, 0.2))]
    if form == "caliscope":
        names = ["cam_0", "cam_1", "cam_2"]
    elif form == "opencv":
        names = ["cam1", "cam2"]
    else:
        names = ["left", "upper right", "other"]
    return [ForeignCamera(name, lens, pose) for name, pose in zip(names, poses[:FORMATS[form].most], strict=False)]


@pytest.mark.parametrize("form", FORMATS)
@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), st.booleans())
@settings(max_examples=25, deadline=None)
def test_cameras_come_back_as_they_went_out(tmp_path_factory: pytest.TempPathFactory, form: str,
                                            numbers: list[float], wide: bool) -> None:
    cameras = cameras_for(form, numbers, wide)
    folder = tmp_path_factory.mktemp("out")
    texts = FORMATS[form].write(cameras, 1.0 if FORMATS[form].states_unit else 1e-3)
    paths = [folder / f"file{k}{FORMATS[form].suffix}" for k in range(len(texts))]
    for path, text in zip(paths, texts.values(), strict=True):
        path.write_text(text)
    name, back = read_files(paths, Stated(unit_m=None if FORMATS[form].states_unit else 1e-3))
    assert name == form and [camera.name for camera in back] == [camera.name for camera in cameras]
    to_theirs = inverse(back[0].camera_from_world) @ cameras[0].camera_from_world
    for mine, theirs in zip(cameras, back, strict=True):
        points = points_before(mine)
        there = model_of(theirs).project(points @ to_theirs[:3, :3].T + to_theirs[:3, 3])
        assert theirs.lens == mine.lens
        assert np.abs(there - model_of(mine).project(points)).max() < CLOSE_PX


def test_opencv_reads_what_is_written(tmp_path: Path) -> None:
    cameras = cameras_for("opencv", [0.5, -0.3, 0.1, 1e-9, 0.2, 0.7], wide=True)
    (text,) = FORMATS["opencv"].write(cameras, 1e-3).values()
    (tmp_path / "pair.yml").write_text(text)
    stored = cv2.FileStorage(str(tmp_path / "pair.yml"), cv2.FILE_STORAGE_READ)
    assert np.array_equal(stored.getNode("M1").mat(), cameras[0].matrix)
    assert np.array_equal(stored.getNode("D2").mat()[0], cameras[1].distortion)
    second_from_first = cameras[1].camera_from_world @ inverse(cameras[0].camera_from_world)
    assert np.allclose(stored.getNode("T").mat()[:, 0], 1e3 * second_from_first[:3, 3], rtol=1e-14)


# -- what is refused ---------------------------------------------------------------------------------------------------

def refused(paths: list[Path], stated: Stated | None = None) -> str:
    """The sentence; anipose's lengths are said to be mm where nothing else is stated."""
    if stated is None:
        stated = Stated(unit_m=1e-3 if "[cam_" in paths[0].read_text() else None)
    with pytest.raises(CalibrationError) as caught:
        read_files(paths, stated)
    assert paths[-1].name in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(("suffix", "text", "model"), [
    (".yaml", KALIBR_CHAIN, "omni"),
    *((".yaml", KALIBR_CHAIN.replace("omni", model), model) for model in ("ds", "eucm")),
    *((".yaml", KALIBR_CHAIN.replace("radtan", model), model) for model in ("equidistant", "fov")),
    (".yaml", ROS_CAMERA.replace("plumb_bob", "equidistant"), "equidistant"),
    (".yaml", ROS_CAMERA.replace("plumb_bob", "thin_prism_fisheye"), "thin_prism_fisheye"),
    (".yml", OPENCV_CAMERA + "fisheye_model: 1\n", "fisheye"),
    (".yml", OPENCV_CAMERA.replace("2.3839153080878486e-01 ]", "0., 0., 0., 0., 1e-3, 0., 0., 0. ]").replace(
        "rows: 5", "rows: 12"), "thin prism"),
    (".toml", ANIPOSE.replace('name = "cam091"', 'name = "cam091"\nfisheye = true'), "fisheye"),
    (".toml", CALISCOPE.replace("port = 1", "port = 1\nfisheye = true"), "fisheye"),
])
def test_a_model_that_rhot_does_not_have_is_refused_by_its_name(written: Written, suffix: str, text: str,
                                                                model: str) -> None:
    assert repr(model) in refused(written(suffix, text))


def test_a_lens_that_kalibr_does_not_have_is_not_written_as_another() -> None:
    (camera, *_) = cameras_for("opencv", [0.1] * 6, wide=True)
    with pytest.raises(CalibrationError, match="k3"):
        FORMATS["kalibr"].write([camera], 1.0)


@pytest.mark.parametrize(("suffix", "text", "words"), [
    (".yml", OPENCV_CAMERA.replace("camera_matrix", "camera_matrices"), "known"),
    (".yml", OPENCV_CAMERA.replace("distortion_coefficients", "distortion"), "distortion_coefficients is missing"),
    (".yml", OPENCV_CAMERA.replace("-2.6637260909660682e-01", ".Nan"), "finite"),
    (".yml", OPENCV_CAMERA.replace("-2.6637260909660682e-01", "much"), "finite"),
    (".yml", OPENCV_CAMERA.replace("5.3591573396163199e+02, 0., 3.42", "5.3591573396163199e+02, 7., 3.42"), "skew"),
    (".yml", OPENCV_CAMERA.replace("5.3591573396163199e+02", "-5.3591573396163199e+02"), "lens"),
    (".yml", OPENCV_CAMERA.replace("image_width: 640", "image_width: 6.5"), "whole"),
    (".yml", OPENCV_CAMERA.replace("image_width: 640", "image_width: 640\nimage_width: 640"), "twice"),
    (".yml", OPENCV_CAMERA.replace("rows: 3", "rows: 2"), "2x3"),
    (".yml", "<?xml version='1.0'?><opencv_storage/>", "XML"),
    (".yaml", ROS_CAMERA.replace("[-1.04482, 1.59252", "[1.59252"), "numbers"),
    (".yaml", ROS_CAMERA + "---\n" + ROS_CAMERA, "document"),
    (".yaml", KALIBR_PINHOLES.replace("0.99998854", "1.99998854"), "rotation"),
    (".yaml", KALIBR_PINHOLES.replace("[ 0.99998854, 0.00216014, 0.00427195", "[-0.99998854, 0, 0"), "rotation"),
    (".yaml", KALIBR_PINHOLES.replace("T_cn_cnm1", "T_cnm1_cn"), "T_cn_cnm1 is missing"),
    (".yaml", KALIBR_PINHOLES.replace("cam1:", "cam2:"), "cam1 is missing"),
    (".yaml", KALIBR_PINHOLES.replace("[752, 480]", "[0, 480]"), "lens"),
    (".toml", ANIPOSE.replace("2.5517119183276713", "nan"), "finite"),
    (".toml", ANIPOSE.replace("rotation = [ -0.0017222068652836759, ", "rotation = [ "), "2 numbers"),
    (".toml", ANIPOSE.replace('"cam091"', '"cam088"'), "cam088"),
    (".toml", "[metadata]\nerror = 1.0\n", "camera"),
    (".toml", "[cam_0", "TOML"),
    (".toml", "a = " + "[" * 5000 + "]" * 5000, "deep"),
    (".toml", "a" + " . a" * 100_000 + "=1", "parts"),
    (".yaml", "a: [1, 2", "YAML"),
    (".yaml", "just words", "table"),
    (".yaml", "a: &x [1]\nb: *x", "alias"),
    (".yaml", "a: " + "[" * 50 + "]" * 50, "deep"),
    (".yaml", "a: " + "[" * 5000 + "]" * 5000, "nesting"),
    (".yaml", "x" * (1 << 20) + "yz", "MiB"),
])
def test_what_is_wrong_is_a_sentence(written: Written, suffix: str, text: str, words: str) -> None:
    assert words in refused(written(suffix, text))


def test_no_alias_unfolds_and_no_tag_makes_an_object(written: Written) -> None:
    """Nine lines that would be three billion strings, and one that would start a program."""
    bomb = "a0: &a0 [lol]\n" + "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 10))
    assert "alias" in refused(written(".yaml", bomb))
    refused(written(".yaml", "camera_matrix: !!python/object/apply:os.abort []\n"))


def test_what_a_format_does_not_say_is_asked_for(written: Written, tmp_path: Path) -> None:
    pair = OPENCV_PAIR + "R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [-75, 0, 0]\n"
    assert "--size" in refused(written(".yml", pair), Stated())
    assert "640x480" in refused(written(".yml", OPENCV_CAMERA), Stated((641, 480)))
    assert "--unit" in refused(written(".toml", ANIPOSE), Stated())
    assert "--unit" in refused(written(".toml", CALISCOPE), Stated(unit_m=1e-3))  # it is in metres
    paths = [*written(".yaml", ROS_CAMERA), tmp_path / "chain.yaml"]
    paths[1].write_text(KALIBR_PINHOLES)
    assert "one calibration" in refused(paths)


def test_the_distances_of_an_anipose_rig_are_in_metres(written: Written) -> None:
    """Stated in millimetres, the four cameras stand some metres around a mouse; all look at one place."""
    _, cameras = read_files(written(".toml", ANIPOSE), Stated(unit_m=1e-3))
    models = [model_of(camera) for camera in cameras]
    apart = [float(np.linalg.norm(a.centre - b.centre)) for a, b in itertools.combinations(models, 2)]
    assert min(apart) > 0.5 and max(apart) < 3.0
    axes = np.array([model.world_from_camera[:3, 2] for model in models])
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    place = np.linalg.solve(across.sum(axis=0), (across @ np.array([m.centre for m in models])[..., None]).sum(axis=0))
    assert all(np.isfinite(model.project(place.T)).all() for model in models)
    assert math.sqrt(float(np.mean([np.sum((c @ (place[:, 0] - m.centre))**2)
                                    for c, m in zip(across, models, strict=True)]))) < 0.1
