"""A node that changes its address: found by its id, believed by its key, and never for what somebody else says."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from findable_nodes import findable, free_udp_port, presence
from patience import eventually
from streaming_node import Setup
from synthetic_node import synthetic_rig

from rhot_app.sources import lost_nodes
from rhot_app.sources.discovery import Found, Sighting
from rhot_app.sources.links import UdpNodes
from rhot_app.sources.lost_nodes import LOST_NS, PATIENT_NS, PLACES_MAX, LostNodes
from rhot_app.sources.node_link import NodeLink

SOON_NS = 300_000_000


@pytest.fixture
def setup(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Setup]:
    monkeypatch.setattr(lost_nodes, "LOST_NS", SOON_NS)
    monkeypatch.setattr(lost_nodes, "ASK_NS", SOON_NS // 4)
    setup = Setup(tmp_path)
    yield setup
    setup.close()


def test_a_paired_node_is_followed_and_streams_again(setup: Setup) -> None:
    setup.run()
    setup.move("127.0.0.2")
    setup.stream()
    eventually(lambda: setup.source.links[0].node.address == "127.0.0.2")
    node = setup.source.links[0].node
    assert (node.udp_port, node.control_port) == (setup.node.link.port, setup.node.server.control_port)
    assert (node.name, node.public_key, node.intrinsics) == (
        setup.rig.nodes[0].name, setup.rig.nodes[0].public_key, setup.rig.nodes[0].intrinsics)
    eventually(lambda: not setup.source._lost._searches)


def test_a_node_that_was_elsewhere_from_the_start_is_found(setup: Setup) -> None:
    setup.source.close()
    setup.move("127.0.0.3")
    setup.source = setup.connect(setup.own)
    setup.run()
    assert setup.source.links[0].node.address == "127.0.0.3"


def test_whoever_poses_as_the_node_gains_nothing(setup: Setup) -> None:
    setup.run()
    link = setup.source.links[0]
    setup.node.link.close()
    with findable(setup.broadcast_port, presence(1, boot_id=9), "127.0.0.6") as liar:
        eventually(lambda: liar.dropped["tag"] > 3)  # he is tried: an open node that takes no tag
        assert link.node.address == "127.0.0.1" and not link.turned_away
        setup.move("127.0.0.2")
        setup.stream()
        eventually(lambda: link.node.address == "127.0.0.2")


def test_an_open_node_is_followed_when_it_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lost_nodes, "LOST_NS", SOON_NS)
    rig = synthetic_rig()
    port = free_udp_port()
    left = msgspec.structs.replace(rig.nodes[0], udp_port=free_udp_port())
    rig = msgspec.structs.replace(rig, nodes=(left,), broadcast=msgspec.structs.replace(rig.broadcast, port=port))
    source = UdpNodes(rig)
    try:
        with findable(port, presence(left.node_id, boot_id=9), "127.0.0.2"):
            eventually(lambda: source.links[0].node.address == "127.0.0.2")
            assert source.links[0].state is not None
    finally:
        source.close()


class Clock:
    """Lost nodes without a network, at times that the test sets; sightings come as if by zeroconf."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, address: str = "10.0.0.5") -> None:
        rig = synthetic_rig()
        rig = msgspec.structs.replace(rig, nodes=(msgspec.structs.replace(rig.nodes[0], address=address),))
        self.link = NodeLink(rig, 0)
        self.asked: list[int] = []
        self.opened = self.closed = 0
        monkeypatch.setattr(lost_nodes.FindSocket, "ask", lambda one, node_id: self.asked.append(node_id))
        self.lost = LostNodes([self.link], free_udp_port(), 0, self.browse)

    def browse(self, found: Found) -> Clock:
        self.opened += 1
        return self

    def close(self) -> None:
        self.closed += 1

    def see(self, address: str, now_ns: int, **changes: int) -> None:
        who = dataclasses.replace(presence(self.link.node.node_id, udp_port=self.link.node.udp_port,
                                           **changes), control_port=self.link.node.control_port)
        self.lost._announced.append(Sighting(who, address))
        self.lost.step(now_ns)

    def places(self) -> list[str]:
        return [place.address for place in self.lost.places(self.link)]


def test_it_is_asked_for_after_two_seconds_often_at_first_and_by_zeroconf_later(
        monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    for tenth in range(151):
        clock.lost.step(tenth * 10**8)
        if tenth == LOST_NS // 10**8:
            assert clock.asked == []
    assert clock.asked == [clock.link.node.node_id] * (6 + 4)
    eventually(lambda: clock.opened == 1)
    clock.link.last_reply_ns = 15 * 10**9
    clock.lost.step(15 * 10**9 + 1)
    eventually(lambda: clock.closed == 1)
    assert clock.lost._questions is None and clock.lost._browser is None


def test_a_rig_of_this_machine_alone_asks_no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch, "127.0.0.1")
    for second in range(12):
        clock.lost.step(second * 10**9)
    assert clock.lost._questions is not None and clock.lost._questions._broadcasts() == ["127.255.255.255"]
    assert clock.opened == 0 and PATIENT_NS < 8 * 10**9


def test_few_places_are_tried_and_each_gets_its_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    now_ns = LOST_NS + 1
    clock.lost.step(now_ns)
    clock.see("10.0.0.5", now_ns)
    assert clock.places() == [], "there it does not answer"
    for last in range(20, 40):
        clock.see(f"10.0.0.{last}", now_ns)
        clock.see(f"10.0.0.{last}", now_ns)
    assert clock.places() == [f"10.0.0.{last}" for last in range(20, 20 + PLACES_MAX)]
    clock.see("10.0.0.50", now_ns + LOST_NS)
    assert clock.places() == ["10.0.0.21", "10.0.0.22", "10.0.0.23", "10.0.0.50"]
    clock.lost._announced.append(Sighting(presence(clock.link.node.node_id + 1), "10.0.0.60"))
    clock.lost.step(now_ns + 2 * LOST_NS)
    assert "10.0.0.60" not in clock.places(), "another node's"
    assert clock.lost.at(clock.link, ("10.0.0.50", clock.link.node.udp_port)) is not None
    assert clock.lost.at(clock.link, ("10.0.0.50", 9)) is None
    clock.link.last_reply_ns = now_ns + 2 * LOST_NS
    clock.lost.step(now_ns + 2 * LOST_NS)
    assert clock.places() == []
