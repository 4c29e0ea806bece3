"""Messages to bytes and back, as docs/wire.md lays them out: little-endian, versioned, nothing implausible accepted."""

from __future__ import annotations

import enum
import hashlib
from collections.abc import Callable
from hmac import compare_digest
from struct import error as struct_error
from typing import Any

from rhot_node.errors import WireError
from rhot_node.wire import commands, points, search
from rhot_node.wire.fields import FRAME, HEADER, TAG_LENGTH, begin, decode_frame, encode_frame
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Fiducials,
    Find,
    ForegroundPart,
    FrameMessage,
    HandLandmarks,
    Here,
    Message,
    Observations,
    SliceEdges,
    Slices,
    Start,
    Stop,
)

# -- authentication tags -----------------------------------------------------------------------------------------------
# Keyed BLAKE2b, 16 bytes at the end of a datagram (docs/wire.md, "Tags").

KEY_LENGTH = 32  # bytes
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


# -- sequence numbers of one stream: what is new, doubled, late, or never came -----------------------------------------

class SequenceVerdict(enum.Enum):
    """What one sequence number says about its datagram."""

    FRESH = 0  # newer than all before
    LATE = 1  # overtaken, but seen for the first time
    DUPLICATE = 2
    STALE = 3  # older than the window
    JUMP = 4  # further ahead than any loss explains


class SequenceWindow:
    """Remembers the last `size` numbers. `lost` counts those that have not come (a late one is taken off again)."""

    def __init__(self, size: int = 512, longest_jump: int = 100_000) -> None:
        self._size = size
        self._mask = (1 << size) - 1
        self._longest_jump = longest_jump
        self._newest: int | None = None
        self._seen = 0  # bit k: number newest - k has come
        self.lost = 0

    def judge(self, sequence: int) -> SequenceVerdict:
        """What `sequence` says, without taking it in: a datagram refused for another reason must leave no trace."""
        newest = self._newest
        if newest is None:
            return SequenceVerdict.FRESH
        ahead = sequence - newest
        if ahead > 0:
            return SequenceVerdict.FRESH if ahead <= self._longest_jump else SequenceVerdict.JUMP
        if -ahead >= self._size:
            return SequenceVerdict.STALE
        return SequenceVerdict.DUPLICATE if self._seen >> -ahead & 1 else SequenceVerdict.LATE

    def take(self, sequence: int) -> None:
        """Take in a number that was judged FRESH or LATE."""
        newest = self._newest
        if newest is None:
            self._newest, self._seen = sequence, self._mask  # what was before the first one is not missing
        elif sequence > newest:
            ahead = sequence - newest
            self._seen = (self._seen << ahead | 1) & self._mask if ahead < self._size else 1
            self._newest = sequence
            self.lost += ahead - 1
        else:
            self._seen |= 1 << newest - sequence
            self.lost -= 1

    def restart(self) -> None:
        """The sender counts from new; the losses so far stay counted."""
        self._newest = None
        self._seen = 0


# -- messages ----------------------------------------------------------------------------------------------------------

MAGIC = b"RHOT"
VERSION = 1
FLAG_TAGGED = 1  # bit 0 of the header's flags: an authentication tag of TAG_LENGTH bytes ends the datagram

_FLAGS_AT = 6  # offset of the header's flags
_TAGGED = FLAG_TAGGED.to_bytes(2, "little")
_MESSAGES: dict[type, tuple[int, Callable[[Any], bytes], Callable[..., Message]]] = {
    Observations: (1, points.encode_observations, points.decode_observations),
    ClockRequest: (2, commands.encode_clock_request, commands.decode_clock_request),
    ClockReply: (3, commands.encode_clock_reply, commands.decode_clock_reply),
    Start: (4, commands.encode_start, commands.decode_start),
    Stop: (5, commands.encode_stop, commands.decode_stop),
    Find: (6, commands.encode_find, commands.decode_find),
    Here: (7, commands.encode_here, commands.decode_here),
    Fiducials: (8, points.encode_fiducials, points.decode_fiducials),
    SliceEdges: (9, search.encode_edges, search.decode_edges),
    Slices: (10, search.encode_slices, search.decode_slices),
    ForegroundPart: (11, search.encode_foreground, search.decode_foreground),
    HandLandmarks: (12, points.encode_hand_landmarks, points.decode_hand_landmarks),
}
"""The type of each message in the header, and what writes and reads its payload: of a frame's message, what follows
the head of all of them."""

