"""What a node tells anybody of itself, so that it can be found: by zeroconf, and in answer to a question by UDP."""

from __future__ import annotations

import ipaddress
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import ifaddr
import msgspec
from msgspec import Meta

from rhot_node.keys import Name
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
