"""An unpaired program on the same network, against real nodes and a real engine that track: it sees no picture, changes
no setting, stops no node, and moves no marker."""

from __future__ import annotations

import contextlib
import json
import socket
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq
from bench import START_S, TEST_S, Bench, node_status, tracks, wait_until
from patience import PATIENCE_S
from scene import start_still_hand

from rhot_app.engine.client import EngineClient
from rhot_app.recording.raw_log import LogReader, RecordKind
from rhot_app.state import Knowledge
from rhot_node.clock import NodeClock
from rhot_node.keys import KeyPair, connect_with, new_key_pair
from rhot_node.wire.codec import Seal, encode
from rhot_node.wire.messages import ClockRequest, MarkerObservation, Message, Observations, Start, StartEntry, Stop

REPEATED = 200
SILENCE_S = 0.2  # a master is answered within milliseconds

pytestmark = pytest.mark.timeout(TEST_S)


AT_START = {"clock_in_doubt", "no_clock"}
"""Why the first observations of an own node may be dropped."""


@dataclass
class Attack:
    """Nodes, engine and client as they track, and what a stranger needs. He knows everything that is no secret:
    addresses, ports, public keys, ids, and the session, which he can read in the datagrams."""

    bench: Bench
    client: EngineClient
    context: zmq.Context[zmq.Socket[bytes]]
    udp: socket.socket

    def dropped(self) -> dict[str, int]:
        """What the engine has refused of the left node's port."""
        self.client.poll(0.15)
        status = node_status(self.client, "left")
        assert status is not None
        return status.dropped

    def connect(self, kind: int, port: int, own: KeyPair | None) -> zmq.Socket[bytes]:
        """A connection to the left node."""
        sock = self.context.socket(kind)
        sock.linger = 0
        if own is not None:
            connect_with(sock, own, self.bench.rig.nodes[0].public_key)
        sock.connect(f"tcp://127.0.0.1:{port}")
        return sock

    def answers(self, **request: Any) -> list[bytes]:
        """Every answer of the left node to a request, through all of its doors."""
        node = self.bench.rig.nodes[0]
        socks = [self.connect(zmq.REQ, port, own) for port in (node.control_port, node.pairing_port)
                 for own in (None, new_key_pair())]
        for sock in socks:
            with contextlib.suppress(zmq.Again):  # the node has shut this door already: nowhere to send to
                sock.send_json(request, zmq.DONTWAIT)
        found: list[bytes] = []
        end = time.monotonic() + SILENCE_S
        while time.monotonic() < end:
            found += [part for sock in socks if sock.poll(20) for part in sock.recv_multipart()]
        return found

    def say(self, message: Message) -> None:
        """A datagram to both nodes, without a tag and with somebody's."""
        for node in self.bench.rig.nodes:
            for seal in (None, Seal(bytes(32))):
                self.udp.sendto(encode(message, seal), ("127.0.0.1", node.udp_port))


@pytest.fixture(scope="module")
def attack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Attack]:
    """One start of everything for all tests, because none may leave a trace."""
    bench = Bench(tmp_path_factory.mktemp("strangers"))
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        with EngineClient(bench.sockets) as client, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.bind(("127.0.0.1", 0))
            udp.settimeout(SILENCE_S)
            start_still_hand(bench)
            wait_until(client, lambda: tracks(client), START_S, "states from both nodes")
            yield Attack(bench, client, context, udp)
    finally:
        context.destroy(linger=0)
        bench.clear()


def test_it_reads_no_picture(attack: Attack) -> None:
    node = attack.bench.rig.nodes[0]
    viewers = [attack.connect(zmq.SUB, node.preview_port, own) for own in (None, new_key_pair())]
    for viewer in viewers:
        viewer.subscribe(b"")
    answers = [json.loads(part) for part in attack.answers(request="still")]
    assert [answer["ok"] for answer in answers] == [False], "the reception refuses, the other doors stay shut"
    assert not any(viewer.poll(100) for viewer in viewers)
    answer = attack.client.command("still", node_id=node.node_id)
    assert answer["png"].startswith(b"\x89PNG"), "the engine gets one"


def test_it_changes_no_setting(attack: Attack) -> None:
    path: Path = attack.bench.settings_path(attack.bench.rig.nodes[0])
    before = path.read_bytes()
    answers = attack.answers(request="set_settings", settings={"name": "mine", "trust": "open"})
    assert not any(json.loads(part)["ok"] for part in answers)
    assert path.read_bytes() == before
    settings = attack.client.command("node", node_id=1, request={"request": "settings"})["answer"]["settings"]
    assert (settings["name"], settings["trust"]) == ("left", "paired")


