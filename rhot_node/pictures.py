"""Pictures and video files that somebody else made, as the sensor gave their pixels: what else they say, such as that a
camera was held upright (EXIF), turns nothing.

A decoder meets no file that its first bytes do not call PNG, JPEG, TIFF or WebP, and none of more pixels than fit the
memory: OpenCV decodes twenty formats, and some by code with known errors (CVE-2025-53644, JPEG 2000).
"""

from __future__ import annotations

import enum
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
from rhot_node.wire.messages import U32_MAX

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
_BITS_MAX, _SAMPLES_MAX = 16, 4  # of a TIFF: what OpenCV reads well


class _Mark(enum.IntEnum):
    """Second bytes of JPEG's markers that are looked at (ITU-T T.81, table B.1)."""

    FIRST_FRAME = 0xC0
    HUFFMAN_TABLES = 0xC4
    RESERVED = 0xC8
    CONDITIONING = 0xCC
    LAST_FRAME = 0xCF
    FILL = 0xFF


class _Tag(enum.IntEnum):
    """Of TIFF 6.0."""

    WIDTH = 256
    HEIGHT = 257
    BITS = 258
    ORIENTATION = 274
    SAMPLES = 277
    ROWS = 278
    TILE_WIDTH = 322
    TILE_HEIGHT = 323


class _Type(enum.IntEnum):
    """Of a TIFF entry's values."""

    SHORT = 3
    LONG = 4


_PNG, _JPEG, _JPEG_BEGIN, _JPEG_END = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\xff\xd8", b"\xff\xd9"
_PNG_HEADER = struct.Struct(">I4sII")
_SEGMENT, _FRAME = struct.Struct(">BBH"), struct.Struct(">BBHBHH")
_NO_FRAMES = _Mark.HUFFMAN_TABLES, _Mark.RESERVED, _Mark.CONDITIONING
_WEBP_SIDE = 0x3FFF  # 14 bits of a side
_VP8X, _VP8L, _VP8 = struct.Struct("<20x4x3s3s"), struct.Struct("<20xBI"), struct.Struct("<20x3x3xHH")
_TIFF_ORDER = {b"II*\0": "<", b"MM\0*": ">"}
_TIFF_LAYOUT = {_Type.SHORT: "H", _Type.LONG: "I"}


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
    _, name, width, height = _PNG_HEADER.unpack_from(data, len(_PNG))
    if name != b"IHDR":
        raise PictureError("is cut off or damaged")
    return width, height


def _jpeg(data: bytes) -> tuple[int, int]:
    """By the frame's header: ITU-T T.81, B.2.2. A picture without its end would be filled up with grey."""
    if data.rfind(_JPEG_END) < (1.0 - _FORGIVEN) * len(data):
        raise PictureError("is cut off or damaged: its end is missing")
    at = len(_JPEG_BEGIN)
    for _ in range(_SEGMENTS_MAX):
        begin, kind, length = _SEGMENT.unpack_from(data, at)
        if begin != _Mark.FILL:
            break
        if kind == _Mark.FILL:
            at += 1
        elif _Mark.FIRST_FRAME <= kind <= _Mark.LAST_FRAME and kind not in _NO_FRAMES:
            *_, height, width = _FRAME.unpack_from(data, at)
            return width, height
        else:
            at += 2 + length
    raise PictureError("is cut off or damaged")


def _webp(data: bytes) -> tuple[int, int]:
    """By its first chunk: RFC 9649."""
    name = data[12:16]
    if name == b"VP8X":
        width, height = (1 + int.from_bytes(side, "little") for side in _VP8X.unpack_from(data))
        return width, height
    if name == b"VP8L":
        _, bits = _VP8L.unpack_from(data)
        return (bits & _WEBP_SIDE) + 1, (bits >> _WEBP_SIDE.bit_length() & _WEBP_SIDE) + 1
    width, height = _VP8.unpack_from(data)
    return width & _WEBP_SIDE, height & _WEBP_SIDE


def _tiff(data: bytes) -> tuple[int, int, bytes]:
    """By the first directory: TIFF 6.0. Its orientation is set to none, because OpenCV always follows it."""
    order = _TIFF_ORDER[data[:4]]
    found: dict[int, int] = {}
    turned = bytearray(data)
    for at, tag, kind, value in _tiff_entries(data, order):
        if tag == _Tag.ORIENTATION:
            struct.pack_into(f"{order}HHIHH", turned, at, tag, _Type.SHORT, 1, 1, 0)
        elif kind in _TIFF_LAYOUT:
            found[tag] = max(value, found.get(tag, 0))
    width, height = found.get(_Tag.WIDTH, 0), found.get(_Tag.HEIGHT, 0)
    rows = found.get(_Tag.ROWS, U32_MAX)
    _require_pixels(width, height)
    _require_pixels(found.get(_Tag.TILE_WIDTH, width),
                    found.get(_Tag.TILE_HEIGHT, height if rows == U32_MAX else rows))  # the strip is the picture
    if found.get(_Tag.BITS, 1) > _BITS_MAX or found.get(_Tag.SAMPLES, 1) > _SAMPLES_MAX:
        raise PictureError(f"is a TIFF of more than {_BITS_MAX} bits in {_SAMPLES_MAX} channels, which is not read")
    return width, height, bytes(turned)


def _tiff_entries(data: bytes, order: str) -> Iterator[tuple[int, int, int, int]]:
    """(place, tag, type, first value) of the first directory's entries."""
    begin = struct.unpack_from(f"{order}4xI", data)[0]
    number, entry = struct.Struct(f"{order}H"), struct.Struct(f"{order}HHI4s")
    at = begin + number.size
    for _ in range(number.unpack_from(data, begin)[0]):
        tag, kind, count, own = entry.unpack_from(data, at)
        value = 0
        if kind in _TIFF_LAYOUT:
            layout = struct.Struct(f"{order}{_TIFF_LAYOUT[kind]}")
            value = (layout.unpack_from(own) if count * layout.size <= len(own) else
                     layout.unpack_from(data, struct.unpack(f"{order}I", own)[0]))[0]
        yield at, tag, kind, value
        at += entry.size
