"""Looks for nodes that answer nothing any more: where are they now?

A sighting proves nothing. Its place is tried beside the old one, with the same tagged datagrams and over the same
encrypted connection, and only an answer that the node alone can give takes the node for moved there; a lie costs a few
datagrams.
"""

from __future__ import annotations

import functools
import logging
import threading
from collections import deque
from collections.abc import Sequence

import msgspec

from rhot_app.project import RigNode
from rhot_app.sources.discovery import AGAIN_S, Browse, FindSocket, Found, Sighting, ZeroconfBrowser
from rhot_app.sources.node_link import NodeLink
from rhot_node.network.presence import is_loopback
from rhot_node.threads import OneShotThread
from rhot_node.wire.fields import BURST

LOST_NS = 2_000_000_000
"""A node that has answered nothing for so long is looked for."""

ASK_NS = round(1e9 * AGAIN_S)
PATIENT_NS = 3_000_000_000
"""How often it is asked for, in the first seconds and later; then it is looked for by zeroconf too."""

PLACES_MAX = 4
"""Places tried for one node at once; a new one takes the turn of the one that was tried longest, if for LOST_NS."""

log = logging.getLogger(__name__)


class _Search:
    """One node that is looked for: since when, and the places that are tried, as the rig would have them."""

    def __init__(self, now_ns: int) -> None:
        self.began_ns = now_ns
        self.due_ns = now_ns
        self.places: dict[RigNode, int] = {}  # since when each is tried

    def add(self, place: RigNode, now_ns: int) -> None:
        """Try one more place, if there is a turn for it."""
        if place in self.places:
            return
        if len(self.places) >= PLACES_MAX:
            longest = next(iter(self.places))
            if now_ns - self.places[longest] < LOST_NS:
                return
            del self.places[longest]
        self.places[place] = now_ns


class LostNodes:
    """Looks after all nodes of a rig. Never waits; one thread."""

    def __init__(self, links: Sequence[NodeLink], broadcast_port: int, now_ns: int,
                 browse: Browse = ZeroconfBrowser) -> None:
        """`links` of nodes that answer requests. A rig of this machine alone asks no network."""
        self._links = {link.node.node_id: link for link in links}
        self._here_only = all(is_loopback(link.node.address) for link in links)
        self._port = broadcast_port
        self._began_ns = now_ns
        self._browse = browse
        self._searches: dict[int, _Search] = {}
        self._questions: FindSocket | None = None
        self._browser: _Browser | None = None
        self._announced: deque[Sighting] = deque(maxlen=BURST)  # filled by the browser's thread

    def step(self, now_ns: int) -> None:
        """Ask for the nodes that are lost, take in where they were seen, and end the search for those that answer."""
        for node_id, link in self._links.items():
            lost = now_ns - max(link.last_reply_ns or 0, self._began_ns) > LOST_NS
            if lost and node_id not in self._searches:
                self._searches[node_id] = _Search(now_ns)
            elif not lost:
                self._searches.pop(node_id, None)
        if not self._searches:
            self._rest()
            return
        self._ask(now_ns)
        while self._announced:
            self._take(self._announced.popleft(), now_ns)

    def places(self, link: NodeLink) -> tuple[RigNode, ...]:
        """Where else the node may be: the node as the rig has it, with other addresses and ports."""
        search = self._searches.get(link.node.node_id)
        return () if search is None else tuple(search.places)

    def at(self, link: NodeLink, sender: tuple[str, int]) -> RigNode | None:
        """The place tried for `link` that `sender` is."""
        return next((place for place in self.places(link) if (place.address, place.udp_port) == sender), None)

    def close(self) -> None:
        """End all searches. May be called twice."""
        self._searches = {}
        self._rest()

    def _ask(self, now_ns: int) -> None:
        if self._questions is None:
            self._questions = FindSocket(self._port, this_machine_only=self._here_only)
        for node_id, search in self._searches.items():
            if now_ns >= search.due_ns:
                searched_ns = now_ns - search.began_ns
                search.due_ns = now_ns + (ASK_NS if searched_ns < PATIENT_NS else PATIENT_NS)
                self._questions.ask(node_id)
                if searched_ns >= PATIENT_NS and self._browser is None and not self._here_only:
                    self._browser = _Browser(self._browse, self._announced.append)
        for sighting in self._questions.answers():
            self._take(sighting, now_ns)

    def _take(self, sighting: Sighting, now_ns: int) -> None:
        who = sighting.presence
        search, link = self._searches.get(who.node_id), self._links.get(who.node_id)
        if search is None or link is None:
            return
        place = msgspec.structs.replace(
            link.node, address=sighting.address, udp_port=who.udp_port, control_port=who.control_port,
            preview_port=who.preview_port, pairing_port=who.pairing_port)
        if (place.address, place.udp_port, place.control_port) != (
                link.node.address, link.node.udp_port, link.node.control_port):
            search.add(place, now_ns)

    def _rest(self) -> None:
        if self._questions is not None:
            self._questions.close()
            self._questions = None
        if self._browser is not None:
            self._browser.close()
            self._browser = None
            self._announced.clear()


class _Browser:
    """A zeroconf search that is begun and ended in a thread of its own: both may take a second."""

    def __init__(self, browse: Browse, found: Found) -> None:
        self._ending = threading.Event()
        self._task = OneShotThread("looks for nodes by zeroconf", functools.partial(self._run, browse, found))

    def close(self) -> None:
        """End it, soon."""
        self._ending.set()

    def _run(self, browse: Browse, found: Found) -> None:
        try:
            browsing = browse(found)
            self._ending.wait()
            browsing.close()
        except Exception as exc:  # the library's, the network's: the broadcast goes on
            log.info("nodes are not looked for by zeroconf (%s: %s)", type(exc).__name__, exc)