_BY_TYPE = {number: (kind, decode) for kind, (number, _, decode) in _MESSAGES.items()}
_FIND = _MESSAGES[Find][0]

Datagram = bytes | bytearray | memoryview


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
    return _decode_body(data, memoryview(data)[HEADER.size:])


def decode_sealed(data: Datagram, seal: Seal) -> Message:
    """The message of one datagram that `seal` tagged. Nothing behind the flags is looked at before the tag is verified.

    Raises WireError like `decode`; 'untagged' without a tag, 'tag' when it is another key's or the bytes were changed.
    """
    if not is_tagged(data):
        raise WireError("untagged", "no tag where one is required")
    if not seal.verifies(data):
        raise WireError("tag", "the tag is not that of this key and these bytes")
    return _decode_body(data, memoryview(data)[HEADER.size:-TAG_LENGTH])


def decode_verified(data: Datagram) -> Message:
    """The message of one datagram whose tag, if any, was verified before: by the caller, or when it was recorded.

    Raises WireError like `decode`; never for what comes straight from a network.
    """
    body = memoryview(data)[HEADER.size:]
    return _decode_body(data, body[:-TAG_LENGTH] if is_tagged(data) else body)


def node_of(data: Datagram) -> int:
    """The node that a datagram claims to be of, to find the key to verify it with. Raises WireError 'length'."""
    return int(begin(memoryview(data), HEADER)[4])


def asks_who_is_there(data: Datagram) -> bool:
    """Whether the datagram claims to be an untagged `Find`, the one message that every node takes from anybody. Raises
    WireError like `is_tagged`."""
    return not is_tagged(data) and HEADER.unpack_from(data)[2] == _FIND


def is_tagged(data: Datagram) -> bool:
    """Whether the datagram has a tag and room for it. Raises WireError when it is none of ours."""
    if len(data) < HEADER.size:
        raise WireError("length", f"{len(data)} bytes, a header has {HEADER.size}")
    magic, version, _, flags, _, _, _ = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise WireError("magic", repr(magic))
    if version not in (VERSION, points.VERSION):
        raise WireError("version", f"{version}, this program speaks {VERSION} and {points.VERSION}")
    if flags & ~FLAG_TAGGED:
        raise WireError("flags", f"unknown header flags {flags:#06x}")
    if flags and len(data) < HEADER.size + TAG_LENGTH:
        raise WireError("length", f"{len(data)} bytes, header and tag have {HEADER.size + TAG_LENGTH}")
    return bool(flags)


def _decode_body(data: Datagram, payload: memoryview) -> Message:
    _, version, number, _, node_id, session, sequence = HEADER.unpack_from(data)
    if number not in _BY_TYPE:
        raise WireError("type", str(number))
    kind, decode_payload = _BY_TYPE[number]
    if kind is Observations:
        return points.decode_observations(payload, decode_frame(payload, node_id, session, sequence), version)
    if version != VERSION:
        raise WireError("version", f"{version} of a message of type {number}, this program speaks {VERSION}")
    if not issubclass(kind, FrameMessage):
        return decode_payload(payload, node_id, session, sequence)
    head = decode_frame(payload, node_id, session, sequence)
    return decode_payload(payload[FRAME.size:], head)


def _encode(message: Message) -> bytes:
    number, encode_payload, _ = _MESSAGES[type(message)]
    version = points.VERSION if number == _MESSAGES[Observations][0] else VERSION
    head = HEADER.pack(MAGIC, version, number, 0, message.node_id, message.session, message.sequence)
    if isinstance(message, FrameMessage):
        head += encode_frame(message)
    return head + encode_payload(message)
