"""Pairing: right and wrong codes, five tries, five minutes, another boot, and somebody between with keys of his own."""

from __future__ import annotations

import json
import secrets
from typing import Any

import pytest
from patience import PATIENCE_MS, eventually, settled
from trusted_node import TrustedNode

from rhot_node.errors import TrustError
from rhot_node.keys import KeyPair, new_key_pair
from rhot_node.network.pairing import (
    ALPHABET,
    CODE_LENGTH,
    Transcript,
    new_code,
    proof,
    proves,
    read_code,
    show_code,
)

NAME = "desk"


def try_to_pair(node: TrustedNode, code: str, own: KeyPair, hello: dict[str, Any] | None = None,
                **lies: Any) -> tuple[dict[str, Any], Transcript]:
    """One try of a master; `lies` replace what its request says."""
    hello = hello or node.stranger(request="hello")
    nonce = secrets.token_hex(16)
    transcript = Transcript(bytes.fromhex(hello["public_key"]), bytes.fromhex(own.public_key),
                            bytes.fromhex(hello["nonce"] or "00" * 16), bytes.fromhex(nonce), hello["node_id"],
                            hello["name"], NAME)
    request = {"request": "pair", "master_key": own.public_key, "master_name": NAME, "master_nonce": nonce,
               "proof": proof(code, "master", transcript).hex(), **lies}
    return node.stranger(**request), transcript


def test_hello_tells_who_it_is_and_nothing_else(node: TrustedNode) -> None:
    assert node.stranger(request="hello") == {
        "ok": True, "node_id": 3, "name": "left", "state": "ready", "trust": "unpaired", "nonce": "",
        "public_key": node.trust.own.public_key}
    for request in ("state", "settings", "set_settings", "still", "start", "stop", "link", "counters"):
        assert not node.stranger(request=request)["ok"]


def test_the_right_code_pairs_both_ways_and_serves_once(node: TrustedNode) -> None:
    own, code = new_key_pair(), node.offers.renew().code
    answer, transcript = try_to_pair(node, read_code(show_code(code).lower()), own)
    assert answer["ok"] and proves(bytes.fromhex(answer["proof"]), code, "node", transcript)
    assert node.trust.admits(own.public_key) and node.stranger(request="hello")["trust"] == "paired"
    assert node.ask(node.connect(node.server.control_port, own), request="state") is not None
    answer, _ = try_to_pair(node, code, new_key_pair())
    assert not answer["ok"] and "offers no code" in answer["error"]
    saved = json.loads(node.keys_path.read_text())
    assert [master["public_key"] for master in saved["masters"]] == [own.public_key]


def test_five_wrong_tries_and_the_code_is_void(node: TrustedNode) -> None:
    own, code = new_key_pair(), node.offers.renew().code
    for left in (4, 3, 2, 1):
        answer, _ = try_to_pair(node, new_code(), own)
        assert not answer["ok"] and f"{left} more tries" in answer["error"]
    assert "No more tries" in try_to_pair(node, new_code(), own)[0]["error"]
    answer, _ = try_to_pair(node, code, own)
    assert not answer["ok"] and not node.trust.masters, "the right one comes too late"


def test_the_fifth_try_may_be_right(node: TrustedNode) -> None:
    own, code = new_key_pair(), node.offers.renew().code
    for _ in range(4):
        try_to_pair(node, new_code(), own)
    assert try_to_pair(node, code, own)[0]["ok"]


@pytest.mark.parametrize(("seconds", "boot_id", "paired"), [
    (299.9, "first boot", True), (300.0, "first boot", False), (1.0, "second boot", False)])
def test_a_code_is_valid_for_five_minutes_of_one_boot(node: TrustedNode, seconds: float, boot_id: str,
                                                      paired: bool) -> None:
    own, code = new_key_pair(), node.offers.renew().code
    hello = node.stranger(request="hello")
    node.clock.now_ns += round(1e9 * seconds)
    node.clock.boot_id = boot_id
    assert try_to_pair(node, code, own, hello)[0]["ok"] is paired
    assert not node.offers.path.exists(), "used or void, it is removed"


def test_a_code_is_removed_after_its_five_minutes_though_nobody_asks(node: TrustedNode) -> None:
    node.offers.renew()
    assert settled(node.offers.path.exists, 1.5)
    node.clock.now_ns += 300 * 10**9
    eventually(lambda: not node.offers.path.exists())


