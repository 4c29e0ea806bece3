"""The live twin as its users meet it: a process that says when it is ready, heals its nodes, and ends with them."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zmq
from patience import PATIENCE_MS, PATIENCE_S, eventually

from rhot_app.keys import load_master_keys
from rhot_app.project import load_rig
from rhot_app.simulator.nodes.remote import TwinRemote
from rhot_app.simulator.scene.scene_description import BoardShow
from rhot_node.keys import connect_with

READY_S = 90.0


def children(pid: int) -> list[int]:
    """Process ids of the children of `pid`."""
    with contextlib.suppress(OSError):
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return []


def udp_ports_open(ports: list[int]) -> bool:
    """Whether somebody listens on all of these UDP ports of the loopback interface."""
    lines = Path("/proc/net/udp").read_text().splitlines()[1:]
    bound = {int(line.split()[1].split(":")[1], 16) for line in lines}
    return set(ports) <= bound


def ask_node(rig_path: Path, request: dict[str, Any]) -> dict[str, Any]:
    """The left node's answer to a request over its control channel."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        requests = context.socket(zmq.REQ)
        requests.linger = 0
        node = load_rig(rig_path).nodes[0]
        connect_with(requests, load_master_keys().own, node.public_key)
        requests.connect(f"tcp://127.0.0.1:{node.control_port}")
        requests.send_json(request)
        assert requests.poll(PATIENCE_MS), "the node gives no answer"
        answer: dict[str, Any] = json.loads(requests.recv_multipart()[0])
        return answer
    finally:
        context.destroy(0)


@pytest.fixture
def twin(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], Path]]:
    """A live twin and its rig file."""
    rig = tmp_path / "live.rig.json"
    process = subprocess.Popen(
        [sys.executable, "-m", "rhot_app.simulator.nodes.live", "--motion", "wave", "--seed", "3",
         "--directory", str(tmp_path), "--rig", str(rig)], stdout=subprocess.PIPE)
    try:
        yield process, rig
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        assert process.stdout is not None
        process.stdout.close()


def test_live_twin_obeys_heals_a_killed_node_and_ends_with_its_nodes(
        twin: tuple[subprocess.Popen[bytes], Path]) -> None:
    process, rig_path = twin
    assert process.stdout is not None
    ready = json.loads(process.stdout.readline())
    assert ready["event"] == "ready" and ready["rig"] == str(rig_path)
    ports = [node.udp_port for node in load_rig(rig_path).nodes]
    changed = ask_node(rig_path, {"request": "set_settings", "settings": {"camera": {"exposure_us": 6000.0}}})
    assert changed["ok"]
    with TwinRemote(rig_path.parent) as remote:
        remote.show(BoardShow(on_table=True))
        eventually(lambda: remote.state().cameras["left"].exposure_us == 6000.0,
                   told=lambda: "what the node is told, the twin's sensor does")
        assert remote.cover("left").covered == ("left",)
        eventually(lambda: "black" in [one["code"] for one in ask_node(rig_path, {"request": "state"})["health"]],
                   told=lambda: "the node does not say that its picture is black")
        assert remote.cover().covered == ()
    nodes = children(process.pid)
    assert len(nodes) == 2 and len(set(ports)) == 2 and udp_ports_open(ports)

    os.kill(nodes[0], signal.SIGKILL)
    eventually(lambda: len(children(process.pid)) == 2 and nodes[0] not in children(process.pid)
               and udp_ports_open(ports), READY_S, told=lambda: f"not healed: {children(process.pid)}")
    healed = children(process.pid)
    assert len(healed) == 2 and nodes[0] not in healed and nodes[1] in healed
    assert udp_ports_open(ports), "the new node listens where the old one did"
    kept = ask_node(rig_path, {"request": "settings"})["settings"]
    assert kept["camera"]["exposure_us"] == 6000.0, "a node that comes back keeps its settings"

    process.send_signal(signal.SIGTERM)
    assert process.wait(PATIENCE_S) == 0
    assert not any(Path(f"/proc/{pid}").exists() for pid in healed)
    assert not [*rig_path.parent.glob("*.frames"), *rig_path.parent.glob("*.ipc")], "no socket is left behind"


def test_unknown_motion_ends_with_a_sentence(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, "-m", "rhot_app.simulator.nodes.live", "--motion", "juggle", "--directory", str(tmp_path),
         "--rig", str(tmp_path / "rig.json")], capture_output=True, text=True, timeout=READY_S, check=False)
    assert result.returncode == 2
    assert "juggle" in result.stderr and "Traceback" not in result.stderr
    assert not (tmp_path / "rig.json").exists()
