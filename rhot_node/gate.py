"""Who may open an encrypted connection to a node: the masters that it is paired with.

libzmq asks a ZAP handler (ZeroMQ RFC 27) about every CURVE handshake, over a socket inside the process. The gate is
that handler. Without one libzmq would admit all who know the public key; ZAP_ENFORCE_DOMAIN makes it admit nobody.
"""

from __future__ import annotations

import logging
import time

import zmq

from rhot_node.errors import printable
from rhot_node.keys import serve_with
from rhot_node.log_limit import LogLimit
from rhot_node.trust import NodeTrust

log = logging.getLogger(__name__)

_ENDPOINT = "inproc://zeromq.zap.01"
_DOMAIN = b"rhot-node"
_VERSION = b"1.0"
_KEY_LENGTH = 32


class Gate:
    """The ZAP handler of one context. `step` belongs to the thread that serves the guarded sockets."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], trust: NodeTrust) -> None:
        """Must be there before a socket is guarded."""
        self.trust = trust
        self.refused = 0  # handshakes of strangers
        self._limit = LogLimit()
        self.socket = context.socket(zmq.REP)
        self.socket.linger = 0
        self.socket.bind(_ENDPOINT)

    def guard(self, sock: zmq.Socket[bytes]) -> None:
        """Encrypt what goes through `sock`, which is not bound yet, and let only masters in."""
        serve_with(sock, self.trust.own)
        sock.setsockopt(zmq.ZAP_DOMAIN, _DOMAIN)
        sock.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)

    def step(self) -> None:
        """Decide about one handshake that waits."""
        _, request_id, domain, address, _, mechanism, *credentials = self.socket.recv_multipart()
        key = credentials[0].hex() if mechanism == b"CURVE" and credentials else ""
        admitted = domain == _DOMAIN and len(key) == 2 * _KEY_LENGTH and self.trust.admits(key)
        if not admitted:
            self.refused += 1
            self._tell(printable(address.decode(errors="replace"), 64), key)
        status = (b"200", b"OK", key.encode()) if admitted else (b"400", b"not paired with this node", b"")
        self.socket.send_multipart([_VERSION, request_id, *status, b""])

    def _tell(self, address: str, key: str) -> None:
        count = self._limit.due(address, time.monotonic())
        if count:
            again = "" if count == 1 else f", {count} times since this was last said"
            log.info("a stranger at %s was not let in, key %s%s", address, key, again)


def master_of(frame: zmq.Frame) -> str:
    """The public key of the master whose connection a message came through; empty without encryption."""
    try:
        return str(frame.get("User-Id"))
    except zmq.ZMQError:
        return ""
