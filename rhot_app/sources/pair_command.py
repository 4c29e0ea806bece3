"""``rhot pair``: pair this master with a node by the code that the node shows, and write its key into a rig."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import PairingError

if TYPE_CHECKING:
    from rhot_app.project import Rig, RigNode
    from rhot_app.sources.pairing import Introduction, NodeAddress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot pair``."""
    parser.add_argument("node", metavar="NODE", help="address of the node, or with --rig its name in the rig")
    parser.add_argument("--rig", type=Path, metavar="FILE", help="write the node's key into this rig file")
    parser.add_argument("--port", type=int, default=None, metavar="N",
                        help="the node's pairing port (default: the rig's, or 47803)")
    parser.add_argument("--code", metavar="CODE", help="the code that `rhot-node pair` shows; asked for when missing")


def run(args: argparse.Namespace) -> int:
    """Pair; raises PairingError, RigError, TrustError."""
    from rhot_app.keys import load_master_keys
    from rhot_app.project import load_rig
    from rhot_app.sources.pairing import pair

    rig = None if args.rig is None else load_rig(args.rig)
    named = None if rig is None else next((node for node in rig.nodes if node.name == args.node), None)
    address = _address(args, named)
    keys = load_master_keys()
    known = None if args.code is not None else _known(address, keys.knows)
    who = known or pair(address, args.code if args.code is not None else _ask_for_code(), keys)
    done = "was paired before" if known else "is paired"
    print(f"{who.name} (id {who.node_id}) {done}; its key is {who.public_key}.")
    if rig is not None:
        _write_key(args.rig, rig, named, who)
    return 0


def _address(args: argparse.Namespace, named: RigNode | None) -> NodeAddress:
    from rhot_app.sources.pairing import PAIRING_PORT, NodeAddress
    port = args.port if args.port is not None else named.pairing_port if named is not None else PAIRING_PORT
    if not 1 <= port <= 65535:
        raise PairingError(f"--port is a number from 1 to 65535, not {port}.")
    return NodeAddress(named.address if named is not None else args.node, port)


def _known(address: NodeAddress, knows: Callable[[str], bool]) -> Introduction | None:
    """Who is there, if it claims a key that was proved once; that it has the key shows when it is spoken to. Raises
    PairingError when nobody answers, before a code is asked for."""
    from rhot_app.sources.pairing import ask_who
    who = ask_who([address])[0]
    if isinstance(who, str):
        raise PairingError(who)
    return who if knows(who.public_key) and not who.nonce else None


def _ask_for_code() -> str:
    try:
        return input("Pairing code (run `rhot-node pair` on the node): ")
    except EOFError as exc:
        raise PairingError("no code was entered; nothing was paired.") from exc


def _write_key(path: Path, rig: Rig, named: RigNode | None, who: Introduction) -> None:
    import msgspec

    from rhot_app.rig_history import accept
    node = named or next((node for node in rig.nodes if node.node_id == who.node_id), None)
    if node is None or node.node_id != who.node_id:
        raise PairingError(f"{path}: node {who.node_id} ({who.name}) is not the one that the rig means; the rig was "
                           "not changed. Give the node the rig's node_id in its settings file, or the rig the node's.")
    changed = msgspec.structs.replace(node, public_key=who.public_key, text_datagrams=False)
    nodes = tuple(changed if one is node else one for one in rig.nodes)
    accept(path, msgspec.structs.replace(rig, nodes=nodes), "pairing")
    print(f"{path}: {node.name} has this key now.")
