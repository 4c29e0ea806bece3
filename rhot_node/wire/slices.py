"""The payload of `slices`: line segments that a master asks a node to search for edges. docs/wire.md, "Slices"."""

from __future__ import annotations

from struct import Struct

import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import WireError
from rhot_node.wire.messages import Slices
from rhot_node.wire.plausible import IMAGE_SIZE_MAX, expect_length, expect_node, expect_session, expect_zeros

Array = NDArray[np.float64]

SLICES_MAX = 1024
"""Slices of one request: four times those of a hand 0.3 m away."""

MAP_STEPS = range(4, 65)
"""px between the pixels of a foreground map."""

PLACE_PX, HALF_PX, TURN_RAD = 1 / 4, 1 / 4, 2.0 * np.pi / 65536.0
"""Units of a record's fields."""

_HEAD = Struct("<IHHHHBBBB")
_RECORD = np.dtype([("x", "<u2"), ("y", "<u2"), ("turn", "<u2"), ("half", "u1")])


def slices_fit(room: int) -> int:
    """How many fit a payload of `room` bytes."""
    return (room - _HEAD.size) // _RECORD.itemsize


def pack_slices(slices: Array) -> bytes:
    """Records of slices (N, 5): centre x, y px, unit normal x, y, half length px; values are rounded to the units."""
    records = np.empty(len(slices), _RECORD)
    places = np.clip(np.round(slices[:, :2] / PLACE_PX), 0, 65535)
    records["x"], records["y"] = places.T
    records["turn"] = np.round(np.arctan2(slices[:, 3], slices[:, 2]) / TURN_RAD).astype(np.int64) & 0xFFFF
    records["half"] = np.clip(np.ceil(slices[:, 4] / HALF_PX), 1, 255)
    return records.tobytes()


def unpack_slices(records: bytes) -> Array:
    """(N, 5) slices of records, the same bits on every machine's master and node but for the sine and cosine."""
    read = np.frombuffer(records, _RECORD)
    turn = TURN_RAD * read["turn"]
    return np.column_stack([PLACE_PX * read["x"], PLACE_PX * read["y"], np.cos(turn), np.sin(turn),
                            HALF_PX * read["half"]])


def encode_slices(message: Slices) -> bytes:
    """The payload. Raises struct.error when a value does not fit its field."""
    count = len(message.records) // _RECORD.itemsize
    return _HEAD.pack(message.request, message.width, message.height, message.slice_count, count, message.part,
                      message.parts, message.map_step, 0) + message.records


def decode_slices(payload: memoryview, node_id: int, session: int, sequence: int) -> Slices:
    """Raises WireError: length, header, reserved, size, count (too many slices), index (of a part), range (a slice
    without length or outside of the image, a step of a map)."""
    if len(payload) < _HEAD.size:
        raise WireError("length", f"payload of {len(payload)} bytes, slices begin with {_HEAD.size}")
    request, width, height, total, count, part, parts, step, zero = _HEAD.unpack_from(payload)
    expect_length(payload, _HEAD.size + count * _RECORD.itemsize)
    expect_node(node_id)
    expect_session(session)
    expect_zeros(bytes([zero]))
    if not (0 < width <= IMAGE_SIZE_MAX and 0 < height <= IMAGE_SIZE_MAX):
        raise WireError("size", f"{width} x {height} px")
    if not count <= total <= SLICES_MAX:
        raise WireError("count", f"{count} of {total} slices, at most {SLICES_MAX}")
    if not part < parts:
        raise WireError("index", f"part {part} of {parts}")
    if step and step not in MAP_STEPS:
        raise WireError("range", f"a map of every {step} px")
    records = bytes(payload[_HEAD.size:])
    read = np.frombuffer(records, _RECORD)
    if count and (read["half"].min() == 0 or PLACE_PX * read["x"].max() > width - 1
                  or PLACE_PX * read["y"].max() > height - 1):
        raise WireError("range", "a slice has no length, or its centre lies outside of the image")
    return Slices(node_id, session, sequence, request, width, height, total, part, parts, step, records)
