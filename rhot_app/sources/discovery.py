"""Which nodes are there: asked by broadcast and by zeroconf at once, put together, with what cannot be right of them.

Nothing here is proved. A node that is found is shown to somebody who pairs with it, or its address is tried.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rhot_app.progress import Progress, silent
from rhot_app.sources.browse import Browse, Browsing, ZeroconfBrowser
from rhot_app.sources.find_socket import BROADCAST_PORT, FindSocket, Sighting
from rhot_node.addresses import is_loopback, own_interfaces
from rhot_node.presence import Presence
from rhot_node.wire.messages import NodeState

SECONDS = 2.5
"""Zeroconf may take more than a second; a broadcast is answered within milliseconds."""

_AGAIN_S = 0.5  # between questions: broadcasts get lost, above all without a cable
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
            if now_s - asked_s >= _AGAIN_S:
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
    told = next((one for one in seen if one.state is not None), seen[0])
    addresses = sorted((one.address for one in seen), key=is_loopback)
    return FoundNode(told.presence, tuple(addresses), told.state)


def _number(count: int) -> str:
    return "Two" if count == 2 else str(count)


def _listed(items: Sequence[str]) -> str:
    return f"{', '.join(items[:-1])} and {items[-1]}"
