"""Any message there and back; any bytes refused or taken for something plausible."""

from __future__ import annotations

import math
import random
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
from wire_samples import RHOT6_CHECKSUM, SAMPLES, lost, packet

from rhot_node.errors import WireError
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Fiducial,
    Fiducials,
    Find,
    HandLandmarks,
    Here,
    LandmarkedHand,
    MarkerFlag,
    MarkerObservation,
    Message,
    NodeState,
    Observations,
    Start,
    StartEntry,
    Stop,
    TrustState,
)

u32 = st.integers(0, 2**32 - 1)
u64 = st.integers(0, 2**64 - 1)
times = st.integers(-(2**62) + 1, 2**62 - 1)


@st.composite
def markers(draw: st.DrawFn, index: int) -> MarkerObservation:
    flags = MarkerFlag(draw(st.integers(0, 63)))
    if flags & MarkerFlag.LOST:
        return lost(index)
    xx, yy = (draw(st.floats(0.0009765625, 64.0, width=32)) for _ in range(2))
    correlation = draw(st.floats(-0.99, 0.99))
    (xy,) = struct.unpack("<f", struct.pack("<f", correlation * math.sqrt(xx * yy)))
    return MarkerObservation(index, draw(st.floats(-64, 703, width=32)), draw(st.floats(-64, 543, width=32)),
                             draw(st.floats(0.5, 1280, width=32)), xx, xy, yy, draw(st.floats(0, 1, width=32)), flags)


@st.composite
def candidates(draw: st.DrawFn, count: int) -> tuple[MarkerObservation, ...]:
    """The best of every marker, and up to three more of those that are found."""
    best = [draw(markers(index)) for index in range(count)]
    more = [draw(markers(mark.index)) for mark in best if mark.found for _ in range(draw(st.integers(0, 3)))]
    return (*best, *(mark for mark in more if mark.found))[:40]


@st.composite
def fiducials(draw: st.DrawFn) -> Fiducial:
    corners = [draw(st.floats(-64, 543, width=32)) for _ in range(8)]
    spread = [draw(st.floats(0.0009765625, 64.0, width=32)) for _ in range(4)]
    return Fiducial(draw(st.integers(0, 21)), draw(st.integers(0, 65535)), tuple(corners),
                    tuple(value for one in spread for value in (one, 0.5 * one, one)))


@st.composite
def hands(draw: st.DrawFn) -> LandmarkedHand:
    points = []
    for _ in range(21):
        spread = draw(st.one_of(st.none(), st.floats(0.0009765625, 64.0, width=32)))
        x, y = draw(st.floats(-64, 543, width=32)), draw(st.floats(-64, 543, width=32))
        points.append((0.0,) * 5 if spread is None else (x, y, spread, 0.5 * spread, spread))
    probabilities = st.floats(0, 1, width=32)
    return LandmarkedHand(draw(probabilities), draw(probabilities), tuple(points))


@st.composite
def messages(draw: st.DrawFn) -> Message:
    node_id, session, sequence = draw(st.integers(1, 2**32 - 1)), draw(st.integers(1, 2**64 - 1)), draw(u32)
    match draw(st.integers(1, 9)):
        case 1:
            t_frame = draw(st.integers(-(2**61), 2**61))
            count = draw(st.integers(0, 12))
            return Observations(node_id, session, sequence, t_frame, t_frame + draw(st.integers(0, 60 * 10**9)),
                                draw(u32), draw(u32), draw(u32), 640, 480, draw(u32), RHOT6_CHECKSUM,
                                draw(candidates(count)), draw(st.booleans()))
        case 2:
            return ClockRequest(node_id, session, sequence, draw(times))
        case 3:
            t2 = draw(st.integers(-(2**61), 2**61))
            return ClockReply(node_id, session, sequence, draw(times), t2, t2 + draw(st.integers(0, 10**12)),
                              draw(u32), draw(st.sampled_from(NodeState)))
        case 4:
            ids = draw(st.lists(st.integers(1, 2**32 - 1), unique=True, max_size=16))
            return Start(session, sequence, tuple(StartEntry(i, draw(st.integers(1, 65535)), draw(times)) for i in ids))
        case 5:
            return Find(draw(u32), sequence, draw(u64))
        case 6:
            name = draw(st.text(st.characters(exclude_categories=("C", "Z")), min_size=1, max_size=64))
            return Here(node_id, sequence, draw(u64), draw(u32), *(draw(st.integers(1, 65535)) for _ in range(4)),
                        draw(st.sampled_from(NodeState)), draw(st.sampled_from(TrustState)), name)
        case 7:
            t_frame = draw(st.integers(-(2**61), 2**61))
            return Fiducials(node_id, session, sequence, t_frame, t_frame + draw(st.integers(0, 60 * 10**9)), draw(u32),
                             draw(u32), draw(u32), 640, 480, draw(u32),
                             tuple(draw(st.lists(fiducials(), max_size=16))), draw(st.booleans()))
        case 8:
            t_frame = draw(st.integers(-(2**61), 2**61))
            return HandLandmarks(node_id, session, sequence, t_frame, t_frame + draw(st.integers(0, 60 * 10**9)),
                                 draw(u32), draw(u32), draw(u32), 640, 480, draw(u32),
                                 tuple(draw(st.lists(hands(), max_size=3))))
        case _:
            return Stop(session, sequence)


@settings(max_examples=300, deadline=None)
@given(messages())
def test_every_message_survives_the_way(message: Message) -> None:
    data = encode(message)
    assert decode(data) == message
    assert encode(decode(data)) == data


def assert_sound(data: bytes) -> None:
    """Whatever the bytes: a WireError or a plausible message that encodes to the same bytes."""
    try:
        message = decode(data)
    except WireError:
        return
    again = encode(message)
    assert decode(again) == message
    if isinstance(message, Observations):
        for m in message.markers:
            assert m.found == math.isfinite(m.x) == math.isfinite(m.y)
            assert math.isfinite(m.diameter + m.cov_xx + m.cov_xy + m.cov_yy) and 0 <= m.quality <= 1


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=400))
def test_random_bytes_never_raise_anything_else(data: bytes) -> None:
    assert_sound(data)
    assert_sound(b"RHOT\x01" + data)


def test_mutated_packets_never_raise_anything_else() -> None:
    rng = random.Random(5)
    originals = [packet(name) for name in SAMPLES]
    for _ in range(20_000):
        data = bytearray(rng.choice(originals))
        for _ in range(rng.choice((1, 1, 2, 8))):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        if rng.random() < 0.2:
            del data[rng.randrange(len(data)):]
        assert_sound(bytes(data))
