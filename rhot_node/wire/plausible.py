"""What a decoder expects of the fields that several kinds of messages share; WireError says which was not so."""

from __future__ import annotations

from rhot_node.errors import WireError

TIME_MAX_NS = 1 << 62  # the difference of two times must fit 64 bits
FRAME_AGE_MAX_NS = 60_000_000_000  # no frame is sent later than this after its exposure
IMAGE_SIZE_MAX = 16384  # px


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


def expect_frame(t_frame_ns: int, t_send_ns: int, width: int, height: int) -> None:
    """Times and image size of one frame. Raises WireError 'time' or 'size'."""
    expect_time(t_frame_ns, t_send_ns)
    if not 0 <= t_send_ns - t_frame_ns <= FRAME_AGE_MAX_NS:
        raise WireError("time", f"sent {(t_send_ns - t_frame_ns) / 1e9:.3f} s after its exposure")
    if not (0 < width <= IMAGE_SIZE_MAX and 0 < height <= IMAGE_SIZE_MAX):
        raise WireError("size", f"{width} x {height} px")
