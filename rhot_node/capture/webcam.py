"""Webcams through OpenCV (V4L2), with every automatic mode off, and network cameras through FFmpeg."""

from __future__ import annotations

import contextlib
import enum
import logging
import re
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import SplitResult, urlsplit

import cv2
import numpy as np

from rhot_node.capture.camera import FIRST_FRAME_S, SILENCE_S, Frame, Newest, available_delay_ns
from rhot_node.capture.v4l2 import EXPOSURE_UNIT_US, Automatics, ExposureMode, read_automatics
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.detect.image import Plane, from_bgr
from rhot_node.errors import CameraError
from rhot_node.threads import OneShotThread

log = logging.getLogger(__name__)

OLDEST_STAMP_NS = 1_000_000_000
"""A frame that is read is never older: a stamp that is, is of another clock than the monotonic one."""


class Capture(Protocol):
    """The part of cv2.VideoCapture that is used."""

    def isOpened(self) -> bool: ...  # noqa: N802 - OpenCV's name
    def set(self, propId: int, value: float) -> bool: ...  # noqa: N803 - OpenCV's name
    def get(self, propId: int) -> float: ...  # noqa: N803 - OpenCV's name
    def read(self) -> tuple[bool, Any]: ...
    def release(self) -> None: ...


def open_v4l2(device: str) -> Capture:
    """Open a device path with OpenCV, by its number where it has one: names are not taken by every build."""
    match = re.fullmatch(r"/dev/video(\d+)", str(Path(device).resolve()))
    return cv2.VideoCapture(int(match[1]) if match else device, cv2.CAP_V4L2)


@dataclass(frozen=True, slots=True)
class Grabbed:
    """One image as the device gave it: (H, W, 3) BGR, how many came before it, when its read returned, and when its
    driver says that it began, None where it does not."""

    image: Plane
    number: int
    t_return_node_ns: int
    t_begin_node_ns: int | None


