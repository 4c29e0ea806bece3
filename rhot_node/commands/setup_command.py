"""``rhot-node install``, ``uninstall``, ``pair`` and ``unpair``: what makes a machine somebody's node."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rhot_node.config import NodeSettings, load_settings
from rhot_node.errors import TrustError
from rhot_node.keys import keys_path, remove_private
from rhot_node.network.pairing import TRIES, VALID_S, Offer, OfferFile, offer_path, show_code
from rhot_node.service import SETTINGS, Host, Wish, install, service_for, uninstall, unit_text
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the command that is the parser's default `command`."""
    name = parser.get_default("command")
    if name in ("pair", "unpair"):
        installed = SETTINGS if SETTINGS.exists() else None
        parser.add_argument("--settings", type=Path, default=installed, metavar="FILE",
                            help="settings of this node (JSON, see docs/node.md); keys lie beside it. Default: those "
                                 f"of the installed service, {SETTINGS}")
        add_examples(parser, f"rhot-node {name}", f"rhot-node {name} --settings left.json")
        return
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


def run(options: argparse.Namespace) -> int:
    """Do it; returns 0. Raises NodeError."""
    if options.command in ("pair", "unpair"):
        return _change_trust(options.command, options.settings)
    host = Host()
    if options.command == "uninstall":
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


def _change_trust(name: str, path: Path | None) -> int:
    """On the node itself, beside the running daemon or without it. Raises SettingsError, TrustError."""
    if path is None:
        raise TrustError(f"No node is installed as a service here ({SETTINGS} is missing). Name the settings file that "
                         f"the node is started with: rhot-node {name} --settings FILE.")
    settings = load_settings(path)
    if name == "pair":
        if settings.trust == "open":
            raise TrustError(f'{path}: "trust" is "open", so there is nothing to pair; change it to "paired" and '
                             "restart the node.")
        print(invitation(settings, OfferFile(offer_path(path)).renew()))
        return 0
    OfferFile(offer_path(path)).close()
    known = remove_private(keys_path(path))
    print(f"{settings.name} forgets its masters and its keys." if known else f"{settings.name} had no keys.")
    return 0


def invitation(settings: NodeSettings, offer: Offer) -> str:
    """What people read on the console."""
    return (f"Pairing code of node {settings.name}:  {show_code(offer.code)}\n"
            f"Enter it in the app (Rig, Connect nodes) or after `rhot pair ADDRESS`. Valid for {VALID_S // 60} "
            f"minutes, {TRIES} tries and one master.")
