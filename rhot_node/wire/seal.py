"""Authentication tags of datagrams: keyed BLAKE2b, 16 bytes at their end. docs/wire.md, "Tags"; docs/security.md."""

from __future__ import annotations

import hashlib
from hmac import compare_digest

KEY_LENGTH = 32  # bytes
TAG_LENGTH = 16  # bytes
_PERSON = b"RHOT datagram 1"  # a key that somebody used elsewhere too would make other tags there


class Seal:
    """One secret key, shared by a node and one master for one link. Knows neither sockets nor messages."""

    __slots__ = ("_keyed",)

    def __init__(self, key: bytes) -> None:
        """`key`: KEY_LENGTH random bytes. Raises ValueError for any other length."""
        if len(key) != KEY_LENGTH:
            raise ValueError(f"a key has {KEY_LENGTH} bytes, not {len(key)}")
        self._keyed = hashlib.blake2b(key=key, digest_size=TAG_LENGTH, person=_PERSON)

    def tag(self, covered: bytes | bytearray | memoryview) -> bytes:
        """The tag of `covered`, everything that stands before it, the header with bit 0 of its flags set included."""
        state = self._keyed.copy()  # the key's block is hashed once, when the seal is made
        state.update(covered)
        return state.digest()

    def verifies(self, datagram: bytes | bytearray | memoryview) -> bool:
        """Whether the datagram ends with the tag of all that stands before; takes equally long wherever they differ."""
        view = memoryview(datagram)
        return compare_digest(self.tag(view[:-TAG_LENGTH]), view[-TAG_LENGTH:])
