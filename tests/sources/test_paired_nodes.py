"""Paired nodes over real sockets: tagged both ways, keys renewed by themselves, replays and forgeries without effect."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
from trusted_node import TrustedNode

from rhot_app.errors import SourceError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import Record, RecordKind
from rhot_app.simulator.synthetic_node import synthetic_rig
from rhot_app.sources.links import new_session
from rhot_app.sources.replay import LogDoor
from rhot_app.sources.udp_nodes import UdpNodes
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings
from rhot_node.keys import KeyPair, new_key_pair
from rhot_node.link import UdpLink
from rhot_node.link_keys import LinkKeys
from rhot_node.wire.codec import decode, encode, is_tagged
from rhot_node.wire.messages import MarkerObservation, NodeState, Observations, Stop
from rhot_node.wire.seal import TAG_LENGTH

CLOCK = NodeClock(7 * 3600 * 10**9, 20.0, 0)


class StreamingNode(TrustedNode):
    """The control side and the UDP link of a closed node; frames are sent by hand."""

    def __init__(self, folder: Path, udp_port: int = 0, boot_id: int = 1) -> None:
        super().__init__(folder)
        self.sequence = 0
        self.open_link(udp_port, boot_id)

    def open_link(self, udp_port: int, boot_id: int) -> None:
        settings = NodeSettings(1, "left", synthetic_rig().markers, "127.0.0.1", udp_port, 0, 0, None)
        self.link = UdpLink(settings, CLOCK, self.sessions, boot_id,
                            lambda: NodeState.STREAMING if self.sessions.current else NodeState.READY, self.keys)
        self.link.start()

    def restart(self) -> None:
        """Another run of the daemon: links and session are forgotten, keys and ports stay."""
        port = self.link.port
        self.link.close()
        self.sessions.stop(0)
        self.keys = LinkKeys()
        self.responder._keys = self.keys
        self.open_link(port, boot_id=2)

    def frame(self, rig: Rig) -> Observations:
        stream = self.sessions.current
        assert stream is not None
        now_ns = CLOCK.now_ns()
        markers = tuple(MarkerObservation(k, 100.0 + k, 50.0, 16.0, 0.01, 0.0, 0.01, 0.5) for k in range(6))
        self.sequence += 1
        return Observations(1, stream.session, self.sequence, now_ns - 8_000_000, now_ns, 5_000_000, 4_000_000, 10_000,
                            640, 480, self.sequence, rig.markers.checksum, markers)

    def send_frame(self, rig: Rig) -> None:
        stream = self.sessions.current
        assert stream is not None
        assert self.link.send(self.frame(rig), stream)

    def close(self) -> None:
        self.link.close()
        super().close()


class Records(list[tuple[RecordKind, int, int, bytes]]):
    """A tap that keeps what it sees."""

    def put(self, kind: RecordKind, node_id: int, t_master_ns: int, data: bytes) -> None:
        self.append((kind, node_id, t_master_ns, data))

    def of(self, kind: RecordKind) -> list[bytes]:
        return [data for one, _, _, data in self if one is kind]


class Setup:
    """One node, the rig that knows it, and a master."""

    def __init__(self, folder: Path) -> None:
        self.node = StreamingNode(folder)
        self.own = self.node.admit()
        rig = synthetic_rig()
        left = msgspec.structs.replace(
            rig.nodes[0], udp_port=self.node.link.port, control_port=self.node.server.control_port,
            public_key=self.node.trust.own.public_key)
        self.rig = msgspec.structs.replace(rig, nodes=(left,))
        self.frames: list[CameraObservations] = []
        self.records = Records()
        self.source = self.connect(self.own)

    def connect(self, own: KeyPair | None) -> UdpNodes:
        self.sent = 0
        source = UdpNodes(self.rig, own)
        source.deliver_to(self.frames.extend)
        source.record_to(self.records)
        return source

    def run(self) -> None:
        """Start, and wait until a frame of the node has come through."""
        eventually(lambda: self.source.links[0].clock.offset_s is not None)
        self.source.start(new_session())
        self.stream()

    def stream(self) -> None:
        """Send frames until one came through, and all that were sent have come."""
        before = len(self.frames)

        def arrived() -> bool:
            stream = self.node.sessions.current
            if stream is not None and stream.session == self.source.links[0].wanted:
                self.node.send_frame(self.rig)
                self.sent += 1
            return len(self.frames) > before
        received = self.source.links[0].door.received - self.sent  # others' datagrams
        eventually(arrived)
        eventually(lambda: self.source.links[0].door.received >= received + self.sent)

    def close(self) -> None:
        self.source.close()
        self.node.close()


def eventually(condition: Callable[[], bool], timeout_s: float = 4.0) -> float:
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < timeout_s, "did not happen in time"
        time.sleep(0.005)
    return time.monotonic() - begun


def settled(condition: Callable[[], bool], seconds: float = 0.3) -> bool:
    """Whether something stays true for a while."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if not condition():
            return False
        time.sleep(0.01)
    return True


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
    door = LogDoor(setup.rig)
    frames = [frame for record in setup.records if (frame := door.feed(Record(*record))) is not None]
    assert len(frames) == len(setup.frames) > 0
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
    assert len(setup.frames) == count and len(setup.records.of(RecordKind.DATAGRAM)) == recorded + 1
    setup.stream()


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
    before = setup.source.links[0].key_name
    setup.node.restart()
    begun = time.monotonic()
    setup.stream()
    assert setup.source.links[0].key_name != before
    assert time.monotonic() - begun < 2.0
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
    link._last_reply_ns = 0  # as after a second without answers
    time.sleep(0.4)
    assert link.key_name == before
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


def test_a_rig_with_keys_needs_the_masters(setup: Setup) -> None:
    with pytest.raises(SourceError, match="left is paired"):
        UdpNodes(setup.rig)


def test_open_and_paired_nodes_stand_side_by_side(setup: Setup, tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.bind(("127.0.0.1", 0))
        plain.settimeout(2.0)
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
