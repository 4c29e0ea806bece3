"""The wire's bytes: golden packets both ways, and what is refused of them by which reason."""

from __future__ import annotations

import dataclasses
import math
import re
import struct
import timeit
import zlib
from pathlib import Path

import numpy as np
import pytest
from wire_samples import (
    KEY,
    PACKETS,
    SAMPLES,
    SESSION,
    SIX,
    TAGGED,
    VERSION_1,
    edges,
    fiducial,
    fiducials,
    found,
    hand_landmarks,
    landmarked_hand,
    lost,
    observations,
    packet,
)

from rhot_node.errors import WireError
from rhot_node.wire.codec import Seal, asks_who_is_there, decode, decode_sealed, encode
from rhot_node.wire.messages import (
    ClockRequest,
    Fiducials,
    Find,
    MarkerFlag,
    MarkerObservation,
    Message,
    Observations,
    SliceEdge,
    Start,
    StartEntry,
    Stop,
)
from rhot_node.wire.points import MarkerTable
from rhot_node.wire.search import pack_map, pack_slices, unpack_map, unpack_slices

OBSERVATIONS = "version_1_observations_some_lost"


def patched(name: str, offset: int, layout: str, *values: float | bytes) -> bytes:
    data = bytearray(packet(name))
    struct.pack_into(layout, data, offset, *values)
    return bytes(data)


def refused(data: bytes) -> str:
    with pytest.raises(WireError) as caught:
        decode(data)
    assert type(caught.value) is WireError
    return caught.value.reason


@pytest.mark.parametrize("name", SAMPLES)
def test_golden_packets_byte_for_byte(name: str) -> None:
    assert encode(SAMPLES[name]) == packet(name)
    assert decode(packet(name)) == SAMPLES[name]
    assert decode(memoryview(packet(name))) == SAMPLES[name]


def test_every_golden_packet_has_its_sample() -> None:
    older = {*VERSION_1, "version_1_tagged_observations_six", "version_1_tagged_observations_none"}
    assert {path.stem for path in PACKETS.glob("*.bin")} == {*SAMPLES, *TAGGED, *older}


@pytest.mark.parametrize("name", VERSION_1)
def test_observations_of_version_1_are_understood(name: str) -> None:
    assert decode(packet(name)) == VERSION_1[name]


def test_a_datagram_with_its_tag_fits_one_frame_and_says_what_it_left_out() -> None:
    best = tuple(found(i, 8.0 * i, 4.0 * i) for i in range(20))
    second = tuple(found(i, 9.0 * i, 4.0 * i) for i in range(20))
    third = tuple(found(i, 7.0 * i, 4.0 * i) for i in range(20))
    data = encode(observations((*best, *second, *third)), Seal(KEY))
    assert 1472 - 32 < len(data) <= 1472
    message = decode_sealed(data, Seal(KEY))
    assert isinstance(message, Observations)
    assert message.truncated
    assert message.marker_count == 20
    assert message.markers == (*best, *second, *third[:3])
    candidates = decode(packet("observations_candidates"))
    assert isinstance(candidates, Observations)
    assert not candidates.truncated


def test_the_document_shows_the_golden_packet() -> None:
    text = (Path(__file__).parents[2] / "docs" / "wire.md").read_text()
    dumps = {name: section.split("```")[1] for name, section in re.findall(
        r"`tests/packets/(\w+)\.bin`:\n\n(```\n.*?```)", text, re.DOTALL)}
    assert set(dumps) == {"observations_two", "tagged_stop"}
    for name, dump in dumps.items():
        shown = "".join(line[7:55].replace(" ", "") for line in dump.splitlines() if line[:4].isdigit())
        assert bytes.fromhex(shown) == packet(name)


Fault = tuple[int, str, tuple[float | bytes], str]

