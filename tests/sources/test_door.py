"""The door: what is admitted arrives in rig order and master time; everything else is counted by reason."""

import math
import random
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from synthetic_node import synthetic_rig

from rhot_app.project import Rig
from rhot_app.sources.clock import NodeClockModel
from rhot_app.sources.validation import DatagramValidator
from rhot_node.clock import NodeClock
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import MarkerFlag, MarkerObservation, Observations, Stop

NOW_NS = 5 * 10**12
SESSION = 77
NODE_CLOCK = NodeClock(9 * 3600 * 10**9, 30.0, 0)


def known_clock() -> NodeClockModel:
    model = NodeClockModel()
    for k in range(5):
        t1 = NOW_NS - (5 - k) * 100_000_000
        t2 = NODE_CLOCK.from_host_ns(t1 + 100_000)
        model.add(t1, t2, t2, t1 + 200_000, 1)
    return model


def message(rig: Rig, **changes: object) -> Observations:
    markers = tuple(MarkerObservation(k, 100.0 + k, 50.0 + k, 16.0 + k, 0.01, 0.001, 0.02, 0.5)
                    for k in range(len(rig.markers.markers)))
    base = Observations(rig.nodes[1].node_id, SESSION, 0, NODE_CLOCK.from_host_ns(NOW_NS - 9_000_000),
                        NODE_CLOCK.from_host_ns(NOW_NS - 200_000), 5_000_000, 4_000_000, 48_000, 640, 480, 0,
                        rig.markers.checksum, markers)
    return replace(base, **changes)


@pytest.fixture
def rig() -> Rig:
    return synthetic_rig()


@pytest.fixture
def door(rig: Rig) -> DatagramValidator:
    door = DatagramValidator(rig, 1, known_clock())
    door.expect_session(SESSION)
    return door


def test_admitted_frame_is_in_master_time_and_rig_order(rig: Rig, door: DatagramValidator) -> None:
    markers = list(message(rig).markers)
    markers[2] = MarkerObservation(2, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)
    frame = door.admit(encode(message(rig, markers=tuple(markers))), NOW_NS)
    assert frame is not None
    assert frame.camera == 1
    assert abs(frame.t_row0_master_ns - (NOW_NS - 9_000_000)) <= 1e9 * frame.clock_bound_s
    assert frame.network_s == pytest.approx(200e-6, abs=frame.clock_bound_s)
    assert frame.detect_s == pytest.approx(5e-3)
    np.testing.assert_allclose(frame.pixels[3], [103.0, 53.0])
    assert np.isnan(frame.pixels[2]).all()
    assert frame.flags[2] == MarkerFlag.LOST
    np.testing.assert_allclose(frame.covariances[4], [[0.01, 0.001], [0.001, 0.02]], rtol=1e-6)
    np.testing.assert_allclose(frame.diameters[[0, 5]], [16.0, 21.0])
    assert frame.pixels.flags.c_contiguous and frame.covariances.flags.c_contiguous
    assert (door.received, door.accepted, door.dropped) == (1, 1, {})


@pytest.mark.parametrize(("changes", "reason"), [
    ({"node_id": 9}, "foreign_node"),
    ({"session": 78}, "session"),
    ({"marker_checksum": 1}, "marker_set"),
    ({"width": 1280}, "image_size"),
    ({"t_frame_node_ns": NODE_CLOCK.from_host_ns(NOW_NS - 2 * 10**9)}, "time"),
    ({"t_frame_node_ns": NODE_CLOCK.from_host_ns(NOW_NS + 10**7), "t_send_node_ns":
      NODE_CLOCK.from_host_ns(NOW_NS + 2 * 10**7)}, "time"),
    ({"t_send_node_ns": NODE_CLOCK.from_host_ns(NOW_NS + 10**9)}, "time"),
    ({"sequence": 10**9}, None),  # the first number may be any
])
def test_refused_by_reason(rig: Rig, door: DatagramValidator, changes: dict[str, object], reason: str | None) -> None:
    frame = door.admit(encode(message(rig, **changes)), NOW_NS)
    assert (frame is None) == (reason is not None)
    assert door.dropped == ({} if reason is None else {reason: 1})


