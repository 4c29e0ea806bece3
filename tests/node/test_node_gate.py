"""The encrypted control channel on real sockets: masters get in, nobody else does, and who is forgotten is out."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
import zmq
from node_fakes import grey_image
from patience import PATIENCE_MS, eventually
from trusted_node import TrustedNode

from rhot_node.capture.camera import Frame
from rhot_node.keys import new_key_pair, serve_with
from rhot_node.terminal import LINES_AT_ONCE, LineLimit, LogLimit, before, cut_log
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import Stop

REFUSED_S = 0.3  # an admitted master is answered within a few milliseconds


def test_a_paired_master_is_answered(node: TrustedNode) -> None:
    sock = node.connect(node.server.control_port, node.admit())
    assert node.ask(sock, request="state") == {"ok": True, "state": "ready"}
    assert node.server.refused == 0


def test_a_stranger_who_knows_the_nodes_key_is_not_let_in(node: TrustedNode) -> None:
    assert node.ask(node.connect(node.server.control_port, new_key_pair()), REFUSED_S, request="state") is None
    eventually(lambda: node.server.refused > 0)


def test_a_stranger_who_knocks_for_ever_fills_no_log(node: TrustedNode, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    strangers = []
    for count in range(4):
        strangers.append(node.connect(node.server.control_port, new_key_pair()))
        eventually(lambda count=count: node.server.refused > count)
    assert sum("was not let in" in line for line in caplog.messages) == 1


def test_log_lines_are_due_once_a_minute_of_each_and_count_what_was_left_out() -> None:
    limit = LogLimit()
    assert [limit.due("a", t_s) for t_s in (0.0, 1.0, 59.0, 60.0, 61.0)] == [1, 0, 0, 3, 0]
    assert limit.due("b", 61.0) == 1
    assert sum(limit.due(f"address {k}", 62.0) > 0 for k in range(10_000)) < 50, "addresses cost nothing to make up"


def test_a_place_in_the_program_writes_some_lines_at_once_and_then_one_a_minute_with_a_count() -> None:
    clock = [0.0]
    limit, lines = LineLimit(lambda: clock[0]), []
    for second in range(200):
        clock[0] = float(second)
        for line in range(100):
            record = logging.LogRecord("a", logging.ERROR, __file__, line % 2, "no, %s", ("never",), None)
            if limit.filter(record):
                lines.append((second, line % 2, record.getMessage()))
    assert [second for second, place, _ in lines if place == 0] == [*[0] * LINES_AT_ONCE, 60, 120, 180]
    assert [second for second, place, _ in lines if place == 1] == [*[0] * LINES_AT_ONCE, 60, 120, 180]
    assert lines[-1][2] == "no, never (2999 more lines like this were left out)"


def test_a_long_log_is_kept_aside_and_written_on(tmp_path: Path) -> None:
    path = tmp_path / "engine.log"
    with path.open("ab", buffering=0) as log:
        log.write(b"first" * 10)
        cut_log(path, 100)
        assert path.stat().st_size == 50, "not yet"
        log.write(b"x" * 100)
        cut_log(path, 100)
        log.write(b"second")
    assert path.read_bytes() == b"second"
    assert before(path).read_bytes() == b"first" * 10 + b"x" * 100


def test_without_encryption_nothing_is_answered(node: TrustedNode) -> None:
    assert node.ask(node.connect(node.server.control_port, None), REFUSED_S, request="state") is None


def test_who_pretends_to_be_the_node_is_not_spoken_to(node: TrustedNode) -> None:
    impostor = node.context.socket(zmq.REP)
    impostor.linger = 0
    serve_with(impostor, new_key_pair())
    port = impostor.bind_to_random_port("tcp://127.0.0.1")
    node.connect(port, node.admit()).send(b"a secret")
    assert not impostor.poll(round(1e3 * REFUSED_S))


def test_only_masters_see_previews(node: TrustedNode) -> None:
    stranger = node.connect(node.server.preview_port, new_key_pair(), kind=zmq.SUB)
    plain = node.connect(node.server.preview_port, None, kind=zmq.SUB)
    for sock in (stranger, plain):
        sock.subscribe(b"")
    eventually(lambda: node.server.refused > 0)
    assert not node.server.pictures.wanted
    master = node.connect(node.server.preview_port, node.admit(), kind=zmq.SUB)
    master.subscribe(b"")
    eventually(lambda: node.server.pictures.wanted)
    node.server.pictures.offer(Frame(grey_image(), 1, 0, 0, 0, 0))
    assert master.poll(PATIENCE_MS) and not stranger.poll(0) and not plain.poll(0)


def test_a_node_that_forgets_its_masters_ends_their_connections_and_streams(node: TrustedNode) -> None:
    own = node.admit()
    sock = node.connect(node.server.control_port, own)
    viewer = node.connect(node.server.preview_port, own, kind=zmq.SUB)
    viewer.subscribe(b"")
    answer = node.ask(sock, request="link")
    assert answer is not None
    assert node.ask(sock, request="start", session=5, host="127.0.0.1", port=9, link=answer["name"]) == {
        "ok": True, "verdict": "started"}
    eventually(lambda: node.server.pictures.wanted)
    old_key, ports = node.trust.own.public_key, (node.server.control_port, node.server.preview_port)

    node.keys_path.unlink()  # as `rhot-node unpair` does
    eventually(lambda: node.trust.own.public_key != old_key)
    eventually(lambda: node.sessions.current is None)
    assert node.ask(sock, REFUSED_S, request="state") is None
    assert not node.server.pictures.wanted and not node.trust.masters
    with pytest.raises(Exception, match="tag"):
        node.keys.open(encode(Stop(5, 1), node.keys.grant("somebody").seal)[:-1])

    again = node.connect(ports[0], node.admit())
    assert node.ask(again, request="state") == {"ok": True, "state": "ready"}, "on the same ports, with other keys"
    assert (node.server.control_port, node.server.preview_port) == ports


def test_a_connection_older_than_a_change_of_the_file_is_worth_nothing(node: TrustedNode) -> None:
    """Also when the file was only shortened by a master: what is let in is decided with every request."""
    sock = node.connect(node.server.control_port, node.admit())
    assert node.ask(sock, request="state")
    node.trust._keys = type(node.trust._keys)(node.trust.own)
    answer = node.ask(sock, request="state")
    assert answer is not None and not answer["ok"] and "not paired" in answer["error"]


def test_without_its_gate_a_guarded_socket_admits_nobody(node: TrustedNode) -> None:
    """libzmq alone would admit whoever knows the key."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        server = context.socket(zmq.REP)
        assert node.server._gate is not None
        node.server._gate.guard(server)
        port = server.bind_to_random_port("tcp://127.0.0.1")
        node.connect(port, node.admit()).send(b"hello")
        assert not server.poll(round(1e3 * REFUSED_S))
    finally:
        context.destroy(linger=0)


def test_a_key_file_that_others_can_read_lets_nobody_in(node: TrustedNode) -> None:
    own = node.admit()
    data = node.keys_path.read_bytes()
    node.keys_path.unlink()
    node.keys_path.write_bytes(data)
    node.keys_path.chmod(0o644)
    eventually(lambda: not node.trust.masters)
    assert node.ask(node.connect(node.server.control_port, own), REFUSED_S, request="state") is None
