"""The keys of a node's datagrams: drawn anew for every link, given to paired masters over the encrypted channel, never
stored. A link is one master program that talks to this run of the node."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable

from rhot_node.errors import WireError
from rhot_node.wire.codec import decode_verified, is_tagged
from rhot_node.wire.messages import Message
from rhot_node.wire.seal import KEY_LENGTH, Seal
from rhot_node.wire.sequence import SequenceWindow, Verdict

LINKS_MAX = 8
"""Links kept; the one that was silent longest goes first. Each costs a wrong datagram one more verification."""

_ANY_JUMP = 1 << 32  # a tagged number may be any distance ahead: the master counted on while the network was down


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
        window = self._windows.setdefault(type(message), SequenceWindow(longest_jump=_ANY_JUMP))
        verdict = window.judge(message.sequence)
        if verdict is not Verdict.FRESH and verdict is not Verdict.LATE:
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