HEADER_FAULTS: list[Fault] = [
    (0, "<4s", (b"rhot",), "magic"),
    (4, "<B", (3,), "version"),
    (5, "<B", (0,), "type"),
    (5, "<B", (255,), "type"),
    (6, "<H", (1,), "tag"),
    (6, "<H", (2,), "flags"),
    (6, "<H", (0x8001,), "flags"),
    (8, "<I", (0,), "header"),  # no node
    (12, "<Q", (0,), "header"),  # no session
]
OBSERVATION_FAULTS: list[Fault] = [
    (24, "<q", (1 << 62,), "time"),
    (24, "<q", (3_600_000_000_000 + 28_000_000,), "time"),  # exposed after it was sent
    (24, "<q", (3_500_000_000_000,), "time"),  # older than any frame that is worth sending
    (52, "<H", (0,), "size"),
    (54, "<H", (20_000,), "size"),
    (64, "<B", (5,), "length"),
    (64, "<B", (65,), "count"),
    (65, "<B", (1,), "reserved"),
    (68, "<H", (1,), "index"),
    (70, "<H", (0x40,), "flags"),
    (70, "<H", (1,), "marker"),  # lost, and yet has a place
    (102, "<H", (0,), "marker"),  # not lost, and yet NaN
    (104, "<f", (1.0,), "marker"),  # lost, and yet a number
    (112, "<f", (1.0,), "marker"),  # lost, and yet a size
    (72, "<f", (-65.0,), "marker"),
    (72, "<f", (704.0,), "marker"),
    (76, "<f", (math.nan,), "marker"),
    (76, "<f", (math.inf,), "marker"),
    (80, "<f", (0.0,), "marker"),
    (80, "<f", (1281.0,), "marker"),
    (84, "<f", (-1e-6,), "marker"),
    (84, "<f", (math.inf,), "marker"),
    (88, "<f", (0.01,), "marker"),  # not positive semi-definite
    (92, "<f", (math.nan,), "marker"),
    (96, "<f", (1.01,), "marker"),
    (96, "<f", (-0.01,), "marker"),
]
OTHER_FAULTS = [
    ("clock_request", 24, "<q", (-(1 << 63),), "time"),
    ("clock_request", 8, "<I", (0,), "header"),
    ("clock_reply_streaming", 40, "<q", (0,), "time"),  # replied before the request came
    ("clock_reply_streaming", 52, "<B", (4,), "range"),
    ("clock_reply_streaming", 53, "<B", (1,), "reserved"),
    ("start_two", 8, "<I", (1,), "header"),
    ("start_two", 12, "<Q", (0,), "header"),
    ("start_two", 24, "<B", (1,), "length"),
    ("start_two", 25, "<B", (1,), "reserved"),
    ("start_two", 28, "<I", (2,), "index"),  # node 2 twice
    ("start_two", 28, "<I", (0,), "header"),
    ("start_two", 32, "<H", (0,), "range"),
    ("start_two", 34, "<H", (1,), "range"),
    ("stop", 8, "<I", (9,), "header"),
    ("find_all", 12, "<Q", (1,), "header"),  # of no session
    ("find_all", 303, "<B", (1,), "reserved"),
    ("here", 8, "<I", (0,), "header"),
    ("here", 12, "<Q", (1,), "header"),
    ("here", 36, "<H", (0,), "range"),  # port 0
    ("here", 42, "<H", (0,), "range"),
    ("here", 44, "<B", (4,), "range"),
    ("here", 45, "<B", (3,), "range"),
    ("here", 46, "<H", (4,), "length"),
    ("here", 48, "<B", (27,), "range"),  # an escape sequence is no name
    ("here", 48, "<B", (255,), "range"),  # nor is what is not UTF-8
    ("fiducials_two", 8, "<I", (0,), "header"),
    ("fiducials_two", 12, "<Q", (0,), "header"),
    ("fiducials_two", 32, "<q", (3_599_999_999_999,), "time"),  # sent before it was exposed
    ("fiducials_two", 52, "<H", (0,), "size"),
    ("fiducials_two", 60, "<B", (1,), "length"),
    ("fiducials_two", 61, "<B", (2,), "flags"),
    ("fiducials_two", 62, "<B", (1,), "reserved"),
    ("fiducials_two", 64, "<B", (22,), "index"),
    ("fiducials_two", 65, "<B", (1,), "reserved"),
    ("fiducials_two", 68, "<f", (704.0,), "marker"),
    ("fiducials_two", 72, "<f", (math.nan,), "marker"),
    ("fiducials_two", 100, "<f", (0.0,), "marker"),
    ("fiducials_two", 104, "<f", (1.0,), "marker"),  # not positive semi-definite
    ("fiducials_two", 108, "<f", (math.inf,), "marker"),
    ("hand_landmarks_two", 8, "<I", (0,), "header"),
    ("hand_landmarks_two", 12, "<Q", (0,), "header"),
    ("hand_landmarks_two", 32, "<q", (3_599_999_999_999,), "time"),  # sent before it was exposed
    ("hand_landmarks_two", 54, "<H", (0,), "size"),
    ("hand_landmarks_two", 60, "<B", (1,), "length"),
    ("hand_landmarks_two", 62, "<B", (1,), "reserved"),
    ("hand_landmarks_two", 64, "<f", (1.5,), "range"),
    ("hand_landmarks_two", 68, "<f", (math.nan,), "range"),
    ("hand_landmarks_two", 72, "<f", (704.0,), "marker"),
    ("hand_landmarks_two", 76, "<f", (math.nan,), "marker"),
    ("hand_landmarks_two", 80, "<f", (0.0,), "marker"),  # a place without an error
    ("hand_landmarks_two", 84, "<f", (3.0,), "marker"),  # not positive semi-definite
    ("hand_landmarks_two", 88, "<f", (math.inf,), "marker"),
    ("hand_landmarks_two", 152, "<f", (1.0,), "marker"),  # none, and yet a place
    ("here_longest_name", 48, "<4s", (b"abcd",), "range"),  # more than 64 characters
    ("stop", 4, "<B", (2,), "version"),  # only observations have a second one
    ("observations_candidates", 4, "<B", (1,), "length"),
    ("observations_candidates", 4, "<B", (3,), "version"),
    ("observations_candidates", 64, "<B", (2,), "index"),
    ("observations_candidates", 64, "<B", (65,), "count"),
    ("observations_candidates", 65, "<B", (5,), "length"),
    ("observations_candidates", 66, "<B", (2,), "flags"),
    ("observations_candidates", 67, "<B", (1,), "reserved"),
    ("observations_candidates", 68 + 32, "<H", (0,), "marker"),  # a fifth candidate
    ("observations_candidates", 70, "<H", (1,), "marker"),  # lost markers have no record
    ("observations_candidates", 72, "<f", (math.nan,), "marker"),
    ("edges_two", 64, "<H", (231,), "index"),  # fewer slices than the edges name
    ("edges_two", 66, "<H", (3,), "length"),
    ("edges_two", 68, "<B", (3,), "index"),  # the part after the last
    ("edges_two", 70, "<B", (1,), "reserved"),
    ("edges_two", 72 + 6, "<B", (0,), "range"),  # an edge known without error
    ("slices_two", 12, "<Q", (0,), "header"),
    ("slices_two", 28, "<H", (0,), "size"),
    ("slices_two", 28, "<H", (638,), "range"),  # a centre at 639 px lies outside
    ("slices_two", 32, "<H", (1,), "count"),  # fewer in all than in this part
    ("slices_two", 32, "<H", (1025,), "count"),
    ("slices_two", 34, "<H", (1,), "length"),
    ("slices_two", 36, "<B", (2,), "index"),
    ("slices_two", 38, "<B", (3,), "range"),  # a map of every third pixel
    ("slices_two", 39, "<B", (1,), "reserved"),
    ("slices_two", 40 + 6, "<B", (0,), "range"),  # a slice without length
    ("foreground_part", 24, "<q", (1 << 62,), "time"),
    ("foreground_part", 64, "<H", (5,), "length"),
    ("foreground_part", 66, "<B", (65,), "range"),
    ("foreground_part", 67, "<B", (2,), "index"),
    ("foreground_part", 69, "<B", (1,), "reserved"),
]


