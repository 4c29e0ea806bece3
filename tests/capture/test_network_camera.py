"""Network cameras, against real servers on loopback."""

from __future__ import annotations

import contextlib

import pytest
from network_pictures import nobody, sending, silent
from patience import PATIENCE_S

import rhot_node.capture.webcam
from rhot_node.capture.open import open_camera
from rhot_node.capture.webcam import shown_url
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError

SETTINGS = CameraSettings(exposure_us=4000)
CLOCK = NodeClock()


def refusal(url: str) -> str:
    with pytest.raises(CameraError) as caught:
        open_camera(url, SETTINGS, CLOCK)
    return str(caught.value)


def test_motion_jpeg_is_read_until_it_ends() -> None:
    with sending() as (address, ending), contextlib.closing(open_camera(f"{address}/video", SETTINGS, CLOCK)) as camera:
        assert camera.size == (64, 48)
        first, second = camera.read(PATIENCE_S), camera.read(PATIENCE_S)
        assert first is not None and second is not None and second.number > first.number
        assert 0 <= CLOCK.now_ns() - second.t_available_node_ns < 10**9 * PATIENCE_S
        assert second.t_available_node_ns - second.t_node_ns == 2_000_000
        ending.set()
        with pytest.raises(CameraError, match="stopped delivering"):
            for _ in range(1000):
                camera.read(PATIENCE_S)


def test_an_address_without_an_answer_is_refused() -> None:
    told = refusal(f"rtsp://{nobody()}/live")
    assert "nobody answers" in told and "127.0.0.1" in told


@pytest.mark.parametrize("scheme", ["http", "rtsp"])
def test_a_server_that_says_nothing_is_given_up(scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhot_node.capture.webcam, "FIRST_FRAME_S", 0.3)
    with silent() as place:
        assert "sends no pictures" in refusal(f"{scheme}://{place}/video")


def test_a_page_is_no_picture() -> None:
    with sending() as (address, _):
        assert "not of the page" in refusal(f"{address}/index.html")


@pytest.mark.parametrize("url", ["gopher://127.0.0.1/x", "http:///video", "http://127.0.0.1:99999/x", "file:///etc/passwd"])
def test_other_addresses_are_refused(url: str) -> None:
    assert "no address of a network camera" in refusal(url)


def test_a_password_is_never_shown() -> None:
    assert shown_url("rtsp://me:secret@10.0.0.7:8554/live?token=secret") == "rtsp://10.0.0.7:8554/live"
    told = refusal(f"http://me:secret@{nobody()}/video?token=secret")
    assert "secret" not in told
