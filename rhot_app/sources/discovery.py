"""Which nodes are there: asked by broadcast and by zeroconf at once, put together, with what cannot be right of them.

Nothing here is proved. A node that is found is shown to somebody who pairs with it, or its address is tried.
"""

from __future__ import annotations

import logging
import secrets
import select
import socket
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from rhot_app.progress import Progress, silent
from rhot_node.errors import WireError
from rhot_node.network.presence import SERVICE, Presence, is_loopback, own_interfaces, presence_of
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.fields import BURST, RECEIVE_MAX
from rhot_node.wire.messages import BROADCAST_PORT, U32_MAX, U64_MAX, Find, Here, NodeState

if TYPE_CHECKING:
    from zeroconf import ServiceStateChange, Zeroconf


# -- discovery by broadcast --------------------------------------------------------------------------------------------
# Anybody can answer anything. What comes back is good for showing and for trying an address, nothing else.

_EVERYBODY = "255.255.255.255"
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
        self._nonce = secrets.randbelow(U64_MAX)  # so that only who has heard the question can answer it
        self._sequence = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._socket.bind(("", 0))
        self._socket.setblocking(False)

    def ask(self, node_id: int = 0, also: Sequence[tuple[str, int]] = ()) -> int:
        """Ask everybody in reach, or only `node_id`, who he is; `also`: further (address, port). Returns how many
        networks and addresses could be asked."""
        self._sequence = (self._sequence + 1) & U32_MAX
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
        for _ in range(BURST):
            try:
                data, sender = self._socket.recvfrom(RECEIVE_MAX)
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


# -- discovery by zeroconf ---------------------------------------------------------------------------------------------

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


# -- both together -----------------------------------------------------------------------------------------------------

SECONDS = 2.5
"""Zeroconf may take more than a second; a broadcast is answered within milliseconds."""

AGAIN_S = 0.5  # between questions: broadcasts get lost, above all without a cable
_STEP_S = 0.1
NO_NETWORK = ("This computer has no network, so only nodes on this computer itself can be found. Connect it to the "
              "network of the nodes.")


@dataclass(frozen=True, slots=True)
class FoundNode:
    """One node: who it says it is, where it was seen, best address first, and what it does (None: not known)."""

    presence: Presence
    addresses: tuple[str, ...]
    state: NodeState | None

    @property
    def address(self) -> str:
        """The one to use."""
        return self.addresses[0]

    def __str__(self) -> str:
        return f"{self.presence.name} (id {self.presence.node_id}) at {self.address}"


@dataclass(frozen=True, slots=True)
class Search:
    """What came of a search. `conflicts` are sentences about nodes that cannot be told apart, `notes` about the search
    itself."""

    nodes: tuple[FoundNode, ...]
    conflicts: tuple[str, ...]
    notes: tuple[str, ...]


def find_nodes(seconds: float = SECONDS, *, port: int = BROADCAST_PORT, progress: Progress = silent,
               browse: Browse = ZeroconfBrowser) -> Search:
    """Search for `seconds`, s. Waits that long, so call it in a worker. `port`: where nodes listen for broadcasts."""
    sightings: list[Sighting] = []  # appended to by the browser's thread too
    notes = [] if any(not one.is_loopback for one in own_interfaces()) else [NO_NETWORK]
    browsing: Browsing | None = None
    questions = FindSocket(port)
    try:
        begun_s = asked_s = time.monotonic()
        questions.ask()
        try:
            browsing = None if notes else browse(sightings.append)
        except Exception as exc:  # the library's, the network's: the broadcast has its own answers
            notes.append(f"Zeroconf cannot be used here ({type(exc).__name__}: {exc}); only nodes that answer a "
                         "broadcast are found.")
        while (now_s := time.monotonic()) < begun_s + seconds:
            progress("looking for nodes", (now_s - begun_s) / seconds)
            if now_s - asked_s >= AGAIN_S:
                asked_s = now_s
                questions.ask()
            sightings += questions.wait(min(_STEP_S, begun_s + seconds - now_s))
    finally:
        questions.close()
        if browsing is not None:
            browsing.close()
    nodes = together(sightings)
    return Search(nodes, conflicts(nodes), tuple(notes))


def together(sightings: Iterable[Sighting]) -> tuple[FoundNode, ...]:
    """One entry for each node, by name and id, however often and wherever it was seen.

    A node is known by its id and by the run of its program: another run at the same place is the same node after a
    restart, at another place it is another node with the same id.
    """
    newest: dict[tuple[int, str, int], Sighting] = {}
    for one in sightings:
        key = (one.presence.node_id, one.address, one.presence.udp_port)
        before = newest.get(key)
        if before is None or one.state is not None or one.presence.boot_id != before.presence.boot_id:
            newest[key] = one  # zeroconf knows less, and is slower to notice a change
    runs: dict[tuple[int, int], list[Sighting]] = {}
    for one in newest.values():
        runs.setdefault((one.presence.node_id, one.presence.boot_id), []).append(one)
    found = [_node(seen) for seen in runs.values()]
    return tuple(sorted(found, key=lambda node: (node.presence.name, node.presence.node_id, node.address)))


def conflicts(nodes: Sequence[FoundNode]) -> tuple[str, ...]:
    """What must or should be changed on a node, in sentences."""
    found = []
    for node_id in sorted({node.presence.node_id for node in nodes}):
        same = [str(node) for node in nodes if node.presence.node_id == node_id]
        if len(same) > 1:
            found.append(f"{_number(len(same))} nodes have the id {node_id}: {_listed(same)}. No rig can use them "
                         "together: change node_id in the settings file of one and start it again.")
    for name in sorted({node.presence.name for node in nodes}):
        ids = {node.presence.node_id for node in nodes if node.presence.name == name}
        if len(ids) > 1:
            same = [str(node) for node in nodes if node.presence.name == name]
            found.append(f"{_number(len(same))} nodes are called {name}: {_listed(same)}. Tell them apart by id and "
                         "address, or change the name in the settings file of one.")
    return tuple(found)


def _node(seen: Sequence[Sighting]) -> FoundNode:
    answering = next((one for one in seen if one.state is not None), seen[0])
    addresses = sorted((one.address for one in seen), key=is_loopback)
    return FoundNode(answering.presence, tuple(addresses), answering.state)


def _number(count: int) -> str:
    return "Two" if count == 2 else str(count)


def _listed(items: Sequence[str]) -> str:
    return f"{', '.join(items[:-1])} and {items[-1]}"
