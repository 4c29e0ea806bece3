"""Asks paired nodes, over their encrypted control channels, for the keys of our datagrams: when we begin, and whenever
one falls silent, because a node that was restarted has forgotten its keys."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import zmq
from zmq.utils.monitor import recv_monitor_message

from rhot_app.errors import SourceError
from rhot_app.project import RigNode
from rhot_app.sources.node_link import RESTART_NS, NodeLink
from rhot_node.errors import NodeError, printable
from rhot_node.keys import HexKey, KeyPair
from rhot_node.network.context import Client, Context, read_answer
from rhot_node.terminal import LogLimit

_REFUSED = zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL

log = logging.getLogger(__name__)


class _Granted(msgspec.Struct):
    """The node's answer."""

    name: str
    key: HexKey


@dataclass(slots=True)
class _Peer:
    link: NodeLink
    client: Client
    monitor: zmq.Socket[bytes]
    endpoints: set[str]
    asked_ns: int = 0


class KeyExchange:
    """One encrypted connection per paired node. `step` never waits; one thread."""

    def __init__(self, links: Sequence[NodeLink], own: KeyPair | None) -> None:
        """`own`: the master's keys. Raises SourceError when a node is paired and there are none, or when an address
        cannot be connected to."""
        self._peers: list[_Peer] = []
        self._limit = LogLimit()
        paired = [link for link in links if link.paired]
        if paired and own is None:
            raise SourceError(f"node {paired[0].node.name} is paired, but this program has no keys to speak to it.")
        self._context: Context | None = Context() if paired else None
        for link in paired:
            self._connect(link, own)

    def step(self, now_ns: int) -> None:
        """Take the keys that have come; ask the nodes whose turn it is."""
        for peer in self._peers:
            self._look(peer)
            if now_ns - peer.asked_ns >= RESTART_NS and peer.link.wants_key(now_ns):
                peer.asked_ns = now_ns
                question = msgspec.json.encode({"request": "link", "name": peer.link.key_name})
                peer.client.send(question)

    def reach(self, link: NodeLink, places: Sequence[RigNode]) -> None:
        """Be connected to where the node is and to these places where it may be. What does not have its key can make no
        connection of any."""
        peer = next((peer for peer in self._peers if peer.link is link), None)
        if peer is None:
            return
        wanted = {_endpoint(node) for node in (link.node, *places)}
        for endpoint in peer.endpoints - wanted:
            peer.client.socket.disconnect(endpoint)
        for endpoint in wanted - peer.endpoints:
            peer.client.socket.connect(endpoint)
        peer.endpoints = wanted

    def close(self) -> None:
        """Close all connections. May be called twice."""
        for peer in self._peers:
            peer.client.socket.disable_monitor()
        self._peers = []
        if self._context is not None:
            self._context.destroy(linger=0)
            self._context = None

    def _look(self, peer: _Peer) -> None:
        try:
            while True:
                event = recv_monitor_message(peer.monitor, zmq.DONTWAIT)
                peer.link.turned_away |= event["endpoint"].decode() == _endpoint(peer.link.node)
        except zmq.Again:
            pass
        while (answer := peer.client.receive()) is not None:
            self._take(peer.link, answer[1][0])

    def _take(self, link: NodeLink, data: bytes) -> None:
        try:
            granted = msgspec.convert(read_answer(data), _Granted)
        except NodeError as exc:
            link.turned_away = True
            self._tell(link, f"gave no key: {exc}")
        except msgspec.MsgspecError as exc:
            self._tell(link, f"gave no key but something that cannot be read ({printable(str(exc))})")
        else:
            link.turned_away = False
            link.use_key(granted.name, bytes.fromhex(granted.key))

    def _tell(self, link: NodeLink, what: str) -> None:
        if self._limit.due(link.node.name, time.monotonic()):
            log.warning("node %s %s", link.node.name, what)

    def _connect(self, link: NodeLink, own: KeyPair | None) -> None:
        assert self._context is not None and own is not None
        node = link.node
        try:
            client = Client(self._context, _endpoint(node), own, node.public_key)
        except zmq.ZMQError as exc:
            self.close()
            raise SourceError(f"node {node.name}: {node.address}:{node.control_port} is no address to connect to "
                              f"({exc.strerror}).") from exc
        self._peers.append(_Peer(link, client, client.socket.get_monitor_socket(_REFUSED), {_endpoint(node)}))


def _endpoint(node: RigNode) -> str:
    return f"tcp://{node.address}:{node.control_port}"
