"""Paired nodes on real sockets: tagged both ways, keys renewed by themselves, replays and forgeries without effect."""

from __future__ import annotations

import dataclasses
import socket
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from patience import PATIENCE_S, eventually, quickest, settled
from streaming_node import Setup
from synthetic_node import synthetic_rig

from rhot_app.errors import SourceError
from rhot_app.recording.raw_log import Record, RecordKind
from rhot_app.sources.links import UdpNodes, new_session
from rhot_app.sources.replay import LogValidator
from rhot_node.keys import new_key_pair
from rhot_node.network.session import LinkKeys
from rhot_node.wire.codec import TAG_LENGTH, decode, encode, is_tagged
from rhot_node.wire.messages import Stop


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[Setup]:
    setup = Setup(tmp_path)
    yield setup
    setup.close()


def test_everything_that_is_said_is_tagged(setup: Setup) -> None:
    setup.run()
    setup.source.stop()
    eventually(lambda: setup.node.sessions.current is None)
    for kind in (RecordKind.DATAGRAM, RecordKind.START, RecordKind.STOP, RecordKind.CLOCK_REQUEST,
                 RecordKind.CLOCK_REPLY):
        assert setup.records.of(kind) and all(is_tagged(data) for data in setup.records.of(kind))
    assert set(setup.node.link.dropped) <= {"replay"}, "the second stop only"
    assert setup.source.links[0].door.dropped == {}


def test_a_log_of_tagged_datagrams_replays_without_the_key(setup: Setup) -> None:
    setup.run()
    door = LogValidator(setup.rig)
    frames = [frame for record in setup.records if (frame := door.feed(Record(*record))) is not None]
    assert len(frames) == setup.source.links[0].door.accepted > 0
    assert door.links[0].clock.offset_s is not None


def test_forged_frames_move_nothing_and_are_not_recorded(setup: Setup) -> None:
    setup.run()
    door, count, recorded = setup.source.links[0].door, len(setup.frames), len(setup.records.of(RecordKind.DATAGRAM))
    forged = setup.node.frame(setup.rig)
    port = setup.source.receivers[0].port
    other = LinkKeys().grant("somebody")
    genuine = setup.records.of(RecordKind.DATAGRAM)[-1]
    changed = bytearray(genuine)
    changed[72] ^= 1
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for data in (encode(forged), encode(forged, other.seal), bytes(changed), genuine[:-TAG_LENGTH], genuine):
            stranger.sendto(data, ("127.0.0.1", port))
    eventually(lambda: sum(door.dropped.values()) == 5)
    assert door.dropped == {"untagged": 1, "tag": 3, "duplicate": 1}
    assert len(setup.frames) == count and len(setup.records.of(RecordKind.DATAGRAM)) == recorded
    setup.stream()


