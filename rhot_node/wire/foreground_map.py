"""The payload of `foreground`: a map of foreground probabilities, compressed, in parts. docs/wire.md, "Foreground"."""

from __future__ import annotations

import zlib
from struct import Struct

import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import WireError
from rhot_node.wire.messages import ForegroundPart
from rhot_node.wire.plausible import expect_frame, expect_length, expect_node, expect_session
from rhot_node.wire.slices import MAP_STEPS

Map = NDArray[np.float32]

LEVELS = 17
"""Probabilities have so many steps: finer ones are noise, and compress badly. One of them is one half: unknown."""

_HEAD = Struct("<qqIIIHHIIHBBB1s")


def part_room(room: int) -> int:
    """Bytes of a compressed map that fit a payload of `room` bytes."""
    return room - _HEAD.size


def pack_map(probabilities: Map) -> bytes:
    """The compressed map (h, w)."""
    levels = np.round((LEVELS - 1) * np.clip(probabilities, 0.0, 1.0)).astype(np.uint8)
    return zlib.compress(levels.tobytes(), 6)


def unpack_map(data: bytes, width: int, height: int, step: int) -> Map:
    """The map (height // step, width // step) of an image. Raises WireError 'range' when the bytes are none."""
    rows, columns = height // step, width // step
    reader = zlib.decompressobj()
    try:
        levels = np.frombuffer(reader.decompress(data, rows * columns + 1), np.uint8)
    except zlib.error as exc:
        raise WireError("range", f"a foreground map that is not compressed as it should be ({exc})") from exc
    if not reader.eof or levels.size != rows * columns or (levels.size and levels.max() >= LEVELS):
        raise WireError("range", f"a foreground map of {levels.size} values where {rows * columns} belong")
    return np.asarray(levels.reshape(rows, columns) / np.float32(LEVELS - 1), np.float32)


def encode_foreground(message: ForegroundPart) -> bytes:
    """The payload. Raises struct.error when a value does not fit its field."""
    return _HEAD.pack(message.t_frame_node_ns, message.t_send_node_ns, message.processing_ns, message.exposure_ns,
                      message.row_time_ns, message.width, message.height, message.frame_number, message.request,
                      len(message.data), message.step, message.part, message.parts, b"\0") + message.data


def decode_foreground(payload: memoryview, node_id: int, session: int, sequence: int) -> ForegroundPart:
    """Raises WireError: length, header, reserved, time, size, index (of a part), range (the map's step)."""
    if len(payload) < _HEAD.size:
        raise WireError("length", f"payload of {len(payload)} bytes, a foreground map begins with {_HEAD.size}")
    (t_frame, t_send, processing, exposure, row_time, width, height, frame_number, request, length, step, part,
     parts, zero) = _HEAD.unpack_from(payload)
    expect_length(payload, _HEAD.size + length)
    expect_node(node_id)
    expect_session(session)
    if any(zero):
        raise WireError("reserved", "the reserved byte of a foreground map is not zero")
    expect_frame(t_frame, t_send, width, height)
    if not part < parts:
        raise WireError("index", f"part {part} of {parts}")
    if step not in MAP_STEPS:
        raise WireError("range", f"a map of every {step} px")
    return ForegroundPart(node_id, session, sequence, t_frame, t_send, processing, exposure, row_time, width, height,
                          frame_number, request, step, part, parts, bytes(payload[_HEAD.size:]))
