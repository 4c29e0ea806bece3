"""Messages to bytes and back, as docs/wire.md lays them out: little-endian, versioned, nothing implausible accepted."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from hmac import compare_digest
from struct import Struct
from struct import error as struct_error

from rhot_node.errors import WireError
from rhot_node.wire.discovery import decode_find, decode_here, encode_find, encode_here
from rhot_node.wire.edges import decode_edges, edges_fit, encode_edges
from rhot_node.wire.fiducials import decode_fiducials, encode_fiducials, fiducials_fit
from rhot_node.wire.foreground_map import decode_foreground, encode_foreground, part_room
from rhot_node.wire.hand_landmarks import decode_hand_landmarks, encode_hand_landmarks, hands_fit
from rhot_node.wire.marker_table import candidate_table, marker_table
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Fiducials,
    Find,
    ForegroundPart,
    HandLandmarks,
    Here,
    MarkerFlag,
    Message,
    NodeState,
    Observations,
    SliceEdges,
    Slices,
    Start,
    StartEntry,
    Stop,
)
from rhot_node.wire.plausible import (
    expect_everybody,
    expect_frame,
    expect_length,
    expect_node,
    expect_session,
    expect_time,
    expect_zeros,
)
from rhot_node.wire.slices import decode_slices, encode_slices, slices_fit

# -- authentication tags -----------------------------------------------------------------------------------------------
# Keyed BLAKE2b, 16 bytes at the end of a datagram (docs/wire.md, "Tags").

KEY_LENGTH = 32  # bytes
TAG_LENGTH = 16  # bytes
_PERSON = b"RHOT datagram 1"  # a key that somebody used elsewhere too would make other tags there


class Seal:
    """One secret key, shared by a node and one master for one link. Knows neither sockets nor messages."""

    __slots__ = ("_keyed",)

    def __init__(self, key: bytes) -> None:
        """`key`: KEY_LENGTH random bytes. Raises ValueError for any other length."""
        if len(key) != KEY_LENGTH:
            raise ValueError(f"a key has {KEY_LENGTH} bytes, not {len(key)}")
        self._keyed = hashlib.blake2b(key=key, digest_size=TAG_LENGTH, person=_PERSON)

    def tag(self, covered: bytes | bytearray | memoryview) -> bytes:
        """The tag of `covered`, everything that stands before it, the header with bit 0 of its flags set included."""
        state = self._keyed.copy()  # the key's block is hashed once, when the seal is made
        state.update(covered)
        return state.digest()

    def verifies(self, datagram: bytes | bytearray | memoryview) -> bool:
        """Whether the datagram ends with the tag of all that stands before; takes equally long wherever they differ."""
        view = memoryview(datagram)
        return compare_digest(self.tag(view[:-TAG_LENGTH]), view[-TAG_LENGTH:])


# -- messages ----------------------------------------------------------------------------------------------------------

MAGIC = b"RHOT"
VERSION = 1
OBSERVATIONS_VERSION = 2  # of observations; their version 1, without further candidates, is still read
FLAG_TAGGED = 1  # bit 0 of the header's flags: an authentication tag of TAG_LENGTH bytes ends the datagram

TYPE_OBSERVATIONS = 1
TYPE_CLOCK_REQUEST = 2
TYPE_CLOCK_REPLY = 3
TYPE_START = 4
TYPE_STOP = 5
TYPE_FIND = 6
TYPE_HERE = 7
TYPE_FIDUCIALS = 8
TYPE_EDGES = 9
TYPE_SLICES = 10
TYPE_FOREGROUND = 11
TYPE_HAND_LANDMARKS = 12

MARKERS_MAX = 64
DATAGRAM_MAX = 1472  # bytes of UDP payload in an Ethernet frame (1500 - 20 IPv4 - 8 UDP): nothing is fragmented
FLAG_TRUNCATED = 1  # bit 0 of the observations' flags: there were more candidates than fit

_HEADER = Struct("<4sBBHIQI")
_FLAGS_AT = 6  # offset of the header's flags
_TAGGED = FLAG_TAGGED.to_bytes(2, "little")
_OBSERVATIONS = Struct("<qqIIIHHIIB3s")
_MARKER = Struct("<HHfffffff")
CANDIDATES_FIT = (DATAGRAM_MAX - _HEADER.size - _OBSERVATIONS.size - TAG_LENGTH) // _MARKER.size
FIDUCIALS_FIT = fiducials_fit(DATAGRAM_MAX - _HEADER.size - TAG_LENGTH)
EDGES_FIT = edges_fit(DATAGRAM_MAX - _HEADER.size - TAG_LENGTH)
SLICES_FIT = slices_fit(DATAGRAM_MAX - _HEADER.size - TAG_LENGTH)
HANDS_FIT = hands_fit(DATAGRAM_MAX - _HEADER.size - TAG_LENGTH)
FOREGROUND_FIT = part_room(DATAGRAM_MAX - _HEADER.size - TAG_LENGTH)
_CLOCK_REQUEST = Struct("<q")
_CLOCK_REPLY = Struct("<qqqIB3s")
_START = Struct("<B3s")
_START_ENTRY = Struct("<IHHq")

Datagram = bytes | bytearray | memoryview

_ZEROS = b"\0\0\0"
_LOST = int(MarkerFlag.LOST)
_STATES = {int(state): state for state in NodeState}


def encode(message: Message, seal: Seal | None = None) -> bytes:
    """The datagram that says `message`, tagged by `seal` if there is one.

    Raises WireError 'range' when a value does not fit its field. It does not check plausibility: `decode` does.
    """
    try:
        plain = _encode(message)
    except (struct_error, OverflowError) as exc:
        raise WireError("range", f"{type(message).__name__}: {exc}") from exc
    if seal is None:
        return plain
    covered = b"".join((plain[:_FLAGS_AT], _TAGGED, plain[_FLAGS_AT + len(_TAGGED):]))
    return covered + seal.tag(covered)


def decode(data: Datagram) -> Message:
    """The message of one untagged datagram. Raises WireError, and nothing else, whatever the bytes are.

    Reasons: length, magic, version, flags, tag (there is one, but no key), type, header, reserved, count, index, time,
    size, marker, range.
    """
    if is_tagged(data):
        raise WireError("tag", "tagged, but no key is known")
    return _decode_body(data, memoryview(data)[_HEADER.size:])


def decode_sealed(data: Datagram, seal: Seal) -> Message:
    """The message of one datagram that `seal` tagged. Nothing behind the flags is looked at before the tag is verified.

    Raises WireError like `decode`; 'untagged' without a tag, 'tag' when it is another key's or the bytes were changed.
    """
    if not is_tagged(data):
        raise WireError("untagged", "no tag where one is required")
    if not seal.verifies(data):
        raise WireError("tag", "the tag is not that of this key and these bytes")
    return _decode_body(data, memoryview(data)[_HEADER.size:-TAG_LENGTH])


def decode_verified(data: Datagram) -> Message:
    """The message of one datagram whose tag, if any, was verified before: by the caller, or when it was recorded.

    Raises WireError like `decode`; never for what comes straight from a network.
    """
    body = memoryview(data)[_HEADER.size:]
    return _decode_body(data, body[:-TAG_LENGTH] if is_tagged(data) else body)


def node_of(data: Datagram) -> int:
    """The node that a datagram claims to be of, to find the key to verify it with. Raises WireError 'length'."""
    if len(data) < _HEADER.size:
        raise WireError("length", f"{len(data)} bytes, a header has {_HEADER.size}")
    return int(_HEADER.unpack_from(data)[4])


def asks_who_is_there(data: Datagram) -> bool:
    """Whether the datagram claims to be an untagged `Find`, the one message that every node takes from anybody. Raises
    WireError like `is_tagged`."""
    return not is_tagged(data) and _HEADER.unpack_from(data)[2] == TYPE_FIND


def is_tagged(data: Datagram) -> bool:
    """Whether the datagram has a tag and room for it. Raises WireError when it is none of ours."""
    if len(data) < _HEADER.size:
        raise WireError("length", f"{len(data)} bytes, a header has {_HEADER.size}")
    magic, version, _, flags, _, _, _ = _HEADER.unpack_from(data)
    if magic != MAGIC:
        raise WireError("magic", repr(magic))
    if version not in (VERSION, OBSERVATIONS_VERSION):
        raise WireError("version", f"{version}, this program speaks {VERSION} and {OBSERVATIONS_VERSION}")
    if flags & ~FLAG_TAGGED:
        raise WireError("flags", f"unknown header flags {flags:#06x}")
    if flags and len(data) < _HEADER.size + TAG_LENGTH:
        raise WireError("length", f"{len(data)} bytes, header and tag have {_HEADER.size + TAG_LENGTH}")
    return bool(flags)


def _decode_body(data: Datagram, payload: memoryview) -> Message:
    _, version, kind, _, node_id, session, sequence = _HEADER.unpack_from(data)
    if kind == TYPE_OBSERVATIONS:
        return _decode_observations(payload, node_id, session, sequence, version)
    decoder = _DECODERS.get(kind)
    if decoder is None:
        raise WireError("type", str(kind))
    if version != VERSION:
        raise WireError("version", f"{version} of a message of type {kind}, this program speaks {VERSION}")
    return decoder(payload, node_id, session, sequence)


def _encode(message: Message) -> bytes:
    match message:
        case Observations():
            return _encode_observations(message)
        case ClockRequest():
            return (_header(TYPE_CLOCK_REQUEST, message.node_id, message.session, message.sequence)
                    + _CLOCK_REQUEST.pack(message.t1_master_ns))
        case ClockReply():
            return (_header(TYPE_CLOCK_REPLY, message.node_id, message.session, message.sequence)
                    + _CLOCK_REPLY.pack(message.t1_master_ns, message.t2_node_ns, message.t3_node_ns,
                                        message.boot_id, message.state, _ZEROS))
        case Start():
            return _encode_start(message)
        case Stop():
            return _header(TYPE_STOP, 0, message.session, message.sequence)
        case Find():
            return _header(TYPE_FIND, message.node_id, 0, message.sequence) + encode_find(message)
        case Here():
            return _header(TYPE_HERE, message.node_id, 0, message.sequence) + encode_here(message)
        case Fiducials():
            return (_header(TYPE_FIDUCIALS, message.node_id, message.session, message.sequence)
                    + encode_fiducials(message, FIDUCIALS_FIT))
        case SliceEdges():
            if len(message.edges) > EDGES_FIT:
                raise WireError("count", f"{len(message.edges)} edges, at most {EDGES_FIT} in a datagram")
            return (_header(TYPE_EDGES, message.node_id, message.session, message.sequence)
                    + encode_edges(message))
        case Slices():
            return _header(TYPE_SLICES, message.node_id, message.session, message.sequence) + encode_slices(message)
        case ForegroundPart():
            return (_header(TYPE_FOREGROUND, message.node_id, message.session, message.sequence)
                    + encode_foreground(message))
        case HandLandmarks():
            if len(message.hands) > HANDS_FIT:
                raise WireError("count", f"{len(message.hands)} hands, at most {HANDS_FIT} in a datagram")
            return (_header(TYPE_HAND_LANDMARKS, message.node_id, message.session, message.sequence)
                    + encode_hand_landmarks(message))


def _header(kind: int, node_id: int, session: int, sequence: int, version: int = VERSION) -> bytes:
    return _HEADER.pack(MAGIC, version, kind, 0, node_id, session, sequence)


def _encode_observations(message: Observations) -> bytes:
    found = [mark for mark in message.markers if not mark.flags.value & _LOST]
    kept = found[:CANDIDATES_FIT]
    truncated = message.truncated or len(found) > len(kept)
    parts = [
        _header(TYPE_OBSERVATIONS, message.node_id, message.session, message.sequence, OBSERVATIONS_VERSION),
        _OBSERVATIONS.pack(message.t_frame_node_ns, message.t_send_node_ns, message.processing_ns,
                           message.exposure_ns, message.row_time_ns, message.width, message.height,
                           message.frame_number, message.marker_checksum, message.marker_count,
                           bytes((len(kept), FLAG_TRUNCATED if truncated else 0, 0))),
    ]
    parts.extend([_MARKER.pack(m.index, m.flags.value, m.x, m.y, m.diameter, m.cov_xx, m.cov_xy, m.cov_yy, m.quality)
                  for m in kept])
    return b"".join(parts)


def _encode_start(message: Start) -> bytes:
    parts = [_header(TYPE_START, 0, message.session, message.sequence), _START.pack(len(message.entries), _ZEROS)]
    parts.extend(_START_ENTRY.pack(entry.node_id, entry.data_port, 0, entry.t_start_node_ns)
                 for entry in message.entries)
    return b"".join(parts)


def _decode_observations(payload: memoryview, node_id: int, session: int, sequence: int,
                         version: int) -> Observations:
    if len(payload) < _OBSERVATIONS.size:
        raise WireError("length", f"payload of {len(payload)} bytes, observations begin with {_OBSERVATIONS.size}")
    (t_frame, t_send, processing, exposure, row_time, width, height, frame_number, checksum, count,
     reserved) = _OBSERVATIONS.unpack_from(payload)
    if count > MARKERS_MAX:
        raise WireError("count", f"{count} markers, at most {MARKERS_MAX}")
    candidates, flags = count, 0
    if version == OBSERVATIONS_VERSION:
        candidates, flags, reserved = reserved[0], reserved[1], reserved[2:]
    expect_length(payload, _OBSERVATIONS.size + candidates * _MARKER.size)
    expect_node(node_id)
    expect_session(session)
    expect_zeros(reserved)
    if flags & ~FLAG_TRUNCATED:
        raise WireError("flags", f"unknown flags of observations {flags:#04x}")
    expect_frame(t_frame, t_send, width, height)
    read = candidate_table if version == OBSERVATIONS_VERSION else marker_table
    markers = read(bytes(payload[_OBSERVATIONS.size:]), count, width, height)
    return Observations(node_id, session, sequence, t_frame, t_send, processing, exposure, row_time, width, height,
                        frame_number, checksum, markers, bool(flags & FLAG_TRUNCATED))


def _decode_clock_request(payload: memoryview, node_id: int, session: int, sequence: int) -> ClockRequest:
    expect_length(payload, _CLOCK_REQUEST.size)
    expect_node(node_id)
    (t1,) = _CLOCK_REQUEST.unpack(payload)
    expect_time(t1)
    return ClockRequest(node_id, session, sequence, t1)


def _decode_clock_reply(payload: memoryview, node_id: int, session: int, sequence: int) -> ClockReply:
    expect_length(payload, _CLOCK_REPLY.size)
    expect_node(node_id)
    t1, t2, t3, boot_id, state, reserved = _CLOCK_REPLY.unpack(payload)
    expect_zeros(reserved)
    expect_time(t1, t2, t3)
    if t3 < t2:
        raise WireError("time", "replied before the request came")
    if state not in _STATES:
        raise WireError("range", f"node state {state}")
    return ClockReply(node_id, session, sequence, t1, t2, t3, boot_id, _STATES[state])


def _decode_start(payload: memoryview, node_id: int, session: int, sequence: int) -> Start:
    if len(payload) < _START.size:
        raise WireError("length", f"payload of {len(payload)} bytes, a start begins with {_START.size}")
    count, reserved = _START.unpack_from(payload)
    expect_length(payload, _START.size + count * _START_ENTRY.size)
    expect_everybody(node_id)
    expect_session(session)
    expect_zeros(reserved)
    entries = []
    for entry_id, port, zero, t_start in _START_ENTRY.iter_unpack(payload[_START.size:]):
        expect_node(entry_id)
        expect_time(t_start)
        if port == 0 or zero != 0:
            raise WireError("range", f"entry of node {entry_id}: port {port}, reserved {zero}")
        entries.append(StartEntry(entry_id, port, t_start))
    if len({entry.node_id for entry in entries}) != count:
        raise WireError("index", "a node has two entries")
    return Start(session, sequence, tuple(entries))


def _decode_stop(payload: memoryview, node_id: int, session: int, sequence: int) -> Stop:
    expect_length(payload, 0)
    expect_everybody(node_id)
    return Stop(session, sequence)


_DECODERS: dict[int, Callable[[memoryview, int, int, int], Message]] = {
    TYPE_CLOCK_REQUEST: _decode_clock_request,
    TYPE_CLOCK_REPLY: _decode_clock_reply,
    TYPE_START: _decode_start,
    TYPE_STOP: _decode_stop,
    TYPE_FIND: decode_find,
    TYPE_HERE: decode_here,
    TYPE_FIDUCIALS: decode_fiducials,
    TYPE_EDGES: decode_edges,
    TYPE_SLICES: decode_slices,
    TYPE_FOREGROUND: decode_foreground,
    TYPE_HAND_LANDMARKS: decode_hand_landmarks,
}
