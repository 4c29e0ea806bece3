"""The UDP link on real sockets: clock replies, start and stop by unicast and broadcast, and all that is dropped."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from node_fakes import OF_ANY_PORT, node_settings
from patience import PATIENCE_S, eventually

from rhot_node.clock import NodeClock
from rhot_node.errors import LinkError
from rhot_node.network.link import ANSWERS_PER_S, UdpLink
from rhot_node.network.presence import Presence
from rhot_node.network.session import LinkKeys, Sessions, Stream
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Find,
    Here,
    Message,
    NodeState,
    Observations,
    Slices,
    Start,
    StartEntry,
    Stop,
    TrustState,
)

CLOCK = NodeClock(offset_ns=-4_000_000_000_000, drift_ppm=30.0)
MakeLink = Callable[..., UdpLink]


@pytest.fixture
def make_link() -> Iterator[MakeLink]:
    links: list[UdpLink] = []

    def make(keys: LinkKeys | None = None, **changes: Any) -> UdpLink:
        settings = node_settings(**{**OF_ANY_PORT, **changes})
        links.append(UdpLink(settings, CLOCK, Sessions(), 0xB007, lambda: NodeState.READY, keys))
        return links[-1]

    yield make
    for link in links:
        link.close()
        link.close()


@pytest.fixture
def master() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        sock.bind(("127.0.0.1", 0))
        sock.settimeout(PATIENCE_S)
        yield sock


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


def say(master: socket.socket, link: UdpLink, *messages: Message | bytes) -> None:
    """Send these, and have the link act upon all of them."""
    taken = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(link, "take", lambda *datagram: taken.append(UdpLink.take(link, *datagram)))
        for message in messages:
            data = message if isinstance(message, bytes) else encode(message)
            master.sendto(data, ("127.0.0.1", link.port))
        eventually(lambda: link.step(0.02) or len(taken) == len(messages))


def ask(master: socket.socket, link: UdpLink, session: int = 0) -> ClockReply:
    say(master, link, ClockRequest(3, session, 41, 123))
    reply = decode(master.recv(2048))
    assert isinstance(reply, ClockReply)
    return reply


def test_a_clock_request_is_answered_with_the_time_of_the_kernel(make_link: MakeLink, master: socket.socket) -> None:
    link = make_link()
    for number in range(1, 50):  # a kernel stamps only from some time after its first socket has asked for it
        before = CLOCK.now_ns()
        master.sendto(encode(ClockRequest(3, 0, 41, 123)), ("127.0.0.1", link.port))
        sent = CLOCK.now_ns()
        time.sleep(0.05)  # the program is late; the time must not be
        link.step(0.2)
        reply = decode(master.recv(2048))
        assert isinstance(reply, ClockReply)
        assert (reply.node_id, reply.sequence, reply.t1_master_ns, reply.boot_id) == (3, 41, 123, 0xB007)
        assert (reply.session, reply.state) == (0, NodeState.READY)
        assert link.clock_requests == number
        if reply.t2_node_ns <= sent + 10_000_000:
            break
    assert before - 50_000 <= reply.t2_node_ns <= sent + 10_000_000
    assert reply.t3_node_ns - reply.t2_node_ns > 40_000_000


def test_start_and_stop_set_the_session_and_the_reply_names_it(make_link: MakeLink, master: socket.socket) -> None:
    link = make_link()
    say(master, link, Start(77, 0, (StartEntry(2, 5002, 0), StartEntry(3, 5003, 0))))
    assert ask(master, link).session == 77
    assert link._sessions.current is not None and link._sessions.current.address == ("127.0.0.1", 5003)
    say(master, link, Stop(77, 1))
    assert ask(master, link).session == 0


def test_two_nodes_of_one_machine_hear_one_broadcast(make_link: MakeLink, master: socket.socket) -> None:
    port = free_port()
    links = [make_link(node_id=node_id, broadcast_port=port) for node_id in (3, 4)]
    start = Start(77, 0, tuple(StartEntry(node_id, 5000 + node_id, 0) for node_id in (3, 4)))
    master.sendto(encode(start), ("127.255.255.255", port))
    for link, data_port in zip(links, (5003, 5004), strict=True):
        link.step(1.0)
        stream = link._sessions.current
        assert stream is not None and stream.address == ("127.0.0.1", data_port)


PRESENCE = Presence(3, 0xB007, "left", 47800, 47801, 47802, 47803, TrustState.UNPAIRED)


@pytest.mark.parametrize("keys", [None, LinkKeys()], ids=["open", "closed"])
def test_whoever_asks_is_told_who_is_there(make_link: MakeLink, master: socket.socket, keys: LinkKeys | None) -> None:
    port = free_port()
    link = make_link(broadcast_port=port, keys=keys)
    link.introduce = lambda: PRESENCE
    master.sendto(encode(Find(0, 7, 99)), ("127.255.255.255", port))
    link.step(1.0)
    say(master, link, Find(3, 8, 100))
    for number, nonce in ((7, 99), (8, 100)):
        data, sender = master.recvfrom(2048)
        assert decode(data) == Here(3, number, nonce, 0xB007, 47800, 47801, 47802, 47803, NodeState.READY,
                                    TrustState.UNPAIRED, "left")
        assert sender == ("127.0.0.1", link.port)
    say(master, link, Find(4, 9, 101), encode(Find(0, 9, 101))[:-1])
    assert link.dropped == {"foreign_node": 1, "length": 1}


def test_a_flood_of_questions_is_not_turned_upon_somebody(make_link: MakeLink, master: socket.socket) -> None:
    link = make_link()
    link.introduce = lambda: PRESENCE
    for _ in range(3 * ANSWERS_PER_S):
        link.take(encode(Find(0, 7, 99)), master.getsockname(), 0)
    assert link.dropped == {"find_often": 2 * ANSWERS_PER_S}
    for _ in range(ANSWERS_PER_S):
        assert len(master.recv(2048)) < len(encode(Find(0, 7, 99)))


def test_what_cannot_be_sent_costs_one_frame_only(make_link: MakeLink) -> None:
    link = make_link()
    observations = Observations(3, 77, 0, 10, 20, 5, 4, 3, 640, 480, 9, 1, ())
    assert not link.send(observations, Stream(77, ("255.255.255.255", 9), 0))  # needs SO_BROADCAST
    assert not link.send(Observations(-3, 77, 0, 10, 20, 5, 4, 3, 640, 480, 9, 1, ()), Stream(77, ("127.0.0.1", 9), 0))


def test_everything_else_is_counted_by_reason(make_link: MakeLink, master: socket.socket) -> None:
    link = make_link()
    say(master, link, b"", b"hello", b"XXXX" + bytes(30), encode(Stop(5, 0))[:-1], ClockRequest(9, 0, 0, 0),
        Start(7, 0, (StartEntry(9, 5000, 0),)), Observations(3, 7, 0, 1, 2, 3, 4, 5, 640, 480, 9, 1, ()),
        Stop(0, 0), Start(8, 0, (StartEntry(3, 5000, 0),)), Start(8, 1, (StartEntry(3, 5000, 0),)), Stop(8, 0),
        Start(8, 2, (StartEntry(3, 5000, 0),)))
    assert link.dropped == {"length": 3, "magic": 1, "foreign_node": 2, "kind": 1, "stop_of_nothing": 1,
                            "start_repeated": 1, "start_stale": 1}
    assert link._sessions.current is None


def test_only_requests_of_the_own_session_keep_a_stream_alive(make_link: MakeLink, master: socket.socket) -> None:
    link = make_link()
    say(master, link, Start(7, 0, (StartEntry(3, 5000, 0),)))
    began = time.monotonic()
    time.sleep(0.02)
    ask(master, link, session=6)
    assert link._sessions.expire(began + 5.01), "a request of session 6 is no sign of session 7's master"
    say(master, link, Start(7, 0, (StartEntry(3, 5000, 0),)))
    ask(master, link, session=7)
    assert not link._sessions.expire(began + 5.01)


def test_the_thread_answers_and_ends(make_link: MakeLink, master: socket.socket) -> None:
    link = make_link()
    link.start()
    for sequence in range(20):
        master.sendto(encode(ClockRequest(3, 0, sequence, 0)), ("127.0.0.1", link.port))
        reply = decode(master.recv(2048))
        assert isinstance(reply, ClockReply) and reply.sequence == sequence
    link.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", link.port))


def test_a_taken_port_is_named_with_its_setting(make_link: MakeLink) -> None:
    link = make_link()
    with pytest.raises(LinkError, match=f"udp_port: UDP port {link.port} on 127.0.0.1"):
        make_link(udp_port=link.port)


def test_an_address_of_another_machine_is_named(make_link: MakeLink) -> None:
    with pytest.raises(LinkError, match=r"203\.0\.113\.7"):
        make_link(bind_address="203.0.113.7")


def test_a_broadcast_port_that_does_not_share_is_named(make_link: MakeLink) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("", 0))
        with pytest.raises(LinkError, match="broadcast_port"):
            make_link(broadcast_port=sock.getsockname()[1])


def test_slices_are_handed_on_with_the_running_session(make_link: MakeLink, master: socket.socket) -> None:
    link, taken = make_link(), []
    slices = Slices(3, 5, 0, 1, 640, 480, 0, 0, 1, 8, b"")
    say(master, link, slices)
    assert link.dropped["kind"] == 1, "nobody takes them yet"

    def take(message: Slices, session: int) -> str:
        taken.append((message, session))
        return "late" if len(taken) > 1 else ""
    link.take_slices = take
    say(master, link, slices, Start(5, 1, (StartEntry(3, 50001, 0),)), slices)
    assert taken == [(slices, 0), (slices, 5)]
    assert link.dropped["slices_late"] == 1