class GrabbedCamera:
    """A camera whose frames are grabbed by OpenCV. Where its driver stamps them (V4L2, at the start of exposure),
    mid-exposure of row 0 is half the exposure later. Else it is taken to be the time at which the read returned, less
    the readout of the frame (rows x row time) and half the exposure; transfer time adds to that."""

    def __init__(self, name: str, remedy: str, capture: Capture, settings: CameraSettings, clock: NodeClock, *,
                 stamped: bool = False) -> None:
        """Wait for the first frame of an opened `capture`. `name` and `remedy` begin and end each sentence about it.
        `stamped`: its driver may state when a frame began. Raises CameraError when no frame comes."""
        self._name, self._remedy = name, remedy
        self._exposure_ns = settings.exposure_ns
        self._row_time_ns = settings.row_time_ns
        self._capture, self._stamped, self._clock = capture, stamped, clock
        self._newest = Newest[Grabbed]()
        self._task = OneShotThread("reads the camera", self._grab)
        first = self._newest.take(FIRST_FRAME_S)
        if first is None:
            self.close()
            raise CameraError(f"{name}: opened, but no frame came within {FIRST_FRAME_S:.0f} s. {remedy}")
        self._size = from_bgr(first.image).size
        self._delay_ns = available_delay_ns(self._exposure_ns, self._row_time_ns, self._size[1])
        self._heard_s = time.monotonic()

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px, as the camera delivers it."""
        return self._size

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame. Raises CameraError when the camera is gone, silent, or changed its image size."""
        grabbed = self._newest.take(timeout_s)
        if grabbed is None:
            if self._newest.closed:
                raise CameraError(f"{self._name}: the camera stopped delivering frames. {self._remedy}")
            if time.monotonic() - self._heard_s > SILENCE_S:
                raise CameraError(f"{self._name}: no frame for {SILENCE_S:.0f} s. {self._remedy}")
            return None
        self._heard_s = time.monotonic()
        image = from_bgr(grabbed.image)
        if image.size != self._size:
            raise CameraError(f"{self._name}: the image size changed from {self._size[0]} x {self._size[1]} to "
                              f"{image.size[0]} x {image.size[1]} px.")
        return Frame(
            image=image,
            number=grabbed.number,
            t_node_ns=(grabbed.t_return_node_ns - self._delay_ns if grabbed.t_begin_node_ns is None
                       else grabbed.t_begin_node_ns + self._exposure_ns // 2),
            t_available_node_ns=grabbed.t_return_node_ns,
            exposure_ns=self._exposure_ns,
            row_time_ns=self._row_time_ns,
        )

    def close(self) -> None:
        """Release the device; where it does not return from its read, leave it to end by itself."""
        self._newest.close()
        self._task.join(2.0)

    def _grab(self) -> None:
        """Read until the device fails or is closed, in a thread of its own."""
        number = 0
        try:
            while not self._newest.closed and (found := _read(self._capture, self._stamped)) is not None:
                image, begin_ns = found
                self._newest.put(Grabbed(image, number, self._clock.now_ns(),
                                         None if begin_ns is None else self._clock.from_host_ns(begin_ns)))
                number += 1
        finally:
            self._newest.close()
            self._capture.release()


class Webcam(GrabbedCamera):
    """A webcam."""

    def __init__(self, device: str, settings: CameraSettings, clock: NodeClock,
                 open_capture: Callable[[str], Capture] = open_v4l2,
                 automatics: Callable[[str], Automatics] = read_automatics) -> None:
        """Open ``/dev/videoN`` and wait for a first frame. Raises CameraError when absent, busy or silent."""
        if not Path(device).exists():
            present = ", ".join(sorted(str(path) for path in Path("/dev").glob("video*"))) or "none"
            raise CameraError(f"{device}: no such camera (present: {present}). Is it plugged in?")
        capture = open_capture(device)
        if not capture.isOpened():
            capture.release()
            raise CameraError(f"{device}: the camera cannot be opened. Does another program use it, and may you read "
                              "it (group video)?")
        refused = configure(capture, settings)
        self._device, self._automatics = device, automatics
        self._fps = capture.get(cv2.CAP_PROP_FPS)
        now = automatics(device)
        self.refused = tuple(dict.fromkeys([
            *refused, *(["automatic exposure off"] if now.exposure else []),
            *(["automatic white balance off"] if now.white_balance else [])]))
        for name in self.refused:
            log.warning("%s: the camera does not take the setting %s", device, name)
        super().__init__(device, "Is the camera plugged in well?", capture, settings, clock, stamped=True)
        if self.size != (settings.width, settings.height):
            log.warning("%s: delivers %d x %d px instead of %d x %d", device, *self.size, settings.width,
                        settings.height)

    def report(self) -> dict[str, Any]:
        """What the driver says: the rate of its mode, its exposure, and which settings it does not take."""
        now = self._automatics(self._device)
        return {"fps": self._fps if self._fps > 0.0 else None, "exposure_us": now.exposure_us,
                "automatic_exposure": now.exposure, "refused": list(self.refused)}


# -- network cameras ---------------------------------------------------------------------------------------------------

class Scheme(enum.IntEnum):
    """Schemes of network cameras and their ports (RFC 9110, RFC 7826)."""

    HTTP = 80
    HTTPS = 443
    RTSP = 554
    RTSPS = 322


PORTS = {scheme.name.lower(): scheme.value for scheme in Scheme}

_REMEDY = "Does the program that sends them still run, and is the address right?"


def open_url(url: str) -> Capture:
    """Open the pictures of an address with FFmpeg, which gives up after `FIRST_FRAME_S`."""
    wait_ms = round(1e3 * FIRST_FRAME_S)
    return cv2.VideoCapture(url, cv2.CAP_FFMPEG, [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, wait_ms,
                                                  cv2.CAP_PROP_READ_TIMEOUT_MSEC, wait_ms])


class NetworkCamera(GrabbedCamera):
    """Pictures that a network camera, a phone or a Pi sends by HTTP (motion JPEG) or RTSP."""

    def __init__(self, url: str, settings: CameraSettings, clock: NodeClock,
                 open_capture: Callable[[str], Capture] = open_url) -> None:
        """Connect and wait for a first frame. Raises CameraError when nobody answers, or sends no pictures."""
        name = shown_url(url)
        _require_answer(_split_url(url), name)
        capture = open_capture(url)
        if not capture.isOpened():
            capture.release()
            raise CameraError(f"{name}: answers, but sends no pictures that can be decoded. Give the address of the "
                              "pictures themselves (motion JPEG or RTSP), not of the page that shows them.")
        super().__init__(name, _REMEDY, capture, settings, clock)


def shown_url(url: str) -> str:
    """The address as it may be shown: without user, password and query."""
    parts = _split_url(url)
    host = f"[{parts.hostname}]" if ":" in (parts.hostname or "") else parts.hostname
    return f"{parts.scheme}://{host}{'' if parts.port is None else f':{parts.port}'}{parts.path}"


def _split_url(url: str) -> SplitResult:
    with contextlib.suppress(ValueError):
        parts = urlsplit(url)
        if parts.scheme in PORTS and parts.hostname and parts.port != 0:
            return parts
    raise CameraError(f"{url.partition('://')[0]}://...: is no address of a network camera. It begins with "
                      f"{', '.join(f'{scheme}://' for scheme in PORTS)} and names a host.")


def _require_answer(parts: SplitResult, name: str) -> None:
    place = parts.hostname or "", parts.port or PORTS[parts.scheme]
    try:
        socket.create_connection(place, SILENCE_S).close()
    except (OSError, UnicodeError) as exc:
        why = "no answer" if isinstance(exc, TimeoutError) else getattr(exc, "strerror", None) or "no such host"
        raise CameraError(f"{name}: nobody answers at {place[0]}, port {place[1]} ({why}). {_REMEDY}") from exc


# -- settings of a webcam ----------------------------------------------------------------------------------------------

def configure(capture: Capture, settings: CameraSettings) -> list[str]:
    """Turn automatic modes off, then set what is given; returns the names of what the driver refused.

    Exposure goes in V4L2's 100 us; gain, saturation, brightness, contrast and colour gains in the driver's own units.
    """
    wanted: list[tuple[str, int, float | None]] = [
        ("width", cv2.CAP_PROP_FRAME_WIDTH, settings.width),
        ("height", cv2.CAP_PROP_FRAME_HEIGHT, settings.height),
        ("fps", cv2.CAP_PROP_FPS, settings.fps),
        ("one buffer", cv2.CAP_PROP_BUFFERSIZE, 1),
        ("automatic exposure off", cv2.CAP_PROP_AUTO_EXPOSURE, ExposureMode.MANUAL),
        ("automatic white balance off", cv2.CAP_PROP_AUTO_WB, 0),
        ("exposure_us", cv2.CAP_PROP_EXPOSURE, max(1.0, round(settings.exposure_us / EXPOSURE_UNIT_US))),
        ("gain", cv2.CAP_PROP_GAIN, settings.gain),
        ("saturation", cv2.CAP_PROP_SATURATION, settings.saturation),
        ("brightness", cv2.CAP_PROP_BRIGHTNESS, settings.brightness),
        ("contrast", cv2.CAP_PROP_CONTRAST, settings.contrast),
        ("red_gain", cv2.CAP_PROP_WHITE_BALANCE_RED_V, settings.red_gain),
        ("blue_gain", cv2.CAP_PROP_WHITE_BALANCE_BLUE_U, settings.blue_gain),
    ]
    return [name for name, prop, value in wanted if value is not None and not capture.set(prop, value)]


def _read(capture: Capture, stamped: bool) -> tuple[Plane, int | None] | None:
    """The next image and when it began, ns by this machine's monotonic clock; None where nothing says it."""
    ok, image = capture.read()
    if not ok or image is None:
        return None
    begin_ns = round(1e6 * capture.get(cv2.CAP_PROP_POS_MSEC)) if stamped else 0
    believed = 0 <= time.monotonic_ns() - begin_ns <= OLDEST_STAMP_NS  # else it is of another clock, or missing
    return np.asarray(image, dtype=np.uint8), begin_ns if believed else None
