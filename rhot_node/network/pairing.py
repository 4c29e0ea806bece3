"""Pairing: how a one-time code shows a node and a master each other's true keys. Pure; docs/security.md explains it.

Both keys, both nonces, and who is who go into one transcript; each side proves that it knows the code by a keyed
BLAKE2b of it. Whoever stands between and puts in other keys changes the transcript, and cannot make a proof for it
without the code. The code has 75 bits: what is seen of an exchange cannot be searched for it within its five minutes.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from hmac import compare_digest
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from rhot_node.errors import NodeError, TrustError
from rhot_node.files import KIB, decode_message
from rhot_node.keys import (
    HexKey,
    Master,
    Name,
    NodeTrust,
    read_private_document,
    remove_private,
    trust_state,
    write_private_document,
)

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


# -- one-time code -----------------------------------------------------------------------------------------------------
# In a file of mode 0600, because the daemon and the command `rhot-node pair` share it, and because a restart must not
# give new tries.

FORMAT: Final = "rhot-node-pairing"
VERSION: Final = 1
VALID_S = 300
TRIES = 5

BootClock = Callable[[], tuple[str, int]]
"""Which boot of the machine this is, and its time, ns. Not the time of day: a Pi has none without a network."""


class Offer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of the file."""

    code: Annotated[str, Meta(pattern=rf"\A[{ALPHABET}]{{{CODE_LENGTH}}}\Z")]
    nonce: Annotated[str, Meta(pattern=rf"\A[0-9a-f]{{{2 * NONCE_LENGTH}}}\Z")]
    boot_id: str
    expires_ns: int
    tries_left: Annotated[int, Meta(ge=1, le=TRIES)]
    format: Literal["rhot-node-pairing"] = FORMAT
    version: Literal[1] = VERSION

    def __repr__(self) -> str:
        return f"Offer({self.tries_left} tries left)"


def offer_path(settings: Path) -> Path:
    """Where the code of the node with this settings file lies."""
    return settings.with_name(f"{settings.stem}.pairing.json")


def boot_clock() -> tuple[str, int]:
    """The machine's own."""
    boot_id = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return boot_id, time.clock_gettime_ns(time.CLOCK_BOOTTIME)


class OfferFile:
    """The file and what may be done with it."""

    def __init__(self, path: Path, clock: BootClock = boot_clock) -> None:
        self.path = path
        self._clock = clock

    def renew(self) -> Offer:
        """Offer a fresh code; the one before, if any, is void. Raises TrustError when it cannot be written."""
        boot_id, now_ns = self._clock()
        offer = Offer(new_code(), secrets.token_hex(NONCE_LENGTH), boot_id, now_ns + VALID_S * 1_000_000_000, TRIES)
        write_private_document(self.path, offer)
        return offer

    def current(self) -> Offer | None:
        """The code that is valid now; one that is not is removed. Raises TrustError."""
        offer = read_private_document(self.path, Offer, FORMAT, VERSION)
        if offer is None:
            return None
        boot_id, now_ns = self._clock()
        if offer.boot_id == boot_id and now_ns < offer.expires_ns:
            return offer
        self.close()
        return None

    def count_wrong_try(self, offer: Offer) -> int:
        """One try less, written down before anybody is told; returns how many are left. Raises TrustError."""
        left = offer.tries_left - 1
        if left:
            write_private_document(self.path, msgspec.structs.replace(offer, tries_left=left))
        else:
            self.close()
        return left

    def close(self) -> bool:
        """Offer no code any more; False when none was offered. Raises TrustError."""
        return remove_private(self.path)

# -- requests without authentication -----------------------------------------------------------------------------------
# Nothing here shows a picture, a setting or a place, and nothing but a proof of the code changes anything.

log = logging.getLogger(__name__)

EXPIRE_S = 1.0
REQUEST_MAX = KIB  # bytes; a pair request has about 400
NO_CODE = ("this node offers no code now. Run `rhot-node pair` on it; a code is valid for five minutes, five tries "
           "and one master.")


class HelloRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="request", tag="hello"):
    """Who are you?"""


class PairRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="request", tag="pair"):
    """Let this master in: it proves that it knows the code, for these keys."""

    master_key: HexKey
    master_name: Name
    master_nonce: Annotated[str, Meta(pattern=rf"\A[0-9a-f]{{{2 * NONCE_LENGTH}}}\Z")]
    proof: HexKey


_decoder = msgspec.json.Decoder(HelloRequest | PairRequest)


class Reception:
    """Answers strangers. `trust` None: the node is open to everybody, and there is nothing to pair."""

    def __init__(self, trust: NodeTrust | None, offers: OfferFile, about: Callable[[], dict[str, Any]]) -> None:
        """`about`: at least node_id, name and state; from any thread."""
        self._trust = trust
        self._offers = offers
        self._about = about
        self._expire_s = 0.0

    def answer(self, data: bytes) -> bytes:
        """The answer to one request. Never raises."""
        try:
            request = decode_message(data, _decoder)
            reply = self._hello() if isinstance(request, HelloRequest) else self._pair(request)
        except (msgspec.DecodeError, NodeError) as exc:
            reply = {"ok": False, "error": str(exc)}
        except Exception:
            log.exception("a stranger's request failed")
            reply = {"ok": False, "error": "the node could not do that; see its log."}
        return msgspec.json.encode(reply)

    def expire(self, now_s: float) -> None:
        """Remove a code that is not valid any more; looks once a second. `now_s`: monotonic, s. Never raises."""
        if now_s < self._expire_s:
            return
        self._expire_s = now_s + EXPIRE_S
        with contextlib.suppress(NodeError):  # who asks for it hears what is wrong with the file
            self._offers.current()

    def _hello(self) -> dict[str, Any]:
        about = {"ok": True, **self._about(), "trust": trust_state(self._trust).name.lower()}
        if self._trust is None:
            return about
        offer = self._offers.current()
        return {**about, "public_key": self._trust.own.public_key, "nonce": "" if offer is None else offer.nonce}

    def _pair(self, request: PairRequest) -> dict[str, Any]:
        if self._trust is None:
            raise TrustError('this node is open to everybody ("trust" in its settings file); there is nothing to pair.')
        offer = self._offers.current()
        if offer is None:
            raise TrustError(NO_CODE)
        about = self._about()
        transcript = Transcript(
            bytes.fromhex(self._trust.own.public_key), bytes.fromhex(request.master_key), bytes.fromhex(offer.nonce),
            bytes.fromhex(request.master_nonce), about["node_id"], about["name"], request.master_name)
        if not proves(bytes.fromhex(request.proof), offer.code, "master", transcript):
            left = self._offers.count_wrong_try(offer)
            log.warning("somebody who calls himself %r tried to pair with a wrong code; %d tries left",
                        request.master_name, left)
            raise TrustError("the code is wrong, or somebody between changes what is said. "
                             + (f"{left} more tries." if left else "No more tries: take a new code with "
                                                                   "`rhot-node pair` on the node."))
        self._offers.close()  # first: a code that serves once must not survive what goes wrong afterwards
        self._trust.add(Master(request.master_key, request.master_name))
        return {"ok": True, "proof": proof(offer.code, "node", transcript).hex()}
