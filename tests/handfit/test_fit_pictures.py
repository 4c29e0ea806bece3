"""Pictures for a fit: what is none, or none of a camera, is refused in a sentence."""

import cv2
import msgspec
import numpy as np
import pytest
from fit_scenes import drawn

from rhot_app.errors import CalibrationError
from rhot_app.handfit.pictures import require_calibrated
from rhot_app.handfit.session import HandFit
from rhot_app.ui.handfit.files import read_instant


@pytest.fixture
def files(tmp_path):
    rig, _, images = drawn()
    paths = []
    for name, image in zip(("a.png", "b.png"), images, strict=True):
        cv2.imwrite(str(tmp_path / name), image[:, :, ::-1])
        paths.append(str(tmp_path / name))
    return rig, paths


def test_pictures_are_in_the_order_of_the_cameras_or_named(files):
    rig, (first, second) = files
    for given in ([first, second], [f"camera 2={second}", f"camera 1={first}"]):
        found = read_instant(rig, given)
        for camera, image in enumerate(drawn()[2]):
            assert np.array_equal(found[camera], image)
    assert set(read_instant(rig, [f"camera 2={second}"])) == {1}


@pytest.mark.parametrize(("second", "choose"), [(-2.0, "a later one"), (9.0, "an earlier one")])
def test_a_second_that_no_video_shows_is_refused(tmp_path, second, choose):
    rig, _, images = drawn()
    height, width = images[0].shape[:2]
    writer = cv2.VideoWriter(str(tmp_path / "a.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (width, height))
    for _ in range(3):
        writer.write(images[0])
    writer.release()
    with pytest.raises(CalibrationError, match=choose):
        read_instant(rig, [str(tmp_path / "a.avi")], second)


def test_what_is_no_picture_of_a_camera_is_said(files, tmp_path):
    rig, (first, second) = files
    (tmp_path / "notes.txt").write_text("no picture")
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((240, 320, 3), np.uint8))
    for given, sentence in (([str(tmp_path / "notes.txt")], "is not a picture"),
                            ([str(tmp_path / "none.png")], "cannot be read"),
                            ([str(tmp_path)], "cannot be read"),
                            ([str(tmp_path / "small.png")], "320 x 240 px.*calibrated at 640 x 480"),
                            ([first, second, first], "one picture more"),
                            (["up=left.avi"], "there is no camera 'up'"),
                            ([first, f"camera 1={first}"], "two pictures"), ([], "No picture was given")):
        with pytest.raises(CalibrationError, match=sentence):
            read_instant(rig, given)


def test_uncalibrated_cameras_are_refused(files):
    rig, _ = files
    bare = msgspec.structs.replace(rig, calibration=None)
    with pytest.raises(CalibrationError, match="No camera of this rig is calibrated"):
        HandFit(bare)
    disparity = msgspec.structs.replace(rig, depth=type(rig.depth)(mode="disparity"))
    with pytest.raises(CalibrationError, match="No camera of this rig is calibrated"):
        require_calibrated(disparity)
    assert require_calibrated(rig) == ""


def test_no_picture_at_all_is_said():
    fit = HandFit(drawn()[0])
    with pytest.raises(CalibrationError, match="No camera gave a picture"):
        fit.add_pictures({})
