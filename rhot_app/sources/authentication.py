"""Which datagrams of a node are taken: anybody's, the holder's of one key, nobody's yet, or what a log holds."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

from rhot_node.errors import WireError
from rhot_node.wire.codec import decode, decode_sealed, decode_verified, is_tagged
from rhot_node.wire.messages import Message
from rhot_node.wire.seal import Seal


@dataclass(frozen=True, slots=True)
class Authentication:
    """`open` gives a datagram's message or raises WireError; `genuine` says whether it comes from whom we listen to,
    whatever it says: only that is recorded."""

    open: Callable[[bytes], Message]
    genuine: Callable[[bytes], bool]


def holder_of(seal: Seal) -> Authentication:
    """Only what `seal` tagged."""
    return Authentication(functools.partial(decode_sealed, seal=seal), seal.verifies)


def _refuse(data: bytes) -> Message:
    if is_tagged(data):
        raise WireError("no_key", "the node has not given the key yet")
    raise WireError("untagged", "no tag where one is required")


ANYBODY = Authentication(decode, lambda data: True)
NOBODY_YET = Authentication(_refuse, lambda data: False)
RECORDED = Authentication(decode_verified, lambda data: True)
