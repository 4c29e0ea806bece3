"""Recordings of raw YUV420 frames with their times (``rhot-yuv``): written by the twin, played in real time.

A recording is a folder with ``recording.json`` (`YuvHeader`) and ``frames.i420``: packed I420 frames, one after the
other. docs/node.md describes it.
"""

from __future__ import annotations

import contextlib
import mmap
import time
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Annotated, Final, Literal, Self

import msgspec
import numpy as np
from msgspec import Meta

from rhot_node.capture.camera import NS_PER_S, EndOfRecording, Frame, PlayedCamera, i420_bytes, wait_until
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.detect.image import Plane, YuvImage, from_i420
from rhot_node.errors import CameraError
from rhot_node.files import open_input, read_document, write_document

FORMAT: Final = "rhot-yuv"
VERSION: Final = 1
HEADER_NAME = "recording.json"
FRAMES_NAME = "frames.i420"

Pixels = Annotated[int, Meta(ge=2, le=16384, multiple_of=2)]
Duration = Annotated[int, Meta(ge=0, le=2**32 - 1)]


class YuvHeader(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """``recording.json``. `times_ns`: mid-exposure of row 0 of each frame since the recording's start, increasing."""

    width: Pixels
    height: Pixels
    exposure_ns: Duration
    row_time_ns: Duration
    times_ns: list[int]
    format: Literal["rhot-yuv"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        if any(later <= earlier for earlier, later in zip(self.times_ns, self.times_ns[1:], strict=False)):
            raise ValueError("times_ns must increase from frame to frame")

    @property
    def frame_bytes(self) -> int:
        """Bytes of one packed I420 frame."""
        return i420_bytes(self.width, self.height)

    @property
    def period_ns(self) -> int:
        """Typical time from frame to frame, ns; that of a camera's settings for a single frame."""
        if len(self.times_ns) < 2:
            return round(NS_PER_S / CameraSettings().fps)
        return int(np.median(np.diff(self.times_ns)))


class YuvWriter:
    """Writes a recording. It can be opened only after `close`: the header is written last, all at once."""

    def __init__(self, folder: Path, width: int, height: int, exposure_ns: int, row_time_ns: int) -> None:
        """Create `folder` when absent; an older recording in it is replaced. Raises OSError, ValueError."""
        if width % 2 or height % 2:
            raise ValueError(f"a YUV420 frame needs an even width and height, not {width} x {height}")
        self._header = YuvHeader(width, height, exposure_ns, row_time_ns, [])
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        (folder / HEADER_NAME).unlink(missing_ok=True)
        self._file = (folder / FRAMES_NAME).open("wb")

    def append(self, t_ns: int, i420: Plane) -> None:
        """Add a frame: mid-exposure of row 0 since the recording's start, ns, and W * H * 3/2 bytes of packed I420."""
        if i420.dtype != np.uint8 or i420.size != self._header.frame_bytes:
            raise ValueError(f"a frame has {self._header.frame_bytes} uint8 values, not {i420.size} {i420.dtype}")
        times = self._header.times_ns
        if times and t_ns <= times[-1]:
            raise ValueError(f"frame times must increase: {t_ns} after {times[-1]} ns")
        self._file.write(np.ascontiguousarray(i420).data)
        times.append(int(t_ns))

    def close(self) -> None:
        """Write the header; the recording is then complete. May be called twice."""
        if not self._file.closed:
            self._file.close()
            write_document(self._folder / HEADER_NAME, self._header)

    def abandon(self) -> None:
        """Stop writing and leave no recording behind."""
        self._file.close()
        with contextlib.suppress(OSError):
            (self._folder / FRAMES_NAME).unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if kind is None:
            self.close()
        else:
            self.abandon()


class YuvRecording(PlayedCamera):
    """A recording as a camera: frame k is available at T0 + times[k] + exposure/2 + readout, host monotonic time.

    T0 is the time of opening, or the instant in `start_file` (`DelayedStart`). A reader that comes late gets the newest
    frame; the frame number shows the gap. Frames are views of the mapped file, without a copy.
    """

    def __init__(self, folder: Path, clock: NodeClock, start_file: Path | None = None) -> None:
        """Open `folder`; raises CameraError naming what is wrong with which file."""
        self._header = header = read_header(folder)
        self._map = _map_frames(folder / FRAMES_NAME, header)
        self._frames = np.frombuffer(self._map, dtype=np.uint8).reshape(-1, header.frame_bytes)
        self._next = 0  # index of the next frame of the recording
        super().__init__(clock, (header.width, header.height), header.exposure_ns, header.row_time_ns,
                         header.period_ns, start_file, header.times_ns[0])
        self._t0_ns = None if start_file else time.monotonic_ns()

    def rewind(self) -> None:
        """Play again, without a pause after the last frame."""
        times = self._header.times_ns
        end_ns = (self._t0_ns or 0) + times[-1] + self._header.period_ns - times[0]
        self._t0_ns = max(end_ns, time.monotonic_ns())
        self._start = None
        self._base += len(times)
        self._next = 0

    def close(self) -> None:
        """Unmap the file, unless somebody still looks at a frame; the last view then unmaps it."""
        self._frames = np.empty((0, 0), dtype=np.uint8)
        with contextlib.suppress(BufferError):
            self._map.close()

    def _first(self) -> YuvImage:
        return self._image(0)

    def _play(self, now_ns: int, deadline_ns: int) -> Frame | None:
        times, t0_ns = self._header.times_ns, self._t0_ns or 0
        if self._next >= len(times):
            raise EndOfRecording
        newest = bisect_right(times, now_ns - t0_ns - self._delay_ns) - 1
        index = max(self._next, newest)
        t_mid = t0_ns + times[index]
        if not wait_until(t_mid + self._delay_ns, deadline_ns):
            return None
        self._next = index + 1
        return self._frame(self._image(index), self._base + index, t_mid)

    def _image(self, index: int) -> YuvImage:
        return from_i420(self._frames[index], *self._size)


def read_header(folder: Path) -> YuvHeader:
    """The header of the recording in `folder`; raises CameraError when it is missing, wrong or empty."""
    if not folder.is_dir():
        raise CameraError(f"{folder}: no such folder; a yuv recording is a folder with {HEADER_NAME}.")
    path = folder / HEADER_NAME
    header = read_document(path, YuvHeader, format_name=FORMAT, version=VERSION, error=CameraError)
    if not header.times_ns:
        raise CameraError(f"{path}: the recording has no frames. Record it again.")
    return header


def read_images(folder: Path) -> Iterator[YuvImage]:
    """The images of the recording in `folder`, as views of the file. Raises CameraError."""
    header = read_header(folder)
    frames = np.frombuffer(_map_frames(folder / FRAMES_NAME, header), np.uint8)
    for frame in frames.reshape(-1, header.frame_bytes):
        yield from_i420(frame, header.width, header.height)


def _map_frames(path: Path, header: YuvHeader) -> mmap.mmap:
    """Map the frames privately: views are ordinary writable arrays, the file is never changed."""
    expected = header.frame_bytes * len(header.times_ns)
    try:
        size = path.stat().st_size
        if size != expected:
            raise CameraError(f"{path}: {size} bytes, but {len(header.times_ns)} frames of {header.width} x "
                              f"{header.height} px need {expected}. The recording is incomplete; record it again.")
        with open_input(path) as file:
            frames = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY)
    except OSError as exc:
        raise CameraError(f"{path}: cannot be opened ({exc.strerror}).") from exc
    frames.madvise(mmap.MADV_SEQUENTIAL)
    return frames
