"""Pairing as people do it: a node as it is shipped, its commands beside the running daemon, the master's command."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
import zmq
from bench import START_S, TEST_S, Bench
from patience import eventually
from scene import Scene

from rhot_app.keys import load_master_keys
from rhot_app.project import load_rig, save_rig
from rhot_app.sources.pairing import Introduction, NodeAddress, ask_who
from rhot_node.keys import connect_with, keys_path


def command(module: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", module, *arguments], capture_output=True, text=True, timeout=120,
                          stdin=subprocess.DEVNULL)


class UnpairedNode:
    """The bench's left node as it is shipped, and what the master sees of it."""

    def __init__(self, bench: Bench) -> None:
        node = bench.rig.nodes[0]
        self.settings = bench.settings_path(node)
        self.keys = keys_path(self.settings)
        self.keys.unlink()
        self.rig_path: Path = bench.rig_path
        save_rig(self.rig_path, msgspec.structs.replace(bench.rig, nodes=(
            msgspec.structs.replace(node, public_key=""), bench.rig.nodes[1])))
        self.address = NodeAddress("127.0.0.1", node.pairing_port)
        self.control_port = node.control_port
        Scene(bench.rig).record(bench.folder / "left.yuv", node, 0.1)
        bench.start_node(0, f"yuv:{bench.folder}/left.yuv")
        eventually(lambda: self.who() is not None, START_S)

    def who(self) -> Introduction | None:
        who = ask_who([self.address], 0.5)[0]
        return None if isinstance(who, str) else who

    def answers(self) -> bool:
        """Whether it answers this master over the channel that the rig's key opens."""
        with zmq.Context() as context, context.socket(zmq.REQ) as sock:
            sock.linger = 0
            connect_with(sock, load_master_keys().own, load_rig(self.rig_path).nodes[0].public_key)
            sock.connect(f"tcp://127.0.0.1:{self.control_port}")
            sock.send(b'{"request": "counters"}')
            return bool(sock.poll(400)) and bool(json.loads(sock.recv())["ok"])


@pytest.mark.timeout(TEST_S)
def test_from_shipped_to_paired_and_back(bench: Bench) -> None:
    node = UnpairedNode(bench)
    code = re.compile(r"Pairing code of node left:  [0-9A-Z]{5}-[0-9A-Z]{5}-[0-9A-Z]{5}")
    eventually(lambda: code.search(bench.log("left")) is not None, START_S)
    who = node.who()
    assert who is not None and who.trust == "unpaired" and who.nonce, "it offers a code when it has started"

    shown = command("rhot_node", "pair", "--settings", str(node.settings))
    match = re.search(r"([0-9A-Z]{5}-){2}[0-9A-Z]{5}", shown.stdout)
    assert shown.returncode == 0 and match is not None
    wrong = command("rhot_app", "pair", "left", "--rig", str(node.rig_path), "--code", "00000-00000-00000")
    assert wrong.returncode == 2 and "4 more tries" in wrong.stderr and "Traceback" not in wrong.stderr
    paired = command("rhot_app", "pair", "left", "--rig", str(node.rig_path), "--code", match.group())
    assert paired.returncode == 0, paired.stderr
    assert load_rig(node.rig_path).nodes[0].public_key == who.public_key
    assert node.answers()
    assert match.group() not in bench.log("left"), "the code of the command is shown by the command only"

    reset = command("rhot_node", "unpair", "--settings", str(node.settings))
    assert reset.returncode == 0 and "forgets" in reset.stdout
    eventually(lambda: (now := node.who()) is not None and now.public_key != who.public_key)
    assert not node.answers()
    again = node.who()
    assert again is not None and again.trust == "unpaired" and not again.nonce


@pytest.mark.timeout(TEST_S)
def test_a_node_with_open_keys_does_not_start(bench: Bench) -> None:
    node = bench.rig.nodes[0]
    path = keys_path(bench.settings_path(node))
    path.chmod(0o644)
    done = command("rhot_node", "--settings", str(bench.settings_path(node)), "--camera", "yuv:nowhere")
    assert done.returncode == 2 and "chmod 600" in done.stderr and "Traceback" not in done.stderr


def test_an_open_node_has_nothing_to_pair(bench: Bench) -> None:
    path = bench.settings_path(bench.rig.nodes[0])
    path.write_text(path.read_text().replace('"trust": "paired"', '"trust": "open"'))
    done = command("rhot_node", "pair", "--settings", str(path))
    assert done.returncode == 2 and "nothing to pair" in done.stderr
