"""Camera specs: files and folders played at their rate or as fast as possible, and every way they can be wrong."""

from __future__ import annotations

import os
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from patience import quickest

from rhot_node.capture.camera import Camera, EndOfRecording, Frame
from rhot_node.capture.open import data_set_settings, open_camera
from rhot_node.capture.yuv import YuvWriter
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError

SETTINGS = CameraSettings(fps=50, exposure_us=4000, row_time_us=50)
PERIOD_NS = 20_000_000
CLOCK = NodeClock(offset_ns=10**14)


def write_images(folder: Path, count: int, size: tuple[int, int] = (64, 48)) -> Path:
    folder.mkdir(exist_ok=True)
    for k in range(count):
        cv2.imwrite(str(folder / f"{k:03d}.png"), np.full((size[1], size[0], 3), 10 * k % 256, np.uint8))
    return folder


def write_video(path: Path, count: int, fps: float = 25.0) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, (64, 48))
    for k in range(count):
        writer.write(np.full((48, 64, 3), 20 * k, np.uint8))
    writer.release()
    return path


def read_all(camera: Camera) -> list[Frame]:
    frames = []
    with pytest.raises(EndOfRecording):
        while True:
            frame = camera.read(1.0)
            assert frame is not None
            frames.append(frame)
    camera.close()
    return frames


def level(frame: Frame) -> int:
    return int(np.median(frame.image.y))


def test_a_folder_plays_at_the_settings_rate(tmp_path: Path) -> None:
    write_images(tmp_path / "images", 6)
    (tmp_path / "images" / "notes.txt").write_text("not an image")
    camera = open_camera(str(tmp_path / "images"), SETTINGS, CLOCK)
    assert camera.size == (64, 48)
    frames = read_all(camera)
    numbers = [frame.number for frame in frames]
    assert numbers[0] == 0 and numbers[-1] == 5
    assert [level(frame) for frame in frames] == [10 * number for number in numbers]
    assert np.diff([frame.t_node_ns for frame in frames]).tolist() == (np.diff(numbers) * PERIOD_NS).tolist()
    assert all(frame.t_available_node_ns - frame.t_node_ns == 2_000_000 + 47 * 50_000 for frame in frames)
    assert all((frame.exposure_ns, frame.row_time_ns) == (4_000_000, 50_000) for frame in frames)


def test_a_late_reader_of_a_file_gets_the_newest_frame(tmp_path: Path) -> None:
    camera = open_camera(str(write_images(tmp_path / "images", 120)), SETTINGS, CLOCK)
    camera.read(1.0)
    time.sleep(0.11)
    frame = camera.read(1.0)
    assert frame is not None and frame.number >= 5 and level(frame) == (10 * frame.number) % 256


def test_as_fast_as_possible_delivers_every_frame(tmp_path: Path) -> None:
    spec = f"{write_images(tmp_path / 'images', 20)}?rate=max"
    frames: list[Frame] = []

    def play() -> None:
        frames[:] = read_all(open_camera(spec, SETTINGS, CLOCK))
        assert [frame.number for frame in frames] == list(range(20))

    own_rate_s = 20 * PERIOD_NS * 1e-9
    assert quickest(play, own_rate_s) < own_rate_s
    assert abs(frames[-1].t_available_node_ns - CLOCK.now_ns()) < 10**9


def test_a_video_plays_at_its_own_rate(tmp_path: Path) -> None:
    frames = read_all(open_camera(str(write_video(tmp_path / "video.avi", 5)), SETTINGS, CLOCK))
    numbers = [frame.number for frame in frames]
    assert numbers[-1] == 4
    assert np.diff([frame.t_node_ns for frame in frames]).tolist() == (np.diff(numbers) * 40_000_000).tolist()
    assert [level(frame) for frame in frames] == pytest.approx([20 * number for number in numbers], abs=4)


@pytest.mark.parametrize("kind", ["images", "video.avi"])
def test_files_can_be_played_again(tmp_path: Path, kind: str) -> None:
    path = write_images(tmp_path / kind, 3) if kind == "images" else write_video(tmp_path / kind, 3)
    camera = open_camera(f"{path}?rate=max", SETTINGS, CLOCK)
    for _ in range(3):
        camera.read(1.0)
    with pytest.raises(EndOfRecording):
        camera.read(1.0)
    camera.rewind()  # type: ignore[attr-defined]
    again = read_all(camera)
    assert [frame.number for frame in again] == [3, 4, 5]
    assert level(again[0]) < level(again[2])


