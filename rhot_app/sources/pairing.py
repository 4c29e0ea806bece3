"""Asking nodes who they are, and pairing with one by the code that it shows: the other side of the node's.

Functions that wait; call them in a worker or a command.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import zmq
from msgspec import Meta

from rhot_app.errors import PairingError
from rhot_app.keys import KnownNode, MasterKeys, remember_node
from rhot_node.errors import printable
from rhot_node.files import PRINTABLE, decode_message
from rhot_node.keys import Name
from rhot_node.network.context import Context
from rhot_node.network.pairing import NO_CODE, NONCE_LENGTH, Transcript, proof, proves, read_code
from rhot_node.wire.messages import PAIRING_PORT, PORT_MAX, U32_MAX

TIMEOUT_S = 2.0
_ANSWER_MAX = 4096  # bytes

Port = Annotated[int, Meta(ge=1, le=65535)]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class NodeAddress:
    """Where to ask."""

    host: str
    pairing_port: int = PAIRING_PORT

    def __str__(self) -> str:
        return f"{self.host}:{self.pairing_port}"


def read_address(text: str) -> tuple[str, int | None]:
    """Host and port of ``HOST`` or ``HOST:PORT``; None for a port that is not told. Raises PairingError."""
    host, colon, port = text.rpartition(":")
    if not colon or ":" in host:
        return text, None
    if not host or not (port.isascii() and port.isdecimal() and 1 <= int(port) <= PORT_MAX):
        raise PairingError(f"{text!r} is not ADDRESS:PORT with a port from 1 to {PORT_MAX}.")
    return host, int(port)


class Introduction(msgspec.Struct, frozen=True):
    """What a node says of itself to anybody. Whether it is true shows when it proves its key."""

    node_id: Annotated[int, Meta(ge=1, le=U32_MAX)]
    name: Name
    state: Annotated[str, Meta(max_length=64, pattern=PRINTABLE)]
    trust: Literal["open", "unpaired", "paired"]
    udp_port: Port
    control_port: Port
    preview_port: Port
    pairing_port: Port
    public_key: Annotated[str, Meta(pattern=r"\A([0-9a-f]{64})?\Z")] = ""
    nonce: Annotated[str, Meta(pattern=r"\A([0-9a-f]{32})?\Z")] = ""  # of the code it offers; empty: it offers none


class _Refusal(msgspec.Struct):
    error: Annotated[str, Meta(max_length=1000)]


class _Paired(msgspec.Struct):
    proof: Annotated[str, Meta(pattern=r"\A[0-9a-f]{64}\Z")]


def ask_who(addresses: Sequence[NodeAddress], timeout_s: float = TIMEOUT_S) -> list[Introduction | str]:
    """Ask every address at once who is there; a sentence stands for one that did not say. Returns after the last answer
    or `timeout_s`."""
    answers = _ask([(address, {"request": "hello"}) for address in addresses], timeout_s)
    found: list[Introduction | str] = []
    for address, answer in zip(addresses, answers, strict=True):
        try:
            found.append(_read(address, answer, Introduction, timeout_s))
        except PairingError as exc:
            found.append(str(exc))
    return found


def pair(address: NodeAddress, code_text: str, keys: MasterKeys, timeout_s: float = TIMEOUT_S,
         check: Callable[[Introduction], object] | None = None) -> Introduction:
    """Pair with the node at `address` by the code that it shows, and remember it; returns who it proved to be.

    `check` sees who it says it is while the code is still unspent, and raises when it is not the node that is meant.
    Raises PairingError, what `check` raises, or TrustError when the code cannot be one or what was learned cannot be
    written down.
    """
    code = read_code(code_text)
    who = ask_who([address], timeout_s)[0]
    if isinstance(who, str):
        raise PairingError(who)
    if check is not None:
        check(who)
    if who.trust == "open":
        raise PairingError(f"node {who.name} is open to everybody; there is nothing to pair. Its settings file says so "
                           '("trust").')
    if not who.nonce:
        raise PairingError(f"node {who.name}: {NO_CODE}")
    nonce = secrets.token_bytes(NONCE_LENGTH)
    transcript = Transcript(bytes.fromhex(who.public_key), bytes.fromhex(keys.own.public_key), bytes.fromhex(who.nonce),
                            nonce, who.node_id, who.name, keys.me.name)
    request = {"request": "pair", "master_key": keys.own.public_key, "master_name": keys.me.name,
               "master_nonce": nonce.hex(), "proof": proof(code, "master", transcript).hex()}
    answer = _read(address, _ask([(address, request)], timeout_s)[0], _Paired, timeout_s)
    if not proves(bytes.fromhex(answer.proof), code, "node", transcript):
        raise PairingError(f"what answers at {address} does not know the code of {who.name}: somebody stands between, "
                           "or answers in its place. Nothing was paired here. Run `rhot-node unpair` on the node and "
                           "look at the network before you try again.")
    remember_node(KnownNode(who.public_key, who.node_id, who.name))
    return who


def _ask(questions: Sequence[tuple[NodeAddress, dict[str, Any]]], timeout_s: float) -> list[bytes | str | None]:
    """The bytes of every answer; None for silence, a sentence for an address that cannot be asked."""
    context = Context()
    poller = zmq.Poller()
    sockets: dict[zmq.Socket[bytes], int] = {}
    answers: list[bytes | str | None] = [None] * len(questions)
    try:
        for place, (address, question) in enumerate(questions):
            socket = context.socket(zmq.REQ)
            socket.maxmsgsize = _ANSWER_MAX
            try:
                socket.connect(f"tcp://{address}")
                socket.send(msgspec.json.encode(question), zmq.DONTWAIT)
            except zmq.Again:
                continue  # what listens there has hung up already; waiting to send would be for ever
            except (zmq.ZMQError, UnicodeError) as exc:
                answers[place] = f"{str(address)!r} is not an address that can be asked ({exc})."
                continue
            sockets[socket] = place
            poller.register(socket, zmq.POLLIN)
        end_s = time.monotonic() + timeout_s
        while sockets and (left_s := end_s - time.monotonic()) > 0.0:
            for socket, _ in poller.poll(round(1e3 * left_s) + 1):
                answers[sockets.pop(socket)] = socket.recv_multipart()[0]
                poller.unregister(socket)
    finally:
        context.destroy(linger=0)
    return answers


def _read(address: NodeAddress, answer: bytes | str | None, kind: type[T], timeout_s: float) -> T:
    """The answer as a `kind`; raises PairingError for anything else."""
    if answer is None:
        raise PairingError(f"{address}: nothing answered within {timeout_s:g} s. Is rhot-node running there, and the "
                           "address right?")
    if isinstance(answer, str):
        raise PairingError(answer)
    try:
        if not decode_message(answer, dict[str, Any]).get("ok"):
            raise PairingError(f"{address}: {printable(decode_message(answer, _Refusal).error)}")
        return decode_message(answer, kind)
    except msgspec.MsgspecError as exc:
        raise PairingError(f"{address}: something answered that is not a node of this system "
                           f"({printable(str(exc))}).") from exc
