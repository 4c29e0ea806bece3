"""Pictures on their way to a film or to a folder of PNG files, either of which appears when it is whole."""

from __future__ import annotations

import contextlib
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ExportError
from rhot_app.export.export import check_place, whole_file
from rhot_app.geometry.camera import CameraModel

Image = NDArray[np.uint8]

_CODECS: Final = {".avi": "MJPG", ".mp4": "mp4v"}
_TEXT_RGB: Final = (255, 255, 255)


def check_pictures(video: Path, target: Path, again: bool) -> None:
    """Refuse a film or a folder that cannot be written, before anything is tracked. Raises ExportError."""
    if target.suffix.lower() in _CODECS:
        check_place(video, target, again, "--overlay")
    elif re.fullmatch(r"\.[A-Za-z]\w{1,4}", target.suffix):
        raise ExportError(f"--overlay {target}: a film ends in {' or '.join(_CODECS)}, not in {target.suffix}. A name "
                          "without an ending is a folder of pictures.")
    elif target.exists():
        raise ExportError(f"{target} exists already; name a new folder for the pictures, or a film (.avi, .mp4).")
    elif not target.absolute().parent.is_dir():
        raise ExportError(f"{target}: the folder {target.parent} does not exist; create it first.")


class Pictures(Protocol):
    """Takes pictures (H, W, 3) RGB of one size."""

    def add(self, picture: Image) -> None:
        """Take one picture."""
        ...


class _Film:
    """A film of pictures of one size."""

    def __init__(self, path: Path, codec: str, fps: float) -> None:
        self._path, self._codec, self._fps = path, codec, fps
        self._writer: cv2.VideoWriter | None = None

    def add(self, picture: Image) -> None:
        """Take one picture (H, W, 3) RGB."""
        if self._writer is None:
            size = picture.shape[1], picture.shape[0]
            self._writer = cv2.VideoWriter(str(self._path), cv2.VideoWriter.fourcc(*self._codec), self._fps, size)
            if not self._writer.isOpened():
                raise ExportError(f"{self._path.suffix} films cannot be written here; choose .avi or a folder.")
        self._writer.write(np.ascontiguousarray(picture[..., ::-1]))

    def close(self) -> None:
        """Let go of the file."""
        if self._writer is not None:
            self._writer.release()


class _Folder:
    """Numbered PNG files."""

    def __init__(self, path: Path) -> None:
        self._path, self._count = path, 0

    def add(self, picture: Image) -> None:
        """Take one picture (H, W, 3) RGB."""
        path = self._path / f"{self._count:06d}.png"
        if not cv2.imwrite(str(path), np.ascontiguousarray(picture[..., ::-1])):
            raise ExportError(f"{path}: the picture cannot be written; is there room?")
        self._count += 1


@contextlib.contextmanager
def whole_pictures(target: Path, fps: float) -> Iterator[Pictures]:
    """A film or a folder that is there when it is whole. Raises ExportError."""
    if target.suffix.lower() in _CODECS:
        with (whole_file(target, lambda: None) as path,
              contextlib.closing(_Film(path, _CODECS[target.suffix.lower()], fps)) as film):
            yield film
        return
    try:
        hidden = Path(tempfile.mkdtemp(dir=target.absolute().parent, prefix=f".{target.name}."))
    except OSError as exc:
        raise ExportError(f"{target}: cannot be written ({exc.strerror}).") from exc
    try:
        yield _Folder(hidden)
        hidden.chmod(0o755)
        hidden.replace(target)
    finally:
        shutil.rmtree(hidden, ignore_errors=True)


def side_by_side(cameras: Sequence[CameraModel], images: Sequence[Image | None], caption: str,
                 draw: Callable[[int, Image], Image]) -> Image:
    """All cameras' images (H, W, 3) RGB beside each other, as `draw` makes of each camera's number and copy, with a
    caption. A camera without an image is black."""
    shown = []
    for number, (camera, image) in enumerate(zip(cameras, images, strict=True)):
        picture = (np.zeros((camera.height, camera.width, 3), np.uint8) if image is None
                   else draw(number, image.copy()))
        cv2.putText(picture, caption, (8, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.7, _TEXT_RGB, 2, cv2.LINE_AA)
        shown.append(picture)
    height = max(picture.shape[0] for picture in shown)
    return np.hstack([np.pad(picture, ((0, height - picture.shape[0]), (0, 0), (0, 0))) for picture in shown])
