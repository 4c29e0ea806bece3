"""What a node was asked to search and what it answers: through the door, in parts, out of order, from a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_node import synthetic_rig
from test_door import NODE_CLOCK, NOW_NS, SESSION, known_clock

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, SliceRequest
from rhot_app.recording.raw_log import Record, RecordKind
from rhot_app.sources.node_link import NodeLink
from rhot_app.sources.replay import LogValidator
from rhot_app.sources.validation import DatagramValidator
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import ForegroundPart, SliceEdges, Slices, Start, StartEntry
from rhot_node.wire.search import SLICES_FIT, pack_edges, pack_map, pack_slices, unpack_slices

RIG = synthetic_rig()
NODE = RIG.nodes[1].node_id
TURN = np.linspace(0.0, 6.0, 300)
ASKED = unpack_slices(pack_slices(np.column_stack([100.0 + TURN, 200.0 - TURN, np.cos(TURN), np.sin(TURN),
                                                   np.full(300, 8.0)])))
HEAD = (NODE_CLOCK.from_host_ns(NOW_NS - 9_000_000), NODE_CLOCK.from_host_ns(NOW_NS - 200_000), 5_000_000, 4_000_000,
        48_000, 640, 480, 41)


@pytest.fixture
def door() -> DatagramValidator:
    door = DatagramValidator(RIG, 1, known_clock())
    door.expect_session(SESSION)
    return door


def answer(request: int, indices: list[int], part: int = 0, parts: int = 1, sequence: int = 0,
           count: int = 300) -> SliceEdges:
    values = np.array([[0.5 * index % 7, 0.5, 12.0, 1.0, 0.0] for index in indices]).reshape(-1, 5)
    return SliceEdges(NODE, SESSION, sequence, *HEAD, request, count, part, parts,
                      pack_edges(np.array(indices, np.int64), values))


def test_a_request_goes_out_in_parts_and_its_edges_come_back_as_one_frame(door: DatagramValidator) -> None:
    request = SliceRequest(1, ASKED, 8, expected="mine")
    messages = [decode(encode(one)) for one in door.searches.ask(request, NODE, SESSION, (640, 480))]
    assert [message.part for message in messages] == [0, 1] and len({one.sequence for one in messages}) == 2
    np.testing.assert_array_equal(unpack_slices(b"".join(one.records for one in messages)), ASKED)
    number = messages[0].request
    second = door.admit(encode(answer(number, [299, 299], 1, 2)), NOW_NS)
    assert second is None and not door.dropped, "the first part is on its way"
    frame = door.admit(encode(answer(number, [0, 3, 3, 3], 0, 2, sequence=1)), NOW_NS)
    assert isinstance(frame, EdgeFrame) and frame.request is request
    assert abs(frame.t_row0_master_ns - (NOW_NS - 9_000_000)) < 1_000_000 and frame.row_time_ns == 48_000
    assert frame.edges.number.tolist() == [1, 0, 0, 3, *[0] * 295, 2]
    np.testing.assert_allclose(frame.edges.offset[3, :4], [1.5, 1.5, 1.5, 0.0])
    assert door.frames["edges"] == 1


def test_a_map_comes_back_as_it_was(door: DatagramValidator) -> None:
    (message,) = door.searches.ask(SliceRequest(1, np.empty((0, 5)), 8), NODE, SESSION, (640, 480))
    known = np.random.default_rng(1).random((60, 80), np.float32)
    data, parts = pack_map(known), []
    for part in range(2):
        piece = data[:1000] if part == 0 else data[1000:]
        parts.append(ForegroundPart(NODE, SESSION, part, *HEAD, message.request, 8, part, 2, piece))
    assert door.admit(encode(parts[0]), NOW_NS) is None
    frame = door.admit(encode(parts[1]), NOW_NS)
    assert isinstance(frame, ForegroundFrame) and frame.step == 8
    np.testing.assert_allclose(frame.probability, known, atol=0.034)
    door.admit(encode(replace(parts[0], sequence=2, frame_number=9)), NOW_NS)
    assert door.admit(encode(replace(parts[1], sequence=3, frame_number=9, data=b"junk")), NOW_NS) is None
    assert door.dropped == {"range": 1}


def test_answers_that_nobody_asked_for_are_dropped(door: DatagramValidator) -> None:
    assert door.admit(encode(answer(5, [1])), NOW_NS) is None
    number = door.searches.ask(SliceRequest(1, ASKED), NODE, SESSION, (640, 480))[0].request
    assert door.admit(encode(answer(number, [1], sequence=1, count=299)), NOW_NS) is None
    assert door.admit(encode(answer(number, [1], sequence=1)), NOW_NS) is None
    assert door.admit(encode(replace(answer(number, [1], sequence=2), session=SESSION + 1)), NOW_NS) is None
    assert door.dropped == {"request": 1, "count": 1, "duplicate": 1, "session": 1}


def test_a_link_asks_only_while_its_node_streams_for_it() -> None:
    link, request = NodeLink(RIG, 1), SliceRequest(1, ASKED[:SLICES_FIT])
    assert link.slices(request) == []
    link.want(SESSION, NOW_NS)
    (datagram,) = link.slices(request)
    message = decode(datagram)
    assert isinstance(message, Slices)
    assert (message.session, message.width, message.height) == (SESSION, 640, 480)


def test_a_log_answers_with_the_slices_that_it_recorded() -> None:
    log = LogValidator(RIG)
    log.links[1].door.clock = known_clock()
    messages = DatagramValidator(RIG, 1, known_clock()).searches.ask(SliceRequest(1, ASKED), NODE, SESSION, (640, 480))
    log.feed(Record(RecordKind.START, 0, NOW_NS, encode(Start(SESSION, 0, (StartEntry(NODE, 50001, 0),)))))
    for message in reversed(messages):
        log.feed(Record(RecordKind.SLICES, NODE, NOW_NS, encode(message)))
    frame = log.feed(Record(RecordKind.DATAGRAM, NODE, NOW_NS, encode(answer(messages[0].request, [7]))))
    assert isinstance(frame, EdgeFrame) and frame.camera == 1
    np.testing.assert_array_equal(frame.request.slices, ASKED)
    assert frame.edges.number[7] == 1
