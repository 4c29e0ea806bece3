"""Video files and image folders as cameras: played at their own rate, or as fast as they are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from rhot_node.capture.camera import NS_PER_S, EndOfRecording, Frame, PlayedCamera, wait_until
from rhot_node.clock import NodeClock
from rhot_node.config import FPS, CameraSettings
from rhot_node.detect.image import Plane, YuvImage, from_bgr
from rhot_node.errors import CameraError, PictureError
from rhot_node.pictures import open_video, read_picture

IMAGE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp"})


def image_files(path: Path) -> tuple[Path, ...]:
    """The images that a path names: itself, or those of a folder in the order of their names."""
    files = sorted(path.iterdir()) if path.is_dir() else (path,)
    return tuple(one for one in files if one.suffix.lower() in IMAGE_SUFFIXES)


class ImageSource(Protocol):
    """Images in order, of a file; knows nothing of time."""

    fps: float | None  # the file's own rate, None when it has none

    def advance(self) -> bool:
        """Go to the next image (to the first one at first); False when there is none."""
        ...

    def image(self) -> Plane:
        """The current image, (H, W, 3) BGR. Raises CameraError when it cannot be decoded."""
        ...

    def rewind(self) -> None:
        """Go before the first image."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


class ImageFiles:
    """Image files, one after the other."""

    fps: float | None = None

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = paths
        self._index = -1

    def advance(self) -> bool:
        """Go to the next file."""
        if self._index + 1 >= len(self._paths):
            return False
        self._index += 1
        return True

    def image(self) -> Plane:
        """Decode the current file."""
        try:
            return read_picture(self._paths[self._index])
        except PictureError as exc:
            raise CameraError(f"{exc} Remove or replace it.") from exc

    def rewind(self) -> None:
        """Go before the first file."""
        self._index = -1

    def close(self) -> None:
        """Nothing is held open."""


class VideoFile:
    """A video file, through OpenCV."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._capture = self._open()
        fps = self._capture.get(cv2.CAP_PROP_FPS)
        self.fps: float | None = fps if FPS[0] < fps < FPS[1] else None
        self._frames = self._capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self._read = 0  # frames that were read
        self._last: Plane | None = None  # the last frame, when there is none behind it

    def advance(self) -> bool:
        """Go to the next frame without decoding it into an image; behind the last frame, that one stays."""
        if self._last is not None:
            return False
        last = self.image() if self._read and self._read >= self._frames else None  # gone once reading has failed
        if self._capture.grab():
            self._read += 1
            return True
        self._last = last
        return False

    def image(self) -> Plane:
        """The current frame."""
        if self._last is not None:
            return self._last
        ok, image = self._capture.retrieve()
        if not ok or image is None:
            raise CameraError(f"{self._path}: a frame cannot be decoded. Is the file complete?")
        return np.asarray(image, dtype=np.uint8)

    def rewind(self) -> None:
        """Open the file again: seeking is not exact in every container."""
        self._capture.release()
        self._capture = self._open()
        self._read, self._last = 0, None

    def close(self) -> None:
        """Close the file."""
        self._capture.release()

    def _open(self) -> cv2.VideoCapture:
        try:
            capture = open_video(self._path)
        except PictureError as exc:
            raise CameraError(str(exc)) from exc
        if not capture.isOpened():
            capture.release()
            raise CameraError(f"{self._path}: not a video that can be decoded. Convert it, e.g. to H.264 in MP4.")
        return capture


class PacedCamera(PlayedCamera):
    """A file as a camera. Frame k is exposed at T0 + k / rate, T0 being the first read or the instant in `start_file`
    (`DelayedStart`); a reader that comes late gets the newest frame. As fast as possible (`rate_max`), every frame is
    delivered and has just been exposed."""

    def __init__(self, source: ImageSource, where: str, settings: CameraSettings, clock: NodeClock, *,
                 rate_max: bool = False, start_file: Path | None = None) -> None:
        """Decode the first image to learn the size; raises CameraError when there is none."""
        self._source, self._where, self._rate_max = source, where, rate_max
        self._number = 0  # of the frame at which the source stands
        if not source.advance():
            raise CameraError(f"{where}: it has no frames.")
        self._pending: YuvImage | None = from_bgr(source.image())
        super().__init__(clock, self._pending.size, settings.exposure_ns, settings.row_time_ns,
                         round(NS_PER_S / (source.fps or settings.fps)), start_file)

    def rewind(self) -> None:
        """Play again from the first frame; numbers and times go on."""
        self._source.rewind()
        self._pending = None

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def _first(self) -> YuvImage:
        return self._upcoming(0)

    def _play(self, now_ns: int, deadline_ns: int) -> Frame | None:
        if self._rate_max:
            return self._deliver(self._upcoming(0), now_ns - self._delay_ns)
        if self._t0_ns is None:
            self._t0_ns = now_ns - self._delay_ns
        image = self._upcoming((now_ns - self._delay_ns - self._t0_ns) // self._period_ns)
        t_mid_ns = self._t0_ns + self._number * self._period_ns
        return self._deliver(image, t_mid_ns) if wait_until(t_mid_ns + self._delay_ns, deadline_ns) else None

    def _upcoming(self, newest: int) -> YuvImage:
        """Decode the next image, or image `newest` when that is later; it stays until it is delivered."""
        if self._pending is None:
            if not self._source.advance():
                raise EndOfRecording
            self._number += 1
        while self._number < newest and self._source.advance():
            self._number += 1
            self._pending = None
        if self._pending is None:
            self._pending = from_bgr(self._source.image())
        if self._pending.size != self._size:
            width, height = self._pending.size
            raise CameraError(f"{self._where}: frame {self._number} has {width} x {height} px, the first one has "
                              f"{self._size[0]} x {self._size[1]}. All frames must have one size.")
        return self._pending

    def _deliver(self, image: YuvImage, t_mid_ns: int) -> Frame:
        self._pending = None
        return self._frame(image, self._base + self._number, t_mid_ns)
