"""Pi cameras, with picamera2 replaced by a faithful fake: modes, controls, buffers, times, gaps, errors."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import numpy as np
import picamera2_fake
import pytest
from picamera2_fake import GLOBAL_SHUTTER, Sensor, libcamera, plug_in
from shipped_markers import RHOT6

import rhot_node.capture.pi_camera
import rhot_node.detect.image
from rhot_node.capture.camera import Frame
from rhot_node.capture.open import open_camera
from rhot_node.capture.pi_camera import CameraStack, PiCamera, load_stack
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.detect.fast import FastDetector
from rhot_node.detectors import warm_up_image
from rhot_node.errors import CameraError

CLOCK = NodeClock(offset_ns=10**14)
SETTINGS = CameraSettings(fps=40, exposure_us=4000, gain=2.0, red_gain=1.5, blue_gain=1.8)
Open = Callable[..., tuple[PiCamera, Any]]


@pytest.fixture
def plug() -> Iterator[Open]:
    """Opens a PiCamera on a fake sensor; returns both the camera and picamera2's own object. Closes them at the end."""
    cameras = []

    def open_it(sensor: Sensor | None = None, settings: CameraSettings = SETTINGS) -> tuple[PiCamera, Any]:
        module = plug_in(sensor or Sensor())
        cameras.append(PiCamera(0, settings, CLOCK, lambda: CameraStack(module, libcamera)))
        return cameras[-1], module.Picamera2.opened[0]

    yield open_it
    for camera in cameras:
        camera.close()


def with_preset(**changes: Any) -> CameraSettings:
    return CameraSettings(**{"fps": 40, "exposure_us": 4000, "gain": 2.0, "red_gain": 1.5, "blue_gain": 1.8, **changes})


def next_frame(camera: PiCamera, fake: Any, frames: int = 1) -> Frame:
    fake.complete(frames)
    frame = camera.read(1.0)
    assert frame is not None
    return frame


def test_the_stream_is_yuv420_alone_in_full_range_without_a_queue(plug: Open) -> None:
    _, fake = plug()
    config = fake.camera_configuration()
    assert config["main"]["format"] == "YUV420" and config["main"]["size"] == (640, 480)
    assert config["raw"] is None and config["lores"] is None and config["queue"] is False
    assert config["display"] is None and config["encode"] is None
    assert config["sensor"] == {"output_size": (1640, 1232), "bit_depth": 10}
    assert config["colour_space"].name == "sYCC"


def test_automatic_modes_are_off_and_given_settings_on(plug: Open) -> None:
    camera, fake = plug()
    assert fake.controls == {
        "AeEnable": False, "AwbEnable": False, "NoiseReductionMode": "noise off",
        "FrameDurationLimits": (25_000, 25_000), "ExposureTime": 4000, "AnalogueGain": 2.0, "ColourGains": (1.5, 1.8)}
    assert camera.report()["refused"] == [] and camera.report()["sync"] == "off"


