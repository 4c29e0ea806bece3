"""``rhot-node landmarks install`` and ``rhot landmarks install``."""

from __future__ import annotations

import argparse
from pathlib import Path

from rhot_node.landmarks.install import (
    FILES,
    LICENCE,
    ORIGIN,
    PACKAGE,
    SERVICE_FOLDER,
    Progress,
    install_networks,
    user_folder,
)
from rhot_node.service import STATE_FOLDER
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``rhot-node landmarks``."""
    parser.add_argument("what", choices=("install",),
                        help=f"install: place the networks on this machine (of {PACKAGE}, {LICENCE})")
    add_wheel(parser)
    parser.add_argument("--service", action="store_true",
                        help=f"for the node's system service, in {SERVICE_FOLDER}; to be run as root")
    add_examples(parser, "rhot-node landmarks install", "sudo rhot-node landmarks install --service")


def add_wheel(parser: argparse.ArgumentParser) -> None:
    """The option that both commands have."""
    parser.add_argument("--wheel", type=Path, metavar="FILE",
                        help=f"the wheel of {PACKAGE}, for a machine without network")


def run(options: argparse.Namespace) -> int:
    """Install by the options of ``rhot-node landmarks``; returns 0. Raises KeypointError."""
    return install(options.wheel, options.service, lambda text, fraction: None)


def install(wheel: Path | None, service: bool, progress: Progress) -> int:
    """Install and say what lies where; returns 0. Raises KeypointError."""
    folder = SERVICE_FOLDER if service else user_folder()
    install_networks(folder, wheel, progress)
    print(f"{ORIGIN}:")
    for name in FILES:
        print(f"  {folder / name}")
    if not service and STATE_FOLDER.exists():
        print("The node's service does not see this folder. For it: sudo rhot-node landmarks install --service")
    return 0
