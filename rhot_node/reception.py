"""What a node says to anybody: who it is, and, while it offers a code, pairing. JSON in, JSON out; no sockets.

Nothing here shows a picture, a setting or a place, and nothing but a proof of the code changes anything.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from rhot_node.errors import NodeError, TrustError
from rhot_node.files import decode_message
from rhot_node.keys import HexKey, Name
from rhot_node.pairing import NONCE_LENGTH, Transcript, proof, proves
from rhot_node.pairing_offer import OfferFile
from rhot_node.trust import Master, NodeTrust, trust_state

log = logging.getLogger(__name__)

EXPIRE_S = 1.0
REQUEST_MAX = 1024  # bytes; a pair request has about 400
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
