"""The payloads of searches that a master asks a node for: slices, the edges on them, and maps of the foreground.

docs/wire.md, "Slices", "Edges" and "Foreground".
"""

from __future__ import annotations

import zlib
from struct import Struct

import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import WireError
from rhot_node.wire.fields import (
    FRAME_ROOM,
    ROOM,
    Table,
    begin,
    expect_length,
    expect_node,
    expect_part,
    expect_session,
    expect_size,
    expect_zeros,
)
from rhot_node.wire.messages import ForegroundPart, FrameHead, SliceEdge, SliceEdges, Slices

Array = NDArray[np.float64]
Map = NDArray[np.float32]

SLICES_MAX = 1024
"""Slices of one request: four times those of a hand 0.3 m away."""

MAP_STEPS = range(4, 65)
"""px between the pixels of a foreground map."""

PLACE_PX, HALF_PX, TURN_RAD = 1 / 4, 1 / 4, 2.0 * np.pi / 65536.0
"""Units of a slice's fields."""

OFFSET_PX, SD_PX, STRENGTH = 1 / 128, 1 / 64, 1 / 32
"""Units of an edge's fields: offset and standard deviation px, slope grey levels per px."""

LEVELS = 17
"""Probabilities have so many steps: finer ones are noise, and compress badly. One of them is one half: unknown."""

_SURE = 255  # a foreground probability of 1
_SLICES = Struct("<IHHHHBBBB")
_SLICE = np.dtype([("x", "<u2"), ("y", "<u2"), ("turn", "<u2"), ("half", "u1")])
_EDGES = Struct("<IHHBB2s")
_EDGE = np.dtype([("slice", "<u2"), ("offset", "<i2"), ("strength", "<i2"), ("sd", "u1"), ("inside", "u1"),
                  ("outside", "u1")])
_FOREGROUND = Struct("<IHBBB1s")

SLICES_FIT = (ROOM - _SLICES.size) // _SLICE.itemsize
EDGES_FIT = (FRAME_ROOM - _EDGES.size) // _EDGE.itemsize
FOREGROUND_FIT = FRAME_ROOM - _FOREGROUND.size
"""What fits a datagram: slices, edges, and bytes of a compressed map."""


# -- slices ------------------------------------------------------------------------------------------------------------

def pack_slices(slices: Array) -> bytes:
    """Records of slices (N, 5): centre x, y px, unit normal x, y, half length px; values are rounded to the units."""
    records = np.empty(len(slices), _SLICE)
    places = np.clip(np.round(slices[:, :2] / PLACE_PX), 0, 65535)
    records["x"], records["y"] = places.T
    records["turn"] = np.round(np.arctan2(slices[:, 3], slices[:, 2]) / TURN_RAD).astype(np.int64) & 0xFFFF
    records["half"] = np.clip(np.ceil(slices[:, 4] / HALF_PX), 1, 255)
    return records.tobytes()


def unpack_slices(records: bytes) -> Array:
    """(N, 5) slices of records, the same bits on every machine's master and node but for the sine and cosine."""
    read = np.frombuffer(records, _SLICE)
    turn = TURN_RAD * read["turn"]
    return np.column_stack([PLACE_PX * read["x"], PLACE_PX * read["y"], np.cos(turn), np.sin(turn),
                            HALF_PX * read["half"]])


def encode_slices(message: Slices) -> bytes:
    """The payload. Raises struct.error when a value does not fit its field."""
    count = len(message.records) // _SLICE.itemsize
    return _SLICES.pack(message.request, message.width, message.height, message.slice_count, count, message.part,
                        message.parts, message.map_step, 0) + message.records


def decode_slices(payload: memoryview, node_id: int, session: int, sequence: int) -> Slices:
    """Raises WireError: length, header, reserved, size, count (too many slices), index (of a part), range (a slice
    without length or outside of the image, a step of a map)."""
    request, width, height, total, count, part, parts, step, zero = begin(payload, _SLICES)
    expect_length(payload, _SLICES.size + count * _SLICE.itemsize)
    expect_node(node_id)
    expect_session(session)
    expect_zeros(bytes([zero]))
    expect_size(width, height)
    if not count <= total <= SLICES_MAX:
        raise WireError("count", f"{count} of {total} slices, at most {SLICES_MAX}")
    expect_part(part, parts)
    if step and step not in MAP_STEPS:
        raise WireError("range", f"a map of every {step} px")
    records = bytes(payload[_SLICES.size:])
    read = np.frombuffer(records, _SLICE)
    if count and (read["half"].min() == 0 or PLACE_PX * read["x"].max() > width - 1
                  or PLACE_PX * read["y"].max() > height - 1):
        raise WireError("range", "a slice has no length, or its centre lies outside of the image")
    return Slices(node_id, session, sequence, request, width, height, total, part, parts, step, records)


