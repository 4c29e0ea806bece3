"""The bad network: seeded, with the statistics it was asked for, and through real sockets."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator

import numpy as np
import pytest
from patience import PATIENCE_S

from rhot_app.simulator.nodes.proxy import DelayQueue, Impairment, UdpProxy
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import ClockRequest, Start, StartEntry


def bound() -> socket.socket:
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.bind(("127.0.0.1", 0))
    s.settimeout(PATIENCE_S)
    return s


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket, socket.socket]]:
    sockets = (bound(), bound(), bound())
    yield sockets
    for s in sockets:
        s.close()


def test_probabilities_come_out_and_a_seed_repeats_them() -> None:
    impairment = Impairment(loss=0.2, delay_s=0.001, jitter_s=0.002, duplicate=0.1, reorder=0.05)
    first = [impairment.arrivals(rng) for rng in [np.random.default_rng(7)] for _ in range(20000)]
    again = [impairment.arrivals(rng) for rng in [np.random.default_rng(7)] for _ in range(20000)]
    assert first == again
    kept = [waits for waits in first if waits]
    assert 1 - len(kept) / len(first) == pytest.approx(0.2, abs=0.01)
    assert sum(len(waits) == 2 for waits in kept) / len(kept) == pytest.approx(0.1, abs=0.01)
    assert min(min(waits) for waits in kept) >= 0.001
    assert np.mean([waits[0] for waits in kept]) == pytest.approx(0.001 + 0.002 + 0.05 * 0.03, rel=0.1)


@pytest.mark.parametrize("wrong", [{"loss": 1.5}, {"reorder": -0.1}, {"delay_s": -1.0}])
def test_nonsense_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError):
        Impairment(**wrong)


def test_queue_delivers_by_arrival_time() -> None:
    queue = DelayQueue()
    for t, name in ((3.0, b"c"), (1.0, b"a"), (2.0, b"b"), (1.0, b"a2")):
        queue.put(t, name)
    assert queue.next_s == 1.0
    assert queue.pop_due(2.5) == [b"a", b"a2", b"b"]
    assert queue.pop_due(2.9) == []


def test_start_is_redirected_and_observations_come_back_through_the_proxy(
        ends: tuple[socket.socket, socket.socket, socket.socket]) -> None:
    master, master_data, node = ends
    proxy = UdpProxy(2, node.getsockname()[1], Impairment())
    proxy.start()
    try:
        start = Start(session=9, sequence=1, entries=(
            StartEntry(1, 4000, 0), StartEntry(2, master_data.getsockname()[1], 0)))
        master.sendto(encode(start), ("127.0.0.1", proxy.command_port))
        datagram, sender = node.recvfrom(2000)
        received = decode(datagram)
        assert isinstance(received, Start)
        assert received.entries[0] == start.entries[0]
        assert received.entries[1].data_port != start.entries[1].data_port
        node.sendto(b"observations", (sender[0], received.entries[1].data_port))
        assert master_data.recv(2000) == b"observations"

        request = encode(ClockRequest(2, 9, 2, 123))
        master.sendto(request, ("127.0.0.1", proxy.command_port))
        datagram, sender = node.recvfrom(2000)
        assert datagram == request
        node.sendto(b"reply", sender)
        reply, source = master.recvfrom(2000)
        assert reply == b"reply"
        assert source[1] == proxy.command_port
    finally:
        proxy.close()
        proxy.close()


def test_loss_delay_and_order_on_real_sockets(ends: tuple[socket.socket, socket.socket, socket.socket]) -> None:
    master, master_data, node = ends
    proxy = UdpProxy(2, node.getsockname()[1], Impairment(loss=0.3, delay_s=0.02, reorder=0.2), seed=3)
    proxy.start()
    try:
        master.sendto(encode(Start(9, 1, (StartEntry(2, master_data.getsockname()[1], 0),))),
                      ("127.0.0.1", proxy.command_port))
        datagram, sender = node.recvfrom(2000)
        received = decode(datagram)
        assert isinstance(received, Start)
        began = time.monotonic()
        for k in range(200):
            node.sendto(k.to_bytes(2, "little"), (sender[0], received.entries[0].data_port))
            time.sleep(0.001)
        master_data.settimeout(1.5)
        arrived = []
        with pytest.raises(TimeoutError):
            while True:
                arrived.append(int.from_bytes(master_data.recv(2000), "little"))
                if len(arrived) == 1:
                    assert time.monotonic() - began >= 0.02
        assert 110 <= len(arrived) <= 170
        assert arrived != sorted(arrived)
    finally:
        proxy.close()
