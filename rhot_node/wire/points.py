"""The payloads of points in one frame: the corners of fiducial tags, and the landmarks of hands. docs/wire.md."""

from __future__ import annotations

from struct import Struct

from rhot_node.errors import WireError
from rhot_node.wire.fields import FLAG_TRUNCATED, FRAME_ROOM, begin, expect_length, expect_point, expect_zeros
from rhot_node.wire.messages import FAMILIES, LANDMARKS, Fiducial, Fiducials, FrameHead, HandLandmarks, LandmarkedHand

_TAGS = Struct("<BB2s")
_TAG = Struct("<BBH8f12f")
_HANDS = Struct("<B3s")
_HAND = Struct(f"<ff{5 * LANDMARKS}f")
_TAGS_FIT = (FRAME_ROOM - _TAGS.size) // _TAG.size
_HANDS_FIT = (FRAME_ROOM - _HANDS.size) // _HAND.size


def encode_fiducials(message: Fiducials) -> bytes:
    """The payload with the first fiducials, as many as fit. Raises struct.error when a value does not fit its field."""
    kept = message.fiducials[:_TAGS_FIT]
    truncated = message.truncated or len(kept) < len(message.fiducials)
    return b"".join((_TAGS.pack(len(kept), FLAG_TRUNCATED if truncated else 0, b"\0\0"), *(
        _TAG.pack(one.family, 0, one.number, *one.corners, *one.covariances) for one in kept)))


def decode_fiducials(payload: memoryview, head: FrameHead) -> Fiducials:
    """Raises WireError: length, reserved, flags, index (an unknown family), marker (implausible corners)."""
    count, flags, reserved = begin(payload, _TAGS)
    expect_length(payload, _TAGS.size + count * _TAG.size)
    expect_zeros(reserved)
    if flags & ~FLAG_TRUNCATED:
        raise WireError("flags", f"unknown flags of fiducials {flags:#04x}")
    found = tuple(_fiducial(record, head) for record in _TAG.iter_unpack(payload[_TAGS.size:]))
    return Fiducials(*head, found, bool(flags & FLAG_TRUNCATED))


def _fiducial(record: tuple[float, ...], head: FrameHead) -> Fiducial:
    family, zero, number = (int(value) for value in record[:3])
    if zero:
        raise WireError("reserved", "reserved byte of a fiducial is not zero")
    if family >= len(FAMILIES):
        raise WireError("index", f"family {family}, of {len(FAMILIES)}")
    corners, covariances = record[3:11], record[11:]
    for place, covariance in zip(_parts(corners, 2), _parts(covariances, 3), strict=True):
        expect_point(f"fiducial {number}", place, covariance, *head[8:10])
    return Fiducial(family, number, corners, covariances)


def encode_hand_landmarks(message: HandLandmarks) -> bytes:
    """The payload. Raises WireError 'count' for too many hands, struct.error when a value does not fit its field."""
    if len(message.hands) > _HANDS_FIT:
        raise WireError("count", f"{len(message.hands)} hands, at most {_HANDS_FIT} in a datagram")
    return b"".join((_HANDS.pack(len(message.hands), b"\0\0\0"), *(
        _HAND.pack(hand.presence, hand.right, *(value for point in hand.points for value in point))
        for hand in message.hands)))


def decode_hand_landmarks(payload: memoryview, head: FrameHead) -> HandLandmarks:
    """Raises WireError: length, reserved, range (a probability), marker (an implausible landmark)."""
    count, reserved = begin(payload, _HANDS)
    expect_length(payload, _HANDS.size + count * _HAND.size)
    expect_zeros(reserved)
    return HandLandmarks(*head, tuple(_hand(record, head) for record in _HAND.iter_unpack(payload[_HANDS.size:])))


def _hand(record: tuple[float, ...], head: FrameHead) -> LandmarkedHand:
    presence, right = record[:2]
    if not (0.0 <= presence <= 1.0 and 0.0 <= right <= 1.0):
        raise WireError("range", f"probabilities of a hand {(presence, right)}")
    points = _parts(record[2:], 5)
    for point in points:
        if point != (0.0, 0.0, 0.0, 0.0, 0.0):
            expect_point("a landmark", point[:2], point[2:], *head[8:10])
    return LandmarkedHand(presence, right, points)


def _parts(values: tuple[float, ...], size: int) -> tuple[tuple[float, ...], ...]:
    return tuple(values[at:at + size] for at in range(0, len(values), size))
