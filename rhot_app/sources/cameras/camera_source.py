"""Where pictures come from: a webcam, a network camera, a film or a folder of pictures, checked before it is opened;
and what somebody sees of it before it is chosen: its newest picture, the rate that it reaches, and its faults."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RecordingError, SourceError
from rhot_app.sources.cameras.camera_set import CameraSource, camera_controls
from rhot_app.sources.recorded_pictures import recorded_pictures
from rhot_node.capture.camera import FIRST_FRAME_S, READ_S, Camera, EndOfRecording, Rewindable, report_of
from rhot_node.capture.open import open_camera
from rhot_node.capture.v4l2 import USUAL, Device, Mode, list_devices, look_at_device
from rhot_node.capture.webcam import NetworkCamera, shown_url
from rhot_node.clock import NodeClock
from rhot_node.config import FPS, CameraSettings
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import CameraError
from rhot_node.files import why
from rhot_node.health.camera import RateMeter, brightness, camera_troubles
from rhot_node.health.checks import STEP_PX, Check, is_black
from rhot_node.threads import OneShotThread

MOST: Final = 16
"""Cameras of a rig."""

_LISTED = "`rhot cameras` lists the cameras of this computer."


def check_sources(texts: Sequence[str], look: Callable[[Path], Device | None] = look_at_device) -> list[CameraSource]:
    """The sources of what was typed. Raises SourceError for none, for one that cannot be opened, and for one that is
    named twice."""
    if not texts:
        raise SourceError(f"Name one camera or more: a number, a film, a folder or an address. {_LISTED}")
    if len(texts) > MOST:
        raise SourceError(f"{len(texts)} cameras; a rig has at most {MOST}.")
    found: list[CameraSource] = []
    for text in texts:
        source = check_source(text, look)
        if source.spec in [one.spec for one in found]:
            raise SourceError(f"{text}: this camera is named twice. Each can be opened once.")
        found.append(source)
    return found


def check_source(text: str, look: Callable[[Path], Device | None] = look_at_device) -> CameraSource:
    """The source of one word: a webcam's number or device, an address, a film or a folder. Raises SourceError."""
    if re.fullmatch(r"\d{1,3}", text):
        return _webcam(Path(f"/dev/video{text}"), look)
    if re.match(r"[a-z]+://", text):
        return _network_camera(text)
    path = Path(text)
    try:
        if text.startswith("/dev/") and not path.is_file():
            return _webcam(path, look)
        if not path.exists():
            raise SourceError(f"{text}: there is no such film, folder or camera. {_LISTED}")
        return _recorded(path.resolve())
    except (OSError, ValueError) as exc:
        raise SourceError(f"{text}: cannot be read ({why(exc)}).") from exc
    except RecordingError as exc:
        raise SourceError(str(exc)) from exc


def _webcam(path: Path, look: Callable[[Path], Device | None]) -> CameraSource:
    device = look(path)
    if device is None:
        present = ", ".join(one.path for one in list_devices()) or "none"
        raise SourceError(f"{path}: there is no such camera (present: {present}). Is it plugged in?")
    return source_of(device)


def source_of(device: Device, mode: Mode | None = None) -> CameraSource:
    """A webcam in a mode, or in its usual one. Raises SourceError when it cannot be used now."""
    if device.problem:
        raise SourceError(f"{device.path} ({device.name}): {device.problem}")
    mode = mode or device.mode
    return CameraSource(str(Path(device.path).resolve()), device.name, _even(mode.width), _even(mode.height), mode.fps)


def _network_camera(url: str) -> CameraSource:
    try:
        camera = NetworkCamera(url, CameraSettings(), NodeClock())
    except CameraError as exc:
        raise SourceError(str(exc)) from exc
    camera.close()
    return CameraSource(url, shown_url(url), *camera.size, USUAL.fps)