# -- edges -------------------------------------------------------------------------------------------------------------

class EdgeTable(Table[SliceEdge]):
    """The edges of a datagram."""

    __slots__ = ()

    def __init__(self, records: bytes | memoryview) -> None:
        """`records`: as `pack_edges` makes them."""
        super().__init__(np.frombuffer(records, _EDGE))

    def _record(self, item: int) -> SliceEdge:
        index, offset, strength, sd, inside, outside = self._records[item].tolist()
        return SliceEdge(index, offset * OFFSET_PX, sd * SD_PX, strength * STRENGTH, inside / _SURE, outside / _SURE)

    @property
    def data(self) -> bytes:
        """The records' bytes."""
        return self._records.tobytes()

    def columns(self) -> tuple[NDArray[np.int64], Array]:
        """The slices' indices (N,), and (N, 5) offset px, sd px, strength, inside and outside of the edges."""
        read = self._records
        return read["slice"].astype(np.int64), np.column_stack([
            OFFSET_PX * read["offset"], SD_PX * read["sd"], STRENGTH * read["strength"], read["inside"] / _SURE,
            read["outside"] / _SURE])


def pack_edges(indices: NDArray[np.int64], values: Array) -> EdgeTable:
    """A table of edges: the inverse of `EdgeTable.columns`. Values beyond a field's range are cut to it."""
    records = np.empty(len(indices), _EDGE)
    records["slice"] = indices
    for name, column, unit, least, most in (("offset", 0, OFFSET_PX, -32768, 32767), ("sd", 1, SD_PX, 1, 255),
                                            ("strength", 2, STRENGTH, -32768, 32767), ("inside", 3, 1 / _SURE, 0, 255),
                                            ("outside", 4, 1 / _SURE, 0, 255)):
        records[name] = np.clip(np.round(values[:, column] / unit), least, most)
    return EdgeTable(records.tobytes())


def encode_edges(message: SliceEdges) -> bytes:
    """The payload. Raises WireError 'count' for too many edges, struct.error when a value does not fit its field."""
    edges = message.edges
    if len(edges) > EDGES_FIT:
        raise WireError("count", f"{len(edges)} edges, at most {EDGES_FIT} in a datagram")
    if not isinstance(edges, EdgeTable):
        indices = np.array([one.slice_index for one in edges], np.int64)
        edges = pack_edges(indices, np.array([[one.offset, one.sd, one.strength, one.inside, one.outside]
                                              for one in edges]).reshape(len(indices), 5))
    return _EDGES.pack(message.request, message.slice_count, len(edges), message.part, message.parts,
                       b"\0\0") + edges.data


def decode_edges(payload: memoryview, head: FrameHead) -> SliceEdges:
    """Raises WireError: length, reserved, index (of a slice or a part), range (an sd of 0)."""
    request, slices, count, part, parts, reserved = begin(payload, _EDGES)
    expect_length(payload, _EDGES.size + count * _EDGE.itemsize)
    expect_zeros(reserved)
    expect_part(part, parts)
    found = EdgeTable(payload[_EDGES.size:])
    indices, values = found.columns()
    if count and indices.max() >= slices:
        raise WireError("index", f"slice {indices.max()} of {slices}")
    if count and values[:, 1].min() == 0.0:
        raise WireError("range", "an edge has a standard deviation of 0")
    return SliceEdges(*head, request, slices, part, parts, found)


# -- maps of the foreground --------------------------------------------------------------------------------------------

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
    return _FOREGROUND.pack(message.request, len(message.data), message.step, message.part, message.parts,
                            b"\0") + message.data


def decode_foreground(payload: memoryview, head: FrameHead) -> ForegroundPart:
    """Raises WireError: length, reserved, index (of a part), range (the map's step)."""
    request, length, step, part, parts, zero = begin(payload, _FOREGROUND)
    expect_length(payload, _FOREGROUND.size + length)
    expect_zeros(zero)
    expect_part(part, parts)
    if step not in MAP_STEPS:
        raise WireError("range", f"a map of every {step} px")
    return ForegroundPart(*head, request, step, part, parts, bytes(payload[_FOREGROUND.size:]))
