"""Frames over a Unix socket: how a live twin, in another process, acts as a camera.

The twin listens on a Unix stream socket and sends, per frame, a header of 40 bytes (`pack_header`) and the packed
I420 bytes. The node connects, so that the twin need not know when nodes start or come back, and says first of all what
its camera is told (`pack_settings`), as a driver tells a sensor.
"""

from __future__ import annotations

import contextlib
import select
import socket
import time
from dataclasses import dataclass
from pathlib import Path
from struct import Struct

import msgspec
import numpy as np

from rhot_node.capture.camera import FIRST_FRAME_S, READ_S, SILENCE_S, Frame, i420_bytes
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.detect.image import from_i420
from rhot_node.errors import CameraError
from rhot_node.files import decode_message

MAGIC = b"RYUV"
SETTINGS_MAGIC = b"RSET"
VERSION = 1
CATCH_UP_FRAMES = 8  # waiting frames thrown away in one read, at most; a flood must not keep us here

_HEADER = Struct("<4sHHIIqII8x")
HEADER_BYTES = _HEADER.size
_SETTINGS_HEADER = Struct("<4sI")
SETTINGS_BYTES_MAX = 4096


@dataclass(frozen=True, slots=True)
class StreamHeader:
    """What precedes each frame. `t_mid_row0_host_ns`: mid-exposure of row 0, host monotonic clock."""

    width: int
    height: int
    number: int
    t_mid_row0_host_ns: int
    exposure_ns: int
    row_time_ns: int

    @property
    def frame_bytes(self) -> int:
        """Bytes of the packed I420 frame that follows."""
        return i420_bytes(self.width, self.height)


def pack_header(header: StreamHeader) -> bytes:
    """The 40 bytes before a frame: magic, width u16, height u16, version u32, number u32, time i64, exposure u32,
    row time u32, 8 zero bytes; little-endian. Raises struct.error when a value does not fit."""
    return _HEADER.pack(MAGIC, header.width, header.height, VERSION, header.number, header.t_mid_row0_host_ns,
                        header.exposure_ns, header.row_time_ns)


def unpack_header(data: bytes | bytearray | memoryview) -> StreamHeader:
    """Inverse of `pack_header`; raises CameraError when these are not the bytes of a header."""
    magic, width, height, version, number, t_mid, exposure, row_time = _HEADER.unpack(data)
    if magic != MAGIC or version != VERSION:
        raise CameraError(f"the stream does not speak {MAGIC.decode()} version {VERSION} (it begins {bytes(magic)!r}, "
                          f"version {version}). Are twin and node of the same release?")
    if width == 0 or height == 0 or width % 2 or height % 2:
        raise CameraError(f"the stream sends frames of {width} x {height} px; both must be even.")
    return StreamHeader(width, height, number, t_mid, exposure, row_time)


def pack_settings(settings: CameraSettings) -> bytes:
    """What the node sends once it has connected: ``RSET``, how many bytes follow (u32), the settings as JSON."""
    document = msgspec.json.encode(settings)
    return _SETTINGS_HEADER.pack(SETTINGS_MAGIC, len(document)) + document


def take_settings(received: bytearray) -> CameraSettings | None:
    """Cut the first whole settings message off what was received; None while it is incomplete.

    Raises CameraError when this is not one.
    """
    if len(received) < _SETTINGS_HEADER.size:
        return None
    magic, length = _SETTINGS_HEADER.unpack_from(received)
    if magic != SETTINGS_MAGIC or length > SETTINGS_BYTES_MAX:
        raise CameraError(f"a node sent {bytes(magic)!r} where it should say its camera's settings.")
    end = _SETTINGS_HEADER.size + length
    if len(received) < end:
        return None
    document = bytes(received[_SETTINGS_HEADER.size:end])
    del received[:end]
    try:
        return decode_message(document, CameraSettings)
    except msgspec.DecodeError as exc:
        raise CameraError(f"a node's camera settings cannot be read ({exc}).") from exc


class StreamCamera:
    """A live twin as a camera. When several frames wait, only the newest is used; the number shows the gap."""

    def __init__(self, path: Path, settings: CameraSettings, clock: NodeClock, *, connect_s: float = FIRST_FRAME_S,
                 silence_s: float = SILENCE_S) -> None:
        """Connect, tell the twin the settings and receive the first frame; raises CameraError when there is none within
        `connect_s`."""
        self._path = path
        self._clock = clock
        self._silence_s = silence_s
        self._socket = _connect(path, time.monotonic() + connect_s)
        with contextlib.suppress(OSError):  # a twin that is gone already shows by its missing frame
            self._socket.sendall(pack_settings(settings))
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._header_buffer = bytearray(HEADER_BYTES)
        self._heard_s = time.monotonic()
        self._size = (0, 0)
        self._pixels = np.empty(0, dtype=np.uint8)
        try:
            if not self._waiting(connect_s):
                raise CameraError(f"{path}: connected, but no frame came within {connect_s:.0f} s. "
                                  "Does the twin still run?")
            self._pending: Frame | None = self._receive()
        except CameraError:
            self.close()
            raise

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._size

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame. Raises CameraError when the twin is gone, silent or changes its image size."""
        frame, self._pending = self._pending, None
        if frame is None and self._waiting(timeout_s):
            frame = self._receive()
        if frame is None:
            if time.monotonic() - self._heard_s > self._silence_s:
                raise CameraError(f"{self._path}: no frame for {self._silence_s:.0f} s. Does the twin still run?")
            return None
        for _ in range(CATCH_UP_FRAMES):
            if not self._waiting(0.0):
                break
            frame = self._receive()
        return frame

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()

    def _waiting(self, timeout_s: float) -> bool:
        return bool(self._poll.poll(timeout_s * 1000.0))

    def _receive(self) -> Frame:
        self._fill(memoryview(self._header_buffer))
        header = unpack_header(self._header_buffer)
        size = (header.width, header.height)
        if not self._pixels.size:
            self._size = size
            self._pixels = np.empty(header.frame_bytes, dtype=np.uint8)
        elif size != self._size:
            raise CameraError(f"{self._path}: the image size changed from {self._size[0]} x {self._size[1]} to "
                              f"{size[0]} x {size[1]} px.")
        self._fill(self._pixels.data)
        self._heard_s = time.monotonic()
        return Frame(
            image=from_i420(self._pixels, *size),
            number=header.number,
            t_node_ns=self._clock.from_host_ns(header.t_mid_row0_host_ns),
            t_available_node_ns=self._clock.now_ns(),
            exposure_ns=header.exposure_ns,
            row_time_ns=header.row_time_ns,
        )

    def _fill(self, view: memoryview) -> None:
        """Receive exactly `view`; the rest of a frame that has begun must follow within the silence limit."""
        position = 0
        try:
            while position < len(view):
                count = self._socket.recv_into(view[position:])
                if count == 0:
                    raise CameraError(f"{self._path}: the twin closed the stream.")
                position += count
        except TimeoutError as exc:
            raise CameraError(f"{self._path}: the stream stopped in the middle of a frame.") from exc
        except OSError as exc:
            raise CameraError(f"{self._path}: the stream broke ({exc.strerror}).") from exc


def _connect(path: Path, deadline_s: float) -> socket.socket:
    while True:
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            connection.connect(str(path))
            connection.settimeout(SILENCE_S)
            return connection
        except OSError as exc:
            connection.close()
            if time.monotonic() >= deadline_s:
                reason = exc.strerror or str(exc)
                raise CameraError(f"{path}: no twin listens here ({reason}). Start the simulator first.") from exc
            time.sleep(READ_S)
