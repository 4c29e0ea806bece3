"""``rhot pair``: pair this master with a node by the code that the node shows, and write its key into a rig."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import PairingError, positive_count
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.project import Rig, RigNode
    from rhot_app.sources.pairing import Introduction, NodeAddress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot pair``."""
    parser.add_argument("node", metavar="NODE",
                        help="ADDRESS or ADDRESS:PORT of the node, or with --rig its name in the rig")
    parser.add_argument("--rig", type=Path, metavar="FILE", help="write the node's key into this rig file")
    parser.add_argument("--port", type=positive_count, default=None, metavar="N",
                        help="the node's pairing port (default: the rig's, or 47803)")
    parser.add_argument("--code", metavar="CODE", help="the code that `rhot-node pair` shows; asked for when missing")
    add_examples(parser, "rhot pair left --rig desk.json", "rhot pair 192.168.0.21 --code 1234-5678")


def run(args: argparse.Namespace) -> int:
    """Pair; raises PairingError, RigError, TrustError."""
    from rhot_app.keys import load_master_keys
    from rhot_app.project import load_rig
    from rhot_app.sources.pairing import pair

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
    from rhot_app.sources.pairing import NodeAddress, read_address
    from rhot_node.wire.messages import PAIRING_PORT, PORT_MAX
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
    import socket
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
    from rhot_app.sources.pairing import ask_who
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
    import msgspec

    from rhot_app.rig_history import accept
    node = _meant(path, rig, named, who)
    changed = msgspec.structs.replace(node, public_key=who.public_key, text_datagrams=False)
    nodes = tuple(changed if one is node else one for one in rig.nodes)
    accept(path, msgspec.structs.replace(rig, nodes=nodes), "pairing")
    print(f"{path}: {node.name} has this key now.")