def test_what_cannot_be_had_is_reported(plug: Open, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        camera, fake = plug(Sensor(sync=False), with_preset(fps=120, gain=40, blue_gain=None, sync="client"))
    refused = " | ".join(camera.report()["refused"])
    assert fake.controls["FrameDurationLimits"] == (23_895, 23_895) and "the sensor's mode gives 41.8" in refused
    assert fake.controls["AnalogueGain"] == 10.666667 and "gain 40 (set to 10.6667)" in refused
    assert "ColourGains" not in fake.controls and "both or none" in refused
    assert camera.report()["sync"] == "unavailable" and "sync client" in refused
    assert "does not take the setting fps 120" in caplog.text


@pytest.mark.parametrize(("preset", "mode", "fps_max", "angle", "row_us"), [
    (None, [1640, 1232], 41.85, 62.2, 48.4), ("wide", [1640, 1232], 41.85, 62.2, 48.4),
    ("fast", [640, 480], 206.65, 26.5, 9.45)])
def test_presets_tell_their_rate_view_and_row_time(plug: Open, preset: str | None, mode: list[int], fps_max: float,
                                                   angle: float, row_us: float) -> None:
    camera, fake = plug(settings=with_preset(preset=preset))
    report = camera.report()
    assert (report["preset"], report["sensor"], report["sensor_mode"]) == (preset or "wide", "imx219", mode)
    assert report["fps_max"] == pytest.approx(fps_max, abs=0.01)
    assert report["view_angle_deg"] == pytest.approx(angle, abs=0.05)
    frame = next_frame(camera, fake)
    assert frame.row_time_ns == pytest.approx(1000 * row_us, rel=2e-3)
    assert report["row_time_us"] == frame.row_time_ns / 1000


def test_a_slower_driver_is_believed(plug: Open) -> None:
    """Half the pixel clock in the same mode, as some kernels have it."""
    sensor = Sensor()
    sensor.modes[640, 480] = picamera2_fake.Mode((1000, 752, 1280, 960), 9_678)
    camera, _ = plug(sensor, with_preset(preset="fast", fps=120))
    assert camera.report()["fps"] == pytest.approx(103.3, abs=0.1)
    assert camera.report()["row_time_us"] == pytest.approx(18.9, abs=0.02)


def test_a_global_shutter_exposes_all_rows_at_once(plug: Open) -> None:
    camera, fake = plug(Sensor("imx296", dict(GLOBAL_SHUTTER)), with_preset(width=728, height=544, fps=60))
    frame = next_frame(camera, fake)
    report = camera.report()
    assert frame.row_time_ns == 0
    assert (report["preset"], report["view_angle_deg"]) == ("global", None), "its lens is bought separately"


def test_an_unknown_sensor_goes_by_its_settings(plug: Open) -> None:
    camera, fake = plug(Sensor("imx708"), with_preset(row_time_us=30))
    frame = next_frame(camera, fake)
    assert frame.row_time_ns == 30_000
    assert camera.report()["preset"] is None


def test_a_row_time_set_by_hand_counts(plug: Open) -> None:
    camera, _ = plug(settings=with_preset(row_time_us=47.5))
    assert camera.report()["row_time_us"] == 47.5


@pytest.mark.parametrize(("changes", "correction_ns"), [
    ({}, -2_000_000), ({"timestamp_marks": "exposure"}, 2_000_000), ({"timestamp_offset_us": -300.0}, -2_300_000)])
def test_times_are_mid_exposures_of_row_0(plug: Open, changes: dict[str, Any], correction_ns: int) -> None:
    camera, fake = plug(settings=with_preset(preset="fast", **changes))
    frame = next_frame(camera, fake)
    assert frame.exposure_ns == 4_000_000
    assert frame.t_node_ns == CLOCK.from_host_ns(fake.now_ns + correction_ns)


def test_the_first_image_row_of_a_scaled_mode_is_read_a_little_later(plug: Open) -> None:
    """1640 x 1232 shown as 640 x 480: one row is cut off, and the first image row is the mean of 2.56 sensor rows."""
    camera, fake = plug()
    frame = next_frame(camera, fake)
    late_ns = frame.t_node_ns - CLOCK.from_host_ns(fake.now_ns - 2_000_000)
    assert late_ns == pytest.approx(18_904 * (1.0 + 0.5 * 1.5625), abs=100)


@pytest.mark.parametrize("width", [640, 600])
def test_the_image_is_the_buffer_itself_without_its_padding(plug: Open, width: int) -> None:
    camera, fake = plug(settings=with_preset(width=width, preset="fast"))
    fake.image = np.arange(width * 480 * 3 // 2, dtype=np.uint32).astype(np.uint8)
    frame = next_frame(camera, fake)
    assert frame.image.size == (width, 480) == camera.size
    planes = np.concatenate([frame.image.y.ravel(), frame.image.u.ravel(), frame.image.v.ravel()])
    assert np.array_equal(planes, fake.image)
    memories = [np.frombuffer(buffer.memory, np.uint8) for buffer in fake.buffers]
    assert any(np.shares_memory(frame.image.u, memory) for memory in memories), "the image was copied"
    assert frame.image.y.flags.c_contiguous == (width == 640)
    del frame, memories


def test_a_native_frame_reaches_the_detector_unconverted(plug: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    camera, fake = plug()
    picture = warm_up_image(RHOT6, (640, 480))
    fake.image = np.concatenate([picture.y.ravel(), picture.u.ravel(), picture.v.ravel()])

    def refuse(*_args: object, **_options: object) -> None:
        raise AssertionError("a frame was converted")

    monkeypatch.setattr(rhot_node.detect.image.cv2, "cvtColor", refuse)
    frame = next_frame(camera, fake)
    seen = FastDetector(RHOT6).detect(frame.image)
    assert all(mark.found for mark in seen)
    assert fake.full_metadata_reads == 0
    del frame


def test_the_newest_frame_is_read_and_gaps_are_counted(plug: Open) -> None:
    camera, fake = plug()
    first = next_frame(camera, fake)
    for _ in range(2):
        fake.complete()
    second = next_frame(camera, fake)
    third = next_frame(camera, fake, frames=4)  # of which three never came
    assert [frame.number - first.number for frame in (second, third)] == [3, 7]
    assert camera.report()["lost_by_camera"] == 3
    assert camera.read(0.0) is None


def test_buffers_go_back_to_the_camera(plug: Open) -> None:
    camera, fake = plug()
    frame = None
    for _ in range(50):
        fake.complete()
        frame = next_frame(camera, fake)
        assert sum(not buffer.free for buffer in fake.buffers) == 1, "only the reader's frame is in use"
    fake.complete()
    del frame
    camera.close()
    camera.close()
    assert not fake.is_open and all(buffer.free for buffer in fake.buffers)


def test_sync_is_asked_for_and_reported(plug: Open) -> None:
    camera, fake = plug(settings=with_preset(sync="server"))
    assert fake.controls["SyncMode"] == "sync server"
    assert camera.report()["sync"] == "waiting"
    fake.metadata = {"SyncReady": True, "SyncTimer": -12}
    fake.complete()
    camera.read(1.0)
    report = camera.report()
    assert (report["sync"], report["sync_role"]) == ("synchronised", "server")


def test_a_camera_that_falls_silent_is_an_error(plug: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhot_node.capture.pi_camera, "SILENCE_S", 0.0)
    camera, _ = plug()
    with pytest.raises(CameraError, match="cable"):
        for _ in range(3):
            camera.read(0.001)


@pytest.mark.parametrize(("sensor", "changes", "words"), [
    (Sensor(busy=True), {}, "another program"),
    (Sensor(broken_mode=True), {}, "Invalid camera configuration"),
    (Sensor(silent=True), {}, "no frame came"),
    (Sensor("imx296", dict(GLOBAL_SHUTTER)), {"preset": "fast"}, 'an imx296, which has: "global"'),
    (Sensor("imx708"), {"preset": "wide"}, "has: none")])
def test_what_is_wrong_is_said_and_the_camera_closed(monkeypatch: pytest.MonkeyPatch, sensor: Sensor,
                                                     changes: dict[str, Any], words: str) -> None:
    monkeypatch.setattr(rhot_node.capture.pi_camera, "FIRST_FRAME_S", 0.01)
    module = plug_in(sensor)
    with pytest.raises(CameraError, match=words):
        PiCamera(0, with_preset(**changes), CLOCK, lambda: CameraStack(module, libcamera))
    assert not any(fake.is_open for fake in module.Picamera2.opened)


def test_a_camera_that_is_not_there_is_named_with_those_that_are() -> None:
    module = plug_in(Sensor())
    with pytest.raises(CameraError, match=r"Pi camera 1: no such camera \(present: 0: imx219\)"):
        PiCamera(1, SETTINGS, CLOCK, lambda: CameraStack(module, libcamera))


def test_without_picamera2_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "libcamera", ModuleType("libcamera"))
    monkeypatch.setitem(sys.modules, "picamera2", None)
    with pytest.raises(CameraError, match=r"apt install .*python3-picamera2.*--system-site-packages"):
        open_camera("pi", SETTINGS, CLOCK)


def test_a_picamera2_built_for_another_numpy_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_args: object, **_options: object) -> None:
        raise ValueError("numpy.dtype size changed, may indicate binary incompatibility")

    monkeypatch.setattr("builtins.__import__", broken)
    with pytest.raises(CameraError, match=r"numpy 1; .*node-bookworm\.txt"):
        load_stack()
