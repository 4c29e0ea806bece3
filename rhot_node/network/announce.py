"""Announces a node by zeroconf, in a thread of its own: its name and ports appear on the masters of the same network.

Nothing depends on it. What goes wrong is logged and tried again; a node is also found by a broadcast or by its address.
"""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable, Sequence
from typing import Protocol

from rhot_node.network.presence import (
    SERVICE,
    Presence,
    host_of,
    instance_of,
    is_loopback,
    own_interfaces,
    properties_of,
)
from rhot_node.threads import FOREIGN, Worker

LOOK_S = 5.0
"""How soon a change is announced: of the trust, of the name, or of the machine's addresses."""

_END_S = 2.0  # goodbyes take half a second; nobody waits longer for them
_ANYWHERE = "0.0.0.0"

log = logging.getLogger(__name__)


class Announced(Protocol):
    """A service that is known to the network."""

    def close(self) -> None:
        """Say goodbye."""
        ...


Announce = Callable[[Presence, Sequence[str]], Announced]
"""Makes a presence known at these addresses of the machine; raises whatever it likes."""


class Announcer:
    """Keeps one node's presence announced. `step` looks once; `start` does so in a thread until `close`."""

    def __init__(self, introduce: Callable[[], Presence], bind_address: str,
                 announce: Announce | None = None) -> None:
        """`bind_address` as in the node's settings; `announce`: zeroconf's unless given."""
        self._introduce = introduce
        self._bind_address = bind_address
        self._announce = announce or announce_by_zeroconf
        self._announced: Announced | None = None
        self._said: tuple[Presence, tuple[str, ...]] | None = None
        self._trouble = ""
        self._worker = Worker("announces the node", self._turn, end=self._withdraw, hang_s=None)

    def step(self) -> None:
        """Announce the node if it, or where it is, has changed. Never raises."""
        now = self._introduce(), self._addresses()
        if now == self._said:
            return
        try:
            self._withdraw()
            if now[1]:
                self._announced = self._announce(*now)
            self._said, self._trouble = now, ""
        except FOREIGN as exc:  # the library's, the network's: whatever it is, the node has other things to do
            if str(exc) != self._trouble:
                self._trouble = str(exc)
                log.warning("the node is not announced by zeroconf (%s: %s); it is found by broadcast and by its "
                            "address", type(exc).__name__, exc)

    def start(self) -> None:
        """Announce in a thread of its own."""
        self._worker.start()

    def close(self) -> None:
        """Say goodbye. May be called twice, and before `start`."""
        self._worker.close(_END_S)

    def _turn(self) -> None:
        self.step()
        self._worker.ending.wait(LOOK_S)

    def _withdraw(self) -> None:
        announced, self._announced, self._said = self._announced, None, None
        if announced is not None:
            announced.close()

    def _addresses(self) -> tuple[str, ...]:
        """Where the node can be reached from outside."""
        if self._bind_address != _ANYWHERE:
            return () if is_loopback(self._bind_address) else (self._bind_address,)
        return tuple(str(interface.ip) for interface in own_interfaces() if not interface.is_loopback)


class _Service:
    """One registered service and the responder that answers for it."""

    def __init__(self, presence: Presence, addresses: Sequence[str]) -> None:
        from zeroconf import IPVersion, ServiceInfo, Zeroconf
        info = ServiceInfo(SERVICE, instance_of(presence), port=presence.udp_port, properties=properties_of(presence),
                           addresses=[socket.inet_aton(address) for address in addresses], server=host_of(presence))
        self._zeroconf = Zeroconf(interfaces=list(addresses), ip_version=IPVersion.V4Only)
        try:
            self._zeroconf.register_service(info, allow_name_change=True)
        except BaseException:
            self._zeroconf.close()
            raise

    def close(self) -> None:
        """Say goodbye and end the responder."""
        self._zeroconf.close()


def announce_by_zeroconf(presence: Presence, addresses: Sequence[str]) -> Announced:
    """Register the service and answer for it. Waits a second or so; raises ImportError, OSError, zeroconf's errors."""
    return _Service(presence, addresses)
