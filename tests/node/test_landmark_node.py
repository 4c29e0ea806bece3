"""Landmarks from other programs: the example node of docs/examples on the wire, and a detector plug-in."""

from __future__ import annotations

import importlib.util
import math
import select
import socket
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest
from patience import PATIENCE_S
from shipped_markers import LANDMARKS21

from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import ClockReply, ClockRequest, NodeState, Observations, Start, StartEntry, Stop

NODE, SESSION = 3, 77



@pytest.fixture
def example() -> ModuleType:
    path = Path(__file__).parents[2] / "docs" / "examples" / "mediapipe_node.py"
    spec = importlib.util.spec_from_file_location("mediapipe_node", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_example_speaks_the_wire(example: ModuleType) -> None:
    assert LANDMARKS21.ids == example.JOINTS and LANDMARKS21.checksum == example.CHECKSUM
    assert "mediapipe" not in sys.modules
    node = example.LandmarkNode(NODE, 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as master:
        master.bind(("127.0.0.1", 0))
        master.settimeout(PATIENCE_S)

        def say(message: ClockRequest | Start | Stop) -> None:
            master.sendto(encode(message), ("127.0.0.1", node.socket.getsockname()[1]))
            select.select([node.socket], [], [], PATIENCE_S)
            node.poll()

        points = [(100.0 + k, 200.5) for k in range(21)]
        points[4] = (math.nan, 0.0)
        node.send(0, time.monotonic_ns(), (640, 480), points, 0.9, 0.5)  # nobody has asked: nothing is sent
        say(ClockRequest(NODE, 0, 5, 1234))
        reply = decode(master.recv(2048))
        assert isinstance(reply, ClockReply)
        assert (reply.sequence, reply.t1_master_ns, reply.state) == (5, 1234, NodeState.READY)
        say(Start(SESSION, 0, (StartEntry(9, 1, 0), StartEntry(NODE, master.getsockname()[1], 0))))
        for sequence, sent in enumerate((points, None)):
            node.send(sequence, time.monotonic_ns(), (640, 480), sent, 0.9, 0.5)
            found = decode(master.recv(2048))
            assert isinstance(found, Observations)
            assert (found.node_id, found.session, found.sequence) == (NODE, SESSION, sequence)
            assert found.marker_checksum == LANDMARKS21.checksum and found.marker_count == 21
            assert [one.index for one in found.markers if one.found] == (
                [k for k in range(21) if k != 4] if sent else [])
            if sent:
                assert (found.markers[20].x, found.markers[20].y, found.markers[20].cov_xx) == (120.0, 200.5, 0.25)
        say(Stop(SESSION, 1))
        assert node.master is None
    node.socket.close()
