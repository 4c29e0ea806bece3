"""The commands of ``rhot-node`` besides the daemon. Their modules are imported when they run."""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Sequence
from types import ModuleType

_SETUP = "rhot_node.commands.setup_command"

COMMANDS = {
    "detect": ("rhot_node.commands.detect_command",
               "Find the markers in an image, a folder of images or a video, frame by frame."),
    "doctor": ("rhot_node.commands.doctor_command",
               "Look at everything that a node needs: power, heat, memory, clock, network, cameras and their light, "
               "compiled code, pairing and the service. Exit code 0: nothing is wrong, as far as can be seen; 1: "
               "something could be better; 2: something is wrong."),
    "install": (_SETUP, "Make the node a system service (systemd): started at boot, restarted when it ends or hangs, "
                        "held in bounds. To be run as root. Its settings then lie in /var/lib/rhot-node/node.json."),
    "landmarks": ("rhot_node.landmarks.install",
                  "Install the networks that find 21 landmarks of a bare hand. They are taken out of a wheel, which "
                  "pip downloads (36 MB) and which is not installed."),
    "pair": (_SETUP, "Show a fresh one-time code to pair a master with; the code before it is void."),
    "uninstall": (_SETUP, "Stop the service and remove it; settings and keys stay."),
    "unpair": (_SETUP, "Forget every master and the node's own keys, as when it was shipped. A running node does so at "
                       "once."),
}
"""By name: the module that has its ``add_arguments(parser)`` and ``run(options) -> int``, and what it does."""

HELP = """rhot-node detect   finds markers in files instead
rhot-node doctor   looks at power, heat, memory, clock, network, camera and says what to do
rhot-node install, rhot-node uninstall   make the node a system service
rhot-node landmarks install   install the networks that find a bare hand's landmarks
rhot-node pair, rhot-node unpair   who may use this node
(each with --help)"""


def parser_of(name: str) -> tuple[ModuleType, argparse.ArgumentParser]:
    """The module of a command, and the parser of its arguments."""
    where, summary = COMMANDS[name]
    module, parser = importlib.import_module(where), argparse.ArgumentParser(
        prog=f"rhot-node {name}", description=summary)
    parser.set_defaults(command=name)
    module.add_arguments(parser)
    return module, parser


def run_command(name: str, arguments: Sequence[str]) -> int:
    """Run command `name` of COMMANDS; returns its exit code. Raises NodeError."""
    module, parser = parser_of(name)
    return int(module.run(parser.parse_args(arguments)))