def test_refused_datagrams_leave_no_trace_in_the_sequence(rig: Rig, door: DatagramValidator) -> None:
    for sequence, session in ((0, SESSION), (500, 5), (1, SESSION), (3, SESSION), (3, SESSION), (2, SESSION)):
        door.admit(encode(message(rig, sequence=sequence, session=session)), NOW_NS)
    assert door.dropped == {"session": 1, "duplicate": 1}
    assert door.sequence.lost == 0
    assert door.accepted == 4


def test_nothing_is_admitted_without_start_or_clock(rig: Rig, door: DatagramValidator) -> None:
    door.expect_session(0)
    assert door.admit(encode(message(rig)), NOW_NS) is None
    door.expect_session(SESSION)
    door.clock.reset()
    assert door.admit(encode(message(rig)), NOW_NS) is None
    assert door.dropped == {"not_started": 1, "no_clock": 1}


def test_foreign_message_kinds_and_bytes_are_counted(door: DatagramValidator) -> None:
    for data in (b"", b"12,34;5,6", encode(Stop(1, 1)), b"RHOT" + bytes(40)):
        assert door.admit(data, NOW_NS) is None
    assert door.received == 4
    assert sum(door.dropped.values()) == 4
    assert {"length", "magic", "kind", "version"} >= set(door.dropped)


