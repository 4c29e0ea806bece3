"""``rhot-node pair`` and ``rhot-node unpair``: on the node itself, beside the running daemon or without it."""

from __future__ import annotations

import argparse
from pathlib import Path

from rhot_node.config import NodeSettings, load_settings
from rhot_node.errors import TrustError
from rhot_node.keys import keys_path, remove_private
from rhot_node.network.pairing import TRIES, VALID_S, Offer, OfferFile, offer_path, show_code
from rhot_node.service.install import SETTINGS
from rhot_node.terminal import add_examples

SUMMARIES = {
    "pair": "Show a fresh one-time code to pair a master with; the code before it is void.",
    "unpair": "Forget every master and the node's own keys, as when it was shipped. A running node does so at once.",
}


def add_arguments(name: str, parser: argparse.ArgumentParser) -> None:
    """Arguments of `pair` or `unpair`."""
    installed = SETTINGS if SETTINGS.exists() else None
    parser.add_argument("--settings", type=Path, default=installed, metavar="FILE",
                        help="settings of this node (JSON, see docs/node.md); keys lie beside it. Default: those of "
                             f"the installed service, {SETTINGS}")
    add_examples(parser, f"rhot-node {name}", f"rhot-node {name} --settings left.json")


def run(name: str, args: argparse.Namespace) -> int:
    """Run the command `name`; raises SettingsError, TrustError."""
    if args.settings is None:
        raise TrustError(f"No node is installed as a service here ({SETTINGS} is missing). Name the settings file that "
                         f"the node is started with: rhot-node {name} --settings FILE.")
    settings = load_settings(args.settings)
    if name == "pair":
        if settings.trust == "open":
            raise TrustError(f'{args.settings}: "trust" is "open", so there is nothing to pair; change it to "paired" '
                             "and restart the node.")
        print(invitation(settings, OfferFile(offer_path(args.settings)).renew()))
        return 0
    OfferFile(offer_path(args.settings)).close()
    known = remove_private(keys_path(args.settings))
    print(f"{settings.name} forgets its masters and its keys." if known else f"{settings.name} had no keys.")
    return 0


def invitation(settings: NodeSettings, offer: Offer) -> str:
    """What people read on the console."""
    return (f"Pairing code of node {settings.name}:  {show_code(offer.code)}\n"
            f"Enter it in the app (Rig, Connect nodes) or after `rhot pair ADDRESS`. Valid for {VALID_S // 60} "
            f"minutes, {TRIES} tries and one master.")
