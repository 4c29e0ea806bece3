"""A motion JPEG video as an AVI file whose every picture carries its own number and time. Bytes and files; no threads.

``cv2.VideoWriter`` can write such a file too, but takes longer for a frame (docs/node.md, Videos), says nothing of a
disk that is full, and has no place for times. Layout: "AVI RIFF File Reference" (Microsoft).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import cv2

from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import VideoError
from rhot_node.files import open_input

JPEG_QUALITY: Final = 90
BYTES_MAX: Final = 2**32 - 2**26
"""An AVI file counts its bytes with 32 bits; what is left is room for the index of four million pictures."""

_HEADER = struct.Struct("<4sI4s 4sI4s 4sI14I 4sI4s 4sI4s4sIHH8I4H 4sIIIIHH4s5I 4sI4s")
_CHUNK = struct.Struct("<4sI")
_INDEX_ENTRY = struct.Struct("<4sIII")
_STAMP = struct.Struct("<4sIqII")
_STAMP_MAGIC = b"RHOT"
_PICTURE = b"00dc"
_PERIOD_US = 33_333  # from picture to picture, where there are not two of them
_HAS_INDEX = _KEY_FRAME = 0x10
_MARK_COMMENT = b"\xff\xfe"  # JPEG: ITU-T T.81, B.2.4.5


@dataclass(frozen=True, slots=True)
class Stamp:
    """What a picture says of itself. `t_node_ns`: mid-exposure of row 0, node clock; `number`: of the camera's frame,
    as in the observations."""

    number: int
    t_node_ns: int
    exposure_ns: int
    row_time_ns: int


@dataclass(frozen=True, slots=True)
class StoredPicture:
    """Where a JPEG lies in its file, and what it says of itself."""

    offset: int
    size: int
    stamp: Stamp


def encode_picture(image: YuvImage, stamp: Stamp) -> bytes:
    """The image as JPEG with `stamp` as a comment behind the first segment, which players skip."""
    jpeg = cv2.imencode(".jpg", to_bgr(image), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()
    comment = _STAMP.pack(_STAMP_MAGIC, stamp.number, stamp.t_node_ns, stamp.exposure_ns, stamp.row_time_ns)
    at = _behind_first_segment(jpeg)
    return b"".join((jpeg[:at], _MARK_COMMENT, (2 + len(comment)).to_bytes(2, "big"), comment, jpeg[at:]))


def begin_video(file: BinaryIO, width: int, height: int) -> None:
    """Write the header of a video without pictures; `finish_video` puts the numbers in."""
    file.write(_header(width, height, 0, 0, 0, _PERIOD_US))


def append_picture(file: BinaryIO, jpeg: bytes) -> None:
    """Add a picture at the end."""
    file.write(_CHUNK.pack(_PICTURE, len(jpeg)) + jpeg + b"\0" * (len(jpeg) % 2))


def pictures_of(file: BinaryIO) -> Iterator[StoredPicture]:
    """All whole pictures of a video, also of one that was never finished. Raises VideoError for another file."""
    video_size(file)
    end = file.seek(0, os.SEEK_END)
    at = _HEADER.size
    while at + _CHUNK.size <= end:
        file.seek(at)
        kind, size = _CHUNK.unpack(file.read(_CHUNK.size))
        begin = at + _CHUNK.size
        if kind != _PICTURE or begin + size + size % 2 > end:
            return
        stamp = _stamp_of(file.read(min(size, 256)))
        if stamp is None:
            return
        yield StoredPicture(begin, size, stamp)
        at = begin + size + size % 2


def finish_video(file: BinaryIO) -> int:
    """Cut off a torn picture, write index and header, and have the disk take it all; returns the number of pictures.

    Raises VideoError when it is no such video, OSError when it cannot be written.
    """
    width, height = video_size(file)
    movi_at, end = _HEADER.size - 4, _HEADER.size
    index = bytearray()
    first_ns = last_ns = 0
    for picture in pictures_of(file):
        end = picture.offset + picture.size + picture.size % 2
        first_ns, last_ns = first_ns or picture.stamp.t_node_ns, picture.stamp.t_node_ns
        index += _INDEX_ENTRY.pack(_PICTURE, _KEY_FRAME, picture.offset - _CHUNK.size - movi_at, picture.size)
    count = len(index) // _INDEX_ENTRY.size
    file.truncate(end)
    file.seek(end)
    file.write(_CHUNK.pack(b"idx1", len(index)) + index)
    total = file.tell()
    file.seek(0)
    period_us = round((last_ns - first_ns) / 1e3 / (count - 1)) if count > 1 else _PERIOD_US
    file.write(_header(width, height, count, end, total, max(period_us, 1)))
    file.flush()
    os.fsync(file.fileno())
    return count


def read_stamps(path: Path) -> tuple[Stamp, ...]:
    """What the pictures of the video at `path` say of themselves, in its order. Raises VideoError."""
    try:
        with open_input(path) as file:
            return tuple(picture.stamp for picture in pictures_of(file))
    except OSError as exc:
        raise VideoError(f"{path}: cannot be read ({exc.strerror}).") from exc


def _header(width: int, height: int, count: int, end: int, total: int, period_us: int) -> bytes:
    """Everything before the first picture. `end`: of the last picture; `total`: of the file; 0 while not known."""
    riff, movi = max(total - 8, 0), max(end - _HEADER.size + 4, 4)
    biggest = width * height * 3
    return _HEADER.pack(
        b"RIFF", riff, b"AVI ", b"LIST", _HEADER.size - 32, b"hdrl",
        b"avih", 56, period_us, 0, 0, _HAS_INDEX, count, 0, 1, biggest, width, height, 0, 0, 0, 0,
        b"LIST", 116, b"strl",
        b"strh", 56, b"vids", b"MJPG", 0, 0, 0, 0, period_us, 1_000_000, 0, count, biggest, 0xFFFFFFFF, 0,
        0, 0, width, height,
        b"strf", 40, 40, width, height, 1, 24, b"MJPG", biggest, 0, 0, 0, 0,
        b"LIST", movi, b"movi")


def video_size(file: BinaryIO) -> tuple[int, int]:
    """(width, height), px, from a video's header. Raises VideoError for another file."""
    file.seek(0)
    head = file.read(_HEADER.size)
    if len(head) < _HEADER.size or head[:4] != b"RIFF" or head[8:12] != b"AVI " or head[-4:] != b"movi":
        raise VideoError(f"{getattr(file, 'name', 'it')}: this is no video of a node.")
    width, height = struct.unpack_from("<II", head, 64)
    return width, height


def _stamp_of(jpeg: bytes) -> Stamp | None:
    at = _behind_first_segment(jpeg)
    comment = jpeg[at + 4:at + 4 + _STAMP.size]
    if jpeg[at:at + 2] != _MARK_COMMENT or len(comment) < _STAMP.size:
        return None
    magic, *values = _STAMP.unpack(comment)
    return Stamp(*values) if magic == _STAMP_MAGIC else None


def _behind_first_segment(jpeg: bytes) -> int:
    """Where the second segment begins: JFIF wants its own to be the first."""
    return 4 + int.from_bytes(jpeg[4:6], "big")
