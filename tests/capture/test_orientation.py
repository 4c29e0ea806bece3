"""Cameras that hang upside down or mirror their pictures: turned pixel by pixel, and refused where times would lie."""

from __future__ import annotations

import contextlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_node.capture.camera import EndOfRecording, Rewindable
from rhot_node.capture.open import open_camera
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    path = tmp_path / "picture.png"
    cv2.imwrite(str(path), np.random.default_rng(1).integers(0, 255, (48, 64, 3), np.uint8))
    return path


def luma(path: Path, **settings: bool) -> np.ndarray:
    with contextlib.closing(open_camera(f"{path}?rate=max", CameraSettings(**settings), NodeClock())) as camera:
        frame = camera.read(1.0)
        assert frame is not None and camera.size == frame.image.size
        assert frame.image.u.flags.c_contiguous
        return frame.image.y


def test_pictures_are_turned_and_mirrored(picture: Path) -> None:
    plain = luma(picture)
    np.testing.assert_array_equal(luma(picture, turned=True), plain[::-1, ::-1])
    np.testing.assert_array_equal(luma(picture, mirrored=True), plain[:, ::-1])
    np.testing.assert_array_equal(luma(picture, turned=True, mirrored=True), plain[::-1])


def test_a_turned_film_still_begins_again(picture: Path) -> None:
    with contextlib.closing(open_camera(f"{picture}?rate=max", CameraSettings(turned=True), NodeClock())) as camera:
        camera.read(1.0)
        with pytest.raises(EndOfRecording):
            camera.read(1.0)
        assert isinstance(camera, Rewindable)
        camera.rewind()
        assert camera.read(1.0) is not None


def test_rows_that_would_be_exposed_backwards_are_refused(picture: Path) -> None:
    settings = CameraSettings(turned=True, row_time_us=20.0)
    with contextlib.closing(open_camera(f"{picture}?rate=max", settings, NodeClock())) as camera, \
            pytest.raises(CameraError, match="turned"):
        camera.read(1.0)
