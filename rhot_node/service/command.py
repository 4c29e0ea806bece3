"""``rhot-node install`` and ``rhot-node uninstall``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rhot_node.service.install import Host, Wish, install, service_for, uninstall, unit_text
from rhot_node.terminal import add_examples

SUMMARIES = {
    "install": "Make the node a system service (systemd): started at boot, restarted when it ends or hangs, held in "
               "bounds. To be run as root. Its settings then lie in /var/lib/rhot-node/node.json.",
    "uninstall": "Stop the service and remove it; settings and keys stay."}


def add_arguments(name: str, parser: argparse.ArgumentParser) -> None:
    """The options of `install` or `uninstall`."""
    parser.add_argument("--user", action="store_true", help="a service of the present user, without root's help")
    if name == "install":
        parser.add_argument("--node-id", type=int, metavar="N", help="of a new node, as in the rig file")
        parser.add_argument("--name", help="of a new node, such as left")
        parser.add_argument("--settings", type=Path, metavar="FILE", help="settings to take over instead")
        parser.add_argument("--camera", default="pi", metavar="SPEC", help="as of rhot-node --camera (default: pi)")
        parser.add_argument("--dry-run", action="store_true", help="print the unit and change nothing")
        add_examples(parser, "sudo rhot-node install --node-id 0 --name left",
                     "rhot-node install --user --settings left.json --camera 0 --dry-run")
    else:
        add_examples(parser, "sudo rhot-node uninstall", "rhot-node uninstall --user")


def run(name: str, options: argparse.Namespace) -> int:
    """Do it; returns 0. Raises NodeError."""
    host = Host()
    if name == "uninstall":
        uninstall(options.user, host, _say)
        return 0
    wish = Wish(options.camera, options.settings, options.node_id, options.name, options.user)
    if options.dry_run:
        sys.stdout.write(unit_text(service_for(wish, host)))
    else:
        install(wish, host, _say)
    return 0


def _say(line: str) -> None:
    print(f"rhot-node: {line}", flush=True)
