"""What a node tells anybody of itself, so that it can be found: by zeroconf, and in answer to a question by UDP."""

from __future__ import annotations

import ipaddress
import logging
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal, Protocol

import ifaddr
import msgspec
from msgspec import Meta

from rhot_node.keys import Name
from rhot_node.threads import FOREIGN, Worker
from rhot_node.wire.codec import VERSION
from rhot_node.wire.messages import U32_MAX, Find, Here, NodeState, TrustState


@dataclass(frozen=True, slots=True)
class Presence:
    """Who is there. Nobody has to believe it: whether it is true shows when the node proves its key."""

    node_id: int
    boot_id: int
    name: str
    udp_port: int
    control_port: int
    preview_port: int
    pairing_port: int
    trust: TrustState

    def answer(self, question: Find, state: NodeState) -> Here:
        """The answer of a node in this state."""
        return Here(self.node_id, question.sequence, question.nonce, self.boot_id, self.udp_port, self.control_port,
                    self.preview_port, self.pairing_port, state, self.trust, self.name)


# -- local IPv4 addresses ----------------------------------------------------------------------------------------------

log = logging.getLogger(__name__)


def own_interfaces() -> list[ipaddress.IPv4Interface]:
    """Every address with its network, the loopback's last; empty when the system does not tell."""
    try:
        found = [ipaddress.IPv4Interface(f"{ip.ip}/{ip.network_prefix}")
                 for adapter in ifaddr.get_adapters() for ip in adapter.ips if ip.is_IPv4]
    except (OSError, ValueError) as exc:
        log.warning("the system does not tell this machine's addresses (%s)", exc)
        return []
    return sorted(found, key=lambda interface: interface.is_loopback)


def is_loopback(address: str) -> bool:
    """Whether an address is one of this machine's that nobody else can reach; False for a name."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


# -- zeroconf service --------------------------------------------------------------------------------------------------

SERVICE: Final = "_rhot-node._udp.local."

_INSTANCE_BYTES_MAX = 63
_Port = Annotated[int, Meta(ge=1, le=65535)]


class _Properties(msgspec.Struct):
    """The properties; others may be there in a later version."""

    id: Annotated[int, Meta(ge=1, le=U32_MAX)]
    boot: Annotated[int, Meta(ge=0, le=U32_MAX)]
    name: Name
    control: _Port
    preview: _Port
    pairing: _Port
    version: Annotated[int, Meta(ge=1)]
    trust: Literal["open", "unpaired", "paired"]


def instance_of(presence: Presence) -> str:
    """The service's name for people who browse; two nodes of one name differ by their ids in it."""
    ending = f" {presence.node_id}"
    name = presence.name.encode(errors="replace")[:_INSTANCE_BYTES_MAX - len(ending)].decode(errors="ignore")
    return f"{name}{ending}.{SERVICE}"


def host_of(presence: Presence) -> str:
    """The host that the service's addresses belong to; of each run its own, so that no two nodes share addresses."""
    return f"rhot-node-{presence.node_id}-{presence.boot_id:08x}.local."


def properties_of(presence: Presence) -> dict[str, str]:
    """What stands beside port and addresses."""
    return {"id": str(presence.node_id), "boot": str(presence.boot_id), "name": presence.name,
            "control": str(presence.control_port), "preview": str(presence.preview_port),
            "pairing": str(presence.pairing_port), "version": str(VERSION), "trust": presence.trust.name.lower()}


def presence_of(properties: Mapping[str, str | None], udp_port: int | None) -> Presence | None:
    """The presence that a service tells of; None when it is not a node of this version. Anybody can announce one."""
    try:
        found = msgspec.convert(dict(properties), _Properties, strict=False)
    except msgspec.ValidationError:
        return None
    if found.version != VERSION or not udp_port or not found.name.isprintable():
        return None
    return Presence(found.id, found.boot, found.name, udp_port, found.control, found.preview, found.pairing,
                    TrustState[found.trust.upper()])


# -- announcement ------------------------------------------------------------------------------------------------------
# In a thread of its own. Nothing depends on it: what goes wrong is logged and tried again; a node is also found by a
# broadcast or by its address.

LOOK_S = 5.0
"""How soon a change is announced: of the trust, of the name, or of the machine's addresses."""

_END_S = 2.0  # goodbyes take half a second; nobody waits longer for them
_ANYWHERE = "0.0.0.0"

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


def announce_by_zeroconf(presence: Presence, addresses: Sequence[str]) -> Announced:
    """Register the service and answer for it. Waits a second or so; raises ImportError, OSError, zeroconf's errors."""
    from zeroconf import IPVersion, ServiceInfo, Zeroconf
    info = ServiceInfo(SERVICE, instance_of(presence), port=presence.udp_port, properties=properties_of(presence),
                       addresses=[socket.inet_aton(address) for address in addresses], server=host_of(presence))
    zeroconf = Zeroconf(interfaces=list(addresses), ip_version=IPVersion.V4Only)
    try:
        zeroconf.register_service(info, allow_name_change=True)
    except BaseException:
        zeroconf.close()
        raise
    return zeroconf
