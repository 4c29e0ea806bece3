"""Recorded pictures of one camera: what a path names, and any of its pictures by number.

A video file, a node's own video, a picture, a folder of pictures in the order of their names, or a folder of raw frames
(``rhot-yuv``). Frames are decoded as they are asked for; no video is kept in memory.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RecordingError
from rhot_node.capture.paced import image_files
from rhot_node.capture.yuv import HEADER_NAME, YuvHeader, read_header, read_images
from rhot_node.detect.image import to_bgr
from rhot_node.errors import CameraError, PictureError, VideoError
from rhot_node.files import open_input, require_file, why
from rhot_node.pictures import decode_picture, open_video, read_picture
from rhot_node.video.avi import Stamp, pictures_of, read_stamps

Image = NDArray[np.uint8]

_READ_ON: Final = 30
"""Frames that are passed over one by one; a decoder that is sent farther begins at the key frame before."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedPictures:
    """What a path names. `size`: width, height px. `count` of its pictures, and the `fps` that it says; 0 where it does
    not. `files`: the pictures, where they are files. `header`: of raw frames. `stamps`: of a node's own video."""

    path: Path
    size: tuple[int, int]
    count: int
    fps: float = 0.0
    files: tuple[Path, ...] = ()
    header: YuvHeader | None = None
    stamps: tuple[Stamp, ...] = ()


def recorded_pictures(path: Path) -> RecordedPictures:
    """What lies at `path`. Raises RecordingError for nothing, and for what cannot be decoded."""
    try:
        if (path / HEADER_NAME).exists():
            header = read_header(path)
            next(read_images(path))
            return RecordedPictures(path, (header.width, header.height), len(header.times_ns), header=header)
        if files := image_files(path):
            height, width = read_picture(files[0]).shape[:2]
            return RecordedPictures(path, (width, height), len(files), files=files)
        if path.is_dir():
            raise RecordingError(f"{path}: this folder has no pictures, and no {HEADER_NAME}, so it is no recording of "
                                 "`rhot simulate`. Name a video, or a folder in it.")
        require_file(path)
        return _video(path)
    except FileNotFoundError as exc:
        raise RecordingError(f"{path}: no such file.") from exc
    except (OSError, ValueError) as exc:
        raise RecordingError(f"{path}: cannot be read ({why(exc)}).") from exc
    except (CameraError, PictureError) as exc:
        raise RecordingError(str(exc)) from exc


def _video(path: Path) -> RecordedPictures:
    stamps: tuple[Stamp, ...] = ()
    if path.suffix.lower() == ".avi":
        with contextlib.suppress(VideoError):  # an ordinary AVI file
            stamps = read_stamps(path)
    capture = open_video(path)
    try:
        read, picture = capture.read()
        if not read:
            raise RecordingError(f"{path}: is no film of which a frame can be decoded. Is it a video, and complete?")
        return RecordedPictures(path, (picture.shape[1], picture.shape[0]),
                                len(stamps) or max(int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0),
                                float(capture.get(cv2.CAP_PROP_FPS)), stamps=stamps)
    finally:
        capture.release()


class FilmReader:
    """Pictures by their numbers; quick where they follow each other."""

    def __init__(self, source: RecordedPictures, *, in_order: bool = False) -> None:
        """`in_order`: numbers only ascend, and no frame is passed over by seeking, which not every container does
        exactly; a picture file that is damaged is an error then. Raises RecordingError when nothing can be opened."""
        self.ended = False  # it has fewer pictures than it says: the last one asked for is behind its end
        self._source, self._in_order = source, in_order
        self._capture: cv2.VideoCapture | None = None
        self._next = 0
        self._last: tuple[Path, Image] | None = None
        try:
            if source.stamps:
                with open_input(source.path) as file:
                    self._places = [(picture.offset, picture.size) for picture in pictures_of(file)]
            elif source.header is not None:
                self._raw = list(read_images(source.path))
            elif not source.files:
                self._capture = open_video(source.path)
        except (OSError, CameraError, PictureError) as exc:
            raise self._lost(exc) from exc

    def picture(self, number: int) -> Image | None:
        """(H, W, 3) RGB; None where it is damaged or missing. Raises RecordingError when the file is gone."""
        try:
            found = self._decoded(number)
        except PictureError as exc:
            if self._in_order and self._source.files:
                raise RecordingError(str(exc)) from exc
            return None
        except OSError as exc:
            raise self._lost(exc) from exc
        return None if found is None else np.ascontiguousarray(found[..., ::-1])

    def close(self) -> None:
        """Let go of the file. May be called twice."""
        if self._capture is not None:
            self._capture.release()

    def _decoded(self, number: int) -> Image | None:
        if files := self._source.files:
            path = files[min(number, len(files) - 1)]
            if self._last is None or self._last[0] != path:
                self._last = path, read_picture(path)
            return self._last[1]
        if self._source.header is not None:
            return to_bgr(self._raw[number])
        if self._capture is None:
            offset, size = self._places[number]
            with open_input(self._source.path) as file:
                file.seek(offset)
                return decode_picture(file.read(size))
        if not (self._in_order or 0 <= number - self._next <= _READ_ON):
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, number)
            self._next = number
        while self._next <= number:
            if not self._capture.grab():
                self.ended = True
                return None
            self._next += 1
        read, picture = self._capture.retrieve()
        return np.asarray(picture, np.uint8) if read else None

    @property
    def passed(self) -> int:
        """How many frames of a video were gone through."""
        return self._next

    def _lost(self, exc: Exception) -> RecordingError:
        return RecordingError(f"{self._source.path}: cannot be shown ({exc}). Is it still there?")