def test_a_single_image_is_one_frame(tmp_path: Path) -> None:
    path = write_images(tmp_path / "images", 1) / "000.png"
    assert len(read_all(open_camera(str(path), SETTINGS, CLOCK))) == 1


def test_odd_images_are_cut_to_even_ones(tmp_path: Path) -> None:
    camera = open_camera(str(write_images(tmp_path / "images", 1, (65, 49))), SETTINGS, CLOCK)
    assert camera.size == (64, 48)


def test_a_timeout_keeps_the_frame(tmp_path: Path) -> None:
    camera = open_camera(str(write_images(tmp_path / "images", 3)), CameraSettings(fps=5), CLOCK)
    camera.read(1.0)
    assert camera.read(0.01) is None
    frame = camera.read(1.0)
    assert frame is not None and frame.number == 1


def test_a_yuv_recording_is_played(tmp_path: Path) -> None:
    with YuvWriter(tmp_path / "recording", 32, 16, 0, 0) as writer:
        writer.append(0, np.zeros(32 * 16 * 3 // 2, np.uint8))
    camera = open_camera(f"yuv:{tmp_path / 'recording'}", SETTINGS, CLOCK)
    assert camera.size == (32, 16) and len(read_all(camera)) == 1


def waiting_camera(kind: str, folder: Path, start: Path) -> Camera:
    """Four frames, 20 ms apart, of the levels 0, 20, 40 and 60, that wait for a start file."""
    if kind == "yuv":
        with YuvWriter(folder / "yuv", 64, 48, 4_000_000, 50_000) as writer:
            for k in range(4):
                writer.append(k * PERIOD_NS, np.full(64 * 48 * 3 // 2, 20 * k, np.uint8))
        return open_camera(f"yuv:{folder / 'yuv'}?start={start}", SETTINGS, CLOCK)
    return open_camera(f"{write_video(folder / 'video.avi', 4, fps=50.0)}?start={start}", SETTINGS, CLOCK)


def put(start: Path, text: str) -> None:
    """Write a start file whole."""
    written = start.with_suffix(".new")
    written.write_text(text)
    written.rename(start)


def read(camera: Camera) -> Frame:
    frame = camera.read(1.0)
    assert frame is not None
    return frame


KINDS = pytest.mark.parametrize("kind", ["yuv", "video"])


@KINDS
def test_stands_still_until_the_start_file_says_when(tmp_path: Path, kind: str) -> None:
    start = tmp_path / "start"
    camera = waiting_camera(kind, tmp_path, start)
    still = [read(camera) for _ in range(3)]
    assert still[-1].number >= 2
    assert all(level(frame) == 0 for frame in still)
    t0_ns = time.monotonic_ns() + 90_000_000
    put(start, f"{t0_ns}\n")
    frames = read_all(camera)
    t0_node_ns = CLOCK.from_host_ns(t0_ns)
    playing = [frame for frame in frames if frame.t_node_ns >= t0_node_ns]
    indices = [round(level(frame) / 20) for frame in playing]
    assert indices[-1] == 3 and indices == sorted(set(indices)), "a reader that comes late misses frames, no more"
    assert [frame.t_node_ns - t0_node_ns for frame in playing] == [k * PERIOD_NS for k in indices]
    assert np.diff([frame.number for frame in playing]).tolist() == np.diff(indices).tolist()
    standing = [frame for frame in frames if frame.t_node_ns < t0_node_ns]
    assert standing and standing[-1].t_node_ns < t0_node_ns - PERIOD_NS // 2
    assert (np.diff([frame.number for frame in still + frames]) > 0).all()


@KINDS
def test_who_waits_too_long_is_in_step_and_gets_the_last_frame(tmp_path: Path, kind: str) -> None:
    start = tmp_path / "start"
    camera = waiting_camera(kind, tmp_path, start)
    read(camera)
    t0_ns = time.monotonic_ns() - 10 * PERIOD_NS
    put(start, str(t0_ns))
    [last] = read_all(camera)
    assert last.t_node_ns == CLOCK.from_host_ns(t0_ns + 3 * PERIOD_NS) and round(level(last) / 20) == 3


def test_a_film_that_is_read_too_late_can_be_played_again(tmp_path: Path) -> None:
    camera = open_camera(str(write_video(tmp_path / "video.avi", 4, fps=50.0)), SETTINGS, CLOCK)
    read(camera)
    for last in (3, 7):
        time.sleep(5e-9 * PERIOD_NS)
        frame = read(camera)
        assert frame.number == last and round(level(frame) / 20) == 3
        with pytest.raises(EndOfRecording):
            camera.read(0.1)
        camera.rewind()  # type: ignore[attr-defined]


@KINDS
def test_an_absurd_start_file_is_named(tmp_path: Path, kind: str) -> None:
    start = tmp_path / "start"
    camera = waiting_camera(kind, tmp_path, start)
    start.write_text("")
    assert read(camera).number == 0, "an empty file is one that is being written"
    start.write_text("tomorrow")
    with pytest.raises(CameraError, match="tomorrow"):
        camera.read(0.1)


def test_recordings_and_twins_bring_their_own_settings() -> None:
    assert data_set_settings("0") and data_set_settings("folder") and data_set_settings("stream:socket")
    assert not data_set_settings("yuv:folder")


@pytest.mark.parametrize(("image", "words"), [
    (cv2.imencode(".png", np.zeros((48, 32, 3), np.uint8))[1].tobytes(),
     "frame 1 has 32 x 48 px, the first one has 64 x 48"),
    (b"\x89PNG and then nothing", r"001\.png is not a picture")], ids=["another size", "broken"])
def test_an_image_that_does_not_fit_is_named(tmp_path: Path, image: bytes, words: str) -> None:
    write_images(tmp_path / "images", 2)
    (tmp_path / "images" / "001.png").write_bytes(image)
    camera = open_camera(f"{tmp_path / 'images'}?rate=max", SETTINGS, CLOCK)
    camera.read(1.0)
    with pytest.raises(CameraError, match=words):
        camera.read(1.0)


def test_only_files_and_cameras_are_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.avi")
    write_images(tmp_path / "images", 2)
    os.mkfifo(tmp_path / "images" / "000.jpg")
    with YuvWriter(tmp_path / "recording", 32, 16, 0, 0) as writer:
        writer.append(0, np.zeros(32 * 16 * 3 // 2, np.uint8))
    os.mkfifo(tmp_path / "start")
    wrong = {
        "/dev/null": "is no camera", "/dev/shm": "is no camera", str(tmp_path / "pipe.avi"): "it is a pipe",
        str(tmp_path / "images"): r"000\.jpg cannot be read \(it is a pipe",
    }
    for spec, sentence in wrong.items():
        with pytest.raises(CameraError, match=sentence):
            open_camera(spec, SETTINGS, CLOCK)
    camera = open_camera(f"yuv:{tmp_path / 'recording'}?start={tmp_path / 'start'}", SETTINGS, CLOCK)
    with pytest.raises(CameraError, match="it is a pipe"):
        camera.read(0.1)


def test_what_cannot_be_opened_is_named(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.avi").write_text("no video")
    (tmp_path / "cut.png").write_bytes(b"\x89PNG")
    write_video(tmp_path / "zero.avi", 0)
    wrong = {
        "/dev/video99": "/dev/video99: no such camera", "99": "/dev/video99: no such camera",
        str(tmp_path / "gone.avi"): "no such file", str(tmp_path / "empty"): "a folder without images",
        str(tmp_path / "text.avi"): r"text\.avi: not a video", str(tmp_path / "cut.png"): r"cut\.png is not a picture",
        str(tmp_path / "zero.avi"): r"zero\.avi", f"yuv:{tmp_path / 'gone'}": "no such folder",
        f"yuv:{tmp_path}?rate=max": "takes \\?start=", f"{tmp_path / 'empty'}?begin=x": "takes .*rate=.*start=",
        f"{tmp_path / 'empty'}?start=": "is not known", f"{tmp_path / 'gone.avi'}?start=x": "no such file",
        f"{tmp_path / 'empty'}?start=x&rate=max": "Leave out",
        f"{tmp_path / 'empty'}?rate=2": "the only rate is max", "": "names no file", "?rate=max": "names no file",
    }
    for spec, sentence in wrong.items():
        with pytest.raises(CameraError, match=sentence):
            open_camera(spec, SETTINGS, CLOCK)
