"""Fields that several kinds of messages share: the header, the head of what is said of a frame, and what a decoder
expects of them. WireError says which was not so."""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct
from typing import Any, TypeVar, overload

from numpy.typing import NDArray

from rhot_node.errors import WireError
from rhot_node.wire.messages import FrameHead, FrameMessage

T = TypeVar("T")

HEADER = Struct("<4sBBHIQI")
"""Magic, version, type, flags, node, session, sequence."""

TAG_LENGTH = 16  # bytes
UDP_MAX = 65535  # bytes of the longest datagram that there can be
RECEIVE_MAX = 8192  # bytes read of a datagram; the longest of ours, a start message, has 4108
BURST = 256  # datagrams taken from a socket before anything else is looked at
DATAGRAM_MAX = 1472  # bytes of UDP payload in an Ethernet frame (1500 - 20 IPv4 - 8 UDP): nothing is fragmented
ROOM = DATAGRAM_MAX - HEADER.size - TAG_LENGTH  # bytes of a payload
FLAG_TRUNCATED = 1  # bit 0 of the flags of observations and fiducials: there were more than fit

TIME_MAX_NS = 1 << 62  # the difference of two times must fit 64 bits
FRAME_AGE_MAX_NS = 60_000_000_000  # no frame is sent later than this after its exposure
IMAGE_SIZE_MAX = 16384  # px
IMAGE_MARGIN = 64.0  # px; the centre of a marker cut by the border may lie this far outside
COVARIANCE_MAX = 1e8  # px^2; also keeps the determinant finite in single precision

FRAME = Struct("<qqIIIHHI")
"""What the payload of every message about a frame begins with."""

FRAME_ROOM = ROOM - FRAME.size  # bytes of a frame's payload behind what all of them begin with


def encode_frame(message: FrameMessage) -> bytes:
    """What the payload of a message about a frame begins with. Raises struct.error when a value does not fit."""
    return FRAME.pack(message.t_frame_node_ns, message.t_send_node_ns, message.processing_ns, message.exposure_ns,
                       message.row_time_ns, message.width, message.height, message.frame_number)


def decode_frame(payload: memoryview, node_id: int, session: int, sequence: int) -> FrameHead:
    """The fields of `FrameMessage`. Raises WireError: length, header, time, size."""
    t_frame, t_send, processing, exposure, row_time, width, height, number = begin(payload, FRAME)
    expect_node(node_id)
    expect_session(session)
    if not -TIME_MAX_NS < t_frame <= t_send <= t_frame + FRAME_AGE_MAX_NS < TIME_MAX_NS:
        raise WireError("time", f"taken at {t_frame} ns, sent at {t_send} ns")
    expect_size(width, height)
    return node_id, session, sequence, t_frame, t_send, processing, exposure, row_time, width, height, number


def begin(payload: memoryview, layout: Struct) -> tuple[Any, ...]:
    """The values with which a payload begins. Raises WireError 'length'."""
    if len(payload) < layout.size:
        raise WireError("length", f"payload of {len(payload)} bytes, it begins with {layout.size}")
    return layout.unpack_from(payload)


def expect_length(payload: memoryview, expected: int) -> None:
    """Raises WireError 'length'."""
    if len(payload) != expected:
        raise WireError("length", f"payload of {len(payload)} bytes where {expected} belong")


def expect_node(node_id: int) -> None:
    """That of a message of or to one node. Raises WireError 'header'."""
    if node_id == 0:
        raise WireError("header", "node id 0 in a message of or to one node")


def expect_everybody(node_id: int) -> None:
    """That of a message to all nodes, which is 0. Raises WireError 'header'."""
    if node_id != 0:
        raise WireError("header", f"node id {node_id} in a message to all nodes")


def expect_session(session: int) -> None:
    """That of a message that belongs to a session. Raises WireError 'header'."""
    if session == 0:
        raise WireError("header", "session 0 names no session")


def expect_no_session(session: int) -> None:
    """That of a message that belongs to none, which is 0. Raises WireError 'header'."""
    if session != 0:
        raise WireError("header", f"session {session} in a message of no session")


def expect_zeros(reserved: bytes | memoryview) -> None:
    """Raises WireError 'reserved'."""
    if reserved != bytes(len(reserved)):
        raise WireError("reserved", "reserved bytes are not zero")


def expect_time(*times_ns: int) -> None:
    """Raises WireError 'time'."""
    for time_ns in times_ns:
        if not -TIME_MAX_NS < time_ns < TIME_MAX_NS:
            raise WireError("time", f"{time_ns} ns")


def expect_size(width: int, height: int) -> None:
    """That of an image, px. Raises WireError 'size'."""
    if not (0 < width <= IMAGE_SIZE_MAX and 0 < height <= IMAGE_SIZE_MAX):
        raise WireError("size", f"{width} x {height} px")


def expect_part(part: int, parts: int) -> None:
    """One of several datagrams. Raises WireError 'index'."""
    if not part < parts:
        raise WireError("index", f"part {part} of {parts}")


def expect_point(what: str, place: Sequence[float], covariance: Sequence[float], width: int, height: int) -> None:
    """A `place` (x, y) px in or near an image, and its covariance xx, xy, yy px^2. Raises WireError 'marker'."""
    (x, y), (xx, xy, yy) = place, covariance
    if not (-IMAGE_MARGIN <= x <= width - 1 + IMAGE_MARGIN and -IMAGE_MARGIN <= y <= height - 1 + IMAGE_MARGIN):
        raise WireError("marker", f"{what} lies outside the image: {(x, y)}")
    if not (0.0 < xx <= COVARIANCE_MAX and 0.0 < yy <= COVARIANCE_MAX
            and xy * xy <= xx * yy * (1.0 + 1e-6)):  # room for rounding to single precision
        raise WireError("marker", f"{what} has an impossible covariance: {(xx, xy, yy)}")


class Table(Sequence[T]):
    """Records over the bytes of a datagram; it equals any sequence of equal records."""

    __slots__ = ("_records",)

    def __init__(self, records: NDArray[Any]) -> None:
        """`records`: a row each."""
        self._records = records

    def _record(self, item: int) -> T:
        raise NotImplementedError

    def __len__(self) -> int:
        return len(self._records)

    @overload
    def __getitem__(self, item: int) -> T: ...
    @overload
    def __getitem__(self, item: slice) -> list[T]: ...
    def __getitem__(self, item: int | slice) -> T | list[T]:
        if isinstance(item, slice):
            return [self._record(row) for row in range(*item.indices(len(self)))]
        return self._record(item)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]  # as a list's