@pytest.mark.parametrize(("offset", "layout", "values", "reason"), HEADER_FAULTS + OBSERVATION_FAULTS)
def test_a_fault_in_observations_is_refused_by_its_reason(offset: int, layout: str, values: tuple[float | bytes],
                                                          reason: str) -> None:
    assert refused(patched(OBSERVATIONS, offset, layout, *values)) == reason


@pytest.mark.parametrize(("name", "offset", "layout", "values", "reason"), OTHER_FAULTS)
def test_a_fault_in_another_message_is_refused_by_its_reason(name: str, offset: int, layout: str,
                                                             values: tuple[float | bytes], reason: str) -> None:
    assert refused(patched(name, offset, layout, *values)) == reason


@pytest.mark.parametrize("name", SAMPLES)
def test_every_truncation_and_any_surplus_is_refused(name: str) -> None:
    data = packet(name)
    for length in range(len(data)):
        assert refused(data[:length]) == "length"
    assert refused(data + b"\0") == "length"


@pytest.mark.parametrize("message", [
    ClockRequest(-1, SESSION, 0, 0),
    ClockRequest(1, SESSION, 0, 1 << 63),
    Stop(SESSION, 1 << 32),
    dataclasses.replace(observations(SIX), processing_ns=-1),
    observations((found(0, 1e300, 0.0),)),
    observations(tuple(found(i, 1.0, 1.0) for i in range(256))),
    Start(SESSION, 0, (StartEntry(1, 70_000, 0),)),
])
def test_a_value_that_does_not_fit_is_refused_when_encoding(message: Message) -> None:
    with pytest.raises(WireError) as caught:
        encode(message)
    assert caught.value.reason == "range"


