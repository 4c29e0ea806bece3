"""The payloads between masters and nodes that are about no frame: clocks, start, stop, and who is there.

`find` and `here` are asked by anybody and answered to anybody, never tagged. A question is as long as the longest
answer, so that a node cannot be made to send more to somebody than was sent to it.
"""

from __future__ import annotations

from struct import Struct

from rhot_node.errors import WireError
from rhot_node.wire.fields import (
    begin,
    expect_everybody,
    expect_length,
    expect_no_session,
    expect_node,
    expect_session,
    expect_time,
    expect_zeros,
)
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Find,
    Here,
    NodeState,
    Start,
    StartEntry,
    Stop,
    TrustState,
)

NAME_MAX = 64  # characters
NAME_BYTES_MAX = 4 * NAME_MAX  # UTF-8

_CLOCK_REQUEST = Struct("<q")
_CLOCK_REPLY = Struct("<qqqIB3s")
_START = Struct("<B3s")
_START_ENTRY = Struct("<IHHq")
_FIND = Struct("<Q")
_HERE = Struct("<QIHHHHBBH")
_PADDING = bytes(_HERE.size + NAME_BYTES_MAX - _FIND.size)

_ZEROS = b"\0\0\0"
_STATES = {int(state): state for state in NodeState}
_TRUSTS = {int(trust): trust for trust in TrustState}


def encode_clock_request(message: ClockRequest) -> bytes:
    """The payload."""
    return _CLOCK_REQUEST.pack(message.t1_master_ns)


def decode_clock_request(payload: memoryview, node_id: int, session: int, sequence: int) -> ClockRequest:
    """Raises WireError: length, header, time."""
    expect_length(payload, _CLOCK_REQUEST.size)
    expect_node(node_id)
    (t1,) = _CLOCK_REQUEST.unpack(payload)
    expect_time(t1)
    return ClockRequest(node_id, session, sequence, t1)


def encode_clock_reply(message: ClockReply) -> bytes:
    """The payload."""
    return _CLOCK_REPLY.pack(message.t1_master_ns, message.t2_node_ns, message.t3_node_ns, message.boot_id,
                             message.state, _ZEROS)


def decode_clock_reply(payload: memoryview, node_id: int, session: int, sequence: int) -> ClockReply:
    """Raises WireError: length, header, reserved, time, range (an unknown state)."""
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


def encode_start(message: Start) -> bytes:
    """The payload."""
    return b"".join((_START.pack(len(message.entries), _ZEROS), *(
        _START_ENTRY.pack(entry.node_id, entry.data_port, 0, entry.t_start_node_ns) for entry in message.entries)))


def decode_start(payload: memoryview, node_id: int, session: int, sequence: int) -> Start:
    """Raises WireError: length, header, reserved, time, range (a port), index (a node twice)."""
    count, reserved = begin(payload, _START)
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


def encode_stop(_message: Stop) -> bytes:
    """Its header says all."""
    return b""


def decode_stop(payload: memoryview, node_id: int, session: int, sequence: int) -> Stop:
    """Raises WireError: length, header."""
    expect_length(payload, 0)
    expect_everybody(node_id)
    return Stop(session, sequence)


def encode_find(message: Find) -> bytes:
    """The payload of a question, padded."""
    return _FIND.pack(message.nonce) + _PADDING


def decode_find(payload: memoryview, node_id: int, session: int, sequence: int) -> Find:
    """Raises WireError: length, header, reserved."""
    expect_length(payload, _FIND.size + len(_PADDING))
    expect_no_session(session)
    expect_zeros(payload[_FIND.size:])
    return Find(node_id, sequence, *_FIND.unpack_from(payload))


def encode_here(message: Here) -> bytes:
    """The payload of an answer."""
    name = message.name.encode(errors="replace")
    return _HERE.pack(message.nonce, message.boot_id, message.udp_port, message.control_port, message.preview_port,
                      message.pairing_port, message.state, message.trust, len(name)) + name


def decode_here(payload: memoryview, node_id: int, session: int, sequence: int) -> Here:
    """Raises WireError: length, header, range (a port, the state, the trust, the name)."""
    nonce, boot_id, udp_port, control_port, preview_port, pairing_port, state, trust, length = begin(payload, _HERE)
    expect_length(payload, _HERE.size + length)
    expect_node(node_id)
    expect_no_session(session)
    if 0 in (udp_port, control_port, preview_port, pairing_port):
        raise WireError("range", "port 0")
    if state not in _STATES or trust not in _TRUSTS:
        raise WireError("range", f"node state {state}, trust {trust}")
    return Here(node_id, sequence, nonce, boot_id, udp_port, control_port, preview_port, pairing_port, _STATES[state],
                _TRUSTS[trust], _read_name(bytes(payload[_HERE.size:])))


def _read_name(data: bytes) -> str:
    """A name that may be shown: anybody can send one."""
    try:
        name = data.decode()
    except UnicodeDecodeError as exc:
        raise WireError("range", f"name: {exc.reason}") from exc
    if not 0 < len(name) <= NAME_MAX or not name.isprintable():
        raise WireError("range", f"name {name[:NAME_MAX]!r}")
    return name