def test_nothing_raises_whatever_the_bytes(rig: Rig, door: DatagramValidator) -> None:
    rng = random.Random(3)
    sound = encode(message(rig))
    for _ in range(3000):
        data = bytearray(sound)
        for _ in range(rng.randint(1, 6)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        door.admit(bytes(data[:rng.choice((len(data), rng.randrange(len(data)))) or None]), NOW_NS)
    assert door.received == 3000 == door.accepted + sum(door.dropped.values())


def exchanged(model: NodeClockModel, clock: NodeClock, t1_ns: int) -> None:
    t2 = clock.from_host_ns(t1_ns + 100_000)
    model.add(t1_ns, t2, t2, t1_ns + 200_000, 1)


def streamed(rig: Rig, door: DatagramValidator, clock: NodeClock, begin_ns: int, count: int,
             travel_ns: int = 200_000) -> list[int]:
    """Errors, ns, of the times of the frames that are admitted, 100 a second; an exchange after every tenth."""
    errors = []
    for k in range(count):
        now = begin_ns + k * 10_000_000
        frame = door.admit(encode(message(rig, sequence=begin_ns // 10_000_000 + k - NOW_NS // 10_000_000,
                                          t_frame_node_ns=clock.from_host_ns(now - travel_ns - 9_000_000),
                                          t_send_node_ns=clock.from_host_ns(now - travel_ns))), now)
        if frame is not None:
            errors.append(frame.t_row0_master_ns - (now - travel_ns - 9_000_000))
        if k % 10 == 9:
            exchanged(door.clock, clock, now + 3_000_000)
    return errors


@pytest.mark.parametrize("step_ns", [-40_000_000, -3_000_000, -1_800_000, 1_800_000, 40_000_000, 10**12])
def test_a_clock_that_is_set_gives_no_frame_a_wrong_time(rig: Rig, door: DatagramValidator, step_ns: int) -> None:
    assert len(streamed(rig, door, NODE_CLOCK, NOW_NS, 20)) == 20
    stepped = NodeClock(NODE_CLOCK.offset_ns + step_ns, 30.0, 0)
    errors = streamed(rig, door, stepped, NOW_NS + 200_000_000, 100)
    assert max(map(abs, errors)) < 300_000, "no time is wrong"
    assert len(errors) >= 50, "and all is well again within half a second"


def test_a_network_that_becomes_slow_is_believed_after_an_exchange(rig: Rig, door: DatagramValidator) -> None:
    assert len(streamed(rig, door, NODE_CLOCK, NOW_NS, 20)) == 20
    assert len(streamed(rig, door, NODE_CLOCK, NOW_NS + 200_000_000, 50, 8_000_000)) == 40
    assert len(streamed(rig, door, NODE_CLOCK, NOW_NS + 700_000_000, 50, 2_000_000)) == 50
    assert door.dropped == {"clock_in_doubt": 10}
    assert door.sequence.lost == 0, "what came is not lost"


def test_frames_that_wait_for_the_clock_are_not_lost(rig: Rig) -> None:
    door = DatagramValidator(rig, 1, NodeClockModel())
    door.expect_session(SESSION)
    for k in (0, 1, 2):
        assert door.admit(encode(message(rig, sequence=k)), NOW_NS) is None
    door.clock = known_clock()
    assert door.admit(encode(message(rig, sequence=4)), NOW_NS) is not None
    assert door.dropped == {"no_clock": 3}
    assert door.sequence.lost == 1


def test_calibrated_time_offset_is_added(rig: Rig) -> None:
    node = msgspec.structs.replace(rig.nodes[1], time_offset_s=0.0035)
    shifted = msgspec.structs.replace(rig, nodes=(rig.nodes[0], node))
    times = []
    for one in (rig, shifted):
        door = DatagramValidator(one, 1, known_clock())
        door.expect_session(SESSION)
        frame = door.admit(encode(message(one)), NOW_NS)
        assert frame is not None
        times.append(frame.t_row0_master_ns)
    assert times[1] - times[0] == 3_500_000


class TestText:
    @pytest.fixture
    def text_door(self, rig: Rig) -> DatagramValidator:
        node = msgspec.structs.replace(rig.nodes[0], text_datagrams=True)
        door = DatagramValidator(msgspec.structs.replace(rig, nodes=(node, rig.nodes[1])), 0, NodeClockModel())
        door.expect_session(1)
        return door

    def test_text_needs_no_clock(self, text_door: DatagramValidator) -> None:
        frame = text_door.admit(b"1,2;3.5,4;-1,-1;,;639,479;7,8\n", NOW_NS)
        assert frame is not None
        assert (frame.t_row0_master_ns, frame.row_time_ns, frame.t_receive_ns) == (NOW_NS, 0, NOW_NS)
        np.testing.assert_array_equal(frame.pixels[[0, 1, 4]], [[1.0, 2.0], [3.5, 4.0], [639.0, 479.0]])
        assert np.isnan(frame.pixels[2:4]).all()
        assert frame.flags.tolist() == [0, 0, MarkerFlag.LOST, MarkerFlag.LOST, 0, 0]
        np.testing.assert_array_equal(frame.covariances[0], np.eye(2))
        assert frame.covariances.shape == (6, 2, 2)

    def test_a_calibrated_delay_is_taken_off(self, rig: Rig) -> None:
        node = msgspec.structs.replace(rig.nodes[0], text_datagrams=True, time_offset_s=-0.040)
        door = DatagramValidator(msgspec.structs.replace(rig, nodes=(node, rig.nodes[1])), 0, NodeClockModel())
        door.expect_session(1)
        frame = door.admit(b"1,2;3.5,4;-1,-1;,;639,479;7,8", NOW_NS)
        assert frame is not None
        assert (frame.t_row0_master_ns, frame.t_receive_ns) == (NOW_NS - 40_000_000, NOW_NS)

    @pytest.mark.parametrize(("data", "reason"), [
        (b"1,2;3,4", "count"), (b"a,b;3,4;5,6;7,8;9,10;11,12", "text"), (b"900,2;3,4;5,6;7,8;9,10;1,1", "marker"),
        (b"nan,2;3,4;5,6;7,8;9,10;1,1", "text"),
    ])
    def test_broken_text_is_counted(self, text_door: DatagramValidator, data: bytes, reason: str) -> None:
        assert text_door.admit(data, NOW_NS) is None
        assert text_door.dropped == {reason: 1}

    def test_text_where_it_is_off_is_malformed(self, door: DatagramValidator) -> None:
        assert door.admit(b"1,2;3,4;5,6;7,8;9,10;11,12;1,2;3,4", NOW_NS) is None
        assert door.dropped == {"magic": 1}
