"""A node of a running engine changes its address: tracking and control channel follow it, and the operator is told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import zmq
from fake_tracker import FakeTracker
from patience import eventually
from streaming_node import Setup

from rhot_app.engine.core import Engine
from rhot_app.engine.node_control import NodeControl
from rhot_app.project import load_rig, save_rig
from rhot_app.sources import lost_nodes
from rhot_app.sources.links import UdpNodes


@pytest.fixture
def setup(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Setup]:
    monkeypatch.setattr(lost_nodes, "LOST_NS", 300_000_000)
    monkeypatch.setattr(lost_nodes, "ASK_NS", 100_000_000)
    setup = Setup(tmp_path)
    setup.source.close()
    yield setup
    setup.node.close()


def test_tracking_and_control_follow_a_node_that_moves(setup: Setup, tmp_path: Path) -> None:
    path = tmp_path / "rig.json"
    save_rig(path, setup.rig)
    published: list[bytes] = []
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    control = NodeControl(context, setup.own)
    engine = Engine(setup.rig, path, lambda rig: UdpNodes(rig, setup.own), FakeTracker, published.append)

    def tracked(more: int) -> Callable[[], bool]:
        wanted = len(published) + more

        def look() -> bool:
            engine.status()
            stream = setup.node.sessions.current
            if stream is not None:
                setup.node.send_frame(setup.rig)
            return len(published) >= wanted
        return look

    def said(words: str) -> bool:
        return any(words in advice.text for advice in engine.status().advice)
    try:
        engine.start()
        eventually(tracked(3))
        assert not said("has moved")
        setup.move("127.0.0.2")
        eventually(lambda: said("Node left has moved from 127.0.0.1 to 127.0.0.2 and is used there. Save the rig"))
        eventually(tracked(3))
        assert load_rig(path) == setup.rig, "nothing is written unasked"

        control.follow(engine.rig)
        control.ask(b"client", "node", {"node_id": 1, "request": {"request": "state"}})
        answers: list[object] = []
        eventually(lambda: answers.extend(control.answers()) or answers)
        assert answers == [(b"client", ({"ok": True, "answer": {"state": "ready"}}, None))]

        engine.save_rig(None)
        assert load_rig(path).nodes[0].address == "127.0.0.2"
        assert not said("has moved")
        engine.set_rig(load_rig(path))
        eventually(tracked(1))
        assert engine.rig.nodes[0].address == "127.0.0.2"
    finally:
        engine.close()
        control.close()
        context.destroy(0)
