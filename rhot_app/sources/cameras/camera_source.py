"""Where pictures come from: a webcam, a network camera, a film or a folder of pictures, checked before it is opened."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from rhot_app.errors import RecordingError, SourceError
from rhot_app.sources.cameras.camera_set import CameraSource
from rhot_app.sources.recorded_pictures import recorded_pictures
from rhot_node.capture.v4l2 import USUAL, Device, Mode, list_devices, look_at_device
from rhot_node.capture.webcam import NetworkCamera, shown_url
from rhot_node.clock import NodeClock
from rhot_node.config import FPS, CameraSettings
from rhot_node.errors import CameraError
from rhot_node.files import why

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
