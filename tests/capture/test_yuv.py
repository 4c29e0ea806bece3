"""Recordings of raw frames: written whole, refused when broken, played in real time."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from patience import quickest

from rhot_node.capture.camera import EndOfRecording, Frame
from rhot_node.capture.yuv import FRAMES_NAME, HEADER_NAME, YuvRecording, YuvWriter
from rhot_node.clock import NodeClock
from rhot_node.errors import CameraError

WIDTH, HEIGHT, EXPOSURE_NS, ROW_TIME_NS = 32, 16, 4_000_000, 100_000
PERIOD_NS = 20_000_000
DELAY_NS = EXPOSURE_NS // 2 + (HEIGHT - 1) * ROW_TIME_NS


def record(folder: Path, frames: int, period_ns: int = PERIOD_NS) -> Path:
    with YuvWriter(folder, WIDTH, HEIGHT, EXPOSURE_NS, ROW_TIME_NS) as writer:
        for k in range(frames):
            writer.append(k * period_ns, np.full(WIDTH * HEIGHT * 3 // 2, k, dtype=np.uint8))
    return folder


def read(camera: YuvRecording, timeout_s: float = 1.0) -> Frame:
    frame = camera.read(timeout_s)
    assert frame is not None
    return frame


def test_frames_come_at_their_time_with_their_pixels(tmp_path: Path) -> None:
    clock = NodeClock(offset_ns=5_000_000_000_000, drift_ppm=40.0)
    opened_ns = time.monotonic_ns()
    camera = YuvRecording(record(tmp_path, 5), clock)
    assert camera.size == (WIDTH, HEIGHT)
    stamps: list[int] = []
    numbers: list[int] = []
    while not numbers or numbers[-1] < 4:
        frame = read(camera)
        now_ns = clock.now_ns()
        numbers.append(k := frame.number)
        assert frame.image.y.shape == (HEIGHT, WIDTH)
        assert (frame.image.y == k).all() and (frame.image.u == k).all() and (frame.image.v == k).all()
        assert frame.image.y.flags.writeable, "read-only views would compile every detector a second time"
        assert frame.t_available_node_ns - frame.t_node_ns == pytest.approx(DELAY_NS, rel=1e-4)
        assert frame.t_available_node_ns <= now_ns + 1000
        stamps.append(frame.t_node_ns)
    assert np.diff(stamps) == pytest.approx(np.diff(numbers) * PERIOD_NS * (1 + 40e-6), abs=2)
    assert stamps[0] >= clock.from_host_ns(opened_ns)
    with pytest.raises(EndOfRecording):
        camera.read(0.0)
    camera.close()
    camera.close()


def test_a_late_reader_gets_the_newest_frame_and_sees_the_gap(tmp_path: Path) -> None:
    camera = YuvRecording(record(tmp_path, 250), NodeClock())
    first = read(camera).number
    time.sleep(5.5 * PERIOD_NS * 1e-9)
    late = read(camera)
    assert late.number >= first + 4
    assert int(late.image.y[0, 0]) == late.number


def test_read_returns_none_when_nothing_is_due_in_time(tmp_path: Path) -> None:
    camera = YuvRecording(record(tmp_path, 3, period_ns=100 * 10**9), NodeClock())
    read(camera)
    assert quickest(lambda: camera.read(0.02) is None or pytest.fail("a frame came"), 0.2, times=3) < 0.2


def test_rewind_goes_on_without_a_pause(tmp_path: Path) -> None:
    camera = YuvRecording(record(tmp_path, 3), NodeClock())
    first = read(camera)
    camera.rewind()
    second = read(camera)
    assert second.number == 3 and (second.image.y == 0).all()
    assert second.t_node_ns - first.t_node_ns == 3 * PERIOD_NS


def test_a_recording_without_close_is_no_recording(tmp_path: Path) -> None:
    writer = YuvWriter(tmp_path, WIDTH, HEIGHT, EXPOSURE_NS, ROW_TIME_NS)
    writer.append(0, np.zeros(WIDTH * HEIGHT * 3 // 2, dtype=np.uint8))
    with pytest.raises(CameraError, match=HEADER_NAME):
        YuvRecording(tmp_path, NodeClock())
    writer.close()
    YuvRecording(tmp_path, NodeClock()).close()


def test_an_error_while_writing_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="increase"), YuvWriter(tmp_path, WIDTH, HEIGHT, 0, 0) as writer:
        frame = np.zeros(WIDTH * HEIGHT * 3 // 2, dtype=np.uint8)
        writer.append(10, frame)
        writer.append(10, frame)
    assert not list(tmp_path.iterdir())


def test_writer_refuses_a_frame_of_another_size(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="768 uint8"), YuvWriter(tmp_path, WIDTH, HEIGHT, 0, 0) as writer:
        writer.append(0, np.zeros(10, dtype=np.uint8))


def test_a_recording_without_frames_is_refused(tmp_path: Path) -> None:
    record(tmp_path, 0)
    with pytest.raises(CameraError, match="no frames"):
        YuvRecording(tmp_path, NodeClock())


def test_a_shortened_recording_is_refused(tmp_path: Path) -> None:
    path = record(tmp_path, 3) / FRAMES_NAME
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(CameraError, match="incomplete"):
        YuvRecording(tmp_path, NodeClock())


@pytest.mark.parametrize(("old", "new"), [("rhot-yuv", "rhot-rig"), ('"version": 1', '"version": 9'),
                                          ('"width": 32', '"width": 31'), ("{", "")])
def test_a_broken_header_is_named(tmp_path: Path, old: str, new: str) -> None:
    path = record(tmp_path, 3) / HEADER_NAME
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(CameraError, match=HEADER_NAME):
        YuvRecording(tmp_path, NodeClock())
