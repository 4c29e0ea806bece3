"""The one-time code that a node offers, in a file of mode 0600 beside its settings: valid for 5 minutes and 5 tries.

In a file, because the daemon and the command `rhot-node pair` share it, and because a restart must not give new tries.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from rhot_node.errors import TrustError
from rhot_node.files import decode_document
from rhot_node.pairing import ALPHABET, CODE_LENGTH, NONCE_LENGTH, new_code
from rhot_node.private_files import read_private, remove_private, write_private

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
        self._write(offer)
        return offer

    def current(self) -> Offer | None:
        """The code that is valid now; one that is not is removed. Raises TrustError."""
        data = read_private(self.path)
        if data is None:
            return None
        offer = decode_document(data, Offer, format_name=FORMAT, version=VERSION, where=str(self.path),
                                error=TrustError)
        boot_id, now_ns = self._clock()
        if offer.boot_id == boot_id and now_ns < offer.expires_ns:
            return offer
        self.close()
        return None

    def count_wrong_try(self, offer: Offer) -> int:
        """One try less, written down before anybody is told; returns how many are left. Raises TrustError."""
        left = offer.tries_left - 1
        if left:
            self._write(msgspec.structs.replace(offer, tries_left=left))
        else:
            self.close()
        return left

    def close(self) -> bool:
        """Offer no code any more; False when none was offered. Raises TrustError."""
        return remove_private(self.path)

    def _write(self, offer: Offer) -> None:
        write_private(self.path, msgspec.json.format(msgspec.json.encode(offer), indent=2) + b"\n")
