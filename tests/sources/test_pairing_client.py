"""The master's side of pairing, against a real reception, an impostor, and somebody between who swaps keys."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zmq
from synthetic_node import synthetic_rig
from trusted_node import ABOUT, TrustedNode

from rhot_app.__main__ import main
from rhot_app.errors import PairingError
from rhot_app.keys import MasterKeys, keys_path, load_master_keys
from rhot_app.project import load_rig, save_rig
from rhot_app.sources.pairing import NodeAddress, ask_who, pair
from rhot_node.errors import TrustError
from rhot_node.keys import new_key_pair
from rhot_node.network.pairing import new_code, show_code

PORTS = {"udp_port": 1, "control_port": 2, "preview_port": 3, "pairing_port": 4}


@pytest.fixture
def node(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TrustedNode]:
    monkeypatch.setenv("RHOT_KEYS", str(tmp_path / "master" / "keys.json"))
    monkeypatch.setitem(ABOUT, "udp_port", 1)
    for name, port in PORTS.items():
        monkeypatch.setitem(ABOUT, name, port)
    node = TrustedNode(tmp_path)
    yield node
    node.close()


@pytest.fixture
def address(node: TrustedNode) -> NodeAddress:
    return NodeAddress("127.0.0.1", node.server.pairing_port)


@pytest.fixture
def between(node: TrustedNode) -> Iterator[Callable[..., NodeAddress]]:
    """Starts somebody who passes on what is said, changed by functions."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    threads: list[threading.Thread] = []

    def start(change_question: Callable[[dict[str, Any]], None], change_answer: Callable[[dict[str, Any]], None],
              ) -> NodeAddress:
        server = context.socket(zmq.REP)
        port = server.bind_to_random_port("tcp://127.0.0.1")

        def run() -> None:
            while server.poll(2000):
                question = json.loads(server.recv())
                change_question(question)
                answer = node.stranger(**question)
                change_answer(answer)
                server.send_json(answer)
                if question["request"] == "pair":
                    return

        threads.append(threading.Thread(target=run))
        threads[-1].start()
        return NodeAddress("127.0.0.1", port)

    yield start
    for thread in threads:
        thread.join()
    context.destroy(linger=0)


def unchanged(_message: dict[str, Any]) -> None:
    pass


def test_the_code_pairs_both_and_both_remember(node: TrustedNode, address: NodeAddress) -> None:
    keys = load_master_keys()
    who = pair(address, show_code(node.offers.renew().code), keys)
    assert (who.node_id, who.name, who.public_key) == (3, "left", node.trust.own.public_key)
    assert node.trust.admits(keys.own.public_key) and load_master_keys().knows(who.public_key)


def test_a_wrong_code_and_no_code_pair_nothing(node: TrustedNode, address: NodeAddress) -> None:
    with pytest.raises(PairingError, match="rhot-node pair"):
        pair(address, new_code(), load_master_keys())
    node.offers.renew()
    with pytest.raises(PairingError, match=r"code is wrong.*4 more tries"):
        pair(address, new_code(), load_master_keys())
    with pytest.raises(TrustError, match="15 letters"):
        pair(address, "1234", load_master_keys())
    assert not node.trust.masters and not load_master_keys().nodes


def test_somebody_between_who_swaps_both_keys_pairs_nobody(node: TrustedNode,
                                                           between: Callable[..., NodeAddress]) -> None:
    attacker = new_key_pair()
    code = node.offers.renew().code

    def swap_master(question: dict[str, Any]) -> None:
        if question["request"] == "pair":
            question["master_key"] = attacker.public_key

    def swap_node(answer: dict[str, Any]) -> None:
        if "public_key" in answer:
            answer["public_key"] = attacker.public_key

    with pytest.raises(PairingError, match="somebody between"):
        pair(between(swap_master, swap_node), code, load_master_keys())
    assert not node.trust.masters and not load_master_keys().nodes


def test_an_impostor_who_says_yes_without_the_code_is_found_out(node: TrustedNode,
                                                                between: Callable[..., NodeAddress]) -> None:
    code = node.offers.renew().code
    said: dict[str, Any] = {}

    def remember(question: dict[str, Any]) -> None:
        said.update(question)

    def say_yes(answer: dict[str, Any]) -> None:
        if "nonce" not in answer:  # an answer to the proof: give it back, as if it were the node's
            answer.clear()
            answer.update(ok=True, proof=said["proof"])

    with pytest.raises(PairingError, match="does not know the code"):
        pair(between(remember, say_yes), code, load_master_keys())
    assert not load_master_keys().nodes


@pytest.mark.parametrize("answer", [b"", b"{}", b'{"ok": true}', b"[1]", b'{"ok": false}', b"\xff",
                                    b'{"a": ' + b"[" * 2000 + b"]" * 2000 + b"}",
                                    b'{"ok": true, "node_id": 0, "name": "x", "state": "y", "trust": "maybe"}'])
def test_what_is_no_node_is_named_so(node: TrustedNode, answer: bytes) -> None:
    server = node.context.socket(zmq.REP)
    address = NodeAddress("127.0.0.1", server.bind_to_random_port("tcp://127.0.0.1"))
    thread = threading.Thread(target=lambda: (server.recv(), server.send(answer)))
    thread.start()
    (who,) = ask_who([address])
    thread.join()
    assert isinstance(who, str) and "not a node of this system" in who


