"""The payloads of `find` and `here`: who is there, asked by anybody and answered to anybody, never tagged.

A question is as long as the longest answer, so that a node cannot be made to send more to somebody than was sent to it.
"""

from __future__ import annotations

from struct import Struct

from rhot_node.errors import WireError
from rhot_node.wire.messages import Find, Here, NodeState, TrustState
from rhot_node.wire.plausible import expect_length, expect_no_session, expect_node, expect_zeros

NAME_MAX = 64  # characters
NAME_BYTES_MAX = 4 * NAME_MAX  # UTF-8

_FIND = Struct("<Q")
_HERE = Struct("<QIHHHHBBH")
_PADDING = bytes(_HERE.size + NAME_BYTES_MAX - _FIND.size)

_STATES = {int(state): state for state in NodeState}
_TRUSTS = {int(trust): trust for trust in TrustState}


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
    if len(payload) < _HERE.size:
        raise WireError("length", f"payload of {len(payload)} bytes, an answer begins with {_HERE.size}")
    nonce, boot_id, *ports, state, trust, length = _HERE.unpack_from(payload)
    expect_length(payload, _HERE.size + length)
    expect_node(node_id)
    expect_no_session(session)
    if 0 in ports:
        raise WireError("range", "port 0")
    if state not in _STATES or trust not in _TRUSTS:
        raise WireError("range", f"node state {state}, trust {trust}")
    udp_port, control_port, preview_port, pairing_port = ports
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