def test_what_is_repeated_over_and_over_is_counted_in_the_log_and_not_recorded(
        setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    masters: set[tuple[str, int]] = set()
    take = setup.node.link.take
    monkeypatch.setattr(setup.node.link, "take", lambda data, sender, t_ns: (masters.add(sender), take(
        data, sender, t_ns)))
    setup.run()
    eventually(lambda: masters and setup.records.of(RecordKind.CLOCK_REPLY))
    (master,) = masters
    link, port = setup.source.links[0], setup.source.receivers[0].port
    frame, reply = setup.records.of(RecordKind.DATAGRAM)[-1], setup.records.of(RecordKind.CLOCK_REPLY)[-1]
    before = link.door.received, link.refused_replies
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for k in range(2_000):
            stranger.sendto(frame, ("127.0.0.1", port))
            stranger.sendto(reply, master)
            if k % 100 == 99:
                sent = k + 1
                eventually(lambda sent=sent: link.door.received - before[0] + link.refused_replies - before[1]
                           >= 2 * sent)
    setup.source.record_to(None)
    assert setup.records.of(RecordKind.DATAGRAM).count(frame) == 1
    assert setup.records.of(RecordKind.CLOCK_REPLY).count(reply) == 1
    replayed = LogValidator(setup.rig)
    for record in setup.records:
        replayed.feed(Record(*record))
    (again,) = replayed.links
    assert again.door.dropped == link.door.dropped and again.door.dropped["duplicate"] == 2_000
    assert again.refused_replies == link.refused_replies == 2_000
    told = setup.records.of(RecordKind.REFUSED)
    assert sum(map(len, told)) < 2_000, "the count is small whatever is sent"


def test_frames_of_another_marker_set_are_recorded_once_for_the_rig_that_knows_it(setup: Setup) -> None:
    setup.run()
    stream = setup.node.sessions.current
    assert stream is not None
    strange = dataclasses.replace(setup.node.frame(setup.rig), marker_checksum=7)
    door, before = setup.source.links[0].door, len(setup.records.of(RecordKind.DATAGRAM))
    for _ in range(3):
        setup.node.link.send(strange, stream)
    eventually(lambda: sum(door.dropped.values()) == 3)
    assert door.dropped == {"marker_set": 1, "duplicate": 2}
    assert len(setup.records.of(RecordKind.DATAGRAM)) == before + 1


def test_commands_of_strangers_and_replayed_ones_change_nothing(setup: Setup) -> None:
    setup.run()
    session = setup.source.links[0].wanted
    start = setup.records.of(RecordKind.START)[-1]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.1", 0))
        stranger.settimeout(0.3)
        for data in (encode(Stop(0, 9)), encode(Stop(session, 9)), encode(Stop(session, 9), LinkKeys().grant("x").seal),
                     start, setup.records.of(RecordKind.CLOCK_REQUEST)[-1]):
            stranger.sendto(data, ("127.0.0.1", setup.node.link.port))
        with pytest.raises(TimeoutError):
            stranger.recv(2048)
    dropped = setup.node.link.dropped
    eventually(lambda: sum(dropped.values()) >= 5)
    assert (dropped["untagged"], dropped["tag"], dropped["replay"]) == (2, 1, 2)
    stream = setup.node.sessions.current
    assert stream is not None and stream.session == session
    assert stream.address == ("127.0.0.1", setup.source.receivers[0].port)


def test_a_stop_is_not_repeated_by_somebody_in_the_next_session(setup: Setup) -> None:
    setup.run()
    setup.source.stop()
    eventually(lambda: setup.node.sessions.current is None)
    stop = setup.records.of(RecordKind.STOP)[-1]
    setup.run()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(stop, ("127.0.0.1", setup.node.link.port))
    setup.stream()
    assert setup.node.sessions.current is not None


def test_a_restarted_node_is_given_a_session_and_key_by_itself(setup: Setup) -> None:
    setup.run()

    def joined_again() -> None:
        before = setup.source.links[0].key_name
        setup.node.restart()
        setup.stream()
        assert setup.source.links[0].key_name != before

    assert quickest(joined_again, 2.0) < 2.0
    old = setup.records.of(RecordKind.START)[0]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(old, ("127.0.0.1", setup.node.link.port))
    eventually(lambda: setup.node.link.dropped["tag"] > 0)


def test_a_restarted_master_takes_the_node_over(setup: Setup) -> None:
    setup.run()
    setup.source.close()
    setup.source = setup.connect(setup.own)
    setup.run()
    assert len(setup.node.keys._links) == 2


def test_a_quiet_network_keeps_the_key(setup: Setup) -> None:
    setup.run()
    link = setup.source.links[0]
    before = link.key_name
    link.last_reply_ns = 0  # as after a second without answers
    assert settled(lambda: link.key_name == before, 0.4)
    setup.stream()


def test_a_master_that_is_not_paired_is_turned_away_and_says_so(setup: Setup) -> None:
    setup.source.close()
    setup.source = setup.connect(new_key_pair())
    link = setup.source.links[0]
    eventually(lambda: link.turned_away)
    setup.source.start(new_session())
    assert settled(lambda: setup.node.sessions.current is None)
    assert link.state is None and setup.node.link.clock_requests == 0

    setup.source.close()
    setup.source = setup.connect(setup.own)
    eventually(lambda: setup.source.links[0].state is not None)
    assert not setup.source.links[0].turned_away


def test_a_node_that_was_reset_is_known_by_its_refusal(setup: Setup) -> None:
    setup.run()
    setup.node.keys_path.unlink()
    eventually(lambda: setup.source.links[0].turned_away)
    assert setup.node.sessions.current is None, "a node without keys streams for nobody"


def test_a_rig_with_keys_needs_the_masters(setup: Setup) -> None:
    with pytest.raises(SourceError, match="left is paired"):
        UdpNodes(setup.rig)


def test_open_and_paired_nodes_stand_side_by_side(setup: Setup, tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.bind(("127.0.0.1", 0))
        plain.settimeout(PATIENCE_S)
        right = msgspec.structs.replace(synthetic_rig().nodes[1], udp_port=plain.getsockname()[1])
        setup.rig = msgspec.structs.replace(setup.rig, nodes=(*setup.rig.nodes, right))
        setup.source.close()
        setup.source = setup.connect(setup.own)
        assert not is_tagged(plain.recv(2048))
        eventually(lambda: setup.source.links[0].clock.offset_s is not None)
        setup.source.start(new_session())
        starts = setup.records.of(RecordKind.START)
        assert [is_tagged(data) for data in starts[-2:]] == [False, True]
        message = decode(starts[-2])
        assert [entry.node_id for entry in getattr(message, "entries", ())] == [2]
