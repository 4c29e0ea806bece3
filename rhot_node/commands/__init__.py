"""The commands of ``rhot-node`` besides the daemon. Their modules are imported when they run."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial

Command = tuple[argparse.ArgumentParser, Callable[[argparse.Namespace], int]]
"""The parser of a command's arguments, and what runs it with them."""


def run_command(name: str, arguments: Sequence[str]) -> int:
    """Run command `name` of COMMANDS; returns its exit code. Raises NodeError."""
    parser, run = COMMANDS[name](name)
    return run(parser.parse_args(arguments))


def _detect(name: str) -> Command:
    from rhot_node.commands import detect_command
    parser = _parser(name, "Find the markers in an image, a folder of images or a video, frame by frame.")
    detect_command.add_arguments(parser)
    return parser, detect_command.run


def _trust(name: str) -> Command:
    from rhot_node.commands import trust_command
    parser = _parser(name, trust_command.SUMMARIES[name])
    trust_command.add_arguments(name, parser)
    return parser, partial(trust_command.run, name)


def _service(name: str) -> Command:
    from rhot_node.service import command
    parser = _parser(name, command.SUMMARIES[name])
    command.add_arguments(name, parser)
    return parser, partial(command.run, name)


def _doctor(name: str) -> Command:
    from rhot_node.commands import doctor_command
    parser = _parser(name, doctor_command.SUMMARY)
    doctor_command.add_arguments(parser)
    return parser, doctor_command.run


def _landmarks(name: str) -> Command:
    from rhot_node.landmarks import install_command
    parser = _parser(name, install_command.SUMMARY)
    install_command.add_arguments(parser)
    return parser, install_command.run


def _parser(name: str, description: str) -> argparse.ArgumentParser:
    return argparse.ArgumentParser(prog=f"rhot-node {name}", description=description)


COMMANDS: dict[str, Callable[[str], Command]] = {
    "detect": _detect, "doctor": _doctor, "install": _service, "landmarks": _landmarks, "pair": _trust,
    "uninstall": _service, "unpair": _trust}
HELP = """rhot-node detect   finds markers in files instead
rhot-node doctor   looks at power, heat, memory, clock, network, camera and says what to do
rhot-node install, rhot-node uninstall   make the node a system service
rhot-node landmarks install   install the networks that find a bare hand's landmarks
rhot-node pair, rhot-node unpair   who may use this node
(each with --help)"""