ABOUT_OK = {"ok": True, "node_id": 3, "name": "left", "state": "ready", "trust": "paired", **PORTS}
STEERING = "\x1b]0;owned\x07\n\x9b2J\u202e"


@pytest.mark.parametrize("answer", [
    {"ok": False, "error": STEERING}, {**ABOUT_OK, "name": STEERING}, {**ABOUT_OK, "state": STEERING},
    {**ABOUT_OK, "trust": STEERING}, {**ABOUT_OK, "public_key": STEERING}, {**ABOUT_OK, "public_key": 64 * "0" + "\n"},
])
def test_a_strangers_answer_does_not_steer_the_terminal(node: TrustedNode, answer: dict[str, Any],
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    server = node.context.socket(zmq.REP)
    port = server.bind_to_random_port("tcp://127.0.0.1")
    thread = threading.Thread(target=lambda: (server.recv(), server.send_json(answer)))
    thread.start()
    assert main(["pair", f"127.0.0.1:{port}", "--code", show_code(new_code())]) == 2
    thread.join()
    said = capsys.readouterr()
    assert (said.out + said.err).removesuffix("\n").isprintable()


def test_the_command_pairs_and_writes_the_key_into_the_rig(node: TrustedNode, address: NodeAddress, tmp_path: Path,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    rig = synthetic_rig()
    left = msgspec.structs.replace(rig.nodes[0], node_id=3, pairing_port=address.pairing_port)
    path = tmp_path / "rig.json"
    save_rig(path, msgspec.structs.replace(rig, nodes=(left, rig.nodes[1])))
    code = show_code(node.offers.renew().code)
    assert main(["pair", "left", "--rig", str(path), "--code", code]) == 0
    assert load_rig(path).nodes[0].public_key == node.trust.own.public_key
    assert "left (id 3) is paired" in capsys.readouterr().out
    assert main(["pair", "left", "--rig", str(path)]) == 0, "a second time needs no code"
    assert "was paired before" in capsys.readouterr().out
    assert main(["pair", "right", "--rig", str(path), "--port", str(address.pairing_port)]) == 2
    assert "means node" in capsys.readouterr().err
    assert main(["pair", "127.0.0.1", "--port", str(address.pairing_port), "--code", "zz"]) == 2


@pytest.mark.parametrize("by_name", [True, False])
def test_another_node_than_the_rig_means_is_refused_before_the_code_is_spent(
        node: TrustedNode, address: NodeAddress, tmp_path: Path, capsys: pytest.CaptureFixture[str],
        by_name: bool) -> None:
    rig = synthetic_rig()
    left, right = (msgspec.structs.replace(one, node_id=node_id, pairing_port=address.pairing_port)
                   for one, node_id in zip(rig.nodes, (7, 8), strict=True))
    path = tmp_path / "rig.json"
    save_rig(path, msgspec.structs.replace(rig, nodes=(left, right)))
    before = path.read_bytes()
    offer = node.offers.renew()
    target = "left" if by_name else str(address)
    assert main(["pair", target, "--rig", str(path), "--code", show_code(offer.code)]) == 2
    said = capsys.readouterr().err
    assert "node 3 (left) answers there" in said and "Nothing was changed" in said
    assert node.offers.current() == offer and not node.trust.masters and not load_master_keys().nodes
    assert path.read_bytes() == before


def test_the_port_may_stand_behind_the_address(node: TrustedNode, address: NodeAddress,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["pair", str(address), "--code", show_code(node.offers.renew().code)]) == 0
    assert "left (id 3) is paired" in capsys.readouterr().out
    assert main(["pair", "127.0.0.1:0"]) == 2
    assert "is not ADDRESS:PORT" in capsys.readouterr().err
    assert main(["pair", str(address), "--port", "4"]) == 2
    assert "two ports" in capsys.readouterr().err


def test_a_name_that_the_rig_has_not_is_told_with_those_it_has(
        node: TrustedNode, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object) -> list[object]:
        raise socket.gaierror(-2, "Name or service not known")
    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    path = tmp_path / "rig.json"
    save_rig(path, synthetic_rig())
    assert main(["pair", "lefft", "--rig", str(path), "--code", "zz"]) == 2
    assert f"there is no node 'lefft' in {path}; there are: left, right." in capsys.readouterr().err


def test_keys_of_the_master_are_drawn_once_and_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RHOT_KEYS", str(tmp_path / "new" / "keys.json"))
    found: list[MasterKeys] = []
    threads = [threading.Thread(target=lambda: found.append(load_master_keys())) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8 and len({keys.own.public_key for keys in found}) == 1
    assert keys_path().stat().st_mode & 0o777 == 0o600 and keys_path().parent.stat().st_mode & 0o777 == 0o700
    assert [path.name for path in keys_path().parent.iterdir()] == ["keys.json"]
    keys_path().chmod(0o640)
    with pytest.raises(TrustError, match="chmod 600"):
        load_master_keys()
