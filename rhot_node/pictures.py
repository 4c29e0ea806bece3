"""Pictures and video files that somebody else made, as the sensor gave their pixels: what else they say, such as that a
camera was held upright (EXIF), turns nothing.

A decoder meets no file that its first bytes do not call PNG, JPEG, TIFF or WebP, and none of more pixels than fit the
memory: OpenCV decodes twenty formats, and some by code with known errors (CVE-2025-53644, JPEG 2000).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import PictureError
from rhot_node.files import open_input, read_input, why

Picture = NDArray[np.uint8]

PIXELS_MAX: Final = 64_000_000
"""Of a picture or a video's frame: the largest cameras for a Pi have so many."""

BYTES_MAX: Final = 4 * PIXELS_MAX
"""Of a file."""

VIDEO_SUFFIXES: Final = frozenset({".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v"})
"""Of a video's name, where pictures and videos are both expected."""

cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # what is wrong with a file is said in a sentence
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # likewise; OpenCV hands it to FFmpeg (AV_LOG_QUIET)

_SEGMENTS_MAX: Final = 4096  # before the size of a JPEG picture
_FORGIVEN: Final = 0.25  # of a JPEG's bytes after its end mark: cameras append thumbnails and notes
_PNG, _JPEG, _JPEG_END = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\xff\xd9"
_TIFF_ORDER = {b"II*\0": "<", b"MM\0*": ">"}
_WIDTH, _HEIGHT, _BITS, _ORIENTATION, _SAMPLES, _ROWS, _TILE_WIDTH, _TILE_HEIGHT = (
    256, 257, 258, 274, 277, 278, 322, 323)  # tags of TIFF 6.0
_SHORT, _LONG = 3, 4
_WHOLE: Final = 2**32 - 1  # rows of a strip that is the picture


def read_picture(path: Path, *, grey: bool = False) -> Picture:
    """The picture of a file: (H, W, 3) BGR, or (H, W) `grey`. Raises PictureError that names the file."""
    try:
        data = read_input(path, BYTES_MAX)
    except (OSError, ValueError) as exc:
        raise PictureError(f"cannot be read ({why(exc)})", path) from exc
    try:
        return decode_picture(data, grey=grey)
    except PictureError as exc:
        raise PictureError(exc.reason, path) from exc


def decode_picture(data: bytes, *, grey: bool = False) -> Picture:
    """The picture of a file's bytes, as `read_picture` gives it. Raises PictureError."""
    try:
        width, height, data = _checked(data)
        kind = cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), kind | cv2.IMREAD_IGNORE_ORIENTATION)
    except (struct.error, IndexError, cv2.error) as exc:
        raise PictureError("is cut off or damaged") from exc
    if picture is None or picture.shape[:2] != (height, width):
        raise PictureError("is cut off or damaged")
    return np.asarray(picture, np.uint8)


def open_video(path: Path) -> cv2.VideoCapture:
    """A decoder of a video file, which opens nothing when it cannot decode it. Raises PictureError for what is no
    regular file, is a picture, or has frames of too many pixels."""
    try:
        with open_input(path) as file:
            head = file.read(16)
    except (OSError, ValueError) as exc:
        raise PictureError(f"cannot be read ({why(exc)})", path) from exc
    if _kind(head):
        raise PictureError("is a picture, not a video", path)
    try:
        name = str(path).encode().decode()
    except UnicodeEncodeError as exc:  # OpenCV would crash
        raise PictureError("has a name that is not UTF-8; rename it", path) from exc
    capture = cv2.VideoCapture(name, cv2.CAP_FFMPEG)
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    try:
        _require_pixels(int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)))
    except PictureError as exc:
        capture.release()
        raise PictureError(exc.reason, path) from exc
    return capture


def _kind(data: bytes) -> str:
    """What the first bytes say; empty for what is not decoded."""
    if data.startswith(_PNG):
        return "PNG"
    if data.startswith(_JPEG):
        return "JPEG"
    if data[:4] in _TIFF_ORDER:
        return "TIFF"
    return "WebP" if data[:4] == b"RIFF" and data[8:12] == b"WEBP" else ""


