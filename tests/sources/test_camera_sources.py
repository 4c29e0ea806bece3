"""What people name as cameras: what can be opened, and a sentence for what cannot."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_app.errors import SourceError
from rhot_app.sources.cameras.camera_set import CameraSource, film_remarks, names_of
from rhot_app.sources.cameras.camera_source import check_source, check_sources
from rhot_node.capture.v4l2 import Device, Mode


def film(path: Path, size: tuple[int, int] = (64, 48), fps: float = 30.0, frames: int = 6) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, size)
    for number in range(frames):
        writer.write(np.full((size[1], size[0], 3), 20 * number, np.uint8))
    writer.release()
    return path


def refused(*texts: object, look=lambda path: None) -> str:
    with pytest.raises(SourceError) as caught:
        check_sources([str(text) for text in texts], look)
    return str(caught.value)


def test_a_film_says_its_size_rate_and_length(tmp_path: Path) -> None:
    source = check_source(str(film(tmp_path / "left.avi", (66, 49), 25.0, 10)))
    assert (source.width, source.height) == (66, 48), "a node cuts an odd row off"
    assert source.fps == pytest.approx(25.0) and source.seconds == pytest.approx(0.4)


def test_a_folder_of_pictures_is_a_film(tmp_path: Path) -> None:
    for number in range(3):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.zeros((48, 64, 3), np.uint8))
    source = check_source(str(tmp_path))
    assert (source.width, source.height, source.seconds) == (64, 48, pytest.approx(0.1))


def test_a_webcam_is_opened_in_its_mode() -> None:
    device = Device("/dev/video3", "HD Webcam", modes=(Mode(640, 480, 30.0), Mode(1920, 1080, 30.0)))
    source = check_source("3", lambda path: device if path == Path("/dev/video3") else None)
    assert source == CameraSource("/dev/video3", "HD Webcam", 640, 480, 30.0)


def test_a_camera_that_cannot_be_used_is_refused(tmp_path: Path) -> None:
    held = Device("/dev/video0", "HD Webcam", problem="Another program uses this camera.")
    assert "Another program" in refused("0", look=lambda path: held)
    assert "no such camera" in refused("7")
    assert "no such film" in refused(tmp_path / "none.mp4")
    assert "Name one camera" in refused()
    (tmp_path / "text.mp4").write_text("no film at all\n" * 100)
    assert "no film" in refused(tmp_path / "text.mp4")
    (tmp_path / "empty").mkdir()
    assert "no pictures" in refused(tmp_path / "empty")
    assert "question mark" in refused(film(tmp_path / "what?.avi"))
    assert "no address" in refused("ftp://10.0.0.1/film")
    assert "at most" in refused(*range(17))


def test_a_camera_named_twice_is_refused(tmp_path: Path) -> None:
    path = film(tmp_path / "left.avi")
    (tmp_path / "link.avi").symlink_to(path)
    assert "twice" in refused(path, tmp_path / "link.avi")
    device = Device("/dev/video0", "HD Webcam")
    assert "twice" in refused("0", "/dev/video0", look=lambda path: device)


def test_films_of_different_lengths_are_told() -> None:
    def lasting(seconds: float | None, fps: float = 30.0) -> CameraSource:
        return CameraSource(f"{seconds}.mp4", f"{seconds}.mp4", 64, 48, fps, seconds)
    assert film_remarks([lasting(4.0), lasting(4.01)]) == []
    assert film_remarks([lasting(4.0)]) == film_remarks([lasting(None), lasting(None)]) == []
    assert film_remarks([lasting(4.0), lasting(4.0, 60.0)]) == [], "rates may differ: frames have times"
    told, = film_remarks([lasting(4.0), lasting(3.8)])
    assert "4.00" in told and "3.80" in told and "same length" in told
    assert "mixed" in film_remarks([lasting(4.0), lasting(None)])[0]


def test_every_camera_has_a_name_of_its_own() -> None:
    def named(title: str, seconds: float | None = 1.0) -> CameraSource:
        return CameraSource(title, title, 64, 48, 30.0, seconds)
    assert names_of([named("left.mp4"), named("HD Webcam", None), named("left.avi"), named("a/ü*.mp4")]) == [
        "left", "camera 2", "left 3", "ü_"]
