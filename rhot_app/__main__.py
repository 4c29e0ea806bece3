"""The ``rhot`` command: hands each subcommand to the room it belongs to."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from types import ModuleType

from rhot_app.errors import RhotError, take_losses
from rhot_app.former_spellings import present_spelling
from rhot_node.errors import NodeError, nearest, system_sentence
from rhot_node.terminal import printable_output


@dataclass(frozen=True, slots=True)
class Subcommand:
    """A subcommand and the module that has its ``add_arguments(parser)`` and ``run(args) -> int``."""

    module: str
    summary: str


APP = "rhot_app.ui.app"
SUBCOMMANDS = {
    "demo": Subcommand("rhot_app.ui.demo_command", "open the app on the simulated rig"),
    "engine": Subcommand("rhot_app.engine.command", "track without a screen and serve the states"),
    "replay": Subcommand("rhot_app.engine.offline.replay_command", "feed a raw log through the tracker"),
    "video": Subcommand("rhot_app.recording.video_command", "fetch the videos that nodes recorded beside a log"),
    "landmarks": Subcommand("rhot_app.export.landmark_command", "make a raw log of landmark tables of a bare hand"),
    "track": Subcommand("rhot_app.export.track_command", "track a bare hand in recorded videos"),
    "offset": Subcommand("rhot_app.sources.offset_command", "find when films of one scene began, by sound or a flash"),
    "recover": Subcommand("rhot_app.recording.recover_command", "write a damaged log's sound records to a clean one"),
    "export": Subcommand("rhot_app.export.export_command", "write a raw log's hand as a file for other programs"),
    "trim": Subcommand("rhot_app.export.trim_command", "take a part of a recording as a recording of its own"),
    "batch": Subcommand("rhot_app.export.batch_command", "track or export many raw logs"),
    "simulate": Subcommand("rhot_app.simulator.simulate_command", "render what the cameras would see, with the truth"),
    "calibrate": Subcommand("rhot_app.calibration.commands.calibrate", "calibrate from images and tables"),
    "refine": Subcommand("rhot_app.calibration.commands.refine", "refine the cameras' poses from a recorded hand"),
    "target": Subcommand("rhot_app.calibration.commands.target", "draw a calibration board in true scale"),
    "check": Subcommand("rhot_app.calibration.commands.check", "check a rig file for what cannot be"),
    "certify": Subcommand("rhot_app.certificate.certify_command", "measure a rig as the thesis does, with intervals"),
    "hand": Subcommand("rhot_app.hand.hand_command", "look at a hand file, or make one of a given length"),
    "fit-hand": Subcommand("rhot_app.ui.handfit.fit_command", "fit a hand to pictures by dragging, sliders and edges"),
    "layers": Subcommand("rhot_app.export.layers_command", "draw which link of a hand or object hides which"),
    "object": Subcommand("rhot_app.objects.object_command", "check an object file, or find the object in still images"),
    "poses": Subcommand("rhot_app.sources.poses.poses_command", "listen to another tracker's poses and record them"),
    "cameras": Subcommand("rhot_app.sources.cameras.camera_set", "list the cameras of this computer"),
    "nodes": Subcommand("rhot_app.sources.nodes_command", "look for nodes on the network"),
    "pair": Subcommand("rhot_app.sources.pairing", "pair with a node by the code that it shows"),
    "history": Subcommand("rhot_app.calibration.commands.history", "list or bring back earlier versions of a rig file"),
    "report": Subcommand("rhot_app.engine.offline.report_command", "collect what somebody needs who looks for a fault"),
    "mouse": Subcommand("rhot_app.mouse.mouse_command", "work a 3-D cursor and two buttons with the hand"),
    "evaluate": Subcommand("rhot_app.evaluation.evaluate_command", "compare runs and trackers with the truth"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code: 2 for a mistake that has a sentence, 3 for work of which a part could
    not be done, as with a log that can be read in part only, 130 when interrupted."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    take_losses()
    with printable_output():
        try:
            module, parsed = parse(arguments)
            code = int(module.run(parsed))
            losses = take_losses()
            for sentence in losses:
                print(f"rhot: {sentence}", file=sys.stderr)
            return 3 if losses and code == 0 else code
        except (RhotError, NodeError) as exc:
            print(f"rhot: {exc}", file=sys.stderr)
            return 2
        except KeyboardInterrupt:
            return 130
        except BrokenPipeError:  # the reader of our output has had enough, as in `rhot replay ... --json | head`
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 1
        except (OSError, MemoryError) as exc:
            print(f"rhot: {system_sentence(exc)}", file=sys.stderr)
            return 2


def parse(arguments: list[str]) -> tuple[ModuleType, argparse.Namespace]:
    """The module that runs a command, and its arguments; what is strange among them ends the program."""
    arguments = present_spelling(_command_first(arguments))
    name = next((argument for argument in arguments if not argument.startswith("-")), None)
    chosen = SUBCOMMANDS.get(name or "")
    parser = argparse.ArgumentParser(
        prog="rhot", description="Track a hand with two or more cheap cameras. Without a command: open the app.")
    parser.add_argument("--version", action="version", version=f"rhot {version('rhot')}")
    rooms = {"": parser}
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    for key, subcommand in SUBCOMMANDS.items():
        sentence = f"{subcommand.summary[0].upper()}{subcommand.summary[1:]}."
        room = commands.add_parser(key, help=subcommand.summary, description=sentence)
        rooms[key] = room
        if subcommand is chosen:  # only this one's room is imported: help stays fast
            _load(subcommand.module).add_arguments(room)
    module = _load(APP if chosen is None else chosen.module)
    if chosen is None:
        module.add_arguments(parser)
    if chosen is None and arguments and arguments[0] == name:
        parser.error(f"there is no command {name!r}{_meant(name, SUBCOMMANDS)}")
    asked = _inner(rooms["" if chosen is None or name is None else name], arguments[1:])
    options = _options(asked)
    strange = [word for word in arguments if word.startswith("--")
               and not any(option.startswith(word.split("=")[0]) for option in options)]
    if chosen is not None or not strange:  # else argparse takes what follows a misspelt option for a command
        try:
            parsed, strange = parser.parse_known_args(arguments)
        except RhotError:  # no such file; it may be what follows a misspelt option
            if not strange:
                raise
    if strange:
        what = "option" if strange[0].startswith("-") else "argument"
        asked.error(f"there is no {what} {strange[0]!r} here{_meant(strange[0].split('=')[0], options)}")
    return module, parsed


def _command_first(arguments: list[str]) -> list[str]:
    """The arguments with the subcommand before its options: the app's own may stand before it, with their values."""
    if not arguments or arguments[0] in SUBCOMMANDS or SUBCOMMANDS.keys().isdisjoint(arguments):
        return arguments
    before = argparse.ArgumentParser(add_help=False)
    _load(APP).add_arguments(before)
    before.add_argument("rest", nargs=argparse.REMAINDER)
    rest = before.parse_known_args(arguments)[0].rest
    if not rest or rest[0] not in SUBCOMMANDS:
        return arguments
    room, count = argparse.ArgumentParser(), 1
    _load(SUBCOMMANDS[rest[0]].module).add_arguments(room)
    while (inner := _inner(room, rest[count:count + 1])) is not room:  # `mouse run` is one command
        room, count = inner, count + 1
    return [*rest[:count], *arguments[:len(arguments) - len(rest)], *rest[count:]]


def _inner(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> argparse.ArgumentParser:
    """The parser that the first of some arguments choose: that of `rhot calibrate depth`, not of all calibrations."""
    for action in parser._actions if arguments else ():
        if isinstance(action, argparse._SubParsersAction) and arguments[0] in action.choices:
            inner: argparse.ArgumentParser = action.choices[arguments[0]]
            return _inner(inner, arguments[1:])
    return parser


def _options(parser: argparse.ArgumentParser) -> list[str]:
    """The options of a parser and of those within it."""
    found = [option for action in parser._actions for option in action.option_strings]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            found += [option for inner in action.choices.values() for option in _options(inner)]
    return found


def _meant(strange: str, known: Iterable[str]) -> str:
    """The one of what is known that somebody may have meant by something strange, as the end of a sentence."""
    near = nearest(strange, known)
    return f"; did you mean {near}?" if near else ". See --help."


def _load(name: str) -> ModuleType:
    return importlib.import_module(name)


if __name__ == "__main__":
    sys.exit(main())