def _recorded(path: Path) -> CameraSource:
    """A film, a picture, or a folder of pictures or of raw frames. Raises SourceError, RecordingError."""
    if "?" in path.name:
        raise SourceError(f"{path}: a film's name has no question mark here; rename it.")
    source = recorded_pictures(path)
    width, height = source.size
    if source.header is not None:
        times = source.header.times_ns
        seconds = 1e-9 * (times[-1] - times[0])
        fps = (len(times) - 1) / seconds if seconds > 0.0 else USUAL.fps
        return CameraSource(f"yuv:{path}", path.name, width, height, fps, seconds)
    fps = source.fps if FPS[0] <= source.fps <= FPS[1] else USUAL.fps
    return CameraSource(str(path), path.name, _even(width), _even(height), fps, source.count / fps)


def _even(pixels: int) -> int:
    """Nodes cut an odd row or column off."""
    return pixels - pixels % 2


# -- preview -----------------------------------------------------------------------------------------------------------

Picture = NDArray[np.uint8]

PICTURE_S: Final = 1.0 / 15.0
"""s: from one picture for the screen to the next."""

ONE_COLOUR: Final = 1.5
"""Grey levels: standard deviation of luma and chroma below which a picture shows nothing. A sensor's noise has more."""



class CameraPreview:
    """Reads a source in a thread of its own until `stop`. The rest may be asked by any thread."""

    def __init__(self, source: CameraSource, after: CameraPreview | None = None,
                 open_source: Callable[[str, CameraSettings, NodeClock], Camera] = open_camera) -> None:
        """`after`: one that was stopped, whose camera may be the same; it is waited for."""
        self.source = source
        self.picture: Picture | None = None
        """(H, W, 3) BGR, the newest one."""
        self._after, self._open = after, open_source
        self._rate = RateMeter()
        self._troubles: list[Check] = []
        self._fault = self._lost = ""
        self._ending = threading.Event()
        self._task = OneShotThread(f"shows the picture of {source.title}", self._run)

    @property
    def problem(self) -> str:
        """Why there is no picture, a sentence; "" while there may be one."""
        return self._lost or self._task.failure

    @property
    def rate_hz(self) -> float | None:
        """Frames/s that come; None until that is measured."""
        return self._rate.rate_hz

    @property
    def remark(self) -> str:
        """What is wrong with the pictures that come, a sentence; "" for nothing."""
        if self._fault or self.problem:
            return self._fault
        return " ".join(check.sentence for check in self._troubles)

    def stop(self) -> None:
        """Let go of the source soon; `wait` says when."""
        self._ending.set()

    def wait(self, timeout_s: float = FIRST_FRAME_S) -> bool:
        """Whether the source was let go of in time."""
        self._task.join(timeout_s)
        return not self._task.running

    def _run(self) -> None:
        if self._after is not None:
            self._after.wait()
            self._after = None
        if self._ending.is_set():
            return
        try:
            camera = self._open(self.source.spec, camera_controls(self.source), NodeClock())
        except CameraError as exc:
            self._lost = str(exc)
            return
        shown_s = 0.0
        try:
            while not self._ending.is_set():
                try:
                    frame = camera.read(READ_S)
                except EndOfRecording:
                    if isinstance(camera, Rewindable):
                        camera.rewind()
                    continue
                if frame is None:
                    continue
                now_s = time.monotonic()
                self._rate.add(frame.number, round(1e9 * now_s))
                if now_s - shown_s >= PICTURE_S:
                    shown_s = now_s
                    self._fault = fault_of(frame.image)
                    self._troubles = camera_troubles(report_of(camera), self.rate_hz, brightness(frame.image.y),
                                                     self.source.fps)
                    self.picture = to_bgr(frame.image)
        except CameraError as exc:
            self._lost = str(exc)
        finally:
            camera.close()


def fault_of(image: YuvImage) -> str:
    """What a picture alone says against its camera; "" for nothing."""
    if is_black(image.y):
        return "The picture is black. Is the lens covered, or a shutter closed?"
    spread = max(float(np.std(plane[::STEP_PX, ::STEP_PX])) for plane in (image.y, image.u, image.v))
    if spread < ONE_COLOUR:
        return ("The picture has one colour only: the camera sends nothing useful. Choose another size, or plug it in "
                "again.")
    return ""
