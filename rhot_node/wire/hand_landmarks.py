"""The payload of `hand_landmarks`: 21 landmarks of each hand in one frame. docs/wire.md, "Hand landmarks"."""

from __future__ import annotations

from struct import Struct

from rhot_node.errors import WireError
from rhot_node.wire.marker_table import COVARIANCE_MAX, IMAGE_MARGIN
from rhot_node.wire.messages import LANDMARKS, HandLandmarks, LandmarkedHand
from rhot_node.wire.plausible import expect_frame, expect_length, expect_node, expect_session, expect_zeros

_HEAD = Struct("<qqIIIHHIB3s")
_RECORD = Struct(f"<ff{5 * LANDMARKS}f")
_ZEROS = b"\0\0\0"


def hands_fit(room: int) -> int:
    """How many fit a payload of `room` bytes."""
    return (room - _HEAD.size) // _RECORD.size


def encode_hand_landmarks(message: HandLandmarks) -> bytes:
    """The payload. Raises struct.error when a value does not fit its field."""
    parts = [_HEAD.pack(message.t_frame_node_ns, message.t_send_node_ns, message.processing_ns, message.exposure_ns,
                        message.row_time_ns, message.width, message.height, message.frame_number, len(message.hands),
                        _ZEROS)]
    parts.extend(_RECORD.pack(hand.presence, hand.right, *(value for point in hand.points for value in point))
                 for hand in message.hands)
    return b"".join(parts)


def decode_hand_landmarks(payload: memoryview, node_id: int, session: int, sequence: int) -> HandLandmarks:
    """Raises WireError: length, header, reserved, time, size, range (a probability), marker (an implausible
    landmark)."""
    if len(payload) < _HEAD.size:
        raise WireError("length", f"payload of {len(payload)} bytes, hand landmarks begin with {_HEAD.size}")
    (t_frame, t_send, processing, exposure, row_time, width, height, frame_number, count,
     reserved) = _HEAD.unpack_from(payload)
    expect_length(payload, _HEAD.size + count * _RECORD.size)
    expect_node(node_id)
    expect_session(session)
    expect_zeros(reserved)
    expect_frame(t_frame, t_send, width, height)
    hands = tuple(_hand(record, width, height) for record in _RECORD.iter_unpack(payload[_HEAD.size:]))
    return HandLandmarks(node_id, session, sequence, t_frame, t_send, processing, exposure, row_time, width, height,
                         frame_number, hands)


def _hand(record: tuple[float, ...], width: int, height: int) -> LandmarkedHand:
    presence, right = record[:2]
    if not (0.0 <= presence <= 1.0 and 0.0 <= right <= 1.0):
        raise WireError("range", f"probabilities of a hand {(presence, right)}")
    points = tuple(record[k:k + 5] for k in range(2, len(record), 5))
    for x, y, xx, xy, yy in points:
        if (x, y, xx, xy, yy) == (0.0, 0.0, 0.0, 0.0, 0.0):
            continue
        if not (-IMAGE_MARGIN <= x <= width - 1 + IMAGE_MARGIN and -IMAGE_MARGIN <= y <= height - 1 + IMAGE_MARGIN):
            raise WireError("marker", f"a landmark lies outside the image: {(x, y)}")
        if not (0.0 < xx <= COVARIANCE_MAX and 0.0 < yy <= COVARIANCE_MAX
                and xy * xy <= xx * yy * (1.0 + 1e-6)):  # room for rounding to single precision
            raise WireError("marker", f"a landmark has an impossible covariance: {(xx, xy, yy)}")
    return LandmarkedHand(presence, right, points)
