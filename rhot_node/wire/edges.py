"""The payload of `edges`: what a node found on the slices that a master asked for. docs/wire.md, "Edges"."""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct
from typing import overload

import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import WireError
from rhot_node.wire.messages import SliceEdge, SliceEdges
from rhot_node.wire.plausible import expect_frame, expect_length, expect_node, expect_session

OFFSET_PX, SD_PX, STRENGTH = 1 / 128, 1 / 64, 1 / 32
"""Units of a record's fields: offset and standard deviation px, slope grey levels per px."""

_SURE = 255  # a foreground probability of 1
_HEAD = Struct("<qqIIIHHIIHHBB2s")
_RECORD = np.dtype([("slice", "<u2"), ("offset", "<i2"), ("strength", "<i2"), ("sd", "u1"), ("inside", "u1"),
                    ("outside", "u1")])


class EdgeTable(Sequence[SliceEdge]):
    """The edges of a datagram over its bytes; it equals any sequence of equal edges."""

    __slots__ = ("_records",)

    def __init__(self, records: bytes | memoryview) -> None:
        """`records`: as `pack_edges` makes them."""
        self._records = np.frombuffer(records, _RECORD)

    def __len__(self) -> int:
        return len(self._records)

    @overload
    def __getitem__(self, item: int) -> SliceEdge: ...
    @overload
    def __getitem__(self, item: slice) -> list[SliceEdge]: ...
    def __getitem__(self, item: int | slice) -> SliceEdge | list[SliceEdge]:
        if isinstance(item, slice):
            return [self[row] for row in range(*item.indices(len(self)))]
        index, offset, strength, sd, inside, outside = self._records[item].tolist()
        return SliceEdge(index, offset * OFFSET_PX, sd * SD_PX, strength * STRENGTH, inside / _SURE, outside / _SURE)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]  # as a list's

    @property
    def data(self) -> bytes:
        """The records' bytes."""
        return self._records.tobytes()

    def columns(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The slices' indices (N,), and (N, 5) offset px, sd px, strength, inside and outside of the edges."""
        read = self._records
        return read["slice"].astype(np.int64), np.column_stack([
            OFFSET_PX * read["offset"], SD_PX * read["sd"], STRENGTH * read["strength"], read["inside"] / _SURE,
            read["outside"] / _SURE])


def pack_edges(indices: NDArray[np.int64], values: NDArray[np.float64]) -> EdgeTable:
    """A table of edges: the inverse of `EdgeTable.columns`. Values beyond a field's range are cut to it."""
    records = np.empty(len(indices), _RECORD)
    records["slice"] = indices
    for name, column, unit, least, most in (("offset", 0, OFFSET_PX, -32768, 32767), ("sd", 1, SD_PX, 1, 255),
                                            ("strength", 2, STRENGTH, -32768, 32767), ("inside", 3, 1 / _SURE, 0, 255),
                                            ("outside", 4, 1 / _SURE, 0, 255)):
        records[name] = np.clip(np.round(values[:, column] / unit), least, most)
    return EdgeTable(records.tobytes())


def edges_fit(room: int) -> int:
    """How many fit a payload of `room` bytes."""
    return (room - _HEAD.size) // _RECORD.itemsize


def encode_edges(message: SliceEdges) -> bytes:
    """The payload. Raises struct.error when a value does not fit its field."""
    edges = message.edges
    if not isinstance(edges, EdgeTable):
        indices = np.array([one.slice_index for one in edges], np.int64)
        edges = pack_edges(indices, np.array([[one.offset, one.sd, one.strength, one.inside, one.outside]
                                              for one in edges]).reshape(len(indices), 5))
    return _HEAD.pack(message.t_frame_node_ns, message.t_send_node_ns, message.processing_ns, message.exposure_ns,
                      message.row_time_ns, message.width, message.height, message.frame_number, message.request,
                      message.slice_count, len(edges), message.part, message.parts, b"\0\0") + edges.data


def decode_edges(payload: memoryview, node_id: int, session: int, sequence: int) -> SliceEdges:
    """Raises WireError: length, header, reserved, time, size, index (of a slice or a part), range (an sd of 0)."""
    if len(payload) < _HEAD.size:
        raise WireError("length", f"payload of {len(payload)} bytes, edges begin with {_HEAD.size}")
    (t_frame, t_send, processing, exposure, row_time, width, height, frame_number, request, slices, count, part, parts,
     reserved) = _HEAD.unpack_from(payload)
    expect_length(payload, _HEAD.size + count * _RECORD.itemsize)
    expect_node(node_id)
    expect_session(session)
    if any(reserved):
        raise WireError("reserved", "reserved bytes of edges are not zero")
    expect_frame(t_frame, t_send, width, height)
    if not part < parts:
        raise WireError("index", f"part {part} of {parts}")
    found = EdgeTable(payload[_HEAD.size:])
    indices, values = found.columns()
    if count and indices.max() >= slices:
        raise WireError("index", f"slice {indices.max()} of {slices}")
    if count and values[:, 1].min() == 0.0:
        raise WireError("range", "an edge has a standard deviation of 0")
    return SliceEdges(node_id, session, sequence, t_frame, t_send, processing, exposure, row_time, width, height,
                      frame_number, request, slices, part, parts, found)
