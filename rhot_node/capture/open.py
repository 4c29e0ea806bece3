"""Camera specs, as typed behind ``--camera``: which backend opens what, and how its pictures are turned."""

from __future__ import annotations

import contextlib
import os
import re
import stat
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from rhot_node.capture.camera import Camera, EndOfRecording, Frame, Rewindable, report_of
from rhot_node.capture.paced import IMAGE_SUFFIXES, ImageFiles, ImageSource, PacedCamera, VideoFile, image_files
from rhot_node.capture.stream import StreamCamera
from rhot_node.capture.webcam import NetworkCamera, Webcam
from rhot_node.capture.yuv import YuvRecording
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.detect.image import Plane, YuvImage
from rhot_node.errors import CameraError, NodeError, PluginError
from rhot_node.plugins import PREFIX, about_plugin, load_plugin
from rhot_node.threads import FOREIGN

VIDEO4LINUX_MAJOR = 81  # Linux, Documentation/admin-guide/devices.txt

SPEC_HELP = """camera specs:
  pi, pi:1, ...         the Raspberry Pi's camera, or its second one, through picamera2
  0, 1, ...             the webcam /dev/video0, /dev/video1, ...
  /dev/videoN           a webcam by its device
  http://, rtsp://      a network camera, a phone or a Pi that sends motion JPEG or RTSP
  FILE or FOLDER        a video file, an image, or a folder of images in the order of their names; a video plays at its
                        own rate, images at the settings' fps; with ?rate=max behind it, as fast as possible
  yuv:FOLDER            a recording of raw YUV420 frames with their times, played in real time
  ...?start=FILE        any of these three from the instant in FILE (integer ns, monotonic clock) once it exists
  stream:SOCKET         a live twin that sends frames over this Unix socket
  plug:NAME:SPEC        the camera plug-in NAME with what it understands (docs/plugins.md)"""


def open_camera(spec: str, settings: CameraSettings, clock: NodeClock) -> Camera:
    """Open what `spec` names (see SPEC_HELP). Raises CameraError saying what is wrong and what to do."""
    camera = _open(spec, settings, clock)
    return OrientedCamera(camera, settings) if settings.turned or settings.mirrored else camera


def _open(spec: str, settings: CameraSettings, clock: NodeClock) -> Camera:
    if match := re.fullmatch(r"pi(?::(\d))?", spec):
        from rhot_node.capture.pi_camera import PiCamera
        return PiCamera(int(match[1] or 0), settings, clock)
    if re.fullmatch(r"\d{1,3}", spec):
        return Webcam(f"/dev/video{spec}", settings, clock)
    if spec.startswith("/dev/") and not Path(spec).is_file():
        _require_video(Path(spec))
        return Webcam(spec, settings, clock)
    if re.match(r"[a-z]+://", spec):
        return NetworkCamera(spec, settings, clock)
    if spec.startswith("stream:"):
        return StreamCamera(Path(spec.removeprefix("stream:")), settings, clock)
    if spec.startswith(PREFIX):
        return open_plugin_camera(spec, settings, clock)
    if spec.startswith("yuv:"):
        name, options = _split_options(spec.removeprefix("yuv:"), spec, "start")
        return YuvRecording(Path(name), clock, _start_file(options))
    name, options = _split_options(spec, spec, "rate", "start")
    if options.get("rate", "max") != "max":
        raise CameraError(f"camera {spec!r}: the only rate is max; without it a file plays at its own.")
    if len(options) > 1:
        raise CameraError(f"camera {spec!r}: a file that starts at an instant plays at its own rate. Leave out "
                          "rate=max or start=FILE.")
    source = _files(Path(name), spec)
    return PacedCamera(source, name, settings, clock, rate_max="rate" in options, start_file=_start_file(options))


def _start_file(options: dict[str, str]) -> Path | None:
    return Path(options["start"]) if "start" in options else None


def _require_video(path: Path) -> None:
    """Raises CameraError for a device that is no camera; OpenCV may read one of those for ever."""
    try:
        info = path.stat()
    except OSError:
        return  # the webcam says which there are
    if not stat.S_ISCHR(info.st_mode) or os.major(info.st_rdev) != VIDEO4LINUX_MAJOR:
        raise CameraError(f"{path}: is no camera. A camera is a video4linux device, such as /dev/video0.")


def data_set_settings(spec: str) -> bool:
    """Whether camera settings mean anything to this source; a recording brings its own."""
    return not spec.startswith("yuv:")


def _files(path: Path, spec: str) -> ImageSource:
    if not path.exists():
        raise CameraError(f"camera {spec!r}: no such file or folder. See rhot-node --help for what a camera may be.")
    images = image_files(path)
    if path.is_dir() and not images:
        raise CameraError(f"{path}: a folder without images ({', '.join(sorted(IMAGE_SUFFIXES))}). A yuv recording is "
                          "opened as yuv:FOLDER.")
    return ImageFiles(images) if images else VideoFile(path)