def test_a_lost_marker_carries_nothing_whatever_the_detector_said() -> None:
    said = MarkerObservation(0, 3.0, math.nan, math.nan, 1.0, 0.0, math.inf, 0.5, MarkerFlag.LOST | MarkerFlag.EDGE)
    message = decode(encode(observations((said,))))
    assert isinstance(message, Observations)
    assert message.markers == (lost(0),)


def test_columns_say_what_the_markers_say() -> None:
    message = decode(packet("observations_some_lost"))
    assert isinstance(message, Observations)
    assert isinstance(message.markers, MarkerTable)
    assert message.markers.indices().tolist() == [marker.index for marker in message.markers]
    pixels, covariances, diameters, qualities, flags = message.markers.columns()
    rows = zip(message.markers, pixels, covariances, diameters, qualities, flags, strict=True)
    for marker, pixel, covariance, diameter, quality, bits in rows:
        np.testing.assert_array_equal(pixel, [marker.x, marker.y])
        assert covariance.tolist() == [[marker.cov_xx, marker.cov_xy], [marker.cov_xy, marker.cov_yy]]
        assert (diameter, quality, bits) == (marker.diameter, marker.quality, marker.flags)
    assert message.markers[1:3] == list(message.markers)[1:3]


def test_fiducials_that_do_not_fit_an_ethernet_frame_are_left_out() -> None:
    many = fiducials(tuple(fiducial(3, k, 1.0, 2.0) for k in range(20)))
    data = encode(many, Seal(KEY))
    message = decode_sealed(data, Seal(KEY))
    assert len(data) <= 1472
    assert isinstance(message, Fiducials)
    assert message.truncated and tuple(message.fiducials) == tuple(many.fiducials[:16])


def test_more_hands_than_fit_an_ethernet_frame_are_refused() -> None:
    assert len(encode(hand_landmarks(*3 * [landmarked_hand(1.0, 0.5)]), Seal(KEY))) <= 1472
    with pytest.raises(WireError, match="count"):
        encode(hand_landmarks(*4 * [landmarked_hand(1.0, 0.5)]))


def test_an_answer_is_never_longer_than_its_question() -> None:
    assert len(packet("here_longest_name")) == len(packet("find_all")) == len(packet("find_one"))
    assert asks_who_is_there(packet("find_one")) and not asks_who_is_there(packet("here"))
    assert not asks_who_is_there(encode(Find(0, 1, 2), Seal(KEY))), "only an untagged one is taken from anybody"


def test_decoding_six_markers_keeps_pace_with_a_flood() -> None:
    data = packet("observations_six")
    best = min(timeit.repeat(lambda: decode(data), number=200, repeat=20)) / 200
    assert best < 60e-6, f"{best * 1e6:.1f} us; about 20 us is normal here"


def test_slices_come_back_within_half_a_unit() -> None:
    turn = np.linspace(-3.1, 3.1, 200)
    asked = np.column_stack([np.linspace(0.0, 639.0, 200), np.linspace(479.0, 0.0, 200), np.cos(turn), np.sin(turn),
                             np.linspace(0.3, 60.0, 200)])
    got = unpack_slices(pack_slices(asked))
    np.testing.assert_allclose(got[:, :2], asked[:, :2], atol=1 / 8)
    np.testing.assert_allclose(got[:, 2:4], asked[:, 2:4], atol=1e-4)
    assert ((got[:, 4] >= asked[:, 4]) & (got[:, 4] < asked[:, 4] + 0.25)).all(), "no slice gets shorter"
    np.testing.assert_array_equal(unpack_slices(pack_slices(got)), got)


def test_a_foreground_map_comes_back_and_no_other_bytes_do() -> None:
    probability = np.linspace(0.0, 1.0, 80 * 60, dtype=np.float32).reshape(60, 80)
    packed = pack_map(probability)
    assert len(packed) < 1000
    np.testing.assert_allclose(unpack_map(packed, 640, 480, 8), probability, atol=1 / 32 + 1e-6)
    unknown = np.full((60, 80), 0.5, np.float32)
    assert (unpack_map(pack_map(unknown), 640, 480, 8) == 0.5).all(), "a node that has learnt nothing says nothing"
    for data in (packed[:-9], b"nothing", pack_map(probability[1:]), zlib.compress(bytes(10**7)),
                 zlib.compress(bytes([17]) * 4800)):
        with pytest.raises(WireError, match="foreground map"):
            unpack_map(data, 640, 480, 8)


def test_more_edges_than_a_datagram_holds_are_refused() -> None:
    with pytest.raises(WireError, match="in a datagram"):
        encode(edges((SliceEdge(0, 0.0, 1.0, 1.0, 0.5, 0.5),) * 400))