def test_it_stops_no_node_and_takes_none_over(attack: Attack) -> None:
    status = attack.client.status
    assert status is not None
    port = attack.udp.getsockname()[1]
    for session in (0, status.session):
        attack.say(Stop(session, 2**31))
    attack.say(Start(status.session + 2, 2**31, (StartEntry(1, port, 0), StartEntry(2, port, 0))))
    attack.say(ClockRequest(1, 0, 2**31, 1))
    with pytest.raises(TimeoutError):
        attack.udp.recv(2048)
    answers = attack.answers(request="stop") + attack.answers(request="start", session=9, host="127.0.0.1", port=port)
    assert not any(json.loads(part)["ok"] for part in answers)
    wait_until(attack.client, lambda: tracks(attack.client), PATIENCE_S, "everything goes on")

    def all_counted() -> bool:
        counters = attack.client.command("node", node_id=1, request={"request": "counters"})["answer"]["counters"]
        dropped = counters["dropped"]
        return dropped.get("untagged", 0) >= 4 and dropped.get("tag", 0) >= 4 and counters["strangers"] >= 2

    wait_until(attack.client, all_counted, PATIENCE_S, "every attempt is counted")
    assert attack.client.status is not None and attack.client.status.session == status.session


def test_it_moves_no_marker(attack: Attack) -> None:
    client, rig = attack.client, attack.bench.rig
    wait_until(client, lambda: tracks(client) and client.state is not None
               and bool((client.state.marker_knowledge == Knowledge.MEASURED).all()), PATIENCE_S, "all markers' places")
    status, node = client.status, node_status(client, "left")
    assert status is not None and node is not None and node.clock_offset_s is not None and client.state is not None
    clock = NodeClock(round(1e9 * node.clock_offset_s))
    before = client.state.marker_positions.copy()
    markers = tuple(MarkerObservation(k, 20.0 + 90 * k, 400.0, 16.0, 1e-4, 0.0, 1e-4, 1.0) for k in range(6))
    states = []
    for k in range(100):
        now_ns = clock.now_ns()
        forged = Observations(1, status.session, 10**4 + k, now_ns - 10**6, now_ns, 10**6, 10**6, 0, 640, 480, k,
                              rig.markers.checksum, markers)
        for seal in (None, Seal(bytes(32))):
            attack.udp.sendto(encode(forged, seal), ("127.0.0.1", rig.nodes[0].data_port))
        states += [state for state in client.poll(0.005) if hasattr(state, "marker_positions")]
    while len(states) <= 10:  # a busy machine solves few in half a second
        states += [state for state in client.poll(0.05) if hasattr(state, "marker_positions")]
    for state in states:
        measured = state.marker_knowledge == Knowledge.MEASURED
        np.testing.assert_allclose(state.marker_positions[measured], before[measured], atol=0.004)

    def forged_ones() -> list[int]:
        return [attack.dropped().get(kind, 0) for kind in ("untagged", "tag")]

    wait_until(client, lambda: sum(forged_ones()) >= 200, PATIENCE_S, "all forgeries are counted")
    assert forged_ones() == [100, 100]
    assert {kind for kind, count in attack.dropped().items() if count} <= {"untagged", "tag"} | AT_START


def test_it_fills_neither_the_log_nor_the_engines_messages(attack: Attack) -> None:
    path, said = attack.bench.folder / "flood.rhotlog", len(attack.bench.log("engine"))
    attack.client.command("record", path=str(path))
    wait_until(attack.client, lambda: genuine_datagrams(path), PATIENCE_S, "observations in the log")
    genuine, port = genuine_datagrams(path)[-1], attack.bench.rig.nodes[0].data_port
    before = attack.dropped().get("duplicate", 0)
    for k in range(REPEATED):
        for data in (genuine, genuine[:-1], bytes(40), b"\n" * 1400):
            attack.udp.sendto(data, ("127.0.0.1", port))
        if k % 50 == 49:  # what the kernel has no room for proves nothing
            sent = k + 1
            wait_until(attack.client, lambda sent=sent: attack.dropped().get("duplicate", 0) - before >= sent,
                       PATIENCE_S, "all are refused")
    attack.client.command("record_stop")
    with contextlib.closing(LogReader(path)) as reader:
        records = list(reader)
    assert [one.data for one in records if one.kind is RecordKind.DATAGRAM].count(genuine) == 1
    refused: Counter[str] = Counter()
    for record in records:
        if record.kind is RecordKind.REFUSED:
            refused.update(json.loads(record.data))
    assert refused["duplicate"] == REPEATED and refused["magic"] == 2 * REPEATED
    assert refused["tag"] == REPEATED, "cut off by a byte"
    assert len(attack.bench.log("engine")) - said < 1000


def genuine_datagrams(path: Path) -> list[bytes]:
    """What the log has of the left node by now."""
    with contextlib.closing(LogReader(path)) as reader:
        return [record.data for record in reader if record.kind is RecordKind.DATAGRAM and record.node_id == 1]


def test_it_pairs_with_nobody_without_a_code(attack: Attack) -> None:
    node = attack.bench.rig.nodes[0]
    own = new_key_pair()
    door = attack.connect(zmq.REQ, node.pairing_port, None)
    door.send_json({"request": "pair", "master_key": own.public_key, "master_name": "nobody", "master_nonce": "00" * 16,
                    "proof": "00" * 32})
    answer = json.loads(door.recv())
    assert not answer["ok"] and "offers no code" in answer["error"]
    assert own.public_key not in (attack.bench.folder / "left.keys.json").read_text()