def _split_options(text: str, spec: str, *known: str) -> tuple[str, dict[str, str]]:
    """Cut ``name?key=value&key=value``; raises CameraError for a key that is not `known`."""
    name, _, query = text.partition("?")
    options: dict[str, str] = {}
    for item in filter(None, query.split("&")):
        key, equals, value = item.partition("=")
        if key not in known or not equals or not value:
            raise CameraError(f"camera {spec!r}: option {item!r} is not known; this source takes "
                              f"{' or '.join(f'?{one}=...' for one in known)}")
        options[key] = value
    if not name:
        raise CameraError(f"camera {spec!r}: it names no file.")
    return name, options


# -- cameras that hang upside down, or whose program mirrors their pictures --------------------------------------------

_BOTH_AXES, _AROUND_X, _AROUND_Y = -1, 0, 1  # of cv2.flip


class OrientedCamera:
    """A camera whose pictures are turned by 180 degrees (`settings.turned`), mirrored (`settings.mirrored`), or both.

    The rows of a rolling shutter would then be exposed from the last to the first, which no message can say: such
    frames are refused.
    """

    def __init__(self, camera: Camera, settings: CameraSettings) -> None:
        self._camera = camera
        self._turned = settings.turned
        self._way = (_AROUND_X if settings.mirrored else _BOTH_AXES) if settings.turned else _AROUND_Y

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._camera.size

    def read(self, timeout_s: float) -> Frame | None:
        """The next frame, as `Camera.read`."""
        frame = self._camera.read(timeout_s)
        if frame is None:
            return None
        if self._turned and frame.row_time_ns:
            raise CameraError("a picture whose rows are exposed one after the other cannot be turned here. Take "
                              "\"turned\" out of the settings and mount the camera upright, or set row_time_us to 0.")
        image = frame.image
        return replace(frame, image=YuvImage(self._flip(image.y), self._flip(image.u), self._flip(image.v)))

    def rewind(self) -> None:
        """Go before the first frame, where the camera can."""
        if isinstance(self._camera, Rewindable):
            self._camera.rewind()

    def report(self) -> dict[str, Any]:
        """What the camera says of itself."""
        return report_of(self._camera)

    def close(self) -> None:
        """Release the camera."""
        self._camera.close()

    def _flip(self, plane: Plane) -> Plane:
        return np.asarray(cv2.flip(plane, self._way), np.uint8)


# -- cameras from other packages ---------------------------------------------------------------------------------------

GROUP: Final = "rhot.cameras"


class PluginCamera:
    """A camera of a plug-in. Whatever goes wrong in it becomes a CameraError: the node says so and opens it again."""

    def __init__(self, name: str, spec: str, settings: CameraSettings, clock: NodeClock) -> None:
        """Open the camera; raises CameraError."""
        self._name = name
        try:
            self._camera: Camera = load_plugin(GROUP, name)(spec, settings, clock)
            width, height = self._camera.size
            self._size = int(width), int(height)
        except CameraError:
            raise
        except PluginError as exc:
            raise CameraError(f"camera {PREFIX}{name}: {exc}") from exc
        except FOREIGN as exc:
            raise self._failed("could not open its camera", exc) from exc

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._size

    def read(self, timeout_s: float) -> Frame | None:
        """The next frame, as `Camera.read`."""
        try:
            frame = self._camera.read(timeout_s)
        except (CameraError, EndOfRecording):
            raise
        except FOREIGN as exc:
            raise self._failed("failed over a frame", exc) from exc
        if frame is not None and (not isinstance(frame, Frame) or frame.image.size != self._size):
            raise CameraError(f"camera {PREFIX}{self._name}: {about_plugin(GROUP, self._name)} gave something else "
                              f"than a frame of {self._size[0]} x {self._size[1]} px.")
        return frame

    def report(self) -> dict[str, Any]:
        """What the camera says of itself, when it does."""
        with contextlib.suppress(*FOREIGN):
            return dict(report_of(self._camera))
        return {}

    def close(self) -> None:
        """Release the camera."""
        with contextlib.suppress(*FOREIGN):
            self._camera.close()

    def _failed(self, what: str, exc: BaseException) -> CameraError:
        if isinstance(exc, NodeError):
            return CameraError(f"camera {PREFIX}{self._name}: {exc}")
        return CameraError(f"camera {PREFIX}{self._name}: {about_plugin(GROUP, self._name)} {what} "
                           f"({type(exc).__name__}: {exc}).")


def open_plugin_camera(spec: str, settings: CameraSettings, clock: NodeClock) -> PluginCamera:
    """Open ``plug:NAME:SPEC`` or ``plug:NAME``. Raises CameraError."""
    name, _, rest = spec.removeprefix(PREFIX).partition(":")
    return PluginCamera(name, rest, settings, clock)
