"""This machine's own IPv4 addresses, with their networks."""

from __future__ import annotations

import ipaddress
import logging

import ifaddr

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
