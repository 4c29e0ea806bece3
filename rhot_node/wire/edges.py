"""The payload of `edges`: what a node found on the slices that a master asked for. docs/wire.md, "Edges"."""

from __future__ import annotations

from struct import Struct

from rhot_node.errors import WireError
from rhot_node.wire.messages import SliceEdge, SliceEdges
from rhot_node.wire.plausible import expect_frame, expect_length, expect_node, expect_session

_HEAD = Struct("<qqIIIHHIIHHBB2s")
_RECORD = Struct("<HhhBBB")
OFFSET_PX, SD_PX, STRENGTH = 1 / 128, 1 / 64, 1 / 32
"""Units of a record's fields: offset and standard deviation px, slope grey levels per px."""
_SURE = 255  # a foreground probability of 1


def edges_fit(room: int) -> int:
    """How many fit a payload of `room` bytes."""
    return (room - _HEAD.size) // _RECORD.size


def encode_edges(message: SliceEdges) -> bytes:
    """The payload. Raises struct.error when a value does not fit its field."""
    parts = [_HEAD.pack(message.t_frame_node_ns, message.t_send_node_ns, message.processing_ns, message.exposure_ns,
                        message.row_time_ns, message.width, message.height, message.frame_number, message.request,
                        message.slice_count, len(message.edges), message.part, message.parts, b"\0\0")]
    parts.extend(_RECORD.pack(one.slice_index, round(one.offset / OFFSET_PX), round(one.strength / STRENGTH),
                              min(max(round(one.sd / SD_PX), 1), 255), round(_SURE * one.inside),
                              round(_SURE * one.outside)) for one in message.edges)
    return b"".join(parts)


def decode_edges(payload: memoryview, node_id: int, session: int, sequence: int) -> SliceEdges:
    """Raises WireError: length, header, reserved, time, size, index (of a slice or a part), range (an sd of 0)."""
    if len(payload) < _HEAD.size:
        raise WireError("length", f"payload of {len(payload)} bytes, edges begin with {_HEAD.size}")
    (t_frame, t_send, processing, exposure, row_time, width, height, frame_number, request, slices, count, part, parts,
     reserved) = _HEAD.unpack_from(payload)
    expect_length(payload, _HEAD.size + count * _RECORD.size)
    expect_node(node_id)
    expect_session(session)
    if any(reserved):
        raise WireError("reserved", "reserved bytes of edges are not zero")
    expect_frame(t_frame, t_send, width, height)
    if not part < parts:
        raise WireError("index", f"part {part} of {parts}")
    found = []
    for index, offset, strength, sd, inside, outside in _RECORD.iter_unpack(payload[_HEAD.size:]):
        if index >= slices:
            raise WireError("index", f"slice {index} of {slices}")
        if sd == 0:
            raise WireError("range", f"an edge of slice {index} has a standard deviation of 0")
        found.append(SliceEdge(index, offset * OFFSET_PX, sd * SD_PX, strength * STRENGTH, inside / _SURE,
                               outside / _SURE))
    return SliceEdges(node_id, session, sequence, t_frame, t_send, processing, exposure, row_time, width, height,
                      frame_number, request, slices, part, parts, tuple(found))