def _checked(data: bytes) -> tuple[int, int, bytes]:
    """Width and height that a picture says, and the bytes to decode. Raises PictureError, struct.error, IndexError."""
    kind = _kind(data)
    if not data:
        raise PictureError("is empty")
    if not kind:
        raise PictureError("is not a picture (PNG, JPEG, TIFF or WebP)")
    if kind == "TIFF":
        return _tiff(data)
    width, height = _png(data) if kind == "PNG" else _jpeg(data) if kind == "JPEG" else _webp(data)
    _require_pixels(width, height)
    return width, height, data


def _require_pixels(width: int, height: int) -> None:
    if width * height > PIXELS_MAX:
        raise PictureError(f"has {width} x {height} px; at most {PIXELS_MAX // 1_000_000} megapixels are read")


def _png(data: bytes) -> tuple[int, int]:
    length, name, width, height = struct.unpack_from(">I4sII", data, len(_PNG))
    if (length, name) != (13, b"IHDR"):
        raise PictureError("is cut off or damaged")
    return width, height


def _jpeg(data: bytes) -> tuple[int, int]:
    """By the frame's header: ITU-T T.81, B.2.2. A picture without its end would be filled up with grey."""
    if data.rfind(_JPEG_END) < (1.0 - _FORGIVEN) * len(data):
        raise PictureError("is cut off or damaged: its end is missing")
    at = 2
    for _ in range(_SEGMENTS_MAX):
        mark, kind, length = struct.unpack_from(">BBH", data, at)
        if mark != 0xFF:
            break
        if kind == 0xFF:  # a fill byte
            at += 1
        elif 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">HH", data, at + 5)
            return width, height
        else:
            at += 2 + length
    raise PictureError("is cut off or damaged")


def _webp(data: bytes) -> tuple[int, int]:
    """By its first chunk: RFC 9649."""
    name = data[12:16]
    if name == b"VP8X":
        first, second = (int.from_bytes(data[at:at + 3], "little") for at in (24, 27))
        return first + 1, second + 1
    if name == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    width, height = struct.unpack_from("<HH", data, 26)
    return width & 0x3FFF, height & 0x3FFF


def _tiff(data: bytes) -> tuple[int, int, bytes]:
    """By the first directory: TIFF 6.0. Its orientation is set to none, because OpenCV always follows it."""
    order = _TIFF_ORDER[data[:4]]
    found: dict[int, int] = {}
    turned = bytearray(data)
    for at, tag, kind, value in _tiff_entries(data, order):
        if tag == _ORIENTATION:
            struct.pack_into(f"{order}HHIHH", turned, at, _ORIENTATION, _SHORT, 1, 1, 0)
        elif kind in (_SHORT, _LONG):
            found[tag] = max(value, found.get(tag, 0))
    width, height = found.get(_WIDTH, 0), found.get(_HEIGHT, 0)
    rows = found.get(_ROWS, _WHOLE)
    _require_pixels(width, height)
    _require_pixels(found.get(_TILE_WIDTH, width), found.get(_TILE_HEIGHT, height if rows == _WHOLE else rows))
    if found.get(_BITS, 1) > 16 or found.get(_SAMPLES, 1) > 4:
        raise PictureError("is a TIFF of more than 16 bits in 4 channels, which is not read")
    return width, height, bytes(turned)


def _tiff_entries(data: bytes, order: str) -> Iterator[tuple[int, int, int, int]]:
    """(place, tag, type, first value) of the first directory's entries."""
    begin = struct.unpack_from(f"{order}I", data, 4)[0]
    for k in range(struct.unpack_from(f"{order}H", data, begin)[0]):
        at = begin + 2 + 12 * k
        tag, kind, count = struct.unpack_from(f"{order}HHI", data, at)
        letter, size = ("H", 2) if kind == _SHORT else ("I", 4)
        place = at + 8 if count * size <= 4 else struct.unpack_from(f"{order}I", data, at + 8)[0]
        value = struct.unpack_from(f"{order}{letter}", data, place)[0] if kind in (_SHORT, _LONG) else 0
        yield at, tag, kind, value
