"""Webcams, with OpenCV's capture replaced: settings, refusals, times, latest frame, unplugging."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import rhot_node.capture.webcam
from rhot_node.capture.v4l2 import Automatics
from rhot_node.capture.webcam import Webcam
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError

SETTINGS = CameraSettings(width=64, height=48, exposure_us=4000, gain=2.0, red_gain=1.5, row_time_us=50)
CLOCK = NodeClock(offset_ns=10**14)
SILENT = Automatics()


class FakeCapture:
    """Delivers one image per release of `gate`, or freely when there is none."""

    def __init__(self, *, opened: bool = True, refuses: frozenset[int] = frozenset(), period_s: float = 0.01) -> None:
        self.opened = opened
        self.refuses = refuses
        self.period_s = period_s
        self.settings: dict[int, float] = {}
        self.size = (48, 64)
        self.works = True
        self.hold = threading.Event()
        self.hold.set()
        self.reads = 0
        self.released = False
        self.stamp_ms: Callable[[], float] = lambda: 0.0  # as a driver without stamps

    def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
        return self.opened

    def set(self, propId: int, value: float) -> bool:  # noqa: N803 - OpenCV's name
        if propId in self.refuses:
            return False
        self.settings[propId] = value
        return True

    def get(self, propId: int) -> float:  # noqa: N803 - OpenCV's name
        if propId == cv2.CAP_PROP_FPS:
            return self.settings[propId]
        assert propId == cv2.CAP_PROP_POS_MSEC
        return self.stamp_ms()

    def read(self) -> tuple[bool, Any]:
        self.hold.wait(5.0)
        time.sleep(self.period_s)
        self.reads += 1
        return self.works, np.full((*self.size, 3), self.reads % 256, np.uint8) if self.works else None

    def release(self) -> None:
        self.released = True


@pytest.fixture
def plug(tmp_path: Path) -> Callable[..., Webcam]:
    device = tmp_path / "video0"
    device.touch()
    return lambda capture, said=SILENT: Webcam(str(device), SETTINGS, CLOCK, lambda _device: capture,
                                                   lambda _device: said)


def test_automatic_modes_are_off_and_given_settings_on(plug: Callable[[FakeCapture], Webcam]) -> None:
    capture = FakeCapture()
    camera = plug(capture)
    assert camera.refused == ()
    assert capture.settings[cv2.CAP_PROP_AUTO_EXPOSURE] == 1 and capture.settings[cv2.CAP_PROP_AUTO_WB] == 0
    assert capture.settings[cv2.CAP_PROP_EXPOSURE] == 40 and capture.settings[cv2.CAP_PROP_GAIN] == 2.0
    assert capture.settings[cv2.CAP_PROP_WHITE_BALANCE_RED_V] == 1.5
    assert cv2.CAP_PROP_SATURATION not in capture.settings, "what is not given stays as the camera has it"
    order = list(capture.settings)
    assert order.index(cv2.CAP_PROP_AUTO_EXPOSURE) < order.index(cv2.CAP_PROP_EXPOSURE)
    camera.close()
    assert capture.released


def test_refused_settings_are_reported(plug: Callable[[FakeCapture], Webcam],
                                       caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        camera = plug(FakeCapture(refuses=frozenset({cv2.CAP_PROP_AUTO_WB, cv2.CAP_PROP_GAIN})))
    assert camera.refused == ("automatic white balance off", "gain")
    assert "does not take the setting gain" in caplog.text
    camera.close()


def test_what_a_driver_takes_and_does_not_do_is_told(plug: Callable[..., Webcam]) -> None:
    camera = plug(FakeCapture(), Automatics(exposure=True, white_balance=False, exposure_us=66_000.0))
    assert camera.refused == ("automatic exposure off",)
    assert camera.report() == {"fps": 30.0, "exposure_us": 66_000.0, "automatic_exposure": True,
                               "refused": ["automatic exposure off"]}
    camera.close()
    manual = plug(FakeCapture(), Automatics(exposure=False, white_balance=False))
    assert manual.refused == ()
    manual.close()


def test_mid_exposure_is_before_readout_and_half_the_exposure(plug: Callable[[FakeCapture], Webcam]) -> None:
    camera = plug(FakeCapture())
    frame = camera.read(1.0)
    assert frame is not None and camera.size == (64, 48) == frame.image.size
    assert frame.t_available_node_ns - frame.t_node_ns == 2_000_000 + 47 * 50_000
    assert 0 <= CLOCK.now_ns() - frame.t_available_node_ns < 10**9
    camera.close()


@pytest.mark.parametrize(("clock_ms", "believed"), [
    (lambda: 1e3 * time.monotonic() - 30.0, True), (lambda: 1e3 * time.time(), False),
    (lambda: 1e3 * time.monotonic() + 500.0, False), (lambda: 1e3 * time.monotonic() - 5e3, False)])
def test_the_drivers_time_is_used_where_it_is_of_the_same_clock(
        plug: Callable[[FakeCapture], Webcam], clock_ms: Callable[[], float], believed: bool) -> None:
    capture = FakeCapture()
    capture.stamp_ms = clock_ms
    camera = plug(capture)
    frame = camera.read(1.0)
    assert frame is not None
    behind_ns = frame.t_available_node_ns - frame.t_node_ns  # began 30 ms before, its middle 2 ms later
    if believed:
        assert 28_000_000 <= behind_ns < 2_000_000_000
    else:
        assert behind_ns == 2_000_000 + 47 * 50_000
    camera.close()


def test_a_slow_reader_gets_the_newest_frame_and_sees_the_gap(plug: Callable[[FakeCapture], Webcam]) -> None:
    camera = plug(FakeCapture())
    first = camera.read(1.0)
    time.sleep(0.2)
    late = camera.read(1.0)
    assert first is not None and late is not None
    assert late.number >= first.number + 5
    assert int(late.image.y[0, 0]) == pytest.approx(late.number + 1, abs=1)
    camera.close()


def test_nothing_in_time_is_none(plug: Callable[[FakeCapture], Webcam]) -> None:
    capture = FakeCapture()
    camera = plug(capture)
    capture.hold.clear()
    time.sleep(0.05)
    camera.read(0.0)
    assert camera.read(0.02) is None
    capture.hold.set()
    assert camera.read(1.0) is not None
    camera.close()


def test_a_camera_that_hangs_is_an_error(plug: Callable[[FakeCapture], Webcam],
                                         monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhot_node.capture.webcam, "SILENCE_S", 0.1)
    capture = FakeCapture()
    camera = plug(capture)
    capture.hold.clear()
    with pytest.raises(CameraError, match="no frame for"):
        for _ in range(10):
            camera.read(0.05)
    capture.hold.set()
    camera.close()


@pytest.mark.parametrize(("change", "value", "words"), [
    ("works", False, "stopped delivering"), ("size", (96, 128), "size changed from 64 x 48 to 128 x 96")])
def test_a_camera_that_stops_or_changes_its_size_is_an_error(plug: Callable[[FakeCapture], Webcam], change: str,
                                                             value: object, words: str) -> None:
    capture = FakeCapture()
    camera = plug(capture)
    setattr(capture, change, value)
    with pytest.raises(CameraError, match=words):
        for _ in range(10):
            camera.read(1.0)
    camera.close()


def test_another_size_than_asked_for_is_reported(plug: Callable[[FakeCapture], Webcam],
                                                 caplog: pytest.LogCaptureFixture) -> None:
    capture = FakeCapture()
    capture.size = (96, 128)
    with caplog.at_level(logging.WARNING):
        camera = plug(capture)
    assert camera.size == (128, 96) and "128 x 96 px instead of 64 x 48" in caplog.text
    camera.close()


def test_a_busy_camera_is_named(plug: Callable[[FakeCapture], Webcam]) -> None:
    capture = FakeCapture(opened=False)
    with pytest.raises(CameraError, match="Does another program use it"):
        plug(capture)
    assert capture.released


def test_a_camera_without_a_first_frame_is_named(plug: Callable[[FakeCapture], Webcam],
                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhot_node.capture.webcam, "FIRST_FRAME_S", 0.05)
    capture = FakeCapture()
    capture.works = False
    with pytest.raises(CameraError, match="no frame came"):
        plug(capture)


def test_an_absent_camera_is_named(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match="no such camera"):
        Webcam(str(tmp_path / "video9"), SETTINGS, CLOCK, lambda _device: FakeCapture())
