"""Finding nodes: real questions and answers on loopback, zeroconf by a stand-in and once for real, and what is said of
nodes that cannot be told apart."""

from __future__ import annotations

import dataclasses
import ipaddress
import json
import queue
import socket
from collections.abc import Callable

import pytest
from findable_nodes import findable, free_udp_port, presence
from patience import PATIENCE_S

from rhot_app.__main__ import main
from rhot_app.sources import discovery
from rhot_app.sources.discovery import (
    NO_NETWORK,
    FindSocket,
    Found,
    Search,
    Sighting,
    ZeroconfBrowser,
    conflicts,
    find_nodes,
    together,
)
from rhot_node.network.presence import announce_by_zeroconf
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import Find, Here, NodeState, TrustState

READY = NodeState.READY


class Nobody:
    """A zeroconf that finds what it is given at once."""

    def __init__(self, *sightings: Sighting) -> None:
        self.sightings = sightings
        self.closed = False

    def __call__(self, found: Found) -> Nobody:
        for one in self.sightings:
            found(one)
        return self

    def close(self) -> None:
        self.closed = True


@pytest.fixture(autouse=True)
def a_network(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """This computer has one network, which nothing is sent into; the test may take it away."""
    def have(*addresses: str) -> None:
        found = [ipaddress.IPv4Interface(address) for address in addresses]
        monkeypatch.setattr(discovery, "own_interfaces", lambda: found)
    have("10.0.0.4/24", "127.0.0.1/8")
    monkeypatch.setattr(discovery.FindSocket, "_broadcasts", lambda self: ["127.255.255.255"])
    return have


def test_nodes_are_found_by_broadcast_and_zeroconf_at_once() -> None:
    port = free_udp_port()
    announced = Nobody(Sighting(presence(9, "elsewhere", trust=TrustState.PAIRED), "10.0.0.7"))
    shown: list[float] = []
    with findable(port, presence(3, "left")) as left, findable(port, presence(4, "right"), "127.0.0.2") as right:
        found = find_nodes(0.3, port=port, browse=announced, progress=lambda text, done: shown.append(done))
    assert [(str(node), node.presence.udp_port, node.state) for node in found.nodes] == [
        ("elsewhere (id 9) at 10.0.0.7", 47800, None), ("left (id 3) at 127.0.0.1", left.port, READY),
        ("right (id 4) at 127.0.0.2", right.port, READY)]
    assert (found.conflicts, found.notes) == ((), ())
    assert announced.closed and shown == sorted(shown) and shown[-1] < 1.0


def test_without_zeroconf_the_broadcast_is_enough() -> None:
    def fails(found: Found) -> Nobody:
        raise OSError("no multicast here")
    port = free_udp_port()
    with findable(port, presence()):
        found = find_nodes(0.2, port=port, browse=fails)
    assert len(found.nodes) == 1 and "no multicast here" in found.notes[0]


def test_without_a_network_it_says_so(a_network: Callable[..., None]) -> None:
    a_network("127.0.0.1/8")
    announced = Nobody(Sighting(presence(), "10.0.0.7"))
    assert find_nodes(0.1, port=free_udp_port(), browse=announced) == Search((), (), (NO_NETWORK,))


def test_only_who_has_heard_the_question_can_answer_it() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.1", 0))
        stranger.settimeout(PATIENCE_S)
        questions = FindSocket(free_udp_port(), this_machine_only=True)
        questions.ask(7, [stranger.getsockname()])
        data, sender = stranger.recvfrom(1024)
        question = decode(data)
        assert isinstance(question, Find) and question.node_id == 7
        right = presence().answer(question, READY)
        for nonce in (question.nonce ^ 1, question.nonce):
            answer = Here(nonce=nonce, **{name: getattr(right, name) for name in Here.__slots__ if name != "nonce"})
            stranger.sendto(encode(answer), sender)
            stranger.sendto(b"nonsense", sender)
        stranger.sendto(data, sender)
        seen: list[Sighting] = []
        while not seen:
            seen = questions.wait(2.0)
        assert seen == [Sighting(presence(), "127.0.0.1", READY)]
        questions.close()


def test_one_node_at_two_addresses_is_one_and_a_restarted_one_too() -> None:
    told = presence(trust=TrustState.PAIRED)
    seen = [Sighting(told, "127.0.0.1", READY), Sighting(told, "10.0.0.4", READY), Sighting(presence(), "10.0.0.4"),
            Sighting(presence(5, boot_id=1), "10.0.0.5", NodeState.STREAMING),
            Sighting(presence(5, boot_id=2), "10.0.0.5")]
    left, other = together(seen)
    assert (left.presence.trust, left.addresses, left.state) == (TrustState.PAIRED, ("10.0.0.4", "127.0.0.1"), READY)
    assert (other.presence.boot_id, other.state) == (2, None), "what it did before is not known of the new run"
    assert len(conflicts((left, other))) == 1


def test_two_nodes_of_one_id_and_two_of_one_name_are_told() -> None:
    nodes = together([Sighting(presence(3, "left", 1), "10.0.0.5"), Sighting(presence(3, "right", 2), "10.0.0.6"),
                      Sighting(presence(4, "right", 3), "10.0.0.7"), Sighting(presence(5, "top", 4), "10.0.0.8")])
    ids, names = conflicts(nodes)
    assert ids.startswith("Two nodes have the id 3: left (id 3) at 10.0.0.5 and right (id 3) at 10.0.0.6.")
    assert "change node_id" in ids
    assert names.startswith("Two nodes are called right: right (id 3) at 10.0.0.6 and right (id 4) at 10.0.0.7.")


def test_the_library_announces_and_finds_on_loopback() -> None:
    seen: queue.Queue[Sighting] = queue.Queue()
    who = presence(77, "real. library", 0xB007)
    browser = ZeroconfBrowser(seen.put, ["127.0.0.1"])
    try:
        service = announce_by_zeroconf(who, ["127.0.0.1"])
        try:
            assert seen.get(timeout=PATIENCE_S) == Sighting(who, "127.0.0.1")
        finally:
            service.close()
    finally:
        browser.close()


def test_the_command_shows_who_is_there(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    nodes = together([Sighting(presence(3, "left", 1), "10.0.0.5", READY),
                      Sighting(presence(3, "right", 2), "10.0.0.6")])
    found = Search(nodes, conflicts(nodes), (NO_NETWORK,))
    monkeypatch.setattr(discovery, "find_nodes", lambda seconds, progress: found)
    assert main(["nodes"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split() for line in lines[:3]] == [
        ["name", "id", "address", "trust", "state"], ["left", "3", "10.0.0.5", "unpaired", "ready"],
        ["right", "3", "10.0.0.6", "unpaired", "announced"]]
    assert lines[3].startswith("Two nodes have the id 3") and lines[4] == NO_NETWORK
    assert main(["nodes", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["nodes"][0] == {
        "node_id": 3, "name": "left", "addresses": ["10.0.0.5"], "udp_port": 47800, "control_port": 47801,
        "preview_port": 47802, "pairing_port": 47803, "boot_id": 1, "trust": "unpaired", "state": "ready"}
    assert (told["nodes"][1]["state"], len(told["conflicts"]), told["notes"]) == ("", 1, [NO_NETWORK])
    monkeypatch.setattr(discovery, "find_nodes", lambda seconds, progress: Search((), (), ()))
    assert main(["nodes", "--seconds", "1"]) == 1
    assert "No node was found within 1 s" in capsys.readouterr().out


def test_an_unusual_pairing_port_stands_behind_the_address(monkeypatch: pytest.MonkeyPatch,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    unusual = dataclasses.replace(presence(), pairing_port=47853)
    found = Search(together([Sighting(unusual, "10.0.0.5", READY)]), (), ())
    monkeypatch.setattr(discovery, "find_nodes", lambda seconds, progress: found)
    assert main(["nodes"]) == 0
    assert capsys.readouterr().out.splitlines()[1].split() == ["left", "3", "10.0.0.5:47853", "unpaired", "ready"]


def test_a_time_that_cannot_be_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nodes", "--seconds", "61"]) == 2
    assert "--seconds" in capsys.readouterr().err
