"""How many options a person meets in the commands, and how many there are to maintain.

    python benchmarks/command_options.py [--each] [--json FILE]

Offered: what ``--help`` lists of each command of `rhot` and `rhot-node`, summed; former spellings, second names of a
calibration and `--help` itself do not count. Defined: the places in the code that add an option; one that several
commands share counts once. `--each` prints the options of each command.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

from tables import arguments, publish, table

from rhot_app.__main__ import APP, SUBCOMMANDS
from rhot_node.__main__ import daemon_parser
from rhot_node.commands import COMMANDS, parser_of

ROOT = Path(__file__).resolve().parents[1]


def offered() -> dict[str, list[str]]:
    """By command: the options that its help lists."""
    found: dict[str, list[str]] = {}
    for name in (None, *SUBCOMMANDS):
        parser = argparse.ArgumentParser()
        importlib.import_module(APP if name is None else SUBCOMMANDS[name].module).add_arguments(parser)
        found |= dict(_of(parser, "rhot" if name is None else f"rhot {name}"))
    found |= dict(_of(daemon_parser(), "rhot-node"))
    for name in COMMANDS:
        found |= dict(_of(parser_of(name)[1], f"rhot-node {name}"))
    return found


def _of(parser: argparse.ArgumentParser, name: str) -> Iterator[tuple[str, list[str]]]:
    """The options of a parser and of those within it; a second name of one is passed over."""
    actions = [action for action in parser._actions if not isinstance(action, argparse._HelpAction)]
    inner = [action for action in actions if isinstance(action, argparse._SubParsersAction)]
    if not inner:
        yield name, [action.option_strings[0] for action in actions
                     if action.option_strings and action.help != argparse.SUPPRESS]
    for action in inner:
        listed = {choice.dest for choice in action._choices_actions}
        for word, one in action.choices.items():
            if word in listed and not str(one.description).startswith("The former name"):
                yield from _of(one, f"{name} {word}")


def defined() -> list[str]:
    """FILE:LINE of each place that adds an option."""
    return [f"{path.relative_to(ROOT)}:{node.lineno}" for room in ("rhot_app", "rhot_node")
            for path in sorted((ROOT / room).rglob("*.py")) for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "add_argument"
            and any(isinstance(one, ast.Constant) and str(one.value).startswith("-") for one in node.args)]


def main() -> int:
    """Print the counts."""
    parser = arguments(__doc__)
    parser.add_argument("--each", action="store_true", help="the options of each command")
    args = parser.parse_args()
    by_command = offered()
    counts = {"commands": len(by_command), "options offered": sum(map(len, by_command.values())),
              "options defined": len(defined())}
    rows = [[name, " ".join(options)] for name, options in by_command.items()] if args.each else []
    publish(args, {**counts, "by command": by_command}, table(["what", "count"], [[*pair] for pair in counts.items()]),
            *([table(["command", "options"], rows)] if rows else []))
    return 0


if __name__ == "__main__":
    sys.exit(main())
