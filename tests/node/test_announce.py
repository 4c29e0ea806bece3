"""The announcement of a node: what it says, when it is said anew, and that nothing which goes wrong there matters."""

from __future__ import annotations

import ipaddress
import logging
import threading
from collections.abc import Callable, Sequence

import pytest
from patience import PATIENCE_S

from rhot_node.network import presence as announce
from rhot_node.network.presence import (
    SERVICE,
    Announcer,
    Presence,
    host_of,
    instance_of,
    presence_of,
    properties_of,
)
from rhot_node.wire.messages import TrustState

LEFT = Presence(3, 0xB007, "left", 47800, 47801, 47802, 47803, TrustState.UNPAIRED)
PAIRED = Presence(3, 0xB007, "left", 47800, 47801, 47802, 47803, TrustState.PAIRED)


class Network:
    """What was announced, and what was withdrawn; `error` is raised instead."""

    def __init__(self) -> None:
        self.announced: list[tuple[Presence, tuple[str, ...]]] = []
        self.goodbyes = 0
        self.error: Exception | None = None
        self.said: Callable[[], None] = lambda: None

    def __call__(self, presence: Presence, addresses: Sequence[str]) -> Network:
        if self.error is not None:
            raise self.error
        self.announced.append((presence, tuple(addresses)))
        self.said()
        return self

    def close(self) -> None:
        self.goodbyes += 1


def interfaces(*addresses: str) -> list[ipaddress.IPv4Interface]:
    return [ipaddress.IPv4Interface(address) for address in addresses]


@pytest.mark.parametrize("presence", [
    LEFT, PAIRED, Presence(2**32 - 1, 2**32 - 1, "a.b/c " + "é" * 58, 1, 2, 3, 65535, TrustState.OPEN)])
def test_what_is_announced_is_understood(presence: Presence) -> None:
    from zeroconf import ServiceInfo
    info = ServiceInfo(SERVICE, instance_of(presence), port=presence.udp_port, properties=properties_of(presence),
                       server=host_of(presence))  # the library's own rules for names and properties
    assert presence_of(info.decoded_properties, info.port) == presence
    assert len(instance_of(presence).removesuffix(f".{SERVICE}").encode()) <= 63


@pytest.mark.parametrize("changes", [
    {"id": "0"}, {"id": "x"}, {"id": None}, {"boot": "-1"}, {"name": ""}, {"name": "\x1b[2J"}, {"control": "70000"},
    {"version": "2"}, {"trust": "all"}])
def test_what_is_no_node_is_passed_over(changes: dict[str, str | None]) -> None:
    assert presence_of({**properties_of(LEFT), **changes}, 47800) is None
    assert presence_of(properties_of(LEFT), 0) is None


def test_it_is_announced_anew_when_it_or_its_address_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    network, now = Network(), [LEFT]
    announcer = Announcer(lambda: now[0], "0.0.0.0", network)
    monkeypatch.setattr(announce, "own_interfaces", lambda: interfaces("10.0.0.4/24", "127.0.0.1/8"))
    announcer.step()
    announcer.step()
    now[0] = PAIRED
    announcer.step()
    monkeypatch.setattr(announce, "own_interfaces", lambda: interfaces("10.0.0.9/24", "127.0.0.1/8"))
    announcer.step()
    assert network.announced == [(LEFT, ("10.0.0.4",)), (PAIRED, ("10.0.0.4",)), (PAIRED, ("10.0.0.9",))]
    assert network.goodbyes == 2
    monkeypatch.setattr(announce, "own_interfaces", lambda: interfaces("127.0.0.1/8"))
    announcer.step()
    assert len(network.announced) == 3 and network.goodbyes == 3, "the network is gone"


def test_a_node_of_this_machine_alone_is_not_announced() -> None:
    network = Network()
    Announcer(lambda: LEFT, "127.0.0.1", network).step()
    assert network.announced == []
    Announcer(lambda: LEFT, "10.0.0.4", network).step()
    assert network.announced == [(LEFT, ("10.0.0.4",))]


@pytest.mark.parametrize("error", [OSError("no multicast here"), ImportError("No module named 'zeroconf'"),
                                   AssertionError()])
def test_what_goes_wrong_is_said_once_and_tried_again(error: Exception, caplog: pytest.LogCaptureFixture) -> None:
    network = Network()
    network.error = error
    announcer = Announcer(lambda: LEFT, "10.0.0.4", network)
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            announcer.step()
    assert len(caplog.records) <= 1 and all(type(error).__name__ in record.message for record in caplog.records)
    network.error = None
    announcer.step()
    assert network.announced == [(LEFT, ("10.0.0.4",))]


def test_the_thread_announces_and_says_goodbye() -> None:
    network, said = Network(), threading.Event()
    network.said = said.set
    announcer = Announcer(lambda: LEFT, "10.0.0.4", network)
    announcer.start()
    assert said.wait(PATIENCE_S)
    announcer.close()
    announcer.close()
    assert network.goodbyes == 1