def test_a_fresh_code_voids_the_one_before(node: TrustedNode) -> None:
    first, second = node.offers.renew().code, node.offers.renew().code
    assert not try_to_pair(node, first, new_key_pair())[0]["ok"]
    assert try_to_pair(node, second, new_key_pair())[0]["ok"]


def test_keys_swapped_on_the_way_are_noticed_by_the_node(node: TrustedNode) -> None:
    """Somebody between shows the master a key of his own, or gives the node one."""
    code, attacker = node.offers.renew().code, new_key_pair()
    shown = {**node.stranger(request="hello"), "public_key": attacker.public_key}
    assert not try_to_pair(node, code, new_key_pair(), shown)[0]["ok"]
    assert not try_to_pair(node, code, new_key_pair(), master_key=attacker.public_key)[0]["ok"]
    assert not try_to_pair(node, code, new_key_pair(), master_name="dask")[0]["ok"]
    assert not node.trust.masters


def test_a_masters_own_proof_sent_back_proves_no_node(node: TrustedNode) -> None:
    code = node.offers.renew().code
    _, transcript = try_to_pair(node, code, new_key_pair())
    assert not proves(proof(code, "master", transcript), code, "node", transcript)


def test_each_field_changes_the_proof_and_none_runs_into_the_next() -> None:
    base = Transcript(b"a" * 32, b"b" * 32, b"c" * 16, b"d" * 16, 3, "left", "desk")
    others = [Transcript(b"b" * 32, b"a" * 32, b"c" * 16, b"d" * 16, 3, "left", "desk"),
              Transcript(b"a" * 32, b"b" * 32, b"d" * 16, b"c" * 16, 3, "left", "desk"),
              Transcript(b"a" * 32, b"b" * 32, b"c" * 16, b"d" * 16, 4, "left", "desk"),
              Transcript(b"a" * 32, b"b" * 32, b"c" * 16, b"d" * 16, 3, "leftd", "esk")]
    code = new_code()
    assert len({proof(code, "master", one) for one in [base, *others]}) == 5


def test_tries_outlive_a_restart_of_the_node(node: TrustedNode) -> None:
    node.offers.renew()
    try_to_pair(node, new_code(), new_key_pair())
    offer = type(node.offers)(node.offers.path, node.clock).current()
    assert offer is not None and offer.tries_left == 4
    assert offer.code not in repr(offer)


@pytest.mark.parametrize("request_data", [
    b"", b"{", b"null", b'{"request": "pair"}', b'{"request": "hello", "x": 1}', b"\xff" * 100,
    b'{"request": "pair", "master_key": "zz", "master_name": "a", "master_nonce": "00", "proof": "00"}',
    b'{"request": "hello"' + b" " * 900 + b"}"])
def test_whatever_a_stranger_says_costs_no_try(node: TrustedNode, request_data: bytes) -> None:
    node.offers.renew()
    sock = node.connect(node.server.pairing_port, None)
    sock.send(request_data)
    assert sock.poll(PATIENCE_MS)
    assert json.loads(sock.recv())["ok"] in (True, False)
    offer = node.offers.current()
    assert offer is not None and offer.tries_left == 5


def test_a_stranger_who_says_much_is_cut_off(node: TrustedNode) -> None:
    sock = node.connect(node.server.pairing_port, None)
    sock.send(b'{"request": "hello"' + b" " * 5000 + b"}")
    assert not sock.poll(200)
    assert node.stranger(request="hello")["ok"], "others are answered"


def test_codes_have_75_bits_and_are_read_as_people_type_them() -> None:
    codes = {new_code() for _ in range(200)}
    assert len(codes) == 200 and all(len(code) == CODE_LENGTH == 15 for code in codes)
    assert len(ALPHABET) == 32 and set("".join(codes)) == set(ALPHABET)
    code = "0123456789ABCDE"
    assert show_code(code) == "01234-56789-ABCDE"
    for typed in ("01234-56789-ABCDE", "o1234 56789 abcde", "OI23456789abcde", " oL234-56789-ABCDE\n"):
        assert read_code(typed) == code
    for typed, word in (("01234", "has 5"), ("01234-56789-ABCDU", "'U'"), ("01234-56789-ABCD€", "'€'")):
        with pytest.raises(TrustError, match=word):
            read_code(typed)
