"""The keys of a node's datagrams: whose they are, what a replay is, what is forgotten."""

from __future__ import annotations

import pytest

from rhot_node.errors import WireError
from rhot_node.network.session import LINKS_MAX, LinkKeys
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import ClockRequest, Message, Start, StartEntry, Stop


def reason(keys: LinkKeys, data: bytes) -> str:
    with pytest.raises(WireError) as caught:
        keys.open(data)
    return caught.value.reason


def request(sequence: int) -> ClockRequest:
    return ClockRequest(3, 0, sequence, 1)


def test_a_datagram_is_its_links(keys: LinkKeys) -> None:
    one, other = keys.grant("a"), keys.grant("b")
    for link in (one, other, one):
        message, found = keys.open(encode(request(link.heard + 100), link.seal))
        assert found is link and isinstance(message, ClockRequest)


def test_every_kind_of_message_is_taken_once(keys: LinkKeys) -> None:
    link = keys.grant("a")
    messages: list[Message] = [request(0), Start(7, 0, (StartEntry(3, 50, 0),)), Stop(7, 0)]
    for message in messages:
        assert keys.open(encode(message, link.seal))[0] == message
    assert [reason(keys, encode(message, link.seal)) for message in messages] == ["replay"] * 3


def test_what_was_overtaken_is_taken_what_is_old_is_not(keys: LinkKeys) -> None:
    seal = keys.grant("a").seal
    for sequence in (5, 1000, 999, 489):  # 511 behind the newest still lies in the window
        keys.open(encode(request(sequence), seal))
    assert [reason(keys, encode(request(sequence), seal)) for sequence in (488, 5, 999, 489, 1000)] == ["replay"] * 5
    keys.open(encode(request(4_000_000_000), seal))  # a network that was down for long


def test_strangers_other_links_and_bare_datagrams_are_refused_by_reason(keys: LinkKeys) -> None:
    link = keys.grant("a")
    assert reason(keys, encode(request(0))) == "untagged"
    assert reason(keys, encode(request(0), LinkKeys().grant("a").seal)) == "tag"
    assert reason(keys, b"hello") == "length"
    broken = encode(Stop(7, 0), link.seal)[:-17]
    assert reason(keys, broken + link.seal.tag(broken)) == "length", "a master may be wrong, too"
    assert reason(LinkKeys(), encode(request(0), link.seal)) == "tag"


def test_a_known_link_is_granted_again_only_to_its_own_master(keys: LinkKeys) -> None:
    link = keys.grant("a")
    assert keys.grant("a", link.name) is link
    assert keys.grant("b", link.name) is not link and keys.find("b", link.name) is None
    assert keys.grant("a") is not link
    assert keys.grant("a", "lost when the node was restarted").name != link.name


def test_the_link_silent_longest_goes_first(keys: LinkKeys) -> None:
    links = [keys.grant("a") for _ in range(LINKS_MAX)]
    keys.open(encode(request(0), links[0].seal))
    keys.grant("a")
    assert keys.find("a", links[0].name) is links[0] and keys.find("a", links[1].name) is None


def test_links_of_forgotten_masters_are_void(keys: LinkKeys) -> None:
    kept, gone = keys.grant("a"), keys.grant("b")
    keys.forget(lambda master: master == "a")
    assert reason(keys, encode(request(0), gone.seal)) == "tag"
    assert keys.open(encode(request(0), kept.seal))


@pytest.fixture
def keys() -> LinkKeys:
    return LinkKeys()
