"""Asking nodes who they are, and pairing with one by the code that it shows: the other side of the node's.

Functions that wait; call them in a worker or a command.
"""

from __future__ import annotations

import argparse
import secrets
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import zmq
from msgspec import Meta

from rhot_app.errors import PairingError, positive_count
from rhot_app.keys import KnownNode, MasterKeys, load_master_keys, remember_node
from rhot_app.options import add_rig_argument
from rhot_app.project import Rig, RigNode, load_rig
from rhot_app.rig_history import accept
from rhot_node.errors import NodeError, printable
from rhot_node.files import PRINTABLE
from rhot_node.keys import Name
from rhot_node.network.context import Client, Context, ask_all, read_answer
from rhot_node.network.pairing import NO_CODE, NONCE_LENGTH, Transcript, proof, proves, read_code
from rhot_node.terminal import add_examples
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


class _Paired(msgspec.Struct):
    proof: Annotated[str, Meta(pattern=r"\A[0-9a-f]{64}\Z")]


def ask_who(addresses: Sequence[NodeAddress], timeout_s: float = TIMEOUT_S) -> list[Introduction | str]:
    """Ask every address at once who is there; a sentence stands for one that did not say. Returns after the last answer
    or `timeout_s`."""
    answers = _ask(addresses, {"request": "hello"}, Introduction, timeout_s)
    return [str(one) if isinstance(one, PairingError) else one for one in answers]


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
    (answer,) = _ask([address], request, _Paired, timeout_s)
    if isinstance(answer, PairingError):
        raise answer
    if not proves(bytes.fromhex(answer.proof), code, "node", transcript):
        raise PairingError(f"what answers at {address} does not know the code of {who.name}: somebody stands between, "
                           "or answers in its place. Nothing was paired here. Run `rhot-node unpair` on the node and "
                           "look at the network before you try again.")
    remember_node(KnownNode(who.public_key, who.node_id, who.name))
    return who


def _ask(addresses: Sequence[NodeAddress], request: dict[str, Any], kind: type[T],
         timeout_s: float) -> list[T | PairingError]:
    """What each address answers as a `kind`, or why it does not."""
    found: dict[NodeAddress, T | PairingError] = {}
    clients: dict[NodeAddress, tuple[Client, bytes]] = {}
    context = Context()
    try:
        for address in addresses:
            try:
                client = Client(context, f"tcp://{address}", longest=_ANSWER_MAX, once=True)
                clients[address] = client, msgspec.json.encode(request)
            except (zmq.ZMQError, UnicodeError) as exc:
                found[address] = PairingError(f"{str(address)!r} is not an address that can be asked ({exc}).")
        answers = ask_all([*clients.values()], timeout_s)
    finally:
        context.destroy(linger=0)
    for address, parts in zip(clients, answers, strict=True):
        found[address] = _read(address, parts[0], kind) if parts is not None else PairingError(
            f"{address}: nothing answered within {timeout_s:g} s. Is rhot-node running there, and the address right?")
    return [found[address] for address in addresses]


def _read(address: NodeAddress, answer: bytes, kind: type[T]) -> T | PairingError:
    try:
        return msgspec.convert(read_answer(answer), kind)
    except NodeError as exc:
        return PairingError(f"{address}: {exc}")
    except msgspec.MsgspecError as exc:
        return PairingError(f"{address}: something answered that is not a node of this system "
                            f"({printable(str(exc))}).")


# -- the command ``rhot pair`` -----------------------------------------------------------------------------------------

