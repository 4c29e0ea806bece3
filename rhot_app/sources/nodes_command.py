"""``rhot nodes``: which nodes are there, by broadcast and by zeroconf."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from rhot_app.errors import SourceError
from rhot_app.options import add_json_argument, add_seconds_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.sources.discovery import FoundNode, Search

SECONDS_MAX = 60.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot nodes``."""
    add_seconds_argument(parser, "how long to look", 3.0)
    add_json_argument(parser)
    add_examples(parser, "rhot nodes", "rhot nodes --seconds 10 --json")


def run(args: argparse.Namespace) -> int:
    """Look and print; 1 when nobody was found. Raises SourceError."""
    from rhot_app.progress import ProgressLine
    from rhot_app.sources.discovery import find_nodes
    if not 0.0 < args.seconds <= SECONDS_MAX:
        raise SourceError(f"--seconds is a number above 0 and up to {SECONDS_MAX:.0f}, not {args.seconds:g}.")
    line = ProgressLine("looking for nodes")
    found = find_nodes(args.seconds, progress=line.report)
    if sys.stderr.isatty():
        line.finish()
    print(json.dumps(_fields(found)) if args.json else _words(found, args.seconds))
    return int(not found.nodes)


def _words(found: Search, seconds: float) -> str:
    rows = [("name", "id", "address", "trust", "state")]
    rows += [(node.presence.name, str(node.presence.node_id), ", ".join(_askable(node)),
              node.presence.trust.name.lower(), _state(node) or "announced") for node in found.nodes]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    if not found.nodes:
        lines = [f"No node was found within {seconds:g} s. Is rhot-node running, and on the same network? Some "
                 "networks pass on neither broadcast nor multicast; `rhot pair ADDRESS` asks one address."]
    return "\n".join([*lines, *found.conflicts, *found.notes])


def _askable(node: FoundNode) -> list[str]:
    """Its addresses as `rhot pair` takes them: with the pairing port where it is not the usual one."""
    from rhot_app.sources.pairing import NodeAddress
    from rhot_node.wire.messages import PAIRING_PORT
    port = node.presence.pairing_port
    return [address if port == PAIRING_PORT else str(NodeAddress(address, port)) for address in node.addresses]


def _fields(found: Search) -> dict[str, Any]:
    nodes = [{"node_id": node.presence.node_id, "name": node.presence.name, "addresses": list(node.addresses),
              "udp_port": node.presence.udp_port, "control_port": node.presence.control_port,
              "preview_port": node.presence.preview_port, "pairing_port": node.presence.pairing_port,
              "boot_id": node.presence.boot_id, "trust": node.presence.trust.name.lower(), "state": _state(node)}
             for node in found.nodes]
    return {"nodes": nodes, "conflicts": list(found.conflicts), "notes": list(found.notes)}


def _state(node: FoundNode) -> str:
    return "" if node.state is None else node.state.name.lower()
