"""Nodes of this machine that can be found: the real UDP side of each, on a loopback address of its own."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.network.link import UdpLink
from rhot_node.network.presence import Presence
from rhot_node.network.session import Sessions
from rhot_node.wire.messages import NodeState, TrustState


def free_udp_port() -> int:
    """A UDP port that nobody uses on any address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("", 0))
        return int(sock.getsockname()[1])


def presence(node_id: int = 3, name: str = "left", boot_id: int = 1, trust: TrustState = TrustState.UNPAIRED,
             udp_port: int = 47800) -> Presence:
    """A node as it presents itself."""
    return Presence(node_id, boot_id, name, udp_port, 47801, 47802, 47803, trust)


@contextlib.contextmanager
def findable(broadcast_port: int, who: Presence, address: str = "127.0.0.1") -> Iterator[UdpLink]:
    """An open node that answers until the end."""
    settings = NodeSettings(who.node_id, who.name, load_markers(resource_path("markers", "rhot6.json")), address, 0, 0,
                            0, broadcast_port, pairing_port=0)
    link = UdpLink(settings, NodeClock(), Sessions(), who.boot_id, lambda: NodeState.READY, None)
    link.introduce = lambda: presence(who.node_id, who.name, who.boot_id, who.trust, link.port)
    link.start()
    try:
        yield link
    finally:
        link.close()
