"""Pairing: how a one-time code shows a node and a master each other's true keys. Pure; docs/security.md explains it.

Both keys, both nonces, and who is who go into one transcript; each side proves that it knows the code by a keyed
BLAKE2b of it. Whoever stands between and puts in other keys changes the transcript, and cannot make a proof for it
without the code. The code has 75 bits: what is seen of an exchange cannot be searched for it within its five minutes.
"""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass
from hmac import compare_digest
from typing import Literal

from rhot_node.errors import TrustError

ALPHABET = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
"""Crockford's base 32: no letter looks like a digit."""

CODE_LENGTH = 15  # letters of 5 bits: 75 bits
NONCE_LENGTH = 16  # bytes

_GROUP = 5
_MISREAD = str.maketrans("OIL", "011")
_VERSION = b"RHOT pairing 1"
_PERSONS = {"master": b"RHOT pair master", "node": b"RHOT pair node"}


def new_code() -> str:
    """A fresh code, without dashes."""
    return "".join(secrets.choice(ALPHABET) for _ in range(CODE_LENGTH))


def show_code(code: str) -> str:
    """The code as people read it: three groups of five."""
    return "-".join(code[at:at + _GROUP] for at in range(0, CODE_LENGTH, _GROUP))


def read_code(text: str) -> str:
    """The code that somebody typed: case, dashes and spaces do not matter, O is 0, I and L are 1. Raises TrustError."""
    code = "".join(text.upper().replace("-", "").split()).translate(_MISREAD)
    wrong = sorted(set(code) - set(ALPHABET))
    if wrong:
        raise TrustError(f"no code has {wrong[0]!r} in it; type the code as the node shows it, such as "
                         "7K2QD-9M4XT-BNWH3.")
    if len(code) != CODE_LENGTH:
        raise TrustError(f"a code has {CODE_LENGTH} letters and digits, this one has {len(code)}.")
    return code


@dataclass(frozen=True, slots=True)
class Transcript:
    """All that both sides must agree on. Keys and nonces are bytes."""

    node_key: bytes
    master_key: bytes
    node_nonce: bytes
    master_nonce: bytes
    node_id: int
    node_name: str
    master_name: str

    def encoded(self) -> bytes:
        """Every field with its length before it, so that no two transcripts have the same bytes."""
        fields = (_VERSION, self.node_key, self.master_key, self.node_nonce, self.master_nonce,
                  self.node_id.to_bytes(4, "little"), self.node_name.encode(), self.master_name.encode())
        return b"".join(len(field).to_bytes(2, "little") + field for field in fields)


def proof(code: str, who: Literal["master", "node"], transcript: Transcript) -> bytes:
    """32 bytes that only somebody who knows `code` can make for this transcript in the role of `who`."""
    return hashlib.blake2b(transcript.encoded(), key=code.encode(), person=_PERSONS[who], digest_size=32).digest()


def proves(given: bytes, code: str, who: Literal["master", "node"], transcript: Transcript) -> bool:
    """Whether `given` is that proof."""
    return compare_digest(given, proof(code, who, transcript))
