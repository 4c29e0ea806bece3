"""Asks by UDP which nodes are there: a broadcast into every network of this computer, and their answers.

Anybody can answer anything. What comes back is good for showing and for trying an address, nothing else.
"""

from __future__ import annotations

import logging
import secrets
import select
import socket
from collections.abc import Sequence
from dataclasses import dataclass

from rhot_node.addresses import own_interfaces
from rhot_node.errors import WireError
from rhot_node.presence import Presence
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import Find, Here, NodeState

BROADCAST_PORT = 47799
"""Where nodes listen for broadcasts unless their settings say otherwise."""

_EVERYBODY = "255.255.255.255"
_DATAGRAM_MAX = 1024
_BURST = 256  # answers taken at once

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Sighting:
    """Somebody at `address` says that he is this node. `state` None: he did not say, as by zeroconf."""

    presence: Presence
    address: str
    state: NodeState | None = None


class FindSocket:
    """One port for questions and answers. Never waits except in `wait`; one thread."""

    def __init__(self, port: int = BROADCAST_PORT, *, this_machine_only: bool = False) -> None:
        """`port`: where nodes listen for broadcasts. `this_machine_only`: no network is asked."""
        self._port = port
        self._this_machine_only = this_machine_only
        self._nonce = secrets.randbits(64)  # so that only who has heard the question can answer it
        self._sequence = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._socket.bind(("", 0))
        self._socket.setblocking(False)

    def ask(self, node_id: int = 0, also: Sequence[tuple[str, int]] = ()) -> int:
        """Ask everybody in reach, or only `node_id`, who he is; `also`: further (address, port). Returns how many
        networks and addresses could be asked."""
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF
        question = encode(Find(node_id, self._sequence, self._nonce))
        asked = 0
        for target in [*((address, self._port) for address in self._broadcasts()), *also]:
            try:
                self._socket.sendto(question, target)
                asked += 1
            except OSError as exc:
                log.debug("find to %s port %d: %s", *target, exc)
        return asked

    def wait(self, timeout_s: float) -> list[Sighting]:
        """The answers that have come, after waiting up to `timeout_s` for the first."""
        select.select([self._socket], [], [], timeout_s)
        return self.answers()

    def answers(self) -> list[Sighting]:
        """The answers that have come; what is none is passed over."""
        found = []
        for _ in range(_BURST):
            try:
                data, sender = self._socket.recvfrom(_DATAGRAM_MAX)
                message = decode(data)
            except WireError as exc:
                log.debug("an answer that is none: %s", exc)
                continue
            except OSError:  # nothing left, or an unreachable host's ICMP error
                break
            if isinstance(message, Here) and message.nonce == self._nonce:
                found.append(Sighting(_presence(message), sender[0], message.state))
        return found

    def close(self) -> None:
        """Close the port. May be called twice."""
        self._socket.close()

    def _broadcasts(self) -> list[str]:
        interfaces = [one for one in own_interfaces() if one.is_loopback or not self._this_machine_only]
        networks = [str(one.network.broadcast_address) for one in interfaces if one.network.prefixlen < 31]
        return networks if self._this_machine_only else [*networks, _EVERYBODY]


def _presence(here: Here) -> Presence:
    return Presence(here.node_id, here.boot_id, here.name, here.udp_port, here.control_port, here.preview_port,
                    here.pairing_port, here.trust)
