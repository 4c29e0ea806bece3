"""A closed node's control side in this process: keys, gate, reception, link keys, and masters as clients of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import zmq
from node_fakes import OF_ANY_PORT, saved_settings
from patience import PATIENCE_S

from rhot_node.clock import NodeClock
from rhot_node.foreground_store import ForegroundStore
from rhot_node.keys import KeyPair, Master, NodeTrust, connect_with, new_key_pair
from rhot_node.network.control import ControlServer
from rhot_node.network.pairing import OfferFile, Reception
from rhot_node.network.requests import Responder
from rhot_node.network.session import LinkKeys, Sessions
from rhot_node.video.recorder import VideoRecorder

ABOUT = {"node_id": 3, "name": "left", "state": "ready"}


class FakeBoot:
    """A boot clock that stands still until told otherwise."""

    def __init__(self) -> None:
        self.boot_id = "first boot"
        self.now_ns = 10**12

    def __call__(self) -> tuple[str, int]:
        return self.boot_id, self.now_ns


class TrustedNode:
    """The server under test and the sockets of those who try it."""

    def __init__(self, folder: Path, address: str = "127.0.0.1") -> None:
        self.address = address
        changes = {**OF_ANY_PORT, "bind_address": address}
        store = saved_settings(folder / "left.json", **changes, preview_hz=20.0, trust="paired")
        self.keys_path = folder / "left.keys.json"
        self.clock = FakeBoot()
        self.offers = OfferFile(folder / "left.pairing.json", self.clock)
        self.trust = NodeTrust(self.keys_path)
        self.keys = LinkKeys()
        self.sessions = Sessions()
        self.server = ControlServer(store.current, self.trust)
        self.responder = Responder(store, self.sessions, self.server.pictures, NodeClock(),
                                   lambda: {"state": "ready"}, dict, self.keys, VideoRecorder(folder / "videos"),
                                   ForegroundStore(None))
        self.server.start(self.responder, Reception(self.trust, self.offers, lambda: ABOUT))
        self.context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()

    def admit(self) -> KeyPair:
        """A master that is paired."""
        master = new_key_pair()
        self.trust.add(Master(master.public_key, "desk"))
        return master

    def connect(self, port: int, own: KeyPair | None, server_key: str | None = None,
                kind: int = zmq.REQ) -> zmq.Socket[bytes]:
        """A client's socket; `own` None: without encryption."""
        sock = self.context.socket(kind)
        sock.linger = 0
        sock.setsockopt(zmq.RECONNECT_IVL, 20)
        if own is not None:
            connect_with(sock, own, server_key or self.trust.own.public_key)
        sock.connect(f"tcp://{self.address}:{port}")
        return sock

    def ask(self, sock: zmq.Socket[bytes], timeout_s: float = PATIENCE_S, **request: Any) -> dict[str, Any] | None:
        """The answer to one request; None when none comes in time."""
        try:
            sock.send(json.dumps(request).encode(), zmq.DONTWAIT)
        except zmq.Again:  # refused already when it connected: nowhere to send to
            return None
        if not sock.poll(round(1e3 * timeout_s)):
            return None
        answer: dict[str, Any] = json.loads(sock.recv_multipart()[0])
        return answer

    def stranger(self, **request: Any) -> dict[str, Any]:
        """The reception's answer."""
        sock = self.connect(self.server.pairing_port, None)
        answer = self.ask(sock, **request)
        sock.close()
        assert answer is not None
        return answer

    def close(self) -> None:
        """End everything."""
        self.server.close()
        self.context.destroy(linger=0)
