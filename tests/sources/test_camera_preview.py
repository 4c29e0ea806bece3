"""Cameras that are looked at before they are chosen: the rate that comes, black and green pictures, and faults."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest
from patience import eventually

from rhot_app.sources.cameras.camera_set import CameraSource
from rhot_app.sources.cameras.camera_source import CameraPreview, fault_of
from rhot_node.capture.camera import EndOfRecording, Frame
from rhot_node.detect.image import YuvImage, from_bgr
from rhot_node.errors import CameraError

SOURCE = CameraSource("0", "HD Webcam", 64, 48, 30.0)


def picture(level: int = 120, noise: float = 8.0) -> YuvImage:
    grey = np.random.default_rng(1).normal(level, noise, (48, 64, 3))
    return from_bgr(np.clip(grey, 0, 255).astype(np.uint8))


class FakeCamera:
    """Delivers `image` at `hz`; ends after `frames` until it is rewound, or vanishes with `error`."""

    def __init__(self, image: YuvImage, hz: float = 30.0, frames: int | None = None, error: str = "") -> None:
        self.image, self.hz, self.frames, self.error = image, hz, frames, error
        self.size, self.never = image.size, threading.Event()
        self.count, self.rewound, self.closed = 0, 0, False
        self.refused: list[str] = []

    def read(self, _timeout_s: float) -> Frame:
        if self.frames is not None and self.count >= self.frames:
            if self.error:
                raise CameraError(self.error)
            raise EndOfRecording
        self.never.wait(1.0 / self.hz)  # as a camera lets its reader wait
        self.count += 1
        return Frame(self.image, self.count, 0, 0, 0, 0)

    def rewind(self) -> None:
        self.rewound, self.count = self.rewound + 1, 0

    def report(self) -> dict[str, object]:
        return {"refused": self.refused}

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def look() -> Iterator[object]:
    """Looks at a fake camera, and away at the end."""
    previews: list[CameraPreview] = []

    def begin(camera: FakeCamera) -> CameraPreview:
        previews.append(CameraPreview(SOURCE, None, lambda spec, settings, clock: camera))
        return previews[-1]
    yield begin
    for preview in previews:
        preview.stop()
        assert preview.wait()


def test_a_slow_camera_is_told_with_what_to_do(look) -> None:
    preview = look(FakeCamera(picture(50), hz=5.0))
    assert preview.rate_hz is None and preview.remark == "", "nothing is said before it is measured"
    eventually(lambda: preview.rate_hz is not None)
    assert preview.rate_hz < 6.0 and "more light" in preview.remark and preview.picture.shape == (48, 64, 3)


def test_automatic_modes_that_stay_on_are_told(look) -> None:
    camera = FakeCamera(picture(), hz=200.0)
    camera.refused = ["gain", "automatic white balance off"]
    preview = look(camera)
    eventually(lambda: "white balance cannot be turned off" in preview.remark)
    assert "exposure" not in preview.remark


def test_a_film_begins_again_and_a_camera_is_let_go_of(look) -> None:
    camera = FakeCamera(picture(), hz=200.0, frames=3)
    preview = look(camera)
    eventually(lambda: camera.rewound > 2)
    preview.stop()
    assert preview.wait() and camera.closed and preview.problem == ""


def test_a_camera_that_vanishes_or_cannot_be_opened_says_why(look) -> None:
    preview = look(FakeCamera(picture(), hz=200.0, frames=2, error="/dev/video0: stopped delivering frames."))
    eventually(lambda: "stopped delivering" in preview.problem)

    def refuse(spec: str, settings: object, clock: object) -> FakeCamera:
        raise CameraError("/dev/video0: cannot be opened.")
    held = CameraPreview(SOURCE, None, refuse)
    assert held.wait() and "cannot be opened" in held.problem and held.picture is None


def test_a_camera_is_opened_again_only_when_it_was_let_go_of() -> None:
    held = FakeCamera(picture(), hz=50.0)
    opened_while_held: list[bool] = []

    def open_other(spec: str, settings: object, clock: object) -> FakeCamera:
        opened_while_held.append(not held.closed)
        return FakeCamera(picture(), hz=200.0)
    first = CameraPreview(SOURCE, None, lambda spec, settings, clock: held)
    eventually(lambda: first.picture is not None)
    first.stop()
    second = CameraPreview(SOURCE, first, open_other)
    eventually(lambda: second.picture is not None)
    second.stop()
    assert second.wait() and opened_while_held == [False]


def test_black_and_green_pictures_are_no_pictures() -> None:
    assert "black" in fault_of(picture(4, 2.0))
    green = YuvImage(np.full((48, 64), 76, np.uint8), np.zeros((24, 32), np.uint8), np.zeros((24, 32), np.uint8))
    assert "one colour" in fault_of(green)
    assert fault_of(picture()) == "" and fault_of(picture(60, 4.0)) == "", "a dark room is a picture"
