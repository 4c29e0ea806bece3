"""The payload of `fiducials`: the corners of the fiducial tags in one frame. docs/wire.md, "Fiducials"."""

from __future__ import annotations

from struct import Struct

from rhot_node.errors import WireError
from rhot_node.wire.marker_table import COVARIANCE_MAX, IMAGE_MARGIN
from rhot_node.wire.messages import FAMILIES, Fiducial, Fiducials
from rhot_node.wire.plausible import expect_frame, expect_length, expect_node, expect_session, expect_zeros

FLAG_TRUNCATED = 1  # bit 0 of the flags: there were more fiducials than fit

_HEAD = Struct("<qqIIIHHIBB2s")
_RECORD = Struct("<BBH8f12f")
_ZEROS = b"\0\0"


def fiducials_fit(room: int) -> int:
    """How many fit a payload of `room` bytes."""
    return (room - _HEAD.size) // _RECORD.size


def encode_fiducials(message: Fiducials, most: int) -> bytes:
    """The payload with the first `most` fiducials. Raises struct.error when a value does not fit its field."""
    kept = message.fiducials[:most]
    truncated = message.truncated or len(kept) < len(message.fiducials)
    parts = [_HEAD.pack(message.t_frame_node_ns, message.t_send_node_ns, message.processing_ns, message.exposure_ns,
                        message.row_time_ns, message.width, message.height, message.frame_number, len(kept),
                        FLAG_TRUNCATED if truncated else 0, _ZEROS)]
    parts.extend(_RECORD.pack(one.family, 0, one.number, *one.corners, *one.covariances) for one in kept)
    return b"".join(parts)


def decode_fiducials(payload: memoryview, node_id: int, session: int, sequence: int) -> Fiducials:
    """Raises WireError: length, header, reserved, flags, time, size, index (an unknown family), marker (implausible
    corners)."""
    if len(payload) < _HEAD.size:
        raise WireError("length", f"payload of {len(payload)} bytes, fiducials begin with {_HEAD.size}")
    (t_frame, t_send, processing, exposure, row_time, width, height, frame_number, count, flags,
     reserved) = _HEAD.unpack_from(payload)
    expect_length(payload, _HEAD.size + count * _RECORD.size)
    expect_node(node_id)
    expect_session(session)
    expect_zeros(reserved)
    if flags & ~FLAG_TRUNCATED:
        raise WireError("flags", f"unknown flags of fiducials {flags:#04x}")
    expect_frame(t_frame, t_send, width, height)
    found = tuple(_fiducial(record, width, height) for record in _RECORD.iter_unpack(payload[_HEAD.size:]))
    return Fiducials(node_id, session, sequence, t_frame, t_send, processing, exposure, row_time, width, height,
                     frame_number, found, bool(flags & FLAG_TRUNCATED))


def _fiducial(record: tuple[float, ...], width: int, height: int) -> Fiducial:
    family, zero, number = (int(value) for value in record[:3])
    if zero:
        raise WireError("reserved", "reserved byte of a fiducial is not zero")
    if family >= len(FAMILIES):
        raise WireError("index", f"family {family}, of {len(FAMILIES)}")
    corners, covariances = record[3:11], record[11:]
    if not (all(-IMAGE_MARGIN <= x <= width - 1 + IMAGE_MARGIN for x in corners[::2])
            and all(-IMAGE_MARGIN <= y <= height - 1 + IMAGE_MARGIN for y in corners[1::2])):
        raise WireError("marker", f"fiducial {number} lies outside the image: {corners}")
    for xx, xy, yy in zip(covariances[::3], covariances[1::3], covariances[2::3], strict=True):
        if not (0.0 < xx <= COVARIANCE_MAX and 0.0 < yy <= COVARIANCE_MAX
                and xy * xy <= xx * yy * (1.0 + 1e-6)):  # room for rounding to single precision
            raise WireError("marker", f"fiducial {number} has an impossible covariance: {(xx, xy, yy)}")
    return Fiducial(family, number, corners, covariances)
