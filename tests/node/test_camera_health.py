"""Why a camera is slow: the dark, a long exposure, or neither; and which automatic modes stay on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from node_fakes import grey_image

from rhot_node.capture.camera import Frame
from rhot_node.capture.v4l2 import Device, Mode
from rhot_node.commands.doctor_command import check_webcams
from rhot_node.errors import CameraError
from rhot_node.health.camera import RateMeter, camera_troubles, check_automatic, check_rate

DARK, BRIGHT = 40.0, 130.0


@pytest.mark.parametrize(("rate_hz", "luma", "said", "code"), [
    (15.0, DARK, {}, "too_dark"),
    (15.0, BRIGHT, {"automatic": True, "exposure_us": 66_000.0}, "too_dark"),  # it brightens what it exposes longer
    (15.0, BRIGHT, {}, "slow"),
    (15.0, BRIGHT, {"automatic": True, "exposure_us": 8_000.0}, "slow"),
    (15.0, BRIGHT, {"automatic": False, "exposure_us": 66_000.0}, "slow"),
    (30.0, DARK, {}, "rate"), (30.0, DARK, {"automatic": True, "exposure_us": 33_000.0}, "rate"),
    (30.0, BRIGHT, {}, "rate"), (None, DARK, {}, "rate")])
def test_why_a_camera_is_slow(rate_hz: float | None, luma: float, said: dict[str, Any], code: str) -> None:
    check = check_rate(rate_hz, 30.0, luma, **said)
    assert check.code == code and check.is_trouble == (code != "rate")
    assert ("dark" in check.sentence) == (code == "too_dark")
    if code == "too_dark":
        assert "more light" in check.remedy and "33 ms" in check.remedy


def test_the_rate_is_the_cameras_and_not_its_readers() -> None:
    meter = RateMeter()
    for number in range(0, 90, 6):  # a reader that takes every sixth frame
        meter.add(number, number * 33_333_333)
    assert meter.rate_hz == pytest.approx(30.0, rel=1e-3)
    meter.add(0, 0)
    assert meter.rate_hz is None, "it was opened again"


def test_automatic_modes_that_stay_on() -> None:
    assert check_automatic(["gain", "red_gain"]) is None
    check = check_automatic(["automatic exposure off", "automatic white balance off"])
    assert check is not None and "exposure and white balance" in check.text and check.remedy


def test_a_camera_without_a_rate_of_its_own_is_not_called_slow() -> None:
    assert camera_troubles({}, 5.0, DARK) == []
    assert [check.code for check in camera_troubles({"fps": 30.0}, 5.0, DARK)] == ["too_dark"]


class Webcam:
    """Delivers grey pictures at a rate, without waiting."""

    def __init__(self, hz: float, luma: int, error: str = "") -> None:
        self.hz, self.image, self.error, self.closed = hz, grey_image(luma), error, False
        self.numbers: Iterator[int] = iter(range(1_000))
        self.size = self.image.size

    def read(self, _timeout_s: float) -> Frame:
        if self.error:
            raise CameraError(self.error)
        number = next(self.numbers)
        t_ns = round(1e9 * number / self.hz)
        return Frame(self.image, number, t_ns, t_ns, 0, 0)

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize(("camera", "code"), [
    (Webcam(15.0, 40), "too_dark"), (Webcam(15.0, 130), "slow"), (Webcam(30.0, 40), "webcam"),
    (Webcam(30.0, 130), "webcam"), (Webcam(15.0, 5), "black"), (Webcam(1.0, 1, "/dev/video0: busy."), "webcam")])
def test_the_doctor_looks_at_each_webcam(tmp_path: Path, camera: Webcam, code: str) -> None:
    device = Device("/dev/video0", "HD Webcam", modes=(Mode(640, 480, 30.0),))
    check, = check_webcams([device], lambda path, settings, clock: camera)
    assert check.code == code and "/dev/video0" in check.text and camera.closed
    assert check.level == ("error" if camera.error else "ok" if code == "webcam" else "warning")


def test_the_doctor_leaves_a_camera_alone_that_another_program_holds() -> None:
    check, = check_webcams([Device("/dev/video0", "HD Webcam", problem="Another program uses this camera.")])
    assert check.level == "unknown" and "Another program" in check.text