def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot pair``."""
    parser.add_argument("node", metavar="NODE",
                        help="ADDRESS or ADDRESS:PORT of the node, or with --rig its name in the rig")
    add_rig_argument(parser, "write the node's key into this rig file", exists=False)
    parser.add_argument("--port", type=positive_count, default=None, metavar="N",
                        help="the node's pairing port (default: the rig's, or 47803)")
    parser.add_argument("--code", metavar="CODE", help="the code that `rhot-node pair` shows; asked for when missing")
    add_examples(parser, "rhot pair left --rig desk.json", "rhot pair 192.168.0.21 --code 1234-5678")


def run(args: argparse.Namespace) -> int:
    """Pair; raises PairingError, RigError, TrustError."""
    rig = None if args.rig is None else load_rig(args.rig)
    named = None if rig is None else next((node for node in rig.nodes if node.name == args.node), None)
    address = _address(args, rig, named)
    keys = load_master_keys()

    def check(who: Introduction) -> None:
        if rig is not None:
            _meant(args.rig, rig, named, who)
    known = None if args.code is not None else _known(address, keys.knows, check)
    who = known or pair(address, args.code if args.code is not None else _ask_for_code(), keys, check=check)
    done = "was paired before" if known else "is paired"
    print(f"{who.name} (id {who.node_id}) {done}; its key is {who.public_key}.")
    if rig is not None:
        _write_key(args.rig, rig, named, who)
    return 0


def _address(args: argparse.Namespace, rig: Rig | None, named: RigNode | None) -> NodeAddress:
    if args.port is not None and not 1 <= args.port <= PORT_MAX:
        raise PairingError(f"--port is a number from 1 to {PORT_MAX}, not {args.port}.")
    if named is not None:
        return NodeAddress(named.address, args.port if args.port is not None else named.pairing_port)
    host, port = read_address(args.node)
    if rig is not None and not _is_address(host):
        names = ", ".join(node.name for node in rig.nodes) or "none"
        raise PairingError(f"there is no node {args.node!r} in {args.rig}; there are: {names}.")
    if None not in (port, args.port) and port != args.port:
        raise PairingError(f"{args.node} and --port {args.port} name two ports; leave one of them out.")
    return NodeAddress(host, args.port or port or PAIRING_PORT)


def _is_address(host: str) -> bool:
    """Whether `host` is written as an address is, or is the name of a computer."""
    if "." in host or ":" in host:
        return True
    try:
        return bool(socket.getaddrinfo(host, None))
    except (OSError, UnicodeError):
        return False


def _known(address: NodeAddress, knows: Callable[[str], bool],
           check: Callable[[Introduction], None]) -> Introduction | None:
    """Who is there, if it claims a key that was proved once; that it has the key shows when it is spoken to. Raises
    PairingError when nobody answers or `check` refuses who does, before a code is asked for."""
    who = ask_who([address])[0]
    if isinstance(who, str):
        raise PairingError(who)
    check(who)
    return who if knows(who.public_key) and not who.nonce else None


def _ask_for_code() -> str:
    try:
        return input("Pairing code (run `rhot-node pair` on the node): ")
    except EOFError as exc:
        raise PairingError("no code was entered; nothing was paired.") from exc


def _meant(path: Path, rig: Rig, named: RigNode | None, who: Introduction) -> RigNode:
    """The rig's node that `who` is; raises PairingError when it is another than `named`, or none of the rig's."""
    node = named or next((node for node in rig.nodes if node.node_id == who.node_id), None)
    if node is None or node.node_id != who.node_id:
        meant = "has no node of this id" if node is None else f"means node {node.node_id} by {node.name!r}"
        raise PairingError(f"node {who.node_id} ({who.name}) answers there, but {path} {meant}. Nothing was changed. "
                           "Give the node the rig's node_id in its settings file, or the rig the node's.")
    return node


def _write_key(path: Path, rig: Rig, named: RigNode | None, who: Introduction) -> None:
    node = _meant(path, rig, named, who)
    changed = msgspec.structs.replace(node, public_key=who.public_key, text_datagrams=False)
    nodes = tuple(changed if one is node else one for one in rig.nodes)
    accept(path, msgspec.structs.replace(rig, nodes=nodes), "pairing")
    print(f"{path}: {node.name} has this key now.")
