"""Which session a node streams in: started, repeated, replaced, stopped, left alone. No sockets, no clock."""

from __future__ import annotations

import logging
import secrets
import threading
from collections.abc import Callable
from dataclasses import dataclass

from rhot_node.errors import WireError
from rhot_node.wire.codec import KEY_LENGTH, Seal, SequenceVerdict, SequenceWindow, decode_verified, is_tagged
from rhot_node.wire.messages import U32_MAX, Message

log = logging.getLogger(__name__)

MASTER_SILENCE_S = 5.0
"""A node that hears nothing of its session for so long takes its master for gone."""

START_AHEAD_MAX_NS = 10_000_000_000
"""A start further ahead than this was meant for another clock; it then begins at once."""

ENDED_MAX = 4096  # sessions remembered as over


@dataclass(frozen=True, slots=True)
class Stream:
    """One session: where the observations go, the first instant to send (node clock, 0: at once), and what tags them
    (None: nothing, the node is open)."""

    session: int
    address: tuple[str, int]
    t_start_node_ns: int
    seal: Seal | None = None


class Sessions:
    """The current session and those that are over. Used by the link's, the control channel's and the main thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._current: Stream | None = None
        self._heard_s = 0.0
        self._ended: dict[int, None] = {}  # in the order of their end

    @property
    def current(self) -> Stream | None:
        """The stream that is asked for now, None when none."""
        return self._current

    def start(self, session: int, address: tuple[str, int], t_start_node_ns: int, *, now_node_ns: int,
              now_s: float, seal: Seal | None = None) -> str:
        """Take up `session`. Returns 'started'; 'repeated' when it is the current one; 'stale' when it is over."""
        if t_start_node_ns - now_node_ns > START_AHEAD_MAX_NS:
            log.warning("session %d was to start %.1f s ahead, by another clock; it starts at once", session,
                        (t_start_node_ns - now_node_ns) / 1e9)
            t_start_node_ns = 0
        with self._lock:
            if session in self._ended:
                return "stale"
            old = self._current
            if old is not None and old.session == session:
                self._heard_s = now_s
                return "repeated"
            if old is not None:
                self._end(old.session)
            self._current = Stream(session, address, t_start_node_ns, seal)
            self._heard_s = now_s
        log.info("session %d started: streaming to %s port %d", session, *address)
        return "started"

    def stop(self, session: int) -> bool:
        """Stop `session`, or whatever runs when it is 0. True when something stopped.

        A session that never ran is over as well: its start may still be on its way.
        """
        with self._lock:
            current = self._current
            if session:
                self._end(session)
            if current is None or session not in (0, current.session):
                return False
            self._end(current.session)
            self._current = None
        log.info("session %d stopped", current.session)
        return True

    def hear(self, session: int, now_s: float) -> None:
        """Note a sign of life of the master of `session`."""
        with self._lock:
            if self._current is not None and self._current.session == session:
                self._heard_s = now_s

    def expire(self, now_s: float) -> bool:
        """End the session when its master fell silent; it may be taken up again when the master comes back."""
        with self._lock:
            current = self._current
            if current is None or now_s - self._heard_s <= MASTER_SILENCE_S:
                return False
            self._current = None
        log.warning("session %d ended: nothing heard of its master for %.0f s", current.session, MASTER_SILENCE_S)
        return True

    def _end(self, session: int) -> None:
        self._ended[session] = None
        while len(self._ended) > ENDED_MAX:
            del self._ended[next(iter(self._ended))]


# -- datagram keys -----------------------------------------------------------------------------------------------------
# Drawn anew for every link, given to paired masters over the encrypted channel, and never stored. A link is one master
# program that talks to this run of the node.

LINKS_MAX = 8
"""Links kept; the one that was silent longest goes first. Each costs a wrong datagram one more verification."""


class Link:
    """One link: its key, whose it is, and which numbers it has used. Messages are taken by one thread."""

    def __init__(self, master: str) -> None:
        """`master`: the public key of the master that asked for it."""
        self.master = master
        self.name = secrets.token_hex(8)
        self.key = secrets.token_bytes(KEY_LENGTH)
        self.seal = Seal(self.key)
        self.heard = 0  # when a datagram of it was last taken, as the ring counts
        self._windows: dict[type[Message], SequenceWindow] = {}

    def is_new(self, message: Message) -> bool:
        """Whether the message comes for the first time; it never does again."""
        # it may be any distance ahead: the master counted on while the network was down
        window = self._windows.setdefault(type(message), SequenceWindow(longest_jump=U32_MAX))
        verdict = window.judge(message.sequence)
        if verdict is not SequenceVerdict.FRESH and verdict is not SequenceVerdict.LATE:
            return False
        window.take(message.sequence)
        return True


class LinkKeys:
    """All links of a node. The control thread grants and forgets, the link's thread opens datagrams."""

    def __init__(self) -> None:
        self._links: tuple[Link, ...] = ()  # replaced, never changed: the other thread reads it
        self._lock = threading.Lock()
        self._count = 0

    def grant(self, master: str, name: str = "") -> Link:
        """The link `name` of this master if it is still known, or a new one."""
        with self._lock:
            known = self._find(master, name)
            if known is not None:
                return known
            link = Link(master)
            self._count += 1
            link.heard = self._count
            kept = sorted(self._links, key=lambda one: one.heard)[-(LINKS_MAX - 1):]
            self._links = (link, *reversed(kept))
            return link

    def find(self, master: str, name: str) -> Link | None:
        """The link `name` of this master."""
        return self._find(master, name)

    def forget(self, admits: Callable[[str], bool]) -> None:
        """Forget the links of masters that are not admitted any more."""
        with self._lock:
            self._links = tuple(link for link in self._links if admits(link.master))

    def open(self, data: bytes) -> tuple[Message, Link]:
        """The message of a datagram and the link that tagged it. Raises WireError: 'untagged', 'tag' when it is no
        link's, 'replay' when it came before, or what `decode` says."""
        if not is_tagged(data):
            raise WireError("untagged", "this node takes only what a paired master has tagged")
        for link in self._links:
            if link.seal.verifies(data):
                message = decode_verified(data)
                if not link.is_new(message):
                    raise WireError("replay", f"number {message.sequence} was had before")
                self._count += 1
                link.heard = self._count
                return message, link
        raise WireError("tag", "the tag is no known link's")

    def _find(self, master: str, name: str) -> Link | None:
        return next((link for link in self._links if link.name == name and link.master == master), None)
