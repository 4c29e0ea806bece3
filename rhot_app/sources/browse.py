"""Looks for nodes that announce themselves by zeroconf."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

from rhot_app.sources.find_socket import Sighting
from rhot_node.addresses import own_interfaces
from rhot_node.announcement import SERVICE, presence_of

if TYPE_CHECKING:
    from zeroconf import ServiceStateChange, Zeroconf

_RESOLVE_MS = 1000  # for what a service did not tell at once

Found = Callable[[Sighting], None]


class Browsing(Protocol):
    """A search that goes on until it is closed."""

    def close(self) -> None:
        """End it."""
        ...


Browse = Callable[[Found], Browsing]
"""Begins a search whose finds are handed on by another thread; raises whatever it likes."""


class ZeroconfBrowser:
    """Hands on every node that is announced, once for each of its addresses."""

    def __init__(self, found: Found, interfaces: Sequence[str] = ()) -> None:
        """`found` is called by the library's thread; `interfaces`: this computer's addresses to look from, all unless
        given. Raises ImportError, OSError, zeroconf's errors."""
        from zeroconf import IPVersion, ServiceBrowser, Zeroconf
        own = [str(one.ip) for one in own_interfaces() if not one.is_loopback]
        self._found = found
        self._version = IPVersion.V4Only
        self._zeroconf = Zeroconf(interfaces=list(interfaces) or own or ["127.0.0.1"], ip_version=self._version)
        try:
            ServiceBrowser(self._zeroconf, SERVICE, handlers=[self._take])
        except BaseException:
            self._zeroconf.close()
            raise

    def close(self) -> None:
        """End the search and its threads."""
        self._zeroconf.close()

    def _take(self, zeroconf: Zeroconf, service_type: str, name: str, state_change: ServiceStateChange) -> None:
        if state_change.name == "Removed":
            return
        info = zeroconf.get_service_info(service_type, name, _RESOLVE_MS)
        presence = None if info is None else presence_of(info.decoded_properties, info.port)
        if info is not None and presence is not None:
            for address in info.parsed_addresses(self._version):
                self._found(Sighting(presence, address))
